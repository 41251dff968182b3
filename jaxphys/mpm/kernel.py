"""Quadratic B-splines (Steffen, Kirby and Berzins 2008, table 1) on the three nearest nodes."""

import jax.numpy as jnp
from jax import Array


def base_node(position: Array, spacing: float, shape: tuple[int, int, int]) -> Array:
    """Lowest of the three nodes per axis around each particle: int32, shaped as `position` (3, N).

    Clamped so that base + 2 is a node: a particle outside the grid, or one that is not a number,
    still addresses memory that exists. Who needs to know asks `inside`.
    """
    last = jnp.array(shape, dtype=jnp.int32)[:, None] - 3
    return jnp.clip(jnp.floor(position / spacing - 0.5).astype(jnp.int32), 0, last)


def inside(position: Array, spacing: float, shape: tuple[int, int, int]) -> Array:
    """Whether all 27 nodes of each particle exist. Shape (N,); False for NaN."""
    scaled = position / spacing
    upper = jnp.array(shape, dtype=position.dtype)[:, None] - 1.5
    return jnp.all((scaled >= 0.5) & (scaled < upper), axis=0)


def weights(offset: Array) -> tuple[Array, Array, Array]:
    """Weights of the three nodes. `offset` is (x - x_base) / spacing in [0.5, 1.5), any shape."""
    return (
        0.5 * (1.5 - offset) ** 2,
        0.75 - (offset - 1.0) ** 2,
        0.5 * (offset - 0.5) ** 2,
    )


def weight_slopes(offset: Array) -> tuple[Array, Array, Array]:
    """Derivatives of `weights` by `offset`: divide by the spacing for those by position [1/m]."""
    return offset - 1.5, 2.0 - 2.0 * offset, offset - 0.5
