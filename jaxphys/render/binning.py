"""Which splats each tile draws, nearest first, with static shapes.

Splats are sorted by depth once. Each then emits one pair (tile, depth rank) for every tile of its
box, so that pairs lie in depth order, into an array of `capacity` slots; sorting the single integer
`tile * N + rank`, in two halves that are then merged, gives every tile a contiguous run in depth
order. All of it is exact: depths are compared with all their bits and no list is cut short, unless
the capacity is too small, which is reported and leaves out the farthest pairs.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from jaxphys.render.projection import Projected
from jaxphys.render.settings import REFERENCE_TILE, Settings
from jaxphys.render.sorting import group_stably, stable_order

# Pairs are counted in int32; a picture that needs more than this is not drawn, and says so.
MOST_PAIRS = 2**30
UNCOUNTABLE = 2**31 - 1
# Pairs are emitted and sorted in so many parts, which XLA's CPU backend works on side by side.
PARTS = 2


class Grid(NamedTuple):
    """Tiles that cover a picture; the last column and row may reach beyond it. Static.

    Where several devices share a picture, each has every so-manieth row of tiles, from its `first`
    one on: rows beside each other hold about as much.

    Attributes:
        columns, rows: of the whole picture.
        tile_size: edge of a tile [pixels].
        share: how many share the rows.
    """

    columns: int
    rows: int
    tile_size: int
    share: int = 1

    @property
    def own_rows(self) -> int:
        """Rows of one of those who share them, the longest share."""
        return -(-self.rows // self.share)

    @property
    def tiles(self) -> int:
        """Tiles of one of those who share them."""
        return self.columns * self.own_rows

    def picture_row(self, row: Array, first: Array) -> Array:
        """Where the own row of tiles `row` is in the picture."""
        return row if self.share == 1 else row * self.share + first

    def own_row(self, row: Array, first: Array) -> Array:
        """How many of the own rows lie before row `row` of the picture."""
        return row if self.share == 1 else (row - first + self.share - 1) // self.share


class Boxes(NamedTuple):
    """Tiles touched by each splat, in order of depth; splats that touch none have count 0.

    Attributes:
        first: which row of tiles is the first own one, see `Grid`, shape ().
        order: which splat is at each depth rank, shape (N,).
        left, top, columns: the box of own tiles, shape (N,) each.
        counts: tiles in the box, shape (N,).
        starts: pairs emitted by nearer splats, shape (N,).
        required: pairs emitted by all splats, or 2^31 - 1 if they are more than 2^30.
    """

    first: Array
    order: Array
    left: Array
    top: Array
    columns: Array
    counts: Array
    starts: Array
    required: Array


class TileLists(NamedTuple):
    """The sorted pairs.

    Attributes:
        ranks: depth rank of the splat in each slot, a tile's slots contiguous, shape (capacity,).
        offsets: first slot of each tile, and the end of the last, shape (tiles + 1,).
    """

    ranks: Array
    offsets: Array


def make_grid(width: int, height: int, settings: Settings) -> Grid:
    """The tiles of a picture of `width` x `height` pixels."""
    size = settings.tile_size
    return Grid(-(-width // size), -(-height // size), size, settings.devices)


def depth_order(depths: Array, valid: Array) -> Array:
    """Indices of splats by increasing depth, equal depths by index, those not drawn last."""
    far = jnp.where(valid, depths, jnp.inf)
    if far.dtype == jnp.float32:
        # Positive floats are ordered as their bits are, of which the sign is zero.
        return stable_order(lax.bitcast_convert_type(far, jnp.uint32), bits=31)
    return jnp.argsort(far, stable=True).astype(jnp.int32)


def tile_boxes(
    projected: Projected, grid: Grid, settings: Settings, first: Array | int = 0
) -> Boxes:
    """The box of tiles of every splat, and how many pairs that makes, in the rows of tiles that are
    shared out to the one whose first row is `first`.
    """
    projected = Projected(*map(lax.stop_gradient, projected))
    order = depth_order(projected.depths, projected.valid)
    low, high = _pixel_box(projected, grid, settings)
    size = grid.tile_size
    limits = jnp.array([[grid.columns], [grid.rows]], jnp.int32)
    begin = jnp.clip(low // size, 0, limits)
    end = jnp.clip(-(-high // size), begin, limits)
    left, right = begin[0], end[0]
    first = jnp.asarray(first, jnp.int32)
    top, bottom = (grid.own_row(edge[1], first) for edge in (begin, end))
    columns, rows = right - left, bottom - top
    counts = jnp.where(projected.valid, columns * rows, 0)

    # A sum in floating point tells whether the sum in integers can be trusted.
    total = jnp.sum(counts.astype(jnp.float32))
    countable = total <= MOST_PAIRS
    counts = jnp.where(countable, counts, 0)[order]
    ends = jnp.cumsum(counts, dtype=jnp.int32)
    last_end = ends[-1] if counts.shape[0] else jnp.int32(0)
    return Boxes(
        first=first,
        order=order,
        left=left[order],
        top=top[order],
        columns=columns[order],
        counts=counts,
        starts=ends - counts,
        required=jnp.where(countable, last_end, UNCOUNTABLE),
    )


def _pixel_box(projected: Projected, grid: Grid, settings: Settings) -> tuple[Array, Array]:
    """First pixel and one past the last pixel that a splat may touch, int32 (2, N) each."""
    size = grid.tile_size
    limits = jnp.array([[grid.columns], [grid.rows]], projected.centres.dtype) * size
    if settings.extent == "three_sigma":
        # Kerbl et al. 2023 number pixel centres by integers and round to whole tiles of 16.
        base = projected.centres - 0.5
        coarse = REFERENCE_TILE
        low = jnp.trunc((base - projected.radii) / coarse) * coarse
        high = jnp.trunc((base + projected.radii + (coarse - 1)) / coarse) * coarse
    else:
        # A little slack: the test of each pixel decides, in whatever order it was rounded.
        reach = projected.half_sizes * (1 + 1e-4) + 1e-2
        low = jnp.ceil(projected.centres - reach - 0.5)
        high = jnp.floor(projected.centres + reach - 0.5) + 1
    low, high = jnp.clip(low, 0, limits), jnp.clip(high, 0, limits)
    empty = high <= low
    return low.astype(jnp.int32), jnp.where(empty, low, high).astype(jnp.int32)


def tile_lists(
    projected: Projected, boxes: Boxes, grid: Grid, settings: Settings, capacity: int
) -> TileLists:
    """Emits the pairs into `capacity` slots, drops those whose ellipse misses the tile, and sorts.

    One uint32 holds tile and rank where (tiles + 1) N <= 2^32; otherwise tiles are sorted stably
    with the rank as payload, which gives the same lists since pairs are emitted in depth order.
    """
    count = boxes.order.shape[0]
    owners = slot_owners(boxes.starts, boxes.counts, capacity)
    table = jnp.stack([boxes.starts, boxes.left, boxes.top, boxes.columns], axis=-1)

    def emit(slots: Array, owners: Array) -> tuple[Array, Array]:
        """Tile and owner of each slot, tile `grid.tiles` where there is none."""
        start, left, top, columns = table[owners].T
        local = slots - start
        down = local // jnp.maximum(columns, 1)
        column, row = left + local - down * columns, top + down
        meets = _meets(projected, boxes, owners, column, row, grid, settings)
        kept = (slots < boxes.required) & meets
        return jnp.where(kept, row * grid.columns + column, grid.tiles), owners

    slots = jnp.arange(capacity, dtype=jnp.int32)
    parts = [emit(*part) for part in zip(_split(slots), _split(owners), strict=True)]
    if (grid.tiles + 1) * count <= 2**32:
        return TileLists(*group_stably(parts, grid.tiles, count))
    tiles = jnp.concatenate([tiles for tiles, _ in parts])
    keys, ranks = lax.sort((tiles, owners), num_keys=1, is_stable=True)
    offsets = jnp.searchsorted(keys, jnp.arange(grid.tiles + 1, dtype=jnp.int32))
    return TileLists(ranks, offsets.astype(jnp.int32))


def _split(slots: Array) -> list[Array]:
    return jnp.array_split(slots, PARTS)


def slot_owners(starts: Array, counts: Array, capacity: int) -> Array:
    """Which of the contiguous runs, at `starts` (N,) and `counts` (N,) long, owns each slot,
    shape (capacity,); slots behind the last run count as its own.
    """
    # Runs that hold anything are written where they start and carried forward.
    where = jnp.where(counts > 0, starts, capacity)
    marks = (
        jnp.zeros(capacity, jnp.int32)
        .at[where]
        .set(jnp.arange(counts.shape[0], dtype=jnp.int32), mode="drop")
    )
    return lax.cummax(marks)


def _meets(projected, boxes, owners, column, row, grid, settings) -> Array:
    """Whether the ellipse alpha = alpha_min reaches the pixel centres of the tile, per slot.

    The smallest value of a convex quadratic over a rectangle that does not hold its centre lies on
    one of the two facing edges, where it is that of a parabola at its clamped vertex.
    """
    size = grid.tile_size
    opacities = jnp.where(projected.valid, projected.opacities, settings.alpha_min)
    level = 2 * jnp.log(opacities / settings.alpha_min)
    table = jnp.concatenate([projected.centres, projected.factors, level[None]])
    x, y, a, b, c, level = lax.stop_gradient(table).T[boxes.order][owners].T
    # Distances centre - pixel over the rectangle of the tile's pixel centres.
    x_high = x - (column * size + 0.5)
    x_low = x_high - (size - 1)
    y_high = y - (grid.picture_row(row, boxes.first) * size + 0.5)
    y_low = y_high - (size - 1)
    x_near, y_near = jnp.clip(0, x_low, x_high), jnp.clip(0, y_low, y_high)

    def doubled(dx: Array, dy: Array) -> Array:
        return (a * dx + b * dy) ** 2 + (c * dy) ** 2

    on_row = doubled(jnp.clip(-(b / a) * y_near, x_low, x_high), y_near)
    vertex = -(a / (b * b + c * c)) * b * x_near
    on_column = doubled(x_near, jnp.clip(vertex, y_low, y_high))
    return jnp.minimum(on_row, on_column) <= level * (1 + 1e-4) + 1e-3
