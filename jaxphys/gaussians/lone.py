"""Splats that hang beside an object: reconstructed and generated ones hold a few."""

import numpy as np

from jaxphys.core.parts import connected_parts

# Parts with less than this share of the points are not parts of the object, where those that are
# hold nearly all.
_SMALL = 0.01
_BODY = 0.95


def lone_points(points: np.ndarray, reach: float) -> np.ndarray:
    """Which of the points (N, 3) hang alone, a mask (N,).

    Points closer than `reach` belong together. A part with less than a hundredth of the points is
    lone if the larger parts hold 95 of a hundred; where nothing hangs together, as in a sparse
    cloud, nothing is lone. An object in a few large pieces keeps them all.

    Args:
        points: (N, 3) [m].
        reach: [m], above 0.
    """
    count = len(points)
    part = connected_parts(points, reach)
    small = (np.bincount(part) < _SMALL * count)[part]
    return small if small.mean() <= 1 - _BODY else np.zeros(count, bool)
