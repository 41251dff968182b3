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
    """Weights, their slopes and the distances of the three nodes, each (..., 3, N).

    offset: (..., N), (x - x_base) / spacing in [0.5, 1.5). Slopes are by `offset`: divided by the
    spacing they are those by position [1/m]. Distances are x_node - x in spacings.

    One formula for the three nodes, 3/4 - d^2 in the middle and (3/2 - |d|)^2 / 2 beside it, rather
    than three arrays joined: XLA computes what is joined element by element.
    """
    node = jnp.arange(3, dtype=offset.dtype)[:, None]
    distance = node - offset[..., None, :]
    middle = node == 1
    slope = jnp.where(middle, 2 * distance, 1.5 * (node - 1) - distance)
    return jnp.where(middle, 0.75 - distance**2, 0.5 * slope**2), slope, distance
