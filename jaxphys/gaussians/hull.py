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
_GAP = 2.0


class Body(NamedTuple):
    """Tetrahedra of a body and of what is around it.

    Attributes:
        mesh: of all points.
        inside: (T,), whether each tetrahedron belongs to the body.
        volume: of each [m^3], (T,).
    """

    mesh: Delaunay
    inside: np.ndarray
    volume: np.ndarray

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether each of `points` (N, 3) [m] is in the body."""
        found = self.mesh.find_simplex(points)
        return (found >= 0) & self.inside[found]

    @property
    def total(self) -> float:
        """Volume of the body [m^3]."""
        return float(self.volume[self.inside].sum())


def surface_spacing(skin: np.ndarray) -> np.ndarray:
    """Distance of each point of a surface to its fourth neighbour [m], (N,): its square's side.

    On a square lattice that is the spacing, among random points on a surface 1.1 times the side of
    the square that each has to itself.
    """
    count = min(5, len(skin))
    return cKDTree(skin).query(skin, k=[count])[0][:, 0]


def _known(skin: np.ndarray, reach: float, points: np.ndarray) -> np.ndarray:
    """Those of `points` farther from the skin than its gaps, a quarter of them deep down."""
    distance = cKDTree(skin).query(points)[0]
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
    reach = _GAP * np.quantile(spacing, 0.9)
    within, without = (_known(skin, reach, places) for places in (within, without))
    points = np.concatenate([skin, within, without])
    noise = np.random.default_rng(0).uniform(-1, 1, points.shape)
    points = points + _JIGGLE * np.median(spacing) * noise
    mesh = Delaunay(points)
    corners, across = mesh.simplices, mesh.neighbors
    a, b, c, d = (points[corners[:, k]] for k in range(4))
    volume = np.abs(np.einsum("ti,ti->t", b - a, np.cross(c - a, d - a))) / 6
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
    return Body(mesh, ~(reached[part] | outside), volume)
