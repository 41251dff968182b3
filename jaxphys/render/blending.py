"""Front-to-back blending of tile lists, and its gradient.

A pixel sums w_i f_i over the splats of its tile in depth order, w_i = a_i prod_{j<i} (1 - a_j)
with a_i = min(alpha_max, o_i exp(-(u^2 + v^2) / 2)) (Kerbl et al. 2023, eq. 3); colour, depth and
opacity are all features f. Groups of tiles of about equal list length advance in lockstep, a chunk
of splats at a time, until every pixel of the group is finished.

The backward pass runs the same loop front to back. With S_i = g . (total - sum_{j<=i} w_j f_j),
what lies behind splat i as the pixel sees it,

    dL/da_i = T_i g . f_i - S_i / (1 - a_i),

which needs no division of the transmittance. Each (tile, splat) pair writes its gradient to its own
slot, in order of emission, where the slots of one splat are contiguous; a sum over these runs gives
the gradient of the splat. Nothing is added to in unknown order, so the bits are reproducible.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from .binning import Boxes, Grid, TileLists, slot_owners
from .settings import Settings

HIGHEST = lax.Precision.HIGHEST
# Elements of one chunk of a group, such that its few arrays stay in a core's cache.
GROUP_ELEMENTS = 2**16
# How many slots are added at once when the gradient of a splat is gathered.
FOLD = 8


class Work(NamedTuple):
    """Tiles in groups of equal size, longest lists first; the last group is filled with tile -1."""

    tiles: Array
    starts: Array
    lengths: Array


@partial(jax.custom_vjp, nondiff_argnums=(4, 5))
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
    table = jnp.concatenate([geometry, features]).T[boxes.order]
    work = _schedule(lists, grid, settings)
    pixels = grid.tile_size**2
    channels = features.shape[0]

    def finish_group(carry):
        index, blended = carry
        group = jax.tree.map(lambda leaf: leaf[index], work)
        size = group.tiles.shape[0]
        x, y = _pixels(group.tiles, grid, table.dtype)

        def advance(carry):
            done, light, total, _ = carry
            rows, _ = _chunk(table, lists, group, done, settings)
            alpha = lax.optimization_barrier(_alpha(rows, x, y, settings)[1])
            before, light = lax.optimization_barrier(_transmittances(alpha, light))
            weights = _weights(alpha, before, settings)
            total = total + _features_sum(weights, rows[..., 6:])
            return done + 1, light, total, _alive(light, group, done + 1, settings)

        light = jnp.ones((size, pixels), table.dtype)
        total = jnp.zeros((size, channels, pixels), table.dtype)
        start = (jnp.int32(0), light, total, jnp.any(group.lengths > 0))
        total = lax.while_loop(lambda carry: carry[3], advance, start)[2]
        where = jnp.where(group.tiles < 0, grid.tiles + jnp.arange(size), group.tiles)
        return index + 1, blended.at[where].set(total, mode="drop", unique_indices=True)

    blank = jnp.zeros((grid.tiles, channels, pixels), table.dtype)
    busy = _busy_groups(work)
    blended = lax.while_loop(lambda c: c[0] < busy, finish_group, (jnp.int32(0), blank))[1]
    return blended, (table, work)


def _busy_groups(work: Work) -> Array:
    """Groups that have anything to draw; by the order of tiles these come first."""
    return jnp.sum(jnp.any(work.lengths > 0, axis=1), dtype=jnp.int32)


def _blend_forward(geometry, features, boxes, lists, grid, settings):
    total, (table, work) = _forward(geometry, features, boxes, lists, grid, settings)
    return total, (table, work, boxes, lists, total)


def _blend_backward(grid, settings, residuals, cotangent):
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
        x, y = _pixels(group.tiles, grid, dtype)
        safe = jnp.maximum(group.tiles, 0)
        g = cotangent[safe]

        def advance(carry):
            done, light, behind, _, slots = carry
            rows, ranks = _chunk(table, lists, group, done, settings)
            raw, alpha = _alpha(rows, x, y, settings)
            raw, alpha = lax.optimization_barrier((raw, alpha))
            before, light = lax.optimization_barrier(_transmittances(alpha, light))
            weights = _weights(alpha, before, settings)
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
                [_geometry_gradient(rows, moments, group.tiles, grid), by_feature], axis=-1
            )
            where = _emission_slots(boxes, ranks, group, grid, capacity)
            slots = slots.at[where].set(gradient, mode="drop", unique_indices=True)
            alive = _alive(light, group, done + 1, settings)
            return done + 1, light, behind, alive, slots

        light = jnp.ones((size, pixels), dtype)
        start = (jnp.int32(0), light, behind_all[safe], jnp.any(group.lengths > 0), slots)
        return index + 1, lax.while_loop(lambda carry: carry[3], advance, start)[4]

    blank = jnp.zeros((capacity, width), dtype)
    busy = _busy_groups(work)
    slots = lax.while_loop(lambda c: c[0] < busy, finish_group, (jnp.int32(0), blank))[1]
    by_rank = _sum_runs(slots, boxes, grid)
    count = boxes.order.shape[0]
    rank_of = (
        jnp.zeros(count, jnp.int32)
        .at[boxes.order]
        .set(jnp.arange(count, dtype=jnp.int32), unique_indices=True)
    )
    gradient = by_rank[rank_of].T
    return gradient[:6], gradient[6:], None, None


blend.defvjp(_blend_forward, _blend_backward)


def _schedule(lists: TileLists, grid: Grid, settings: Settings) -> Work:
    """Sorts tiles by decreasing list length and cuts them into groups, shapes (groups, size)."""
    size = settings.group_size or max(
        1, GROUP_ELEMENTS // (settings.chunk_size * grid.tile_size**2)
    )
    size = min(size, grid.tiles)
    groups = -(-grid.tiles // size)
    lengths = lists.offsets[1:] - lists.offsets[:-1]
    # The length only steers the speed, so it may saturate in favour of one integer key.
    bits = grid.tiles.bit_length()
    most = 2 ** (31 - bits) - 1
    keys = ((most - jnp.minimum(lengths, most)) << bits) | jnp.arange(grid.tiles, dtype=jnp.int32)
    tiles = jnp.sort(keys) & (2**bits - 1)

    def grouped(values: Array, filler: int) -> Array:
        short = groups * size - grid.tiles
        return jnp.pad(values, (0, short), constant_values=filler).reshape(groups, size)

    return Work(
        grouped(tiles, -1), grouped(lists.offsets[:-1][tiles], 0), grouped(lengths[tiles], 0)
    )


def _pixels(tiles: Array, grid: Grid, dtype) -> tuple[Array, Array]:
    """Pixel centres of each tile, shapes (G, 1, P)."""
    size = grid.tile_size
    local = jnp.arange(size * size)
    x = (tiles % grid.columns * size)[:, None] + local % size
    y = (tiles // grid.columns * size)[:, None] + local // size
    return x[:, None, :].astype(dtype) + 0.5, y[:, None, :].astype(dtype) + 0.5


def _chunk(table, lists, group: Work, done, settings) -> tuple[Array, Array]:
    """The next splats of each tile: rows (G, C, 6 + F), opacity 0 past the end, and ranks (-1)."""
    chunk = settings.chunk_size
    position = done * chunk + jnp.arange(chunk, dtype=jnp.int32)
    inside = position < group.lengths[:, None]
    slots = jnp.where(inside, group.starts[:, None] + position, 0)
    ranks = lists.ranks[slots]
    rows = jnp.where(inside[..., None], table[ranks], 0)
    return rows, jnp.where(inside, ranks, -1)


def _alpha(rows: Array, x: Array, y: Array, settings: Settings) -> tuple[Array, Array]:
    """o exp(-(u^2 + v^2) / 2) and the alpha made of it, shapes (G, C, P)."""
    mx, my, a, b, c, opacity = (rows[..., k, None] for k in range(6))
    dy = my - y
    u = a * (mx - x) + b * dy
    v = c * dy
    raw = opacity * jnp.exp(-0.5 * (u * u + v * v))
    alpha = jnp.where(raw >= settings.alpha_min, jnp.minimum(raw, settings.alpha_max), 0)
    return raw, alpha


def _transmittances(alpha: Array, light: Array) -> tuple[Array, Array]:
    """Light that reaches each splat of the chunk (G, C, P), and what leaves the chunk (G, P)."""
    before = []
    for k in range(alpha.shape[1]):
        before.append(light)
        light = light * (1 - alpha[:, k])
    return jnp.stack(before, axis=1), light


def _weights(alpha: Array, before: Array, settings: Settings) -> Array:
    """w_i, shape (G, C, P); 0 from the splat on that would leave less than `transmittance_min`.

    The product runs on past that splat; as it never grows again, all later ones are refused too.
    """
    return jnp.where(before * (1 - alpha) >= settings.transmittance_min, before * alpha, 0)


def _remainders(terms: Array, behind: Array) -> tuple[Array, Array]:
    """`behind` less the running sum of terms (G, C, P), and what is left after the chunk (G, P)."""
    after = []
    for k in range(terms.shape[1]):
        behind = behind - terms[:, k]
        after.append(behind)
    return jnp.stack(after, axis=1), behind


def _features_sum(weights: Array, features: Array) -> Array:
    """Sum over the chunk of w_i f_i: (G, C, P), (G, C, F) -> (G, F, P)."""
    return sum(weights[:, k, None, :] * features[:, k, :, None] for k in range(weights.shape[1]))


def _feature_dot(features: Array, g: Array) -> Array:
    """g . f_i for every pixel: (G, C, F), (G, F, P) -> (G, C, P)."""
    return sum(features[:, :, f, None] * g[:, None, f] for f in range(g.shape[1]))


def _alive(light: Array, group: Work, done: Array, settings: Settings) -> Array:
    """Whether any tile has both splats left and a pixel that still takes some."""
    open_pixels = jnp.max(light, axis=-1) >= settings.transmittance_min
    return jnp.any(open_pixels & (done * settings.chunk_size < group.lengths))


def _monomials(grid: Grid, dtype) -> Array:
    """1, x, y, x^2, x y, y^2 of pixels relative to the middle of their tile, shape (P, 6)."""
    size = grid.tile_size
    local = jnp.arange(size * size)
    x = (local % size).astype(dtype) + 0.5 - 0.5 * size
    y = (local // size).astype(dtype) + 0.5 - 0.5 * size
    return jnp.stack([jnp.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


def _geometry_gradient(rows: Array, moments: Array, tiles: Array, grid: Grid) -> Array:
    """Gradient with respect to the six numbers of each splat from the moments of the slope.

    With s the gradient with respect to the exponent at a pixel, all six are sums of s times a
    polynomial of degree two in the pixel's position, hence of the six moments (G, C, 6).
    """
    size = grid.tile_size
    mx, my, a, b, c, opacity = (rows[..., k] for k in range(6))
    x = mx - (tiles % grid.columns * size + 0.5 * size)[:, None].astype(rows.dtype)
    y = my - (tiles // grid.columns * size + 0.5 * size)[:, None].astype(rows.dtype)
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


def _sum_runs(slots: Array, boxes: Boxes, grid: Grid) -> Array:
    """Sums the contiguous slots of each splat: (capacity, K) -> (N, K).

    Eight neighbours at distance 1, 8, 64, ... inside a run are added in turn, until the longest run
    has collapsed onto its first slot: a tree of fixed shape, whatever the device.
    """
    capacity = slots.shape[0]
    owners = slot_owners(boxes, capacity)
    local = jnp.arange(capacity, dtype=jnp.int32) - boxes.starts[owners]
    counts = boxes.counts[owners]

    def fold(carry):
        distance, slots = carry
        summed = slots[:capacity]
        for k in range(1, FOLD):
            shifted = lax.dynamic_slice_in_dim(slots, k * distance, capacity)
            takes = (local % (FOLD * distance) == 0) & (local + k * distance < counts)
            summed = summed + jnp.where(takes[:, None], shifted, 0)
        return FOLD * distance, lax.dynamic_update_slice_in_dim(slots, summed, 0, 0)

    longest = jnp.max(boxes.counts)
    # Room for the largest distance within a run; a slice that starts beyond takes part in nothing.
    slots = jnp.pad(slots, ((0, 1 << grid.tiles.bit_length()), (0, 0)))
    _, slots = lax.while_loop(lambda carry: carry[0] < longest, fold, (jnp.int32(1), slots))
    first = jnp.minimum(boxes.starts, capacity - 1)
    drawn = (boxes.counts > 0) & (boxes.starts < capacity)
    return jnp.where(drawn[:, None], slots[first], 0)
