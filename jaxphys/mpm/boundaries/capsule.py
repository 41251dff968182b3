"""A capsule: a cylinder with a half ball at each end."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp

from jaxphys.core.fields import NON_NEGATIVE, unit
from jaxphys.mpm.boundaries.base import LENGTH, array_of
from jaxphys.mpm.boundaries.free import Solid
from jaxphys.mpm.boundaries.obstacle import Obstacle, length_and_direction


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Capsule(Obstacle):
    """All within a distance of a line along its own z axis, or a hollow in the shape of that.

    Attributes:
        centre, orientation, motion, inside, surface, friction, start, end: as for any `Obstacle`.
        radius: [m].
        half_height: of the line, without the half balls at its ends [m].
    """

    type: ClassVar[str] = "capsule"
    radius: float = field(metadata=LENGTH)
    half_height: float = field(metadata=NON_NEGATIVE | unit("m"))

    def sides(self, x):
        half = array_of(self.half_height)
        length, direction = length_and_direction([x[0], x[1], x[2] - jnp.clip(x[2], -half, half)])
        return [(length - self.radius, direction)]

    @property
    def reach(self):
        return array_of(self.half_height) + self.radius

    def solid(self):
        r, h = array_of(self.radius), array_of(self.half_height)
        tube, ends = 2 * jnp.pi * r**2 * h, 4 / 3 * jnp.pi * r**3
        axial = tube * r**2 / 2 + ends * 0.4 * r**2
        # Of a half ball, whose centre of mass is 3/8 r from its plane.
        across = tube * (r**2 / 4 + h**2 / 3) + ends * (0.4 * r**2 + h**2 + 0.75 * h * r)
        nothing = jnp.zeros_like(r)
        lever = (h + r) ** 2
        return Solid(
            volume=tube + ends,
            middle=jnp.zeros(3, r.dtype),
            inertia=jnp.diag(jnp.stack([across, across, axial])),
            area=4 * jnp.pi * r * (h + r),
            levers=jnp.stack([lever, lever, nothing]),
            points=jnp.stack([jnp.stack([nothing, nothing, z]) for z in (-h, h)], axis=1),
            radius=r,
        )
