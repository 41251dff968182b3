"""A region that turns as it is told."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.fields import between, unit
from jaxphys.mpm.boundaries.base import (
    DIRECTION,
    FOREVER,
    LENGTH,
    ON_EDGE,
    PER_PARTICLE,
    PLACE,
    TIME,
    Boundary,
    Setting,
    Vector,
    active,
    array_of,
    unit_vector,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rotate(Boundary):
    """The particles that start inside a cylinder turn about its axis and move along it.

    Attributes:
        point: centre of the cylinder [m].
        axis: its direction, of any length.
        half_height, radius: [m].
        angular_velocity: about the axis, by the right-hand rule [rad/s].
        axial_velocity: along the axis [m/s].
        start, end: acts while start <= time < end [s].
        chosen: the particles, (N,) bool.
    """

    type: ClassVar[str] = "rotate"
    point: Vector = field(metadata=PLACE)
    axis: Vector = field(metadata=DIRECTION)
    half_height: float = field(metadata=LENGTH)
    radius: float = field(metadata=LENGTH)
    angular_velocity: float = field(default=0.0, metadata=between(-1e8, 1e8) | unit("rad/s"))
    axial_velocity: float = field(default=0.0, metadata=between(-1e8, 1e8) | unit("m/s"))
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)
    chosen: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def prepared(self, setting: Setting) -> Self:
        axis = np.asarray(self.axis, np.float64)
        arm = np.asarray(setting.rest, np.float64) - np.asarray(self.point)
        along = arm @ (axis / np.linalg.norm(axis))
        across = np.sqrt(np.maximum(np.sum(arm**2, axis=1) - along**2, 0))
        edge = ON_EDGE * setting.grid.spacing
        chosen = (np.abs(along) < self.half_height - edge) & (across < self.radius - edge)
        return replace(super().prepared(setting), chosen=jnp.asarray(chosen))

    def on_particles(self, position, velocity, loads, time, dt):
        axis = unit_vector(array_of(self.axis))
        turning = jnp.cross(axis, (position - array_of(self.point)[:, None]).T).T
        motion = self.angular_velocity * turning + (self.axial_velocity * axis)[:, None]
        return jnp.where(loads["chosen"] & active(time, self.start, self.end), motion, velocity)
