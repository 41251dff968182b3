"""Of many points or Gaussians, so many: those that lie evenly spread, or some by chance."""

import math
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from jaxphys.gaussians.gaussians import Gaussians, select


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


def some_of(total: int, count: int) -> np.ndarray:
    """Indices, rising, of `count` of so many Gaussians; the same each time. By chance, since small
    and dense ones, which draw the details, would be the first to go where distances decide.
    """
    return np.sort(np.random.default_rng(0).permutation(total)[:count])


def enlarged_by(total: int, count: int) -> float:
    """By what standard deviations grow where `count` of `total` Gaussians stand for all: a surface
    stays closed.
    """
    return math.sqrt(total / count)


def fewer(gaussians: Gaussians, count: int) -> Gaussians:
    """At most `count` of some Gaussians, enlarged so that a surface stays closed."""
    if gaussians.count <= count:
        return gaussians
    chosen = select(gaussians, some_of(gaussians.count, count))
    larger = np.float32(math.log(enlarged_by(gaussians.count, count)))
    return replace(chosen, log_scales=chosen.log_scales + larger)
