"""Clouds made fit to start Gaussians from."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from jaxphys.guidance.clouds import even_subset, isolation, large_parts


def ball(count: int, seed: int = 0) -> np.ndarray:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return 0.3 * points / np.linalg.norm(points, axis=1, keepdims=True)


def test_floating_points_go_and_thin_parts_stay():
    rod = np.stack([np.zeros(30), np.zeros(30), np.linspace(0.33, 1.2, 30)], 1)
    floating = np.array([[0.6, 0.0, 0.0], [0.0, -0.7, 0.1], [-0.5, 0.5, 0.0]])
    points = np.concatenate([ball(400), floating, rod])
    factor = isolation(points)
    assert set(np.argsort(factor)[-3:]) == {400, 401, 402} and factor[400:403].min() > 2
    assert (factor[:400] > 1.4).mean() < 0.02 and factor[403:-1].max() < 1.4  # all but its tip
    np.testing.assert_array_equal(isolation(np.zeros((1, 3))), [1])
    np.testing.assert_array_equal(isolation(np.zeros((20, 3))), np.ones(20))
    assert not np.isin([400, 401, 402], even_subset(points, 350)).any()


def test_specks_go_and_parts_stay():
    rng = np.random.default_rng(1)
    second = ball(300, 2) * 0.4 + [0.0, 0.0, 0.9]
    speck = rng.normal(size=(10, 3)) * 0.01 + [0.7, 0.0, 0.0]
    points = np.concatenate([ball(900), second, speck])
    np.testing.assert_array_equal(large_parts(points, 0.01), np.arange(1200))
    # Ten points close together are no strays to their neighbours: only their number tells.
    assert np.median(isolation(points)[1200:]) < 1.4
    assert even_subset(points, 1000).max() < 1200
    # Negative control: a share that every part has, and one that none has, leave all.
    assert len(large_parts(points, 0.001)) == len(large_parts(points, 0.9)) == 1210


def test_a_subset_is_more_even_than_the_cloud():
    points = ball(3000)
    kept = even_subset(points, 1000)
    assert len(np.unique(kept)) == 1000 and (np.diff(kept) > 0).all()

    def unevenness(points):
        nearest = cKDTree(points).query(points, k=2)[0][:, 1]
        return nearest.std() / nearest.mean()

    def largest_gap(points):
        return cKDTree(points).query(ball(20000, 5))[0].max()

    assert unevenness(points[kept]) < 0.3 < 0.45 < unevenness(points[:1000])
    assert largest_gap(points[kept]) < 0.9 * largest_gap(points[:1000])


@pytest.mark.parametrize("total", [1, 2, 7])
def test_small_and_coincident_clouds(total):
    for count in range(1, total + 1):
        assert len(even_subset(np.zeros((total, 3)), count)) == count
        assert len(even_subset(np.eye(7, 3)[:total], count)) == count
