"""How sure a fit is, where the answer is known: straight lines through points with noise."""

import numpy as np
import pytest
from scipy import stats

from jaxphys.fitting.free import Free
from jaxphys.fitting.layout import Entry, Layout
from jaxphys.fitting.uncertainty import fading, independent_residuals, laplace


def lines(count: int) -> Layout:
    """A layout of `count` numbers of size 1."""
    entries = [Entry(f"x{i}", Free(1.0), i, i + 1, (), None, None) for i in range(count)]
    return Layout(tuple(entries))


def test_intervals_are_those_of_least_squares():
    """Against SciPy's linear regression, whose formulas are not ours."""
    random = np.random.default_rng(0)
    x = np.linspace(0, 1, 40)
    y = 2 + 3 * x + 0.1 * random.normal(size=40)
    J = np.stack([np.ones(40), x], axis=1)
    found, *_ = np.linalg.lstsq(J, y, rcond=None)
    residuals = J @ found - y
    sure = laplace(lines(2), found, J.T @ J, residuals @ residuals, 40, 40.0)
    known = stats.linregress(x, y)
    half = stats.t.ppf(0.95, 38) * np.array([known.intercept_stderr, known.stderr])
    np.testing.assert_allclose(sure.high - sure.value, half, rtol=1e-4)
    np.testing.assert_allclose(sure.value - sure.low, half, rtol=1e-4)
    assert sure.determined("x0") and not sure.undetermined


def test_residuals_that_repeat_count_once():
    """Every point four times tells no more than once."""
    random = np.random.default_rng(1)
    x = np.linspace(0, 1, 30)
    y = 1 + x + 0.1 * random.normal(size=30)
    J = np.stack([np.ones(30), x], axis=1)
    found, *_ = np.linalg.lstsq(J, y, rcond=None)
    once = J @ found - y
    whole = np.repeat(once, 4)
    independent = independent_residuals([whole], [(0,)])
    assert 20 < independent < 42
    plain = laplace(lines(2), found, J.T @ J, once @ once, 30, 30.0)
    fourfold = laplace(lines(2), found, 4 * J.T @ J, whole @ whole, 120, 30.0)
    np.testing.assert_allclose(fourfold.width, plain.width, rtol=1e-6)


def test_fading_of_noise_and_of_an_autoregressive_series():
    random = np.random.default_rng(2)
    noise = random.normal(size=(50, 400))
    assert fading(noise, 1) == pytest.approx(1, abs=0.05)
    series = np.zeros_like(noise)
    for k in range(1, 400):
        series[:, k] = 0.8 * series[:, k - 1] + noise[:, k]
    assert fading(series, 1) == pytest.approx((1 + 0.8) / (1 - 0.8), rel=0.15)
    assert fading(series.T, 0) == fading(series, 1)


def test_a_direction_that_nothing_tells_is_named():
    """Only the sum of two numbers is seen."""
    J = np.ones((50, 2)) / 2
    residuals = 1e-3 * np.random.default_rng(3).normal(size=50)
    sure = laplace(lines(2), np.array([1.0, 1.0]), J.T @ J, residuals @ residuals, 50, 50.0)
    assert not sure.determined("x0") and not sure.determined("x1")
    (direction,) = sure.undetermined
    shares = direction["direction"]
    assert shares["x0"] == pytest.approx(-shares["x1"], abs=1e-3)
    assert direction["width"] > 1


def test_the_intervals_cover_the_truth_as_often_as_they_say():
    """300 seeds of noise: 90% intervals cover 86 to 94%."""
    random = np.random.default_rng(4)
    x = np.linspace(-1, 1, 25)
    J = np.stack([np.ones(25), x, x**2], axis=1)
    truth, covered = np.array([0.5, -1.0, 2.0]), 0
    for _ in range(300):
        y = J @ truth + 0.2 * random.normal(size=25)
        found, *_ = np.linalg.lstsq(J, y, rcond=None)
        r = J @ found - y
        sure = laplace(lines(3), found, J.T @ J, r @ r, 25, 25.0)
        covered += np.mean((sure.low < truth) & (truth < sure.high))
    assert 0.86 < covered / 300 < 0.94
