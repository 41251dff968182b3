"""A push on a region."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.fields import POSITIVE, between, unit, vector
from jaxphys.mpm.boundaries.base import (
    HALF_SIZE,
    PER_PARTICLE,
    PLACE,
    STATIC,
    TIME,
    Boundary,
    Setting,
    Vector,
    array_of,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Impulse(Boundary):
    """A force for a while on the particles that start inside a box, shared by mass.

    PhysGaussian gives the force to each particle, which makes the motion depend on how many
    particles there are; here it is the force on all of them together, unless asked otherwise.

    Attributes:
        centre, half_size: of the box, at rest [m].
        force: on all of it together [N].
        start, duration: [s].
        per_particle: the force is meant for each particle, so that the sum grows with their
            number.
        chosen: the particles, (N,) bool.
    """

    type: ClassVar[str] = "impulse"
    regions: ClassVar[tuple[str, ...]] = ("centre", "half_size")
    centre: Vector = field(metadata=PLACE)
    half_size: Vector = field(metadata=HALF_SIZE)
    force: Vector = field(metadata=vector(between(-1e15, 1e15), unit("N")))
    start: float = field(default=0.0, metadata=TIME)
    duration: float = field(default=1e-3, metadata=POSITIVE | unit("s"))
    per_particle: bool = field(default=False, metadata=STATIC)
    chosen: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def derived(self, setting: Setting) -> Self:
        chosen = setting.in_box(array_of(self.centre), array_of(self.half_size))
        return replace(self, chosen=chosen)

    def loads(self, model, grid):
        mass = jnp.where(array_of(self.chosen), model.mass, 0)
        total = jnp.sum(mass)
        share = mass / jnp.where(total > 0, total, 1)
        return {"share": share * jnp.sum(array_of(self.chosen)) if self.per_particle else share}

    def impulse(self, position, velocity, slip, loads, time, dt, since):
        # Of the step only what lies within: a push shorter than a step is no stronger for it.
        end = jnp.minimum(time + dt, self.start + self.duration)
        lasts = jnp.clip(end - jnp.maximum(time, self.start), 0, dt)
        return lasts * array_of(self.force)[:, None] * loads["share"], None
