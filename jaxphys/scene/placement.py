"""From the coordinates of an object's file to those of the domain."""

from typing import NamedTuple

import numpy as np

from jaxphys.gaussians.gaussians import Gaussians, transform
from jaxphys.mpm.boundaries import Vector

Matrix = tuple[Vector, Vector, Vector]


def _vector(values) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


class Placement(NamedTuple):
    """Where the contents of a file are: x in the file is at scale (rotation x - middle) + centre.

    Hashable, so that it can be a static part of a pytree.

    Attributes:
        rotation: as rows.
        scale: metres for a unit of the file.
        middle: of the object's bounding box once it is turned, in the file's units.
        centre: where that is in the domain [m].
    """

    rotation: Matrix
    scale: float
    middle: Vector
    centre: Vector

    @classmethod
    def of(cls, rotation, scale, middle, centre) -> "Placement":
        """From arrays: (3, 3), (), (3,) and (3,)."""
        x, y, z = (_vector(row) for row in rotation)
        return cls((x, y, z), float(scale), _vector(middle), _vector(centre))

    def point(self, x) -> np.ndarray:
        """Places (..., 3) in the file, in the domain [m]."""
        turned = np.asarray(x, np.float64) @ np.asarray(self.rotation).T
        return self.scale * (turned - self.middle) + self.centre

    def undone(self, gaussians: Gaussians) -> Gaussians:
        """Gaussians of the domain in the coordinates and units of the file."""
        rotation = np.asarray(self.rotation)
        turned = transform(
            gaussians,
            scale=1 / self.scale,
            translation=self.middle - np.asarray(self.centre) / self.scale,
        )
        return transform(turned, rotation.T)


AS_IT_IS = Placement.of(np.eye(3), 1.0, np.zeros(3), np.zeros(3))
