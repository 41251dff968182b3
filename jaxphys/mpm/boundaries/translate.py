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
    speed_within,
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
    regions: ClassVar[tuple[str, ...]] = ("centre", "half_size")
    centre: Vector = field(metadata=PLACE)
    half_size: Vector = field(metadata=HALF_SIZE)
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=VELOCITY)
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)
    chosen: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def derived(self, setting: Setting) -> Self:
        chosen = setting.in_box(array_of(self.centre), array_of(self.half_size))
        return replace(self, chosen=chosen)

    def fastest(self, begin=0.0, end=FOREVER):
        speed = jnp.sqrt(jnp.sum(array_of(self.velocity) ** 2))
        return speed_within(speed, begin, end, self.start, self.end)

    def on_particles(self, position, velocity, loads, time, dt):
        acts = loads["chosen"] & active(time, self.start, self.end)
        return jnp.where(acts, array_of(self.velocity)[:, None], velocity)
