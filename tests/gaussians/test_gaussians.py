import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import axis_angle_to_matrix, quaternion_to_matrix
from jaxphys.gaussians import (
    Gaussians,
    concatenate,
    covariances,
    from_points,
    opacities,
    require_finite,
    select,
    to_splats,
    transform,
)


def random_gaussians(count=20, degree=3, dtype=jnp.float64, seed=0):
    k = jax.random.split(jax.random.key(seed), 5)
    return Gaussians(
        jax.random.normal(k[0], (count, 3), dtype),
        jax.random.normal(k[1], (count, 3), dtype) - 2,
        jax.random.normal(k[2], (count, 4), dtype),
        jax.random.normal(k[3], (count,), dtype),
        0.3 * jax.random.normal(k[4], (count, (degree + 1) ** 2, 3), dtype),
    )


@pytest.mark.parametrize("dtype,tolerance", [(jnp.float64, 1e-12), (jnp.float32, 1e-5)])
def test_covariance_has_the_scales_and_axes(dtype, tolerance):
    g = random_gaussians(dtype=dtype)
    sigma = covariances(g)
    assert sigma.dtype == dtype
    np.testing.assert_array_equal(sigma, jnp.swapaxes(sigma, 1, 2))
    values = np.linalg.eigvalsh(np.asarray(sigma, np.float64))
    np.testing.assert_allclose(values, np.sort(np.exp(2 * g.log_scales), axis=1), rtol=tolerance)
    axis = quaternion_to_matrix(g.quaternions)[:, :, 0]
    expected = jnp.exp(2 * g.log_scales[:, :1]) * axis
    np.testing.assert_allclose(jnp.einsum("nij,nj->ni", sigma, axis), expected, atol=tolerance)


def test_splats_turn_the_view_direction_back():
    g = random_gaussians()
    camera = jnp.array([3.0, -2.0, 1.0])
    R = quaternion_to_matrix(jax.random.normal(jax.random.key(9), (g.count, 4)))
    turned = to_splats(g, camera, R)
    # A camera placed so that the unturned Gaussian is seen along R^T d.
    back = jnp.einsum("nji,nj->ni", R, g.means - camera)
    for i in range(3):
        one = select(g, slice(i, i + 1))
        expected = to_splats(one, g.means[i] - back[i])
        np.testing.assert_allclose(turned.colours[i], expected.colours[0], atol=1e-12)
    assert jnp.abs(turned.colours - to_splats(g, camera).colours).max() > 0.05
    assert turned.colours.min() >= 0


def test_similarity_moves_covariances_and_colours():
    g = random_gaussians()
    R = axis_angle_to_matrix(jnp.array([1.0, 2.0, -1.0]), jnp.asarray(0.7))
    s, t = 2.5, jnp.array([0.3, -1.0, 2.0])
    moved = transform(g, R, s, t)
    camera = jnp.array([1.0, 5.0, 2.0])
    before, after = to_splats(g, camera), to_splats(moved, s * R @ camera + t)
    np.testing.assert_allclose(after.means, s * before.means @ R.T + t, atol=1e-12)
    np.testing.assert_allclose(
        after.covariances, s**2 * R @ before.covariances @ R.T, rtol=1e-11, atol=1e-13
    )
    np.testing.assert_allclose(after.colours, before.colours, atol=1e-12)
    np.testing.assert_array_equal(after.opacities, before.opacities)


def test_from_points():
    points = np.random.default_rng(0).normal(size=(7, 3)).astype(np.float32)
    colours = np.linspace(0, 1, 21).reshape(7, 3)
    g = from_points(points, colours, 0.1, opacity=[0, 1, 0.5, 0.2, 0.9, 0.1, 0.3], degree=2)
    assert g.degree == 2
    assert all(leaf.dtype == jnp.float32 for leaf in jax.tree.leaves(g))
    s = to_splats(g, jnp.zeros(3, jnp.float32))
    np.testing.assert_allclose(s.colours, colours, atol=1e-6)
    np.testing.assert_allclose(
        s.covariances, np.broadcast_to(0.01 * np.eye(3), (7, 3, 3)), rtol=1e-5
    )
    np.testing.assert_allclose(s.opacities, [0, 1, 0.5, 0.2, 0.9, 0.1, 0.3], atol=4e-7)
    assert jnp.isfinite(g.opacity_logits).all()
    with pytest.raises(InputError, match="colours of shape"):
        from_points(points, colours[:4], 0.1)
    with pytest.raises(InputError, match="degree 4"):
        from_points(points, colours, 0.1, degree=4)


def test_select_and_concatenate():
    a, b = random_gaussians(4, 1), random_gaussians(3, 3, seed=1)
    both = concatenate([a, b])
    assert both.count == 7 and both.degree == 3
    np.testing.assert_array_equal(both.harmonics[:4, :4], a.harmonics)
    np.testing.assert_array_equal(both.harmonics[:4, 4:], 0)
    np.testing.assert_array_equal(select(both, jnp.arange(4, 7)).means, b.means)
    np.testing.assert_array_equal(select(both, np.arange(7) >= 4).means, b.means)
    np.testing.assert_array_equal(select(both, jnp.arange(7) >= 4).means, b.means)
    with pytest.raises(InputError, match="at least one"):
        concatenate([])


@pytest.mark.parametrize("count", [0, 1])
def test_none_and_one(count):
    g = transform(random_gaussians(count), jnp.eye(3), 2.0)
    s = to_splats(g, jnp.zeros(3))
    assert s.covariances.shape == (count, 3, 3) and s.colours.shape == (count, 3)
    assert all(bool(jnp.isfinite(x).all()) for x in s)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_extreme_values_stay_finite_with_finite_gradients(dtype):
    g = Gaussians(
        jnp.zeros((3, 3), dtype),
        jnp.array([[200, -200, 0], [-200, -200, -200], [0, 0, 0]], dtype),
        jnp.array([[0, 0, 0, 0], [1e-3, 0, 0, 0], [1, 2, 3, 4]], dtype),
        jnp.array([-1000, 1000, 0], dtype),
        jnp.ones((3, 16, 3), dtype),
    )

    def total(g):
        return sum(jnp.sum(x) for x in to_splats(g, jnp.zeros(3, dtype)))  # camera at the means

    splats = to_splats(g, jnp.zeros(3, dtype))
    np.testing.assert_array_equal(splats.opacities[:2], [0, 1])
    assert all(bool(jnp.isfinite(x).all()) for x in splats)
    assert all(bool(jnp.isfinite(x).all()) for x in jax.tree.leaves(jax.jit(jax.grad(total))(g)))
    turned = transform(g, axis_angle_to_matrix(jnp.array([0, 0, 1.0]), jnp.asarray(1.0)))
    expected = np.cos(0.5)  # a zero quaternion turns as the identity does
    np.testing.assert_allclose(turned.quaternions[0], [expected, 0, 0, np.sin(0.5)], rtol=1e-6)


def test_gradient_of_splats():
    g = random_gaussians(3)
    R = quaternion_to_matrix(jax.random.normal(jax.random.key(9), (3, 4)))

    def f(g, camera, R):
        return to_splats(g, camera, R)

    check_grads(f, (g, jnp.array([3.0, -2.0, 1.0]), R), order=1, modes=["rev"])


def test_not_finite_is_named():
    g = random_gaussians(5)
    require_finite(g, "here")
    bad = Gaussians(
        g.means, g.log_scales.at[3, 1].set(jnp.nan), g.quaternions, g.opacity_logits, g.harmonics
    )
    with pytest.raises(InputError, match=r"here: log_scales not finite for 1 of 5 .*first: 3"):
        require_finite(bad, "here")
    assert opacities(bad).shape == (5,)
