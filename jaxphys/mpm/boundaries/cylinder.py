"""A cylinder."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.mpm.boundaries.base import LENGTH, array_of
from jaxphys.mpm.boundaries.box import corner_distance
from jaxphys.mpm.boundaries.free import Solid
from jaxphys.mpm.boundaries.obstacle import Obstacle, length_and_direction

RIM = 12  # points of each rim at which a free one touches what is flat


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cylinder(Obstacle):
    """A cylinder along its own z axis, or a hollow in the shape of one.

    Attributes:
        centre, orientation, motion, inside, surface, friction, start, end: as for any `Obstacle`.
        radius, half_height: [m].
    """

    type: ClassVar[str] = "cylinder"
    radius: float = field(metadata=LENGTH)
    half_height: float = field(metadata=LENGTH)

    @property
    def count(self):
        return 2 if self.inside else 1

    def sides(self, x):
        across, radial = length_and_direction(x[:2])
        upward = jnp.sign(x[2])
        wall, ends = across - self.radius, jnp.abs(x[2]) - self.half_height
        nothing = jnp.zeros_like(wall)
        if self.inside:
            return [(wall, [*radial, nothing]), (ends, [nothing, nothing, upward])]
        distance, (to_wall, to_ends) = corner_distance([wall, ends])
        return [(distance, [to_wall * radial[0], to_wall * radial[1], to_ends * upward])]

    @property
    def reach(self):
        return jnp.hypot(self.radius, self.half_height)

    def solid(self):
        r, h = array_of(self.radius), array_of(self.half_height)
        volume = 2 * jnp.pi * r**2 * h
        across = volume * (r**2 / 4 + h**2 / 3)
        lever = jnp.maximum(r, h) ** 2
        turn = 2 * np.pi * np.arange(RIM) / RIM
        rim = np.stack([np.cos(turn), np.sin(turn)])
        ends = [jnp.concatenate([r * rim, jnp.full((1, RIM), 1.0) * z]) for z in (-h, h)]
        return Solid(
            volume=volume,
            middle=jnp.zeros(3, r.dtype),
            inertia=jnp.diag(jnp.stack([across, across, volume * r**2 / 2])),
            area=2 * jnp.pi * r * (r + 2 * h),
            levers=jnp.stack([lever, lever, jnp.zeros_like(r)]),
            points=jnp.concatenate(ends, axis=1).astype(r.dtype),
            radius=jnp.zeros_like(r),
        )
