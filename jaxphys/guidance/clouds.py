"""From a cloud as the point prior draws it to points that Gaussians can start from.

The prior's points are independent draws from a surface: some stray from it, and the rest leave gaps
and heaps, which Gaussians of any one size would show as holes or as a blur.
"""

import numpy as np
from scipy.spatial import cKDTree

from jaxphys.core.parts import connected_parts
from jaxphys.gaussians.thinning import thin

# Isolation above which points go: one in ten does, of a clean surface too, where it costs little.
# 1.4 left visibly more noise, since thinning prefers what lies alone.
STRAY = 1.2
REACH = 8.0  # median distances to the nearest neighbour: what is no nearer is not connected
SPECK = 0.01  # share of the points: connected parts of fewer may go


def isolation(points: np.ndarray) -> np.ndarray:
    """How many times as far each of the points (N, 3) lies from its neighbours as they from theirs.

    A simple form of the local outlier factor (Breunig et al. 2000): about 1 on surfaces and along
    thin parts, 2 and more for points that float beside them.
    """
    near = min(9, len(points))
    distance, neighbours = cKDTree(points).query(points, k=near)
    mean = distance.reshape(len(points), near)[:, 1:].sum(1) + 1e-9
    return mean / mean[neighbours.reshape(len(points), near)].mean(1)


def large_parts(points: np.ndarray, share: float) -> np.ndarray:
    """Indices of the points of (N, 3) in connected parts of at least `share` N points, in order.

    Points are connected that lie within `REACH` times the median distance to the nearest
    neighbour. If no part is that large, all stay.
    """
    nearest = cKDTree(points).query(points, k=min(2, len(points)))[0].reshape(len(points), -1)
    part = connected_parts(points, REACH * float(np.median(nearest[:, -1])))
    large = np.bincount(part)[part] >= share * len(points)
    return np.flatnonzero(large) if large.any() else np.arange(len(points))


def even_subset(points: np.ndarray, count: int) -> np.ndarray:
    """Indices (count,) of the points of a cloud (N, 3), N >= count, to start from, in order: specks
    and strays go as long as enough is left, the rest is thinned until it is evenly spread.
    """
    large = large_parts(points, SPECK)
    kept = large if len(large) >= count else np.arange(len(points))
    factor = isolation(points[kept])
    enough = max(count, int(np.sum(factor <= STRAY)))
    kept = np.sort(kept[np.argsort(factor, kind="stable")[:enough]])
    return kept[thin(points[kept], count)]
