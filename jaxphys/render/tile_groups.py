"""Groups of tiles that blend in lockstep, a chunk of splats at a time, until each pixel is done.

The parts of that loop which blending (`blending.py`) and its gradient (`blending_gradient.py`)
share: a group holds tiles of about equal list length, G tiles with P pixels each, and a chunk the
next C splats of each tile's list.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from jaxphys.render.binning import Grid, TileLists
from jaxphys.render.settings import Settings

# Elements of one chunk of a group, such that its few arrays stay in a core's cache.
GROUP_ELEMENTS = 2**16


class Work(NamedTuple):
    """Tiles in groups of equal size, longest lists first; the last group is filled with tile -1."""

    tiles: Array
    starts: Array
    lengths: Array


def schedule(lists: TileLists, grid: Grid, settings: Settings) -> Work:
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


def busy_groups(work: Work) -> Array:
    """Groups that have anything to draw; by the order of tiles these come first."""
    return jnp.sum(jnp.any(work.lengths > 0, axis=1), dtype=jnp.int32)


def corners(tiles: Array, first: Array, grid: Grid) -> tuple[Array, Array]:
    """First pixel of each tile in the picture, shapes (G,); `first` as in `Boxes`."""
    row = grid.picture_row(tiles // grid.columns, first)
    return tiles % grid.columns * grid.tile_size, row * grid.tile_size


def pixel_centres(tiles: Array, first: Array, grid: Grid, dtype) -> tuple[Array, Array]:
    """Pixel centres of each tile, shapes (G, 1, P)."""
    size = grid.tile_size
    local = jnp.arange(size * size)
    left, top = corners(tiles, first, grid)
    x = left[:, None] + local % size
    y = top[:, None] + local // size
    return x[:, None, :].astype(dtype) + 0.5, y[:, None, :].astype(dtype) + 0.5


def next_chunk(table, lists, group: Work, done, settings) -> tuple[Array, Array]:
    """The next splats of each tile: rows (G, C, 6 + F), opacity 0 past the end, and ranks (-1)."""
    chunk = settings.chunk_size
    position = done * chunk + jnp.arange(chunk, dtype=jnp.int32)
    inside = position < group.lengths[:, None]
    slots = jnp.where(inside, group.starts[:, None] + position, 0)
    ranks = lists.ranks[slots]
    rows = jnp.where(inside[..., None], table[ranks], 0)
    return rows, jnp.where(inside, ranks, -1)


def splat_alpha(rows: Array, x: Array, y: Array, settings: Settings) -> tuple[Array, Array]:
    """o exp(-(u^2 + v^2) / 2) and the alpha made of it, shapes (G, C, P)."""
    mx, my, a, b, c, opacity = (rows[..., k, None] for k in range(6))
    dy = my - y
    u = a * (mx - x) + b * dy
    v = c * dy
    raw = opacity * jnp.exp(-0.5 * (u * u + v * v))
    clamped = jnp.minimum(raw, settings.alpha_max)
    if settings.gradient_through_clamp:
        # Tangents pass as if there were no clamp; the gradient's rule says so for itself.
        clamped = lax.stop_gradient(clamped) + (raw - lax.stop_gradient(raw))
    return raw, jnp.where(raw >= settings.alpha_min, clamped, 0)


def transmittances(alpha: Array, light: Array) -> tuple[Array, Array]:
    """Light that reaches each splat of the chunk (G, C, P), and what leaves the chunk (G, P)."""
    before = []
    for k in range(alpha.shape[1]):
        before.append(light)
        light = light * (1 - alpha[:, k])
    return jnp.stack(before, axis=1), light


def blending_weights(alpha: Array, before: Array, settings: Settings) -> Array:
    """w_i, shape (G, C, P); 0 from the splat on that would leave less than `transmittance_min`.

    The product runs on past that splat; as it never grows again, all later ones are refused too.
    """
    return jnp.where(before * (1 - alpha) >= settings.transmittance_min, before * alpha, 0)


def any_alive(light: Array, group: Work, done: Array, settings: Settings) -> Array:
    """Whether any tile has both splats left and a pixel that still takes some."""
    open_pixels = jnp.max(light, axis=-1) >= settings.transmittance_min
    return jnp.any(open_pixels & (done * settings.chunk_size < group.lengths))
