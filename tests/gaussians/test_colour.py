import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.gaussians import (
    ColourRange,
    Gaussians,
    colour_range,
    from_points,
    regularise,
    to_splats,
    to_unit_interval,
)


def test_the_formula():
    colours = jnp.array([[-0.5, 0.0, 0.5], [1.0, 1.5, 0.25]])
    bounds = ColourRange(jnp.asarray(-0.5), jnp.asarray(1.5))
    np.testing.assert_allclose(regularise(colours, bounds), [[0, 0.25, 0.5], [0.75, 1, 0.375]])
    tight = ColourRange(jnp.asarray(0.0), jnp.asarray(0.5))  # a range that does not hold them all
    np.testing.assert_allclose(regularise(colours, tight), [[0, 0, 1], [1, 1, 0.5]])


def test_range_of_constant_colours():
    points = jnp.zeros((3, 3))
    colours = jnp.array([[0.2, 0.9, 0.4], [1.7, 0.5, 0.3], [-0.4, 0.3, 0.3]])
    bounds = colour_range(from_points(points, colours, 0.1))
    np.testing.assert_allclose(bounds, [0, 1.7], atol=1e-6)  # a renderer draws -0.4 as 0
    unit = regularise(jnp.maximum(colours, 0), bounds)
    np.testing.assert_allclose([unit.min(), unit.max()], [0, 1], atol=1e-6)


def test_range_looks_from_all_sides():
    harmonics = jnp.zeros((2, 4, 3)).at[0, 2, 1].set(0.6)  # green grows with z
    g = Gaussians(jnp.zeros((2, 3)), jnp.zeros((2, 3)), jnp.ones((2, 4)), jnp.zeros(2), harmonics)
    amplitude = 0.6 * np.sqrt(3 / (4 * np.pi))
    bounds = colour_range(g)
    np.testing.assert_allclose(bounds, [0.5 - amplitude, 0.5 + amplitude], atol=0.05 * amplitude)
    seen = [regularise(to_splats(g, jnp.array([0, 0, z])).colours, bounds) for z in (-1.0, 1.0)]
    assert jnp.abs(seen[0] - seen[1]).max() > 0.9  # one range: the views stay apart


def test_one_colour_and_none():
    one = from_points(jnp.zeros((2, 3)), jnp.full((2, 3), 0.3), 0.1)
    bounds = colour_range(one)
    np.testing.assert_allclose(regularise(jnp.full((2, 3), 0.3), bounds), 0.3)
    np.testing.assert_allclose(regularise(jnp.full((2, 3), 1.3), bounds), 1.0)
    none = from_points(jnp.zeros((0, 3)), jnp.zeros((0, 3)), 0.1)
    np.testing.assert_array_equal(colour_range(none), [0, 1])


def test_widened_range_keeps_valid_colours():
    colours = jnp.array([[0.4, 0.6, 0.5]])
    bounds = colour_range(from_points(jnp.zeros((1, 3)), colours, 0.1))
    stretched = regularise(colours, bounds)
    np.testing.assert_allclose(stretched, [[0, 1, 0.5]], atol=1e-6)
    np.testing.assert_array_equal(regularise(colours, to_unit_interval(bounds)), colours)
    bright = to_unit_interval(ColourRange(jnp.asarray(0.2), jnp.asarray(2.0)))
    np.testing.assert_allclose(regularise(jnp.array([2.0, 1.0, 0.0]), bright), [1, 0.5, 0])


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_gradients_are_finite(dtype):
    def total(colours, low, high):
        return jnp.sum(regularise(colours, ColourRange(low, high)) ** 2)

    colours = jnp.array([[0.3, 0.5, 2.0]], dtype)
    for low, high in [(0.5, 0.5), (0.0, 1.0)]:
        gradient = jax.grad(total, argnums=(0, 1, 2))(
            colours, jnp.asarray(low, dtype), jnp.asarray(high, dtype)
        )
        assert all(bool(jnp.isfinite(g).all()) and g.dtype == dtype for g in gradient)
