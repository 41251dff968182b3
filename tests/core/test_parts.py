"""Parts of points that hang together, against all pairs."""

import tracemalloc

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from jaxphys.core.parts import connected_parts


def same_partition(a, b):
    pairs = np.unique(np.stack([a, b], axis=1), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


@pytest.mark.parametrize("radius", [0.02, 0.06, 0.09, 0.12, 0.3, 2.0])
def test_parts_are_those_of_all_pairs(radius):
    """A clump whose points have their nearest among themselves, a sparse cloud around it, a pair at
    the radius exactly, and points at one place.
    """
    random = np.random.default_rng(0)
    clump, cloud = 0.01 * random.normal(size=(60, 3)), random.uniform(-1, 1, (500, 3))
    pair = np.array([[5.0, 0.0, 0.0], [5.0 + radius, 0.0, 0.0]])
    points = np.concatenate([clump, cloud, clump + np.array([0.1, 0.0, 0.0]), pair, pair[:1]])
    _, expected = connected_components(coo_matrix(cdist(points, points) <= radius), directed=False)
    assert same_partition(connected_parts(points, radius), expected)


def test_few_points():
    assert connected_parts(np.zeros((0, 3)), 1.0).tolist() == []
    assert connected_parts(np.zeros((1, 3)), 1.0).tolist() == [0]
    assert len(set(connected_parts(np.array([[0.0, 0, 0], [3, 0, 0]]), 1.0).tolist())) == 2


def test_memory_grows_with_the_points_and_not_with_their_pairs():
    """20,000 points in a ball of the radius: 200 million pairs, of 16 bytes each."""
    points = 0.3 * np.random.default_rng(0).uniform(-1, 1, (20_000, 3))
    tracemalloc.start()
    assert set(connected_parts(points, 1.0)) == {0}
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6
