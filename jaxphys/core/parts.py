"""Which points hang together."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree


def connected_parts(points: np.ndarray, radius: float) -> np.ndarray:
    """The number (N,) from 0 up of each point's part; points (N, D) are connected that lie no
    farther apart than `radius`, directly or through others. Runs on the host."""
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(points),) * 2)
    return connected_components(links, directed=False)[1]
