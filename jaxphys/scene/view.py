"""Where a scene is looked at from."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.fields import LENGTH, PLACE, RATE, SPEED, Checked, between, direction
from jaxphys.mpm.boundaries import Vector

ANGLE = between(-1e6, 1e6)
Z: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Photograph(Checked):
    """A camera that stood in the world that the first object's file describes, in its coordinates
    and units: it moves along when the object is turned, scaled and put in its place.

    Attributes:
        position: of the camera.
        rotation: from the camera, x right, y down, z forward, to the file, as rows.
        focal: focal lengths in x and y over the picture's width.
    """

    position: Vector = field(metadata=PLACE)
    rotation: tuple[Vector, Vector, Vector] = field(metadata=between(-1.001, 1.001))
    focal: tuple[float, float] = field(metadata={"above": 0} | between(1e-6, 1e6))

    def __post_init__(self):
        super().__post_init__()
        matrix = np.asarray(self.rotation)
        # cameras.json holds float32 that went through a text.
        if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-3 or np.linalg.det(matrix) < 0:
            raise InputError("rotation: is no rotation; its rows must be orthonormal, its sign +")


@dataclass(frozen=True)
class View(Checked):
    """The camera: it looks at `target` from `distance`, and may move; or a photograph's.

    Attributes:
        azimuth: degrees about `up`, by the right hand, from the world's x made perpendicular to it
            (from y where `up` lies along x): about z, 0 looks from +x, 90 from +y.
        elevation: degrees above the horizon.
        distance: to the target; null: so that the whole motion is in the picture.
        target: [m]; null: the middle of the motion.
        field_of_view: horizontal, degrees.
        turn, rise: change of azimuth and elevation [degrees/s].
        approach: change of distance, a second.
        up: what points upwards in the picture, of any length.
        units: of `distance` and `approach`: metres, or those of the first object's file.
        photograph: a camera that stands still, in place of all of the above; null: none.
    """

    azimuth: float = field(default=-60.0, metadata=ANGLE)
    elevation: float = field(default=14.0, metadata=between(-89.9, 89.9))
    distance: float | None = field(default=None, metadata=LENGTH)
    target: Vector | None = field(default=None, metadata=PLACE)
    field_of_view: float = field(default=35.0, metadata=between(1.0, 150.0))
    turn: float = field(default=0.0, metadata=RATE)
    rise: float = field(default=0.0, metadata=RATE)
    approach: float = field(default=0.0, metadata=SPEED)
    up: Vector = field(default=Z, metadata=direction())
    units: Literal["metres", "source"] = "metres"
    photograph: Photograph | None = None

    @property
    def frame(self) -> np.ndarray:
        """Directions of azimuth 0, of azimuth 90, and upwards (3, 3), as rows."""
        up = np.asarray(self.up, np.float64)
        up = up / np.linalg.norm(up)
        start = np.eye(3)[1 if abs(up[0]) > 1 - 1e-6 else 0]
        start = start - (start @ up) * up
        start = start / np.linalg.norm(start)
        return np.stack([start, np.cross(up, start), up])

    @property
    def stands_by_itself(self) -> bool:
        """Whether the motion decides nothing of where it stands."""
        return self.photograph is not None or not (self.distance is None or self.target is None)
