"""What of a capture is its object: without background, and without splats that float about."""

import numpy as np

REACH = 2.5  # median distances from the middle that belong to an object
ROUNDS = 30
WIDEST = 6.0  # a splat so many times as large as the object's usual ones is no part of its skin


def object_of(means: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Which splats of a capture are its object, a mask (N,).

    A capture shows its object close by and all around, so that its splats are small and many, and
    those of what is behind large: the object is what lies within 2.5 median distances of the
    median, both weighted by one over a splat's size, taken again among what is kept until nothing
    changes. A body by itself stays whole whatever its shape: from a ball of uniform density that
    is twice its radius, from a rod more than its ends. Of what is kept, splats six times as large
    as the median are left out as well.

    Args:
        means: (N, 3), in any unit.
        sizes: largest standard deviation of each, above 0, (N,).
    """
    kept = np.ones(len(means), bool)
    for _ in range(ROUNDS):
        weights = 1 / np.maximum(sizes[kept], 1e-12)
        middle = np.array([_median(means[kept, axis], weights) for axis in range(3)])
        distance = np.linalg.norm(means - middle, axis=1)
        within = kept & (distance <= REACH * _median(distance[kept], weights))
        if within.sum() == kept.sum() or not within.any():
            break
        kept = within
    usual = _median(sizes[kept], 1 / np.maximum(sizes[kept], 1e-12))
    slim = kept & (sizes <= WIDEST * usual)
    return slim if slim.any() else kept


def _median(values: np.ndarray, weights: np.ndarray) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, 0.5 * total[-1])]])
