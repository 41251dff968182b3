"""Order and error against motions whose error is known, and against motions without an order."""

import numpy as np
import pytest

from jaxphys.accuracy.choice import FINEST, SAFETY, choose
from jaxphys.accuracy.convergence import NoOrder, convergence, root_mean_square, scale_of
from jaxphys.core.errors import InputError

SPACINGS = (0.2, 0.2 / 2**0.5, 0.1)
RANDOM = np.random.default_rng(0)
TRUTH = np.cumsum(RANDOM.normal(size=(5, 40, 3)), axis=0)
SHAPE = RANDOM.normal(size=TRUTH.shape)


def motions(order, size=0.3, spacings=SPACINGS):
    """The truth with an error of one shape that falls with a power of the spacing."""
    return [TRUTH + size * spacing**order * SHAPE for spacing in spacings]


@pytest.mark.parametrize("order", [1.0, 1.5, 2.0])
def test_order_and_error_of_an_error_that_has_an_order(order):
    found = convergence(SPACINGS, motions(order))
    assert np.isclose(found.order, order, rtol=1e-6) and np.isclose(found.alignment, 1.0)
    finest = motions(order)[-1]
    exact = root_mean_square(finest - TRUTH) / scale_of(finest)
    assert np.isclose(found.error, exact, rtol=1e-6)
    assert np.isclose(found.error_at(0.05), exact / 2**order, rtol=1e-6)
    assert np.isclose(found.error_at(found.spacing_for(1e-3)), 1e-3)


def test_an_order_beyond_the_methods_is_seen_but_not_trusted():
    fast, slow = convergence(SPACINGS, motions(2.6)), convergence(SPACINGS, motions(0.7))
    assert np.isclose(fast.order, 2.6) and fast.trusted_order == 2.0
    assert np.isclose(slow.order, 0.7) and slow.trusted_order == 1.0
    # So that what falls faster than order 2 is told to be worse than it is, and not better.
    finest = motions(2.6)[-1]
    assert fast.error > root_mean_square(finest - TRUTH) / scale_of(finest)


def test_errors_are_relative_to_the_motion_and_not_to_where_it_is():
    moved = [motion + 100.0 for motion in motions(1.5)]
    assert np.isclose(convergence(SPACINGS, moved).error, convergence(SPACINGS, motions(1.5)).error)
    assert np.isclose(
        convergence(SPACINGS, [7 * motion for motion in motions(1.5)]).error,
        convergence(SPACINGS, motions(1.5)).error,
    )


@pytest.mark.parametrize("order", [0.2, -0.5, 3.4])
def test_an_order_out_of_range_is_refused_with_the_numbers(order):
    with pytest.raises(NoOrder, match=rf"an order of {order:.2f}"):
        convergence(SPACINGS, motions(order))


def test_differences_that_point_elsewhere_are_refused():
    first, second, third = motions(1.5)
    turned = second + (third - second)[..., [1, 2, 0]] * [1, -1, 1]
    with pytest.raises(NoOrder, match="different directions"):
        convergence(SPACINGS, [first, second, turned])


def test_noise_has_no_order():
    noise = [TRUTH + 0.05 * RANDOM.normal(size=TRUTH.shape) for _ in SPACINGS]
    with pytest.raises(NoOrder):
        convergence(SPACINGS, noise)


def test_equal_motions_are_right_to_rounding():
    found = convergence(SPACINGS, [TRUTH, TRUTH + 1e-9, TRUTH])
    assert found.error < 1e-4 and found.difference < 1e-8


def test_what_stands_still_has_no_error():
    still = np.broadcast_to(TRUTH[:1], TRUTH.shape)
    with pytest.raises(NoOrder, match="nothing moves"):
        convergence(SPACINGS, [still] * 3)


@pytest.mark.parametrize("spacings", [(0.1, 0.14, 0.2), (0.2, 0.15, 0.1), (0.1, 0.1, 0.1)])
def test_grids_must_become_finer_in_equal_ratios(spacings):
    with pytest.raises(InputError, match="equal ratios"):
        convergence(spacings, motions(1.0))


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_the_chosen_grid_is_the_coarsest_of_its_series_that_is_fine_enough(order):
    found = convergence(SPACINGS, motions(order, size=1.0))
    tolerance = SAFETY * found.error / 1.8
    chosen = choose(found, tolerance)
    assert chosen.error * SAFETY <= tolerance * (1 + 1e-9)
    assert found.error_at(chosen.spacing * 2**0.25) * SAFETY > tolerance
    assert np.isclose(chosen.cost, (SPACINGS[-1] / chosen.spacing) ** 4)


def test_a_loose_tolerance_is_met_on_a_pilots_grid_and_one_out_of_reach_is_refused():
    found = convergence(SPACINGS, motions(1.0, size=1.0))
    assert choose(found, 100 * found.error).spacing == SPACINGS[1]
    with pytest.raises(InputError, match="is in reach"):
        choose(found, found.error / (2 * FINEST))
