"""A ball."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp

from jaxphys.mpm.boundaries.base import LENGTH, array_of
from jaxphys.mpm.boundaries.free import Solid
from jaxphys.mpm.boundaries.obstacle import Obstacle, length_and_direction


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Ball(Obstacle):
    """A ball, or a hollow in the shape of one.

    Attributes:
        centre, orientation, motion, inside, surface, friction, start, end: as for any `Obstacle`.
        radius: [m].
    """

    type: ClassVar[str] = "ball"
    radius: float = field(metadata=LENGTH)

    def sides(self, x):
        length, direction = length_and_direction(x)
        return [(length - self.radius, direction)]

    @property
    def reach(self):
        return array_of(self.radius)

    def solid(self):
        r = array_of(self.radius)
        volume = 4 / 3 * jnp.pi * r**3
        return Solid(
            volume=volume,
            middle=jnp.zeros(3, r.dtype),
            inertia=0.4 * volume * r**2 * jnp.eye(3, dtype=r.dtype),
            area=4 * jnp.pi * r**2,
            levers=jnp.zeros(3, r.dtype),
            points=jnp.zeros((3, 1), r.dtype),
            radius=r,
        )
