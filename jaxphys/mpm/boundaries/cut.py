"""A half-space that holds, with a layer that slides."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp

from jaxphys.core.fields import between
from jaxphys.mpm.boundaries.base import (
    DIRECTION,
    FOREVER,
    ON_EDGE,
    PLACE,
    TIME,
    Boundary,
    Vector,
    active,
    array_of,
    column,
    height,
    unit_vector,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cut(Boundary):
    """A half-space that holds what is in it, but for a layer that slides along it, slowed.

    PhysGaussian's `cut`, whose layer is fixed in the code at heights 0.40 to 0.53 and at a factor
    of 0.3 along x and z, with the layer's bounds and the factor made parameters and the plane's own
    normal in place of y. It acts on the nodes inside.

    Attributes:
        point, normal, start, end: as for `Plane`.
        lower, upper: of the layer along z [m].
        factor: what is left of the velocity along the plane in the layer.
    """

    type: ClassVar[str] = "cut"
    point: Vector = field(metadata=PLACE)
    normal: Vector = field(metadata=DIRECTION)
    lower: float = field(default=0.40, metadata=between(-1e6, 1e6))
    upper: float = field(default=0.53, metadata=between(-1e6, 1e6))
    factor: float = field(default=0.3, metadata=between(0, 1))
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)

    def on_grid(self, velocity, coordinates, grid, time, dt):
        edge = ON_EDGE * grid.spacing
        normal = unit_vector(array_of(self.normal))
        inside = height(coordinates, self.point, normal) < -edge
        layer = (coordinates[2] > self.lower + edge) & (coordinates[2] < self.upper - edge)
        n = column(normal, coordinates)
        slid = self.factor * (velocity - n * jnp.sum(n * velocity, axis=0))
        held = jnp.where(layer, slid, 0)
        return jnp.where(inside & active(time, self.start, self.end), held, velocity)
