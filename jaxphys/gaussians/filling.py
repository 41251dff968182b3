"""Particles for the inside of a hollow object, by the rules of PhysGaussian (Xie et al. 2024).

Reconstructed and meshed objects are shells of Gaussians. The opacity field on a grid tells the
shell from the rest: cells that are dense enough are solid, and empty cells that see solid ones all
around are inside. In solid cells the body ends at the surface through the Gaussians' centres.

What differs from PhysGaussian's code: a Gaussian's reach is bounded, so that an enormous one
cannot stall the search; a Gaussian flatter than a cell counts with half a cell of thickness, so
that thin shells do not slip between grid nodes; both searches run over the whole grid at once; no
particle is put outside the skin (theirs fill solid cells whole); and the particles are a jittered
lattice instead of random.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import numpy as np
from jax import Array
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.gaussians.gaussians import Gaussians, opacities, require_finite, scales
from jaxphys.gaussians.hull import GAP, enclosed, surface_spacing
from jaxphys.gaussians.volumes import DEEP, SAMPLES, body_volumes, cell_volumes, thinned

_MARGIN = 2
_JITTER = 0.25
_CHUNK = 1 << 21


@dataclass(frozen=True)
class FillingConfig:
    """How the inside is found. Directions count 0 to 5 for +x, -x, +y, -y, +z, -z; -1 is none.

    Attributes:
        spacing: side of a cell [m].
        density_threshold: summed opacity above which a cell is solid, so that the skin is in or
            beside it; None: a quarter of the median over the cells that hold Gaussians, which suits
            sparse and dense shells.
        search_threshold: density that a ray must meet to have hit something; None: as above.
        search_count: how many of the directions searched must hit; at most all of them.
        exclude_direction: the one that is not searched, for objects open on that side.
        ray_direction: along it the number of solid runs crossed must be odd as well.
        per_cell: particles for every cell's volume inside.
        maximum: most particles to add.
        area: (x0, x1, y0, y1, z0, z1) [m], the part to fill; None: all.
        smooth: blur the density by one cell first, which closes small holes.
        reach: bound on a Gaussian's radius [cells].
        maximum_cells: bound on the grid's size.
    """

    spacing: float
    density_threshold: float | None = None
    search_threshold: float | None = None
    search_count: int = 6
    exclude_direction: int = -1
    ray_direction: int = -1
    per_cell: int = 1
    maximum: int = 2_000_000
    area: tuple[float, float, float, float, float, float] | None = None
    smooth: bool = False
    reach: int = 6
    maximum_cells: int = 1 << 26

    @property
    def pitch(self) -> float:
        """Distance between the particles that are added [m]."""
        return self.spacing / self.per_cell ** (1 / 3)


def _grid(points: np.ndarray, config: FillingConfig) -> tuple[np.ndarray, tuple[int, int, int]]:
    """Origin and shape of the grid that holds the points and a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    if config.area is not None:
        area = np.asarray(config.area, np.float64)
        low, high = np.maximum(low, area[0::2]), np.minimum(high, area[1::2])
        if np.any(low > high):
            raise InputError("filling: the area holds no Gaussians; widen it")
    cells = np.ceil((high - low) / config.spacing - 1e-4) + 2 * _MARGIN
    if np.prod(cells) > config.maximum_cells:
        longest = (high - low).max()
        raise InputError(
            f"filling: spacing {config.spacing:g} makes {np.prod(cells):.2g} cells over "
            f"{longest:.3g} m, more than {config.maximum_cells:.2g}; make it coarser, or leave "
            f"out Gaussians far away"
        )
    # About the middle: a symmetric object gets a symmetric grid.
    nx, ny, nz = (int(n) for n in cells)
    return (low + high - cells * config.spacing) / 2, (nx, ny, nz)


def _cells(points: np.ndarray, origin: np.ndarray, spacing: float) -> np.ndarray:
    return np.floor((points - origin) / spacing).astype(np.int64)


@jax.jit
def _shapes(gaussians: Gaussians) -> tuple[Array, Array, Array]:
    """Opacities (N,), own axes (N, 3, 3) and standard deviations along them (N, 3)."""
    return opacities(gaussians), quaternion_to_matrix(gaussians.quaternions), scales(gaussians)


def density_field(
    gaussians: Gaussians, origin: np.ndarray, shape: tuple[int, int, int], config: FillingConfig
) -> np.ndarray:
    """Opacity summed over Gaussians in each cell, shape (nx, ny, nz).

    A Gaussian adds its opacity times exp(-d^T S^-1 d / 2), averaged over the cell's corners, to the
    cells within one standard deviation of it, rounded up.
    """
    spacing = config.spacing
    mean = np.asarray(gaussians.means, np.float64)
    opacity, axes, deviation = (np.asarray(x, np.float64) for x in _shapes(gaussians))
    radius = np.clip(np.ceil(deviation.max(axis=1) / spacing), 1, config.reach).astype(int)
    deviation = np.maximum(deviation, spacing / 2)
    cell = _cells(mean, origin, spacing)
    field = np.zeros(int(np.prod(shape)))
    for r in np.unique(radius):
        members = np.flatnonzero(radius == r)
        nodes = np.stack(np.meshgrid(*[np.arange(-r, r + 2)] * 3, indexing="ij"), axis=-1)
        offsets = nodes[:-1, :-1, :-1].reshape(-1, 3)
        for start in range(0, len(members), max(1, _CHUNK // len(offsets))):
            part = members[start : start + max(1, _CHUNK // len(offsets))]
            corner = origin + spacing * cell[part] - mean[part]
            # In the Gaussian's own axes, in standard deviations.
            turn = axes[part] / deviation[part][:, None, :]
            step = np.einsum("xyzi,nij->nxyzj", spacing * nodes, turn)
            away = step + np.einsum("ni,nij->nj", corner, turn)[:, None, None, None]
            value = opacity[part][:, None, None, None] * np.exp(-0.5 * np.sum(away**2, axis=-1))
            for axis in (1, 2, 3):
                value = 0.5 * (
                    np.take(value, range(2 * r + 1), axis)
                    + np.take(value, range(1, 2 * r + 2), axis)
                )
            index = cell[part][:, None] + offsets
            inside = np.all((index >= 0) & (index < shape), axis=-1)
            flat = np.ravel_multi_index(tuple(index[inside].T), shape)
            field += np.bincount(flat, value.reshape(len(part), -1)[inside], field.size)
    return field.reshape(shape)


def _ahead(solid: np.ndarray, direction: int) -> np.ndarray:
    """A view of `solid` in which the ray of each cell runs towards index 0 of axis 0."""
    view = np.moveaxis(solid, direction // 2, 0)
    return view if direction % 2 else view[::-1]


def _back(values: np.ndarray, direction: int) -> np.ndarray:
    return np.moveaxis(values if direction % 2 else values[::-1], 0, direction // 2)


def _hits(solid: np.ndarray, direction: int) -> np.ndarray:
    """Whether a ray from each cell meets a solid one."""
    seen = np.logical_or.accumulate(_ahead(solid, direction), axis=0)
    before = np.concatenate([np.zeros_like(seen[:1]), seen[:-1]])
    return _back(before, direction)


def _odd_crossings(solid: np.ndarray, direction: int) -> np.ndarray:
    """Whether a ray from each empty cell crosses an odd number of solid runs."""
    view = _ahead(solid, direction)
    before = np.concatenate([np.zeros_like(view[:1]), view[:-1]])
    runs = np.cumsum(view & ~before, axis=0)
    return _back(runs % 2 == 1, direction)


def inner_cells(density: np.ndarray, config: FillingConfig) -> np.ndarray:
    """The empty cells that are inside, a mask in the shape of `density`."""
    threshold = config.search_threshold
    solid = density > (config.density_threshold if threshold is None else threshold)
    searched = [d for d in range(6) if d != config.exclude_direction]
    hits = sum(_hits(solid, direction).astype(np.int8) for direction in searched)
    inside = ~solid & (hits >= min(config.search_count, len(searched)))
    if config.ray_direction >= 0:
        inside &= _odd_crossings(solid, config.ray_direction)
    return inside


def _lattice(
    origin: np.ndarray, shape: tuple[int, int, int], config: FillingConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Corner (3,) [m] and shape (3,) of a lattice of the filling's pitch all over the grid."""
    extent = np.array(shape) * config.spacing
    count = np.floor(extent / config.pitch + 1e-6).astype(int)
    return origin + 0.5 * (extent - count * config.pitch), count


def _middles(corner: np.ndarray, pitch: float, index: np.ndarray) -> np.ndarray:
    return corner + pitch * (index + 0.5)


class Filled(NamedTuple):
    """What fills a body, and how much of it each particle stands for.

    Attributes:
        points: added (M, 3) [m].
        volumes: of the Gaussians and of the points [m^3], (N + M,).
    """

    points: np.ndarray
    volumes: np.ndarray


def fill(
    gaussians: Gaussians,
    config: FillingConfig,
    seed: int = 0,
    *,
    spread: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Filled:
    """Fills the body whose skin the Gaussians' centres are.

    Inside are the empty cells that see solid ones all around, by `config`, and what lies between
    them and the skin (`hull.enclosed`). It is filled by a jittered lattice, which keeps half a
    pitch away from the Gaussians. Particles, volumes and their sum move with the object.

    Args:
        gaussians: the skin; there may be more inside.
        config: what is inside.
        seed: the same gives the same points.
        spread: moves the points (M, 3), for instance apart, before their volumes are measured.

    Raises:
        InputError: a Gaussian is not finite, the grid is too large, there would be more than
            `maximum` points, or a number of `config` is out of range.
    """
    if not config.spacing > 0 or config.per_cell < 1 or config.reach < 1:
        raise InputError("filling: spacing, per_cell and reach must be positive")
    require_finite(gaussians, "filling")
    means = np.asarray(gaussians.means, np.float64)
    none = np.zeros((0, 3))
    first = thinned(means, config.pitch / 4)[0] if len(means) else means
    if len(first) < 5:  # places: no skin, and nothing that it could enclose
        return Filled(none, cell_volumes(means, config.spacing))
    origin, shape = _grid(means, config)
    density = density_field(gaussians, origin, shape, config)
    if config.smooth:
        density = gaussian_filter(density, 1.0)
    if config.density_threshold is None:
        present = _cells(means, origin, config.spacing)
        present = present[np.all((present >= 0) & (present < shape), axis=1)]
        own = density[tuple(present.T)]
        config = replace(config, density_threshold=0.25 * float(np.median(own)))
    inner = inner_cells(density, config)
    corner, count = _lattice(origin, shape, config)
    index = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 3)
    middles = _middles(corner, config.pitch, index)
    # Moved by up to a quarter of a pitch along each axis: at least half a pitch apart, which places
    # drawn at random are not, and in no rows.
    jitter = np.random.default_rng(seed).uniform(-_JITTER, _JITTER, middles.shape)
    places = middles + config.pitch * jitter
    cell = tuple(np.minimum(_cells(places, origin, config.spacing), np.array(shape) - 1).T)
    within = inner[cell]
    if within.sum() > config.maximum:
        raise _too_many(int(within.sum()), config)
    # Between the two lies the skin; what is far from it on either side is known.
    solid = density > config.density_threshold
    without = places[~solid[cell] & ~within]
    body = enclosed(means[first], places[within], without)
    fine = config.pitch / SAMPLES
    samples = body.samples(corner, fine, SAMPLES * count)
    unsure = np.flatnonzero(solid[cell] & ~within)
    within[unsure] = samples[tuple(_cells(places[unsure], corner, fine).T)]
    points = places[within]
    # Half a pitch from the skin, which is nearer than its points where it is sparse.
    distance, nearest = cKDTree(means).query(points, workers=-1)
    gap = np.minimum(GAP * surface_spacing(means)[nearest], config.pitch / 2)
    points = points[np.hypot(gap, config.pitch / 2) < distance]
    if config.area is not None:
        area = np.asarray(config.area)
        points = points[np.all((points > area[0::2]) & (points < area[1::2]), axis=1)]
    if len(points) > config.maximum:
        raise _too_many(len(points), config)
    if spread is not None and len(points):
        points = spread(points)
    cut = cKDTree(means).query(middles, workers=-1)[0] < DEEP * config.pitch
    fine_cells = np.stack(np.meshgrid(*[np.arange(SAMPLES)] * 3, indexing="ij"), axis=-1)
    fine_index = (SAMPLES * index[cut][:, None] + fine_cells.reshape(-1, 3)).reshape(-1, 3)
    fine_index = fine_index[samples[tuple(fine_index.T)]]
    near = _middles(corner, fine, fine_index)
    return Filled(points, body_volumes(means, points, config.pitch, body.volume, near))


def _too_many(count: int, config: FillingConfig) -> InputError:
    return InputError(
        f"filling: {count} particles, more than the maximum of {config.maximum}; make the "
        f"spacing coarser, lower per_cell, or raise the maximum"
    )


def fill_interior(gaussians: Gaussians, config: FillingConfig, seed: int = 0) -> np.ndarray:
    """Points (M, 3) [m] to add to the Gaussians' centres, in the dtype of the means; see `fill`."""
    return fill(gaussians, config, seed).points.astype(gaussians.means.dtype)
