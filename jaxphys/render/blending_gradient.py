"""The gradient of blending, written by hand.

The backward pass runs the same loop as the forward pass, front to back. With
S_i = g . (total - sum_{j<=i} w_j f_j), what lies behind splat i as the pixel sees it,

    dL/da_i = T_i g . f_i - S_i / (1 - a_i),

which needs no division of the transmittance. Each (tile, splat) pair writes its gradient to its own
slot, in order of emission, where the slots of one splat are contiguous; a sum over these runs gives
the gradient of the splat. Nothing is added to in unknown order, so the bits are reproducible.
"""

import jax
import jax.numpy as jnp
from jax import Array, lax

from jaxphys.core import algebra
from jaxphys.render.binning import Boxes, Grid, slot_owners
from jaxphys.render.tile_groups import (
    Work,
    any_alive,
    blending_weights,
    busy_groups,
    corners,
    next_chunk,
    pixel_centres,
    splat_alpha,
    transmittances,
)

HIGHEST = lax.Precision.HIGHEST
# How many slots are added at once when the gradient of a splat is gathered.
FOLD = 8


def blend_backward(grid, settings, residuals, cotangent):
    """The rule of `blending.blend`: gradients of geometry (6, N) and features (F, N), None for the
    lists.

    residuals: what the forward pass kept: the table of splats by rank, the groups, boxes, lists and
    the blended features; cotangent: of these features, shape (tiles, F, tile_size^2).
    """
    table, work, boxes, lists, total = residuals
    capacity = lists.ranks.shape[0]
    dtype = table.dtype
    width = table.shape[1]
    pixels = grid.tile_size**2
    # g . total: what lies behind the camera, so to speak.
    behind_all = jnp.sum(total * cotangent, axis=1)
    moments_of = _monomials(grid, dtype)

    def finish_group(carry):
        index, slots = carry
        group = jax.tree.map(lambda leaf: leaf[index], work)
        size = group.tiles.shape[0]
        x, y = pixel_centres(group.tiles, boxes.first, grid, dtype)
        safe = jnp.maximum(group.tiles, 0)
        g = cotangent[safe]

        def advance(carry):
            done, light, behind, _, slots = carry
            rows, ranks = next_chunk(table, lists, group, done, settings)
            raw, alpha = splat_alpha(rows, x, y, settings)
            raw, alpha = lax.optimization_barrier((raw, alpha))
            before, light = lax.optimization_barrier(transmittances(alpha, light))
            weights = blending_weights(alpha, before, settings)
            value = lax.optimization_barrier(_feature_dot(rows[..., 6:], g))
            after, behind = lax.optimization_barrier(_remainders(weights * value, behind))
            slope = jnp.where(weights > 0, before * value - after / (1 - alpha), 0)
            if not settings.gradient_through_clamp:
                slope = jnp.where(raw < settings.alpha_max, slope, 0)
            # Gradient with respect to the exponent -(u^2 + v^2) / 2.
            slope = slope * raw
            moments = lax.dot_general(
                slope, moments_of, (((2,), (0,)), ((), ())), precision=HIGHEST
            )
            by_feature = lax.dot_general(
                weights, g, (((2,), (2,)), ((0,), (0,))), precision=HIGHEST
            )
            gradient = jnp.concatenate(
                [_geometry_gradient(rows, moments, group.tiles, boxes.first, grid), by_feature],
                axis=-1,
            )
            where = _emission_slots(boxes, ranks, group, grid, capacity)
            slots = slots.at[where].set(gradient, mode="drop", unique_indices=True)
            alive = any_alive(light, group, done + 1, settings)
            return done + 1, light, behind, alive, slots

        light = jnp.ones((size, pixels), dtype)
        start = (jnp.int32(0), light, behind_all[safe], jnp.any(group.lengths > 0), slots)
        return index + 1, lax.while_loop(lambda carry: carry[3], advance, start)[4]

    blank = jnp.zeros((capacity, width), dtype)
    busy = busy_groups(work)
    slots = lax.while_loop(lambda c: c[0] < busy, finish_group, (jnp.int32(0), blank))[1]
    by_rank = _sum_runs(slots, boxes)
    count = boxes.order.shape[0]
    rank_of = (
        jnp.zeros(count, jnp.int32)
        .at[boxes.order]
        .set(jnp.arange(count, dtype=jnp.int32), unique_indices=True)
    )
    gradient = by_rank[rank_of].T
    return gradient[:6], gradient[6:], None, None


def _remainders(terms: Array, behind: Array) -> tuple[Array, Array]:
    """`behind` less the running sum of terms (G, C, P), and what is left after the chunk (G, P)."""
    after = []
    for k in range(terms.shape[1]):
        behind = behind - terms[:, k]
        after.append(behind)
    return jnp.stack(after, axis=1), behind


def _feature_dot(features: Array, g: Array) -> Array:
    """g . f_i for every pixel: (G, C, F), (G, F, P) -> (G, C, P)."""
    return algebra.total(features[:, :, f, None] * g[:, None, f] for f in range(g.shape[1]))


def _monomials(grid: Grid, dtype) -> Array:
    """1, x, y, x^2, x y, y^2 of pixels relative to the middle of their tile, shape (P, 6)."""
    size = grid.tile_size
    local = jnp.arange(size * size)
    x = (local % size).astype(dtype) + 0.5 - 0.5 * size
    y = (local // size).astype(dtype) + 0.5 - 0.5 * size
    return jnp.stack([jnp.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


def _geometry_gradient(
    rows: Array, moments: Array, tiles: Array, first: Array, grid: Grid
) -> Array:
    """Gradient with respect to the six numbers of each splat from the moments of the slope.

    With s the gradient with respect to the exponent at a pixel, all six are sums of s times a
    polynomial of degree two in the pixel's position, hence of the six moments (G, C, 6).
    """
    half = 0.5 * grid.tile_size
    mx, my, a, b, c, opacity = (rows[..., k] for k in range(6))
    left, top = corners(tiles, first, grid)
    x = mx - (left + half)[:, None].astype(rows.dtype)
    y = my - (top + half)[:, None].astype(rows.dtype)
    m, m_x, m_y, m_xx, m_xy, m_yy = (moments[..., k] for k in range(6))
    # Moments of s about the centre of the splat: dx = x - pixel and so on.
    s_x, s_y = x * m - m_x, y * m - m_y
    s_xx = x * (x * m - 2 * m_x) + m_xx
    s_xy = x * (y * m - m_y) - y * m_x + m_xy
    s_yy = y * (y * m - 2 * m_y) + m_yy
    u_x, u_y = a * s_xx + b * s_xy, a * s_xy + b * s_yy
    u = a * s_x + b * s_y
    return jnp.stack(
        [
            -a * u,
            -b * u - c * c * s_y,
            -u_x,
            -u_y,
            -c * s_yy,
            m / jnp.where(opacity > 0, opacity, 1),
        ],
        axis=-1,
    )


def _emission_slots(boxes: Boxes, ranks: Array, group: Work, grid: Grid, capacity: int) -> Array:
    """Where the pair (tile, rank) was emitted; `capacity` and beyond for places without a splat."""
    column = (group.tiles % grid.columns)[:, None]
    row = (group.tiles // grid.columns)[:, None]
    box = jnp.stack([boxes.starts, boxes.left, boxes.top, boxes.columns], axis=-1)
    start, left, top, columns = jnp.moveaxis(box[jnp.maximum(ranks, 0)], -1, 0)
    slot = start + (row - top) * columns + column - left
    beyond = capacity + jnp.arange(ranks.size, dtype=jnp.int32).reshape(ranks.shape)
    return jnp.where(ranks >= 0, slot, beyond)


def _sum_runs(slots: Array, boxes: Boxes) -> Array:
    """Sums the contiguous slots of each splat: (capacity, K) -> (N, K).

    Eight neighbours of a run are added in turn, and their sums lie together again as a shorter run,
    until one is left of each: a tree of fixed shape, whatever the device.
    """
    capacity, count = slots.shape[0], boxes.counts.shape[0]
    counts = jnp.clip(capacity - boxes.starts, 0, boxes.counts)
    room = -(-capacity // FOLD) + count
    runs = _fold(slots, boxes.starts, counts, room)
    sums, starts, counts = lax.while_loop(
        lambda runs: jnp.max(runs[2]) > 1, lambda runs: _fold(*runs, room), runs
    )
    first = jnp.minimum(starts, room - 1)
    return jnp.where((counts > 0)[:, None], sums[first], 0)


def _fold(slots: Array, starts: Array, counts: Array, room: int) -> tuple[Array, Array, Array]:
    """Sums of up to eight neighbours of each run, (room, K), and where the shorter runs lie."""
    shorter = -(-counts // FOLD)
    ends = jnp.cumsum(shorter, dtype=jnp.int32)
    begins = ends - shorter
    owners = slot_owners(begins, shorter, room)
    done = FOLD * (jnp.arange(room, dtype=jnp.int32) - begins[owners])
    first, left = starts[owners] + done, counts[owners] - done
    rows = (slots.at[first + k].get(mode="clip") for k in range(FOLD))
    summed = algebra.total(jnp.where((k < left)[:, None], row, 0) for k, row in enumerate(rows))
    return summed, begins, shorter
