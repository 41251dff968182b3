"""The diagonal 3 x 3 blocks of a stiffness that particles give to the grid."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import packed
from jaxphys.mpm.transfer.stencil import Stencil, Window


def scatter_blocks(
    window: Window, at: Stencil, blocks: Array, stiffness: Array, spring: Array | None
) -> Array:
    """`blocks` (M, 6) and what particles add to them: the part of a second derivative that belongs
    to one node, packed. Of quadratic splines.

    Where velocities u act on a particle by sum w u and by sum w u d^T, and an energy of these has
    the second derivatives `spring` and `stiffness`, the block of a node is w^2 spring and
    (w d) . stiffness . (w d).

    Args:
        stiffness: 9 x 9 over entries (i, j) in the order 3 i + j, packed (45, N).
        spring: 3 x 3, packed (6, N), or None for none.
    """
    plane, line = window.shape[1] * window.shape[2], window.shape[2]
    (wx, wy, wz), (mx, my, mz) = at.weight, at.moment
    s, nine = packed.split(stiffness), packed.places(9)

    def entry(a, b, w, arm):
        total = 0.0 if spring is None else w * w * spring[packed.places(3)[a, b]]
        for j in range(3):
            for k in range(3):
                total = total + s[nine[3 * a + j, 3 * b + k]] * (arm[j] * arm[k])
        return total

    def add_plane(a, blocks):
        first = at.row + a * plane

        def add_row(n, blocks):
            b, c = n // 3, n % 3
            wyz = wy[b] * wz[c]
            arm = (mx[a] * wyz, wx[a] * my[b] * wz[c], wx[a] * wy[b] * mz[c])
            new = jnp.stack([entry(i, j, wx[a] * wyz, arm) for i, j in packed.triangle(3)], axis=-1)
            return blocks.at[first + (b * line + c)].add(
                new, mode="promise_in_bounds", wrap_negative_indices=False
            )

        return jax.lax.fori_loop(0, 9, add_row, blocks)

    return jax.lax.fori_loop(0, 3, add_plane, blocks)
