"""Free numbers: each transform there and back, its slope, its range, and fields between nodes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.fitting import Angle, Bounded, Field, Free, Log, Softplus

KINDS = [
    (Free(-2.0), -2.0, -2.0),
    (Log(2e4), 2e4, np.log(2e4)),
    (Bounded(0.3, 0.0, 0.49), 0.3, np.log(0.3 / 0.19)),
    (Softplus(0.5), 0.5, np.log(np.expm1(1.0))),
    (Angle(30.0), 30.0, np.pi / 6),
]


@pytest.mark.parametrize("kind, value, place", KINDS, ids=lambda x: getattr(x, "type", ""))
def test_the_line_is_where_the_formula_says_and_leads_back(kind, value, place):
    np.testing.assert_allclose(kind.to_line(value), place, rtol=1e-12)
    np.testing.assert_allclose(kind.from_line(jnp.float64(place)), value, rtol=1e-12)


@pytest.mark.parametrize("kind, value, place", KINDS, ids=lambda x: getattr(x, "type", ""))
def test_slopes_are_those_of_differences(kind, value, place):
    h = 1e-6
    slope = jax.grad(kind.from_line)(jnp.float64(place))
    difference = (kind.from_line(place + h) - kind.from_line(place - h)) / (2 * h)
    np.testing.assert_allclose(slope, difference, rtol=1e-8)


def test_a_bounded_number_never_leaves_its_bounds_and_a_log_stays_positive():
    far = jnp.array([-700.0, -40.0, 40.0, 700.0])
    bounded = Bounded(0.3, 0.0, 0.49).from_line(far)
    assert jnp.all((bounded >= 0) & (bounded <= 0.49))
    assert jnp.all(Log(1.0).from_line(far) > 0)
    assert jnp.all(Softplus(1.0).from_line(far) >= 0)


def test_a_step_that_is_much_is_a_decade_or_a_tenth_of_the_way():
    assert np.exp(Log(3.0).scale(3.0)) == pytest.approx(10)
    kind = Bounded(0.25, 0.0, 0.5)
    h = 1e-4 * kind.scale(0.25)
    moved = kind.from_line(kind.to_line(0.25) + h) - 0.25
    assert float(moved) == pytest.approx(1e-4 * 0.1 * 0.5, rel=1e-3)
    assert Free((0.0, -4.0, 0.0)).scale(np.zeros(3)).tolist() == [4, 4, 4]


@pytest.mark.parametrize(
    "make, told",
    [
        (lambda: Log(0.0), "above 0"),
        (lambda: Log(float("nan")), "finite"),
        (lambda: Bounded(0.5, 0.0, 0.5), "between 0.0 and 0.5"),
        (lambda: Bounded(0.5, 1.0, 0.0), "low < high"),
        (lambda: Free(1.0, per="partcle"), "particle"),
        (lambda: Free(1.0, groups=np.array([0.5])), "whole numbers"),
        (lambda: Field(Log(1.0), nodes=(1, 2, 2)), "at least 2"),
    ],
)
def test_what_cannot_be_is_refused(make, told):
    with pytest.raises(InputError, match=told):
        make()


def test_a_field_is_linear_between_its_nodes_and_exact_at_them():
    random = np.random.default_rng(0)
    rest = np.vstack([[0, 0, 0], [2, 1, 4], random.uniform(0, [2, 1, 4], (20, 3))])
    field = Field(Free(0.0), nodes=(3, 2, 5))
    which, much = field.weights(rest)
    np.testing.assert_allclose(much.sum(axis=0), 1)
    lines = (np.linspace(0, 2, 3), np.linspace(0, 1, 2), np.linspace(0, 4, 5))
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    values = nodes @ [1.0, -2.0, 0.5] + 3
    np.testing.assert_allclose((values[which] * much).sum(axis=0), rest @ [1.0, -2.0, 0.5] + 3)
    first, second = field.neighbours()
    apart = np.abs(nodes[first] - nodes[second])
    assert len(first) == 2 * 2 * 5 + 3 * 1 * 5 + 3 * 2 * 4
    assert np.all((apart > 0).sum(axis=1) == 1)
