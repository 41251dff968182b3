"""Steps within a radius, against the conditions that mark them."""

import numpy as np
import pytest

from jaxphys.fitting.fit import default_stages, frames_of
from jaxphys.fitting.free import Free
from jaxphys.fitting.layout import Entry, Layout
from jaxphys.fitting.search import Adam, GaussNewton, within


def test_a_step_within_the_radius_is_newtons():
    H, g = np.array([[4.0, 1.0], [1.0, 3.0]]), np.array([1.0, -2.0])
    step, held = within(H, g, 10.0)
    assert not held
    # What H does not know of is held to a hundred: 1e-4 on the diagonal.
    np.testing.assert_allclose(step, -np.linalg.solve(H, g), rtol=1e-3)


def test_a_step_that_is_held_back_ends_on_the_radius_where_the_slope_points_out():
    random = np.random.default_rng(0)
    A = random.normal(size=(7, 4)) * [1, 10, 100, 1000]
    H, g = A.T @ A, 1e3 * random.normal(size=4)
    step, held = within(H, g, 0.5)
    assert held and np.linalg.norm(step) == pytest.approx(0.5, rel=1e-6)
    # Moré and Sorensen: (H + d) step = -g with one d >= 0.
    left = -(g + H @ step)
    damping = left @ step / (step @ step)
    assert damping > 0
    np.testing.assert_allclose(left, damping * step, atol=1e-2 * np.abs(left).max())


def test_what_matters_little_hardly_moves_while_a_step_is_held_back():
    """A step that only shortens Newton's would go a hundred times further along y than along x."""
    H, g = np.diag([1e4, 1.0]), np.array([1e4, 100.0])
    step, held = within(H, g, 0.5)
    assert held and abs(step[1]) < 0.1 * abs(step[0])


def test_directions_that_nothing_tells_stay():
    step, held = within(np.zeros((2, 2)), np.zeros(2), 1.0)
    assert not held and np.all(step == 0)


def test_gauss_newton_sees_more_and_more_and_others_all_at_once():
    entries = (
        Entry("velocity", Free((0.0, 0.0, 0.0)), 0, 3, (3,), None, None),
        Entry("density", Free(1.0), 3, 4, (), None, None),
    )
    stages = default_stages(Layout(entries), GaussNewton(), 10)
    assert [(s.names, round(s.share, 3)) for s in stages] == [
        (("velocity",), 0.333), (None, 0.5), (None, 0.75), (None, 1.0)
    ]  # fmt: skip
    assert [s.share for s in default_stages(Layout(entries), Adam(), 10)] == [1 / 3, 1.0]
    assert [s.share for s in default_stages(Layout(entries[:1]), GaussNewton(), 3)] == [1.0]


def test_frames_of_a_share():
    class Asked:
        times = tuple(0.1 * k for k in range(10))

    assert [frames_of(Asked, share) for share in (1 / 3, 0.5, 0.75, 1.0)] == [3, 5, 8, 10]
    assert frames_of(Asked, 0.01) == 2  # the first of them is where nothing has moved
