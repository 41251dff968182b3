"""The body that a skin of points encloses: the tetrahedra that a rolling ball cannot enter.

Points of the skin, with places known to be inside and outside, are joined to Delaunay tetrahedra.
From outside a ball of radius `reach` then goes wherever it fits through a face (the alpha shape of
Edelsbrunner and Muecke 1994, carved as in Portaneri et al. 2022); what it cannot reach is the body,
whose surface passes through the skin's points. Nothing depends on a grid, so that neither place
nor turn changes the volume.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay, cKDTree

_FACES = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])  # face k lies opposite corner k
# In spacings of the skin: moves points off common spheres and planes, which stall the search.
_JIGGLE = 1e-4
_REACH = 2.0  # of the ball, in spacings of the skin
# From a point of the skin to the middle of a triangle of its points, in spacings.
GAP = 0.6
_BOX = 4.0  # in sizes of the skin
_HAIR = np.array([1.7e-5, 2.9e-5, 0.0])


class Body(NamedTuple):
    """A body by its surface.

    Attributes:
        triangles: of the closed surface (B, 3, 3) [m].
        volume: within it [m^3].
    """

    triangles: np.ndarray
    volume: float

    def samples(self, origin: np.ndarray, pitch: float, shape: np.ndarray) -> np.ndarray:
        """Whether the middle of each cube of a lattice is inside, a mask in its `shape` (3,).

        By the parity of the triangles below it. The columns are moved by a hair, so that none
        meets an edge of a lattice's own.
        """
        nx, ny, nz = (int(n) for n in shape)
        a, b, c = np.moveaxis((self.triangles - origin) / pitch - 0.5 + _HAIR, 1, 0)
        flat = np.stack([a, b, c])[..., :2]
        low = np.maximum(np.ceil(flat.min(axis=0)), 0).astype(np.int64)
        high = np.minimum(np.floor(flat.max(axis=0)), [nx - 1, ny - 1]).astype(np.int64)
        wide, deep = np.maximum(high - low + 1, 0).T
        face = np.repeat(np.arange(len(a)), wide * deep)
        rank = np.arange(len(face)) - np.repeat(np.cumsum(wide * deep) - wide * deep, wide * deep)
        i, j = low[face, 0] + rank // deep[face], low[face, 1] + rank % deep[face]
        column = np.stack([i, j], axis=-1)

        def doubled(p: np.ndarray, q: np.ndarray) -> np.ndarray:
            """Twice the signed area of a column and an edge of its triangle, seen from above."""
            along, offset = (q - p)[face, :2], column - p[face, :2]
            return along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]

        weights = np.stack([doubled(b, c), doubled(c, a), doubled(a, b)])
        met = np.all(weights > 0, axis=0) | np.all(weights < 0, axis=0)
        heights = np.stack([a[face, 2], b[face, 2], c[face, 2]])[:, met]
        height = np.sum(weights[:, met] * heights, axis=0) / weights[:, met].sum(axis=0)
        above = np.clip(np.ceil(height), 0, nz).astype(np.int64)
        crossed = np.zeros((nx, ny, nz + 1), np.uint8)
        np.add.at(crossed, (i[met], j[met], above), 1)
        return np.bitwise_xor.accumulate(crossed % 2, axis=2)[:, :, :nz].astype(bool)


def surface_spacing(skin: np.ndarray) -> np.ndarray:
    """Distance of each point of a surface to its fourth neighbour [m], (N,): its square's side.

    On a square lattice that is the spacing, among random points on a surface 1.1 times the side of
    the square that each has to itself.
    """
    count = min(5, len(skin))
    return cKDTree(skin).query(skin, k=[count], workers=-1)[0][:, 0]


def _known(skin: np.ndarray, reach: float, points: np.ndarray) -> np.ndarray:
    """Those of `points` farther from the skin than its gaps, a quarter of them deep down."""
    distance = cKDTree(skin).query(points, workers=-1)[0]
    some = np.arange(len(points)) % 4 == 0
    return points[(distance > reach) & (some | (distance < 3 * reach))]


def _circumradius(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Of triangles with corners (T, 3) each."""
    sides = [np.linalg.norm(v, axis=1) for v in (b - a, c - b, a - c)]
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return sides[0] * sides[1] * sides[2] / np.maximum(2 * doubled, 1e-300)


def enclosed(skin: np.ndarray, within: np.ndarray, without: np.ndarray) -> Body:
    """The body inside a skin.

    Args:
        skin: points (S, 3) [m] of its surface, of which there may be more inside.
        within: points (I, 3) [m] known to be inside.
        without: points (O, 3) [m] known to be outside, at least all around.

    Places within `reach` of the skin are not taken as known, for they would come through its gaps.
    """
    spacing = surface_spacing(skin)
    reach = _REACH * np.quantile(spacing, 0.9)
    within, without = (_known(skin, reach, places) for places in (within, without))
    # Corners of a box around everything: whatever is asked for lies in some tetrahedron.
    middle, size = (skin.max(0) + skin.min(0)) / 2, np.ptp(skin, axis=0).max()
    box = middle + _BOX * size * np.array(list(np.ndindex(2, 2, 2))) - _BOX * size / 2
    without = np.concatenate([without, box])
    points = np.concatenate([skin, within, without])
    noise = np.random.default_rng(0).uniform(-1, 1, points.shape)
    points = points + _JIGGLE * np.median(spacing) * noise
    mesh = Delaunay(points)
    corners, across = mesh.simplices, mesh.neighbors
    kind = np.repeat([0, 1, 2], [len(skin), len(within), len(without)])[corners]
    outside = (kind == 2).any(axis=1)
    # A tetrahedron with points of both sides spans a gap of the skin: the inside closes it.
    sure = (kind == 1).any(axis=1)
    outside &= ~sure
    gates = []
    for k in range(4):
        i, j, m = (points[corners[:, n]] for n in _FACES[k])
        wide = (_circumradius(i, j, m) > reach) & (across[:, k] >= 0)
        wide &= ~sure & ~sure[across[:, k]]
        gates.append(np.stack([np.flatnonzero(wide), across[wide, k]]))
    start, end = np.concatenate(gates, axis=1)
    size = len(corners)
    _, part = connected_components(coo_matrix((np.ones(len(start)), (start, end)), (size, size)))
    reached = np.zeros(part.max() + 1, bool)
    reached[part[outside]] = True
    inside = ~(reached[part] | outside)
    a, b, c, d = (points[corners[inside, k]] for k in range(4))
    volume = np.abs(np.einsum("ti,ti->t", b - a, np.cross(c - a, d - a))).sum() / 6
    surface = []
    for k in range(4):
        # Every face of the hull belongs to a corner of the box: no neighbour, no body.
        skin_face = inside & ~inside[across[:, k]]
        surface.append(points[corners[skin_face][:, _FACES[k]]])
    return Body(np.concatenate(surface), float(volume))
