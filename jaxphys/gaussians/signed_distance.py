"""The signed distance of a closed mesh, sampled on a grid. Runs once, in numpy.

Distances are those from the nearest of the triangles that a tree over the surface finds: exact near
the surface, and where many parts of it are about as near, far away or deep inside, too long by less
than a step of the grid. The sign is that of the winding number, counted along lines of nodes.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError

LOOKED_AT = (6, 24)  # nearest pieces, and then as many of those points that need more
MOST_PIECES = 20_000_000


class SignedDistance(NamedTuple):
    """Samples of a mesh whose bounding box has its centre at 0 and a longest side of 1.

    distance: (nx, ny, nz), negative inside; first: place of node (0, 0, 0), (3,); pitch: between
    nodes.
    """

    distance: np.ndarray
    first: np.ndarray
    pitch: float


def signed_distance(triangles: np.ndarray, resolution: int, margin: float) -> SignedDistance:
    """The signed distance of a mesh around its surface and in it.

    Args:
        triangles: of a closed mesh, turned one way, (F, 3, 3).
        resolution: samples along the longest side of its bounding box, at least 2.
        margin: how far the grid reaches beyond that box, in lengths of its longest side.

    Raises:
        InputError: the mesh is not closed.
    """
    require_closed(triangles)
    low, high = triangles.min((0, 1)), triangles.max((0, 1))
    triangles = (triangles - (low + high) / 2) / np.max(high - low)
    half = (high - low) / (2 * np.max(high - low))
    pitch = 1 / (resolution - 1)
    # Nodes lie about the centre, so that what is symmetric stays so.
    steps = np.ceil((half + margin) / pitch).astype(int)
    axes = [pitch * np.arange(-n, n + 1) for n in steps]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    distance = unsigned_distance(triangles, points.reshape(-1, 3), pitch).reshape(points.shape[:3])
    inside = winding_number(triangles, axes) != 0
    return SignedDistance(np.where(inside, -distance, distance), points[0, 0, 0], pitch)


def require_closed(triangles: np.ndarray) -> None:
    """Raises `InputError` unless each edge of triangles (F, 3, 3) is passed as often one way as the
    other. Corners at the same place are one, whatever else a file holds of them.
    """
    _, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = corners.reshape(-1, 3).astype(np.int64)
    edges = np.concatenate([faces, np.roll(faces, -1, axis=1)]).reshape(2, -1)
    low, high = edges.min(axis=0), edges.max(axis=0)
    forth = np.sign(edges[1] - edges[0])  # 0 where a triangle has a side of no length
    _, edge = np.unique(low * (faces.max() + 1) + high, return_inverse=True)
    open_edges = np.count_nonzero(np.bincount(edge, forth))
    if open_edges:
        raise InputError(
            f"the mesh is not closed: {open_edges} of its edges lack a second triangle that is "
            "turned the same way; fill its holes and unify its normals"
        )


def pieces(triangles: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Points (P, 3) spread over triangles (F, 3, 3), which of these each lies on (P,), and how far
    the surface is from them at most; edges longer than `longest` are divided.
    """
    sides = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(sides / longest), 1).astype(np.int64)
    if np.sum(parts**2) > MOST_PIECES:
        raise InputError(
            "the mesh has too many triangles to sample; simplify it or lower `resolution`"
        )
    points, owners = [], []
    for n in np.unique(parts):
        chosen = np.flatnonzero(parts == n)
        i, j = (x.ravel() for x in np.mgrid[:n, :n])
        up = i + j < n  # of n^2 equal triangles, those that point up and those that point down
        shares = np.where(up[:, None], np.stack([3 * i + 1, 3 * j + 1], 1) / (3 * n), 0.0)
        i, j = n - i, n - j
        shares[~up] = (np.stack([3 * i - 1, 3 * j - 1], 1) / (3 * n))[~up]
        a, b, c = np.moveaxis(triangles[chosen][:, None], 2, 0)
        points.append(a + shares[:, :1] * (b - a) + shares[:, 1:] * (c - a))
        owners.append(np.repeat(chosen, n * n))
    # A third of its longest side times two: from a triangle's middle to its farthest corner.
    farthest = np.max(sides / parts) * (2 / 3)
    return np.concatenate([p.reshape(-1, 3) for p in points]), np.concatenate(owners), farthest


def unsigned_distance(triangles: np.ndarray, points: np.ndarray, longest: float) -> np.ndarray:
    """Distance (P,) of points (P, 3) from the nearest of triangles (F, 3, 3).

    longest: length of edges to which the surface is divided in order to find the nearest triangle.
    """
    middles, owners, farthest = pieces(triangles, longest)
    tree = cKDTree(middles)
    found, left = np.full(len(points), np.inf), np.arange(len(points))
    for count in np.minimum(LOOKED_AT, len(middles)):
        reached, near = tree.query(points[left], count)
        reached, near = reached.reshape(len(left), -1), near.reshape(len(left), -1)
        for column in near.T:
            to = to_triangles(points[left], triangles[owners[column]])
            found[left] = np.minimum(found[left], to)
        # A piece that was not looked at may be nearer by what it extends from its middle.
        left = left[found[left] > reached[:, -1] - farthest]
    return found


def to_triangles(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distance (P,) of each of points (P, 3) from its own triangle (P, 3, 3)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    best = np.minimum(_to_side(points, a, b), _to_side(points, b, c))
    best = np.minimum(best, _to_side(points, c, a))
    normal = np.cross(b - a, c - a)
    squared = np.sum(normal**2, axis=1)
    flat = squared <= 1e-30 * np.sum((b - a) ** 2, axis=1) * np.sum((c - a) ** 2, axis=1)
    above = np.ones(len(points), bool)
    for start, end in ((a, b), (b, c), (c, a)):
        above &= np.sum(np.cross(normal, end - start) * (points - start), axis=1) >= 0
    along = np.sum(normal * (points - a), axis=1)
    height = np.abs(along) / np.sqrt(np.where(flat, 1, squared))
    return np.where(above & ~flat, height, np.sqrt(best))


def _to_side(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Squared distance (P,) of points from the line between two corners, (P, 3) each."""
    side, arm = end - start, points - start
    length = np.sum(side**2, axis=1)
    share = np.clip(np.sum(arm * side, axis=1) / np.where(length > 0, length, 1), 0, 1)
    return np.sum((arm - share[:, None] * side) ** 2, axis=1)


def winding_number(triangles: np.ndarray, axes: list[np.ndarray]) -> np.ndarray:
    """How often closed triangles (F, 3, 3) wind around each node of a grid, (nx, ny, nz) int.

    It is the sum of the signs with which a line from the node upwards passes through the surface
    (Jacobson, Kavan and Sorkine-Hornung 2013, section 2). Lines are shifted by a little, so that
    none passes through an edge.
    """
    x, y, z = axes
    tiny = 1e-9 * (z[-1] - z[0])
    x, y = x + np.sqrt(2) * tiny, y + np.sqrt(3) * tiny
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    first = [np.searchsorted(line, low[:, a]) for a, line in enumerate((x, y))]
    count = [np.searchsorted(line, high[:, a]) - first[a] for a, line in enumerate((x, y))]
    pairs = count[0] * count[1]
    owner = np.repeat(np.arange(len(triangles)), pairs)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    i, j = first[0][owner] + rank // count[1][owner], first[1][owner] + rank % count[1][owner]
    a, b, c = np.moveaxis(triangles[owner], 1, 0)
    line = np.stack([x[i], y[j]], 1)
    turns = np.stack([_turn(p, q, line) for p, q in ((b, c), (c, a), (a, b))])
    hit = np.all(turns > 0, axis=0) | np.all(turns < 0, axis=0)
    i, j, turns = i[hit], j[hit], turns[:, hit]
    shares = turns / turns.sum(axis=0)
    height = np.sum(shares * np.stack([p[hit, 2] for p in (a, b, c)]), axis=0)
    sign = np.where(turns[0] > 0, 1, -1)
    # Each crossing counts for all nodes below it.
    below = np.searchsorted(z, height)
    found = np.zeros((len(x), len(y), len(z) + 1), int)
    np.add.at(found, (i, j, below), sign)
    return np.cumsum(found[..., ::-1], axis=2)[..., ::-1][..., 1:]


def _turn(p: np.ndarray, q: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Twice the signed area of p, q and a line as seen from above, the same with the opposite sign
    to the last digit for q and p.
    """
    swap = (p[:, 0] > q[:, 0]) | ((p[:, 0] == q[:, 0]) & (p[:, 1] > q[:, 1]))
    p, q = np.where(swap[:, None], q, p), np.where(swap[:, None], p, q)
    area = (q[:, 0] - p[:, 0]) * (line[:, 1] - p[:, 1])
    area -= (q[:, 1] - p[:, 1]) * (line[:, 0] - p[:, 0])
    return np.where(swap, -area, area)
