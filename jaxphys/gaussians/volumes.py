"""How much of a body each particle stands for.

Two kinds of particles, told apart by who calls: those on the skin of a body that is filled, half of
whose surroundings is outside (`body_volumes`), and those that are all there is, each in the middle
of its own piece (`cell_volumes`). Neither knows the solver's grid: the mass of a body is the same
at every place, turn and spacing.
"""

import math

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from jaxphys.gaussians.hull import surface_spacing

# Points of the skin closer together than this many pitches of the filling count as one place, and
# places within 1.5 pitches, or two spacings, share what is nearest to them evenly.
_MERGED = 0.25
_EVEN = 1.5
_EVEN_SPACINGS = 2.0
# Farther than this from the skin, in pitches, no cube of a particle is cut by it.
DEEP = 2.0
_MOST = 1.5
# Least volume of a particle, of the cube as wide as the distance to its neighbours: what a leaf or
# a thread outside the body has, a layer a tenth as thick as its splats are apart.
_LAYER = 0.1
# Radius in spacings that lets the outer layer of a lattice reach half a spacing out, on average
# over its dips: mean of sqrt(r^2 - x^2 - y^2) over |x|, |y| < 1/2 is 1/2.
_REACH = 0.65
# A gap within so many spacings of a particle counts if the middle of the eight particles around it
# is within the other: it lies among them, not beside them.
_GAP, _AMONG, _AROUND = 1.2, 0.6, 8
SAMPLES = 3  # a spacing and axis
_BLOCK = 2**15  # cells that are sampled at once


def thinned(points: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices of one point in every cell of side `pitch`, and for each point its cell's place."""
    cell = np.floor((points - points.min(axis=0)) / pitch).astype(np.int64)
    _, first, group = np.unique(cell, axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _evened(
    volume: np.ndarray, members: np.ndarray, points: np.ndarray, radius: float
) -> np.ndarray:
    """What each member of each place gets if the volumes (P,) are shared evenly within `radius`.

    The sum over `members` (P,), a count at each of `points` (P, 3), is that of the volumes.
    """
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    own = np.arange(len(points))
    start = np.concatenate([own, pairs[:, 0], pairs[:, 1]])
    end = np.concatenate([own, pairs[:, 1], pairs[:, 0]])
    size = len(points)
    near = csr_matrix((np.ones(len(start)), (start, end)), (size, size))
    return near @ (volume / (near @ members))


def body_volumes(
    skin: np.ndarray, inner: np.ndarray, pitch: float, volume: float, samples: np.ndarray
) -> np.ndarray:
    """Volume of each particle of a filled body [m^3], (S + I,); the sum is that of the body.

    Args:
        skin: particles on its surface (S, 3) [m].
        inner: particles inside (I, 3) [m], one to a cube of side `pitch`, none within half a pitch
            of the skin.
        pitch: [m].
        volume: of the body [m^3].
        samples: places in it, evenly spread (Q, 3) [m], 27 to a cube; those far from the skin are
            not needed.

    Deep inside each particle has its cube. Near the skin it has what is nearest to it, within a
    factor of 1.5 of its cube; the rest is the skin's, which shares it evenly over 1.5 pitches, so
    that a share does not depend on which splat happens to lie deepest.
    """
    near = cKDTree(skin).query(inner, workers=-1)[0] < DEEP * pitch
    inside = np.where(near, 0, pitch**3)
    first, group = thinned(skin, _MERGED * pitch)
    corners = skin[first]
    owner = cKDTree(np.concatenate([corners, inner[near]])).query(samples, workers=-1)[1]
    count = np.bincount(owner, minlength=len(corners) + near.sum()) * (pitch / SAMPLES) ** 3
    inside[near] = np.clip(count[len(corners) :], pitch**3 / _MOST, pitch**3 * _MOST)
    members = np.bincount(group).astype(float)
    width = surface_spacing(skin)
    radius = max(_EVEN * pitch, _EVEN_SPACINGS * float(np.median(width)))
    shares = _evened(count[: len(corners)], members, corners, radius)[group]
    rest = volume - inside.sum()
    if rest > 0 and shares.sum() > 0:
        shares *= rest / shares.sum()
    shares = np.concatenate([shares, inside])
    width = np.concatenate([width, np.full(len(inner), pitch)])
    return np.maximum(shares, _LAYER * np.minimum(width, pitch) ** 3)


def _cell_width(tree: cKDTree) -> np.ndarray:
    """Side of the cell of each particle [m], (N,): the distance to its fourth neighbour.

    That is the spacing in lattices and in sheets but at corners, which take the median of their
    neighbours', and for random particles the cube root of the volume that each has. Along a thread
    it is bounded by one and a half times the second's.
    """
    distance, around = tree.query(tree.data, k=5)
    width = np.minimum(distance[:, 4], 1.5 * distance[:, 2])
    return np.median(width[around], axis=1)


def _cells(points: np.ndarray, low: np.ndarray, width: float) -> np.ndarray:
    """All cells of that width with a particle in or beside them, (Q, 3), counted from `low`."""
    held = np.floor((points - low) / width).astype(np.int64)
    beside = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    shape = [int(count) + 3 for count in held.max(axis=0)]
    if math.prod(shape) >= 2**63:  # so wide that cells have no number
        held = np.unique(held, axis=0)
        return np.unique((held[:, None] + beside).reshape(-1, 3), axis=0)
    numbers = np.unique(np.ravel_multi_index(tuple(held.T + 1), shape))
    steps = beside @ np.array([shape[1] * shape[2], shape[2], 1])
    found = np.unique(numbers[:, None] + steps)
    return np.stack(np.unravel_index(found, shape), axis=-1) - 1


def _owned(tree: cKDTree, points: np.ndarray, width: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The particles, one for each of `places` (Q, 3) that some particle owns."""
    distance, owner = tree.query(places, workers=-1)
    distance = distance / width[owner]
    owned = distance < _REACH
    gaps = np.flatnonzero(~owned & (distance < _GAP))
    if len(gaps) and len(points) >= _AROUND:
        middle = points[tree.query(places[gaps], k=_AROUND, workers=-1)[1]].mean(axis=1)
        offset = np.linalg.norm(middle - places[gaps], axis=1) / width[owner[gaps]]
        owned[gaps] = offset < _AMONG
    return owner[owned]


def cell_volumes(points: np.ndarray, single: float) -> np.ndarray:
    """Volume of particles that are all there is of a thing [m^3], (N,), from (N, 3) [m].

    Each owns what is nearest to it within 0.65 of the distance to its neighbours, and the gaps
    among them: spacing^3 in a lattice, to its corners, and in a sheet one particle thick.

    Args:
        points: (N, 3) [m].
        single: width of a particle with fewer than four others [m].
    """
    points = np.asarray(points, np.float64)
    distinct, which, count = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    if len(distinct) < len(points):
        # Particles at one place share what one of them would have.
        which = which.reshape(-1)
        return cell_volumes(distinct, single)[which] / count[which]
    if len(points) < 5:
        return np.full(len(points), single**3)
    tree = cKDTree(points)
    width = _cell_width(tree)
    typical = float(np.median(width))
    low = points.min(axis=0) - typical / 2
    cells = _cells(points, low, typical)
    ticks = (np.arange(SAMPLES) + 0.5) / SAMPLES
    within = np.stack(np.meshgrid(*[ticks] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    samples = np.zeros(len(points), np.int64)
    for first in range(0, len(cells), _BLOCK):
        some = cells[first : first + _BLOCK, None]
        places = (low + typical * (some + within)).reshape(-1, 3)
        samples += np.bincount(_owned(tree, points, width, places), minlength=len(points))
    volume = samples * (typical / SAMPLES) ** 3
    # Particles closer together than the samples share what the nearest sample gave.
    return np.maximum(volume, (typical / SAMPLES) ** 3)
