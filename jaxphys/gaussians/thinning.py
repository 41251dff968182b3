"""Of many points, so many that lie evenly spread."""

import numpy as np
from scipy.spatial import cKDTree


def thin(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of `count` well spread rows: in rounds, of close pairs the tighter lose one each.

    A parallel form of sample elimination (Yuksel 2015). Each round drops at most a tenth of those
    left, so that the distances it goes by stay current.

    Args:
        points: (N, D), in any number of dimensions; those of a mesh carry normals too.
        count: of rows to keep, at least 1; all N stay where there are no more.

    Returns:
        (min(N, count),) indices, rising.
    """
    alive = np.arange(len(points))
    while len(alive) > count:
        distance, neighbour = cKDTree(points[alive]).query(points[alive], k=2)
        nearest, other = distance[:, 1], neighbour[:, 1]
        # One of a mutual pair is dropped, the other stays for this round.
        loses = ~((other[other] == np.arange(len(alive))) & (other > np.arange(len(alive))))
        order = np.argsort(np.where(loses, nearest, np.inf), kind="stable")
        number = min(len(alive) - count, max(len(alive) // 10, 1), int(loses.sum()))
        alive = np.delete(alive, order[:number])
    return alive
