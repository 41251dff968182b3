"""A box that may be turned, with sharp or round edges."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import NON_NEGATIVE, unit
from jaxphys.mpm.boundaries.base import HALF_SIZE, Setting, Vector, array_of
from jaxphys.mpm.boundaries.box import box_distance
from jaxphys.mpm.boundaries.free import Solid
from jaxphys.mpm.boundaries.obstacle import Obstacle


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cuboid(Obstacle):
    """A box along axes of its own, or a room in the shape of one.

    Attributes:
        centre, orientation, motion, inside, surface, friction, start, end: as for any `Obstacle`.
        half_size: edges included [m].
        rounding: radius of its edges and corners [m]; zero: sharp.
    """

    type: ClassVar[str] = "cuboid"
    half_size: Vector = field(metadata=HALF_SIZE)
    rounding: float | None = field(default=0.0, kw_only=True, metadata=NON_NEGATIVE | unit("m"))

    def __post_init__(self):
        super().__post_init__()
        if not isinstance(self.half_size, tuple) or not self.rounding:
            return  # arrays, checked when they were numbers, or sharp
        if self.rounding > min(self.half_size):
            raise InputError(
                f"rounding: {self.rounding} is more than the least half_size, "
                f"{min(self.half_size)}; round less"
            )

    def prepared(self, setting: Setting):
        # Sharp edges are left out of the program, and cannot be differentiated.
        return super(Cuboid, self if self.rounding else replace(self, rounding=None)).prepared(
            setting
        )

    @property
    def count(self):
        return 3 if self.inside and self.rounding is None else 1

    def sides(self, x):
        half_size = array_of(self.half_size)
        if self.count == 3:
            # Beside an edge two sides hold, in a corner all three.
            axes = jnp.eye(3, dtype=half_size.dtype)
            return [
                (jnp.abs(x[i]) - half_size[i], [a * jnp.sign(x[i]) for a in axes[i]])
                for i in range(3)
            ]
        if self.rounding is None:
            return [box_distance(x, half_size)]
        distance, direction = box_distance(x, half_size - self.rounding)
        return [(distance - self.rounding, direction)]

    @property
    def reach(self):
        return jnp.sqrt(jnp.sum(array_of(self.half_size) ** 2))

    def solid(self):
        size = array_of(self.half_size)
        r = jnp.zeros_like(size[0]) if self.rounding is None else array_of(self.rounding)
        core = size - r
        squares, volume = second_moments(core, r)
        y, z = jnp.roll(size, -1), jnp.roll(size, -2)
        signs = np.stack(np.meshgrid(*[(-1, 1)] * 3, indexing="ij")).reshape(3, 8)
        c = core
        faces = 8 * (c[0] * c[1] + c[1] * c[2] + c[2] * c[0])
        return Solid(
            volume=volume,
            middle=jnp.zeros_like(size),
            inertia=jnp.diag(jnp.sum(squares) - squares),
            area=faces + 4 * jnp.pi * r * jnp.sum(core) + 4 * jnp.pi * r**2,
            levers=jnp.maximum(y, z) ** 2,
            points=core[:, None] * signs,
            radius=r,
        )


def second_moments(core: Array, r: Array) -> tuple[Array, Array]:
    """The integral of x^2 along each axis [m^5], (3,), and the volume [m^3], (), of all within r of
    a box of half sizes `core`.

    It is a box, a slab on each face, a quarter of a cylinder on each edge and an eighth of a ball
    in each corner.
    """
    pi = jnp.pi
    moments = []
    for axis in range(3):
        a, b, c = (core[(axis + i) % 3] for i in range(3))
        even = 8 * a * b * c + 8 * a * (b + c) * r + 2 * pi * r**2 * a  # as far as the core goes
        slabs = 8 / 3 * b * c * ((a + r) ** 3 - a**3)
        edges = 2 * (b + c) * (pi * a**2 * r**2 + 8 / 3 * a * r**3 + pi / 4 * r**4)
        corners = pi * (4 / 3 * a**2 * r**3 + a * r**4 + 4 / 15 * r**5)
        moments.append(even * a**2 / 3 + slabs + edges + corners)
    a, b, c = core
    volume = 8 * a * b * c + 8 * r * (a * b + b * c + c * a)
    volume = volume + 2 * pi * r**2 * (a + b + c) + 4 / 3 * pi * r**3
    return jnp.stack(moments), volume
