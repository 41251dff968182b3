"""A region that moves as it is told."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.boundaries.base import (
    FOREVER,
    HALF_SIZE,
    PER_PARTICLE,
    PLACE,
    TIME,
    VELOCITY,
    Boundary,
    Setting,
    Vector,
    active,
    array_of,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Translate(Boundary):
    """The particles that start inside a box move at a given velocity; zero holds them fixed.

    Attributes:
        centre, half_size: of the box, at rest [m].
        velocity: [m/s].
        start, end: acts while start <= time < end [s].
        chosen: the particles, (N,) bool.
    """

    type: ClassVar[str] = "translate"
    centre: Vector = field(metadata=PLACE)
    half_size: Vector = field(metadata=HALF_SIZE)
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=VELOCITY)
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)
    chosen: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def prepared(self, setting: Setting) -> Self:
        chosen = setting.in_box(self.centre, self.half_size)
        return replace(super().prepared(setting), chosen=jnp.asarray(chosen))

    def on_particles(self, position, velocity, loads, time, dt):
        acts = loads["chosen"] & active(time, self.start, self.end)
        return jnp.where(acts, array_of(self.velocity)[:, None], velocity)
