"""Which matter a ray meets."""

import numpy as np


def met(points: np.ndarray, origin: np.ndarray, direction: np.ndarray, radius: float) -> int | None:
    """The first of some points along a ray, or None where it passes all of them.

    Args:
        points: (N, 3) [m].
        origin, direction: of the ray, (3,); the direction of any length but zero.
        radius: how far from a point the ray may pass it and still meet it [m].
    """
    along = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    arms = np.asarray(points, np.float64) - np.asarray(origin, np.float64)
    depth = arms @ along
    beside = np.sum(arms**2, axis=1) - depth**2
    hit = np.flatnonzero((beside <= radius**2) & (depth > 0))
    return int(hit[np.argmin(depth[hit])]) if hit.size else None
