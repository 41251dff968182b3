"""B-splines (Steffen, Kirby and Berzins 2008, table 1) on the nearest nodes of each axis."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import jax.numpy as jnp
from jax import Array

KernelName = Literal["quadratic", "cubic"]


@dataclass(frozen=True)
class Kernel:
    """A B-spline. Static.

    Attributes:
        width: nodes per axis that a particle reaches.
        inverse_inertia: dx^2 over the sum of w d^2, the second moment along an axis, which is the
            same wherever the particle is: C = inverse_inertia / dx^2 B (Jiang et al. 2015).
        weights: of an offset (..., N), (x - x_base) / dx in [reach, reach + 1): weights, their
            slopes and the distances of the nodes, each (..., width, N). Slopes are by the offset:
            divided by dx they are those by position [1/m]. Distances are x_node - x in spacings.
    """

    width: int
    inverse_inertia: float
    weights: Callable[[Array], tuple[Array, Array, Array]]

    @property
    def reach(self) -> float:
        """Least offset of a particle from its first node, and so from the end of the domain."""
        return (self.width - 2) / 2

    def base_node(self, position: Array, spacing: float, shape: tuple[int, int, int]) -> Array:
        """Lowest node per axis around each particle: int32, shaped as `position` (3, N).

        Clamped so that all nodes exist: a particle outside the grid, or one that is not a number,
        still addresses memory that exists. Who needs to know asks `inside`.
        """
        last = jnp.array(shape, dtype=jnp.int32)[:, None] - self.width
        return jnp.clip(jnp.floor(position / spacing - self.reach).astype(jnp.int32), 0, last)

    def inside(self, position: Array, spacing: float, shape: tuple[int, int, int]) -> Array:
        """Whether all nodes of each particle exist. Shape (N,); False for NaN."""
        scaled = position / spacing
        upper = jnp.array(shape, dtype=position.dtype)[:, None] - (1 + self.reach)
        return jnp.all((scaled >= self.reach) & (scaled < upper), axis=0)


# One formula for all nodes each, rather than arrays of each node joined: XLA computes what is
# joined element by element.


def _quadratic(offset: Array) -> tuple[Array, Array, Array]:
    """3/4 - d^2 in the middle and (3/2 - |d|)^2 / 2 beside it."""
    node = jnp.arange(3, dtype=offset.dtype)[:, None]
    distance = node - offset[..., None, :]
    middle = node == 1
    slope = jnp.where(middle, 2 * distance, 1.5 * (node - 1) - distance)
    return jnp.where(middle, 0.75 - distance**2, 0.5 * slope**2), slope, distance


def _cubic(offset: Array) -> tuple[Array, Array, Array]:
    """2/3 - d^2 + |d|^3 / 2 for the inner two nodes and (2 - |d|)^3 / 6 for the outer two.

    |d| by the sides on which the nodes are, which leaves polynomials of the offset.
    """
    node = jnp.arange(4, dtype=offset.dtype)[:, None]
    distance = node - offset[..., None, :]
    side = jnp.where(node < 2, -1, 1).astype(offset.dtype)
    inner = (node == 1) | (node == 2)
    size = side * distance
    rest = 2 - size
    weight = jnp.where(inner, 2 / 3 - size**2 * (1 - 0.5 * size), rest**3 / 6)
    slope = side * jnp.where(inner, size * (2 - 1.5 * size), 0.5 * rest**2)
    return weight, slope, distance


QUADRATIC = Kernel(3, 4.0, _quadratic)
CUBIC = Kernel(4, 3.0, _cubic)
KERNELS: dict[KernelName, Kernel] = {"quadratic": QUADRATIC, "cubic": CUBIC}
