"""A box that holds, carries or pushes."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.fields import NON_NEGATIVE, one_of
from jaxphys.mpm.boundaries.base import (
    DURATION,
    FOREVER,
    HALF_SIZE,
    PLACE,
    STATIC,
    TIME,
    VELOCITY,
    Vector,
    active,
    array_of,
    column,
    speed_within,
)
from jaxphys.mpm.boundaries.contact import FAR, Contact, Face, Surface


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Box(Contact):
    """A box that moves at a given velocity, and what is inside with it; or one that pushes.

    Attributes:
        centre, half_size: at `start` [m]; the box moves along with its velocity.
        velocity: [m/s].
        start, end: acts while start <= time < end [s].
        rest_after: how long the box stands still after that [s].
        surface: `sticky` holds all that is inside; `slip` and `separate` are as for a plane, and
            push out what comes in through a face.
        friction: Coulomb's coefficient; sticky ignores it.
    """

    type: ClassVar[str] = "box"
    place: ClassVar[str] = "centre"
    centre: Vector = field(metadata=PLACE)
    half_size: Vector = field(metadata=HALF_SIZE)
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=VELOCITY)
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)
    rest_after: float = field(default=0.0, metadata=DURATION)
    surface: Surface = field(default="sticky", metadata=STATIC | one_of(Surface))
    friction: float | None = field(default=0.0, metadata=NON_NEGATIVE)

    @property
    def kinds(self):
        return ((self.surface, self.friction is not None),)

    def fastest(self, begin=0.0, end=FOREVER):
        speed = jnp.sqrt(jnp.sum(array_of(self.velocity) ** 2))
        return speed_within(speed, begin, end, self.start, self.end)

    def faces(self, x, time: Array) -> tuple[Face, ...]:
        moved = array_of(self.velocity) * jnp.clip(time - self.start, 0, self.end - self.start)
        velocity = jnp.where(active(time, self.start, self.end), array_of(self.velocity), 0)
        offset = [x[i] - self.centre[i] - moved[i] for i in range(3)]
        distance, normal = box_distance(offset, array_of(self.half_size))
        distance = jnp.where(active(time, self.start, self.end + self.rest_after), distance, FAR)
        return (Face(distance, normal, column(velocity, x), self.friction, self.surface),)


def box_distance(offset, half_size: Array) -> tuple[Array, Array]:
    """Signed distance (...) of a box [m], and the direction (3, ...) away from it.

    offset: from its centre, (3, ...) or three arrays that broadcast [m]. Outside, the direction is
    that from the nearest point; inside, that of the nearest face.
    """
    distance, shares = corner_distance([jnp.abs(offset[i]) - half_size[i] for i in range(3)])
    sign = jnp.stack([jnp.broadcast_to(jnp.sign(offset[i]), distance.shape) for i in range(3)])
    return distance, sign * shares


def corner_distance(beyond) -> tuple[Array, Array]:
    """Signed distance (...) of the solid that faces at right angles to each other enclose, and how
    much of the direction away from it is along the normal of each, (K, ...).

    beyond: K signed distances of the faces, which broadcast [m].
    """
    beyond = jnp.stack(jnp.broadcast_arrays(*beyond))
    out = jnp.maximum(beyond, 0)
    squared = jnp.sum(out**2, axis=0)
    outside = squared > 0
    length = jnp.sqrt(jnp.where(outside, squared, 1))
    nearest = jnp.max(beyond, axis=0)
    # Of several that are as near, the first: the others' share would make the direction longer.
    rows = jnp.arange(len(beyond)).reshape(-1, *(1,) * nearest.ndim)
    face = rows == jnp.argmax(beyond, axis=0)
    return jnp.where(outside, length, nearest), jnp.where(outside, out / length, face)
