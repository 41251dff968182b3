"""A half-space."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.fields import NON_NEGATIVE, one_of
from jaxphys.mpm.boundaries.base import (
    DIRECTION,
    FOREVER,
    PLACE,
    STATIC,
    TIME,
    VELOCITY,
    Vector,
    active,
    array_of,
    column,
    height,
    speed_within,
    unit_vector,
)
from jaxphys.mpm.boundaries.contact import FAR, Contact, Face, Surface


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plane(Contact):
    """A half-space that holds matter on the side its normal points to.

    Attributes:
        point: a point of the plane at `start` [m].
        normal: points out of the solid, of any length.
        surface: `sticky` stops what touches it, `slip` lets it slide but not leave, `separate`
            also lets it leave.
        friction: Coulomb's coefficient; sticky ignores it.
        start, end: acts while start <= time < end [s].
        velocity: of the plane [m/s]; the surface moves with it from `start` on.
    """

    type: ClassVar[str] = "plane"
    place: ClassVar[str] = "point"
    point: Vector = field(default=(0.0, 0.0, 0.1), metadata=PLACE)
    normal: Vector = field(default=(0.0, 0.0, 1.0), metadata=DIRECTION)
    surface: Surface = field(default="separate", metadata=STATIC | one_of(Surface))
    friction: float | None = field(default=0.3, metadata=NON_NEGATIVE)
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=VELOCITY)

    @property
    def kinds(self):
        return ((self.surface, self.friction is not None),)

    def fastest(self, begin=0.0, end=FOREVER):
        speed = jnp.sqrt(jnp.sum(array_of(self.velocity) ** 2))
        return speed_within(speed, begin, end, self.start, self.end)

    def faces(self, x, time: Array) -> tuple[Face, ...]:
        normal = unit_vector(array_of(self.normal))
        velocity = array_of(self.velocity)
        point = array_of(self.point) + velocity * jnp.maximum(time - self.start, 0)
        acts = active(time, self.start, self.end)
        distance = jnp.where(acts, height(x, point, normal), FAR)
        return (
            Face(
                distance,
                column(normal, x),
                column(velocity, x),
                self.friction,
                self.surface,
            ),
        )
