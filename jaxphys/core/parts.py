"""Which points hang together."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

NEAR = 8  # neighbours of each point that are linked first
BLOCK = 1000  # points whose neighbours are all looked up at once


def connected_parts(points: np.ndarray, radius: float) -> np.ndarray:
    """The number (N,) from 0 up of each point's part; points (N, D) are connected that lie no
    farther apart than `radius`, directly or through others. Runs on the host.

    All pairs within the radius may be far more than there is memory for. So each point is linked
    to its nearest first; a link that still joins two parts has an end outside of the largest one,
    and all neighbours of these points are looked up, some at a time.
    """
    count = len(points)
    if count < 2:
        return np.zeros(count, np.int32)
    tree = cKDTree(points)
    distance, other = tree.query(points, k=min(NEAR + 1, count))
    start, rank = np.nonzero(distance <= radius)
    part = _joined(start, other[start, rank], count)
    outside = np.flatnonzero(part != np.bincount(part).argmax())
    links = [np.zeros((0, 2), part.dtype)]
    for first in range(0, len(outside), BLOCK):
        block = outside[first : first + BLOCK]
        found = tree.query_ball_point(points[block], radius)
        ends = np.concatenate([np.asarray(one, np.int64) for one in found])
        starts = np.repeat(block, [len(one) for one in found])
        links.append(np.unique(np.stack([part[starts], part[ends]], axis=1), axis=0))
    between = np.concatenate(links)
    return _joined(between[:, 0], between[:, 1], part.max() + 1)[part]


def _joined(start: np.ndarray, end: np.ndarray, count: int) -> np.ndarray:
    """The number (count,) of each node's component of a graph with these links."""
    links = coo_matrix((np.ones(len(start), bool), (start, end)), (count, count))
    return connected_components(links, directed=False)[1]
