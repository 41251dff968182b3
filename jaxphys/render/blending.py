"""Front-to-back blending of tile lists.

A pixel sums w_i f_i over the splats of its tile in depth order, w_i = a_i prod_{j<i} (1 - a_j)
with a_i = min(alpha_max, o_i exp(-(u^2 + v^2) / 2)) (Kerbl et al. 2023, eq. 3); colour, depth and
opacity are all features f. Groups of tiles of about equal list length advance in lockstep, a chunk
of splats at a time, until every pixel of the group is finished. Tangents go through the same loop;
its transpose, the gradient, is written by hand, in `blending_gradient.py` (`core.linear_map`).
"""

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array, lax

from jaxphys.core import algebra
from jaxphys.core.linear_map import linear_map
from jaxphys.render.binning import Boxes, Grid, TileLists
from jaxphys.render.blending_gradient import blend_backward
from jaxphys.render.settings import Settings
from jaxphys.render.tile_groups import (
    Work,
    any_alive,
    blending_weights,
    busy_groups,
    next_chunk,
    pixel_centres,
    schedule,
    splat_alpha,
    transmittances,
)


@partial(jax.custom_jvp, nondiff_argnums=(4, 5))
def blend(
    geometry: Array, features: Array, boxes: Boxes, lists: TileLists, grid: Grid, settings: Settings
) -> Array:
    """Blends features over all tiles.

    Args:
        geometry: rows centre x, centre y, factors a, b, c, opacity, shape (6, N).
        features: what is blended, shape (F, N).
        boxes, lists: from `binning`.

    Returns:
        Sums of w_i f_i, shape (tiles, F, tile_size^2), pixels row by row.
    """
    return _forward(geometry, features, boxes, lists, grid, settings)[0]


def _forward(geometry, features, boxes, lists, grid, settings):
    table = by_rank(geometry, features, boxes)
    work = schedule(lists, grid, settings)
    total = _totals(table, boxes, lists, work, grid, settings)
    return total, (table, work, boxes, lists, total)


@blend.defjvp
def _blend_jvp(grid, settings, primals, tangents):
    geometry, features, boxes, lists = primals
    total, residuals = _forward(geometry, features, boxes, lists, grid, settings)

    def forward(kept, rates):
        filled = [
            jnp.zeros_like(own) if rate is None else rate
            for own, rate in zip((geometry, features), rates, strict=True)
        ]
        return (blend_tangent(grid, settings, kept, filled),)

    def transpose(kept, cotangents):
        return blend_backward(grid, settings, kept, cotangents[0])[:2]

    (rate,) = linear_map(forward, transpose, residuals, tangents[:2], (total,))
    return total, rate


def blend_tangent(grid, settings, residuals, tangents):
    """The derivative of `blend` along tangents, whose transpose is `blend_backward`.

    Args:
        residuals: what `blend` kept, as for `blend_backward`.
        tangents: of geometry (6, N) and of features (F, N). Which splat is in which tile, and in
            what order, has no derivative.

    Returns:
        The tangent of the blended features, shape (tiles, F, tile_size^2).
    """
    table, work, boxes, lists, _ = residuals

    def totals(table: Array) -> Array:
        return _totals(table, boxes, lists, work, grid, settings)

    return jax.jvp(totals, (table,), (by_rank(tangents[0], tangents[1], boxes),))[1]


def by_rank(geometry: Array, features: Array, boxes: Boxes) -> Array:
    """A row a splat, nearest first, shape (N, 6 + F)."""
    return jnp.concatenate([geometry, features]).T[boxes.order]


def _totals(
    table: Array, boxes: Boxes, lists: TileLists, work: Work, grid: Grid, settings: Settings
) -> Array:
    """Blended features (tiles, F, tile_size^2) of splats by rank."""
    pixels = grid.tile_size**2
    channels = table.shape[1] - 6

    def finish_group(carry):
        index, blended = carry
        group = jax.tree.map(lambda leaf: leaf[index], work)
        size = group.tiles.shape[0]
        x, y = pixel_centres(group.tiles, boxes.first, grid, table.dtype)

        def advance(carry):
            done, light, total, _ = carry
            rows, _ = next_chunk(table, lists, group, done, settings)
            alpha = lax.optimization_barrier(splat_alpha(rows, x, y, settings)[1])
            before, light = lax.optimization_barrier(transmittances(alpha, light))
            weights = blending_weights(alpha, before, settings)
            total = total + _features_sum(weights, rows[..., 6:])
            return done + 1, light, total, any_alive(light, group, done + 1, settings)

        light = jnp.ones((size, pixels), table.dtype)
        total = jnp.zeros((size, channels, pixels), table.dtype)
        start = (jnp.int32(0), light, total, jnp.any(group.lengths > 0))
        total = lax.while_loop(lambda carry: carry[3], advance, start)[2]
        where = jnp.where(group.tiles < 0, grid.tiles + jnp.arange(size), group.tiles)
        return index + 1, blended.at[where].set(total, mode="drop", unique_indices=True)

    blank = jnp.zeros((grid.tiles, channels, pixels), table.dtype)
    busy = busy_groups(work)
    return lax.while_loop(lambda c: c[0] < busy, finish_group, (jnp.int32(0), blank))[1]


def _features_sum(weights: Array, features: Array) -> Array:
    """Sum over the chunk of w_i f_i: (G, C, P), (G, C, F) -> (G, F, P)."""
    return algebra.total(
        weights[:, k, None, :] * features[:, k, :, None] for k in range(weights.shape[1])
    )
