"""A capture's object among background and floaters; bodies by themselves stay whole."""

import numpy as np
import pytest

from jaxphys.gaussians.cropping import object_of


def ball(count, radius, random, thickness=0.0):
    points = random.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points * radius * random.uniform(1 - thickness, 1, (count, 1))


@pytest.mark.parametrize("background", [0.3, 1.0])
def test_of_a_capture(background):
    """An object off centre on a table, a far background as large in number, and floaters."""
    random = np.random.default_rng(0)
    place = np.array([3.0, -2.0, 7.0])
    body = place + ball(2000, 0.5, random, 0.2)
    far = place + ball(int(2000 * background), 20.0, random, 0.5)
    floaters = place + ball(40, 3.0, random, 0.3)
    fog = place + 0.3 * random.normal(size=(10, 3))
    means = np.concatenate([body, far, floaters, fog])
    sizes = np.concatenate(
        [
            random.uniform(0.01, 0.03, len(body)),
            random.uniform(0.2, 1.0, len(far)),
            random.uniform(0.02, 0.1, len(floaters)),
            np.full(len(fog), 0.6),
        ]
    )
    order = random.permutation(len(means))
    kept = np.empty(len(means), bool)
    kept[order] = object_of(means[order], sizes[order])
    assert kept[:2000].all()
    assert not kept[2000:].any()


@pytest.mark.parametrize("shape", [(1, 1, 1), (8, 1, 1), (6, 6, 0.1), (1, 1, 0)])
def test_a_body_by_itself_stays_whole(shape):
    random = np.random.default_rng(1)
    means = 100 + np.asarray(shape) * random.uniform(-1, 1, (3000, 3))
    assert object_of(means, random.uniform(0.01, 0.03, 3000)).all()


def test_one_is_an_object():
    assert object_of(np.zeros((1, 3)), np.ones(1)).all()
