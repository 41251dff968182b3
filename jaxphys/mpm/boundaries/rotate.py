"""A region that turns as it is told."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
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
    speed_within,
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
    regions: ClassVar[tuple[str, ...]] = ("point", "axis", "half_height", "radius")
    point: Vector = field(metadata=PLACE)
    axis: Vector = field(metadata=DIRECTION)
    half_height: float = field(metadata=LENGTH)
    radius: float = field(metadata=LENGTH)
    angular_velocity: float = field(default=0.0, metadata=between(-1e8, 1e8) | unit("rad/s"))
    axial_velocity: float = field(default=0.0, metadata=between(-1e8, 1e8) | unit("m/s"))
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)
    chosen: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def derived(self, setting: Setting) -> Self:
        arm = setting.rest - array_of(self.point)
        along = arm @ unit_vector(array_of(self.axis))
        squared = jnp.sum(arm**2, axis=1) - along**2
        edge = ON_EDGE * setting.grid.spacing
        within = squared < jnp.maximum(self.radius - edge, 0) ** 2
        return replace(self, chosen=within & (jnp.abs(along) < self.half_height - edge))

    def fastest(self, begin=0.0, end=FOREVER):
        # Within the cylinder, where the particles start.
        across = self.radius * self.angular_velocity
        speed = jnp.sqrt(across**2 + self.axial_velocity**2)
        return speed_within(speed, begin, end, self.start, self.end)

    def on_particles(self, position, velocity, loads, time, dt):
        axis = unit_vector(array_of(self.axis))
        turning = jnp.cross(axis, (position - array_of(self.point)[:, None]).T).T
        motion = self.angular_velocity * turning + (self.axial_velocity * axis)[:, None]
        return jnp.where(loads["chosen"] & active(time, self.start, self.end), motion, velocity)
