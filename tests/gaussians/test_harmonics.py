import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.gaussians import harmonics as sh


def unit(key, count):
    x = jax.random.normal(jax.random.key(key), (count, 3))
    return x / jnp.linalg.norm(x, axis=-1, keepdims=True)


def test_known_values():
    d = jnp.array([[0.6, 0.0, 0.8]])
    b = sh.basis(d, 3)[0]
    c1 = np.sqrt(3 / (4 * np.pi))
    np.testing.assert_allclose(b[:4], [np.sqrt(1 / (4 * np.pi)), 0, c1 * 0.8, -c1 * 0.6])
    np.testing.assert_allclose(b[6], np.sqrt(5 / (16 * np.pi)) * (3 * 0.64 - 1))
    np.testing.assert_allclose(b[7], -np.sqrt(15 / (4 * np.pi)) * 0.48)
    np.testing.assert_allclose(b[8], np.sqrt(15 / (16 * np.pi)) * 0.36)
    np.testing.assert_allclose(b[12], np.sqrt(7 / (16 * np.pi)) * (5 * 0.8**3 - 3 * 0.8))
    np.testing.assert_allclose(b[15], -np.sqrt(35 / (32 * np.pi)) * 0.6**3)


def test_orthonormal_on_the_sphere():
    # Gauss-Legendre in z times equal angles integrates polynomials of degree 6 exactly.
    z, weight = np.polynomial.legendre.leggauss(6)
    angle = 2 * np.pi * np.arange(12) / 12
    z, a = np.meshgrid(z, angle, indexing="ij")
    r = np.sqrt(1 - z**2)
    d = jnp.asarray(np.stack([r * np.cos(a), r * np.sin(a), z], -1).reshape(-1, 3))
    w = np.repeat(weight, 12) * 2 * np.pi / 12
    b = sh.basis(d, 3)
    np.testing.assert_allclose(jnp.einsum("n,nk,nl->kl", w, b, b), np.eye(16), atol=1e-13)


@pytest.mark.parametrize("degree", range(4))
@pytest.mark.parametrize("dtype,tolerance", [(jnp.float64, 1e-13), (jnp.float32, 2e-5)])
def test_rotate_then_evaluate_is_evaluate_turned_back(degree, dtype, tolerance):
    n = 40
    h = jax.random.normal(jax.random.key(0), (n, (degree + 1) ** 2, 3), dtype)
    R = quaternion_to_matrix(jax.random.normal(jax.random.key(1), (n, 4), dtype))
    d = unit(2, n).astype(dtype)
    back = jnp.einsum("nji,nj->ni", R, d)
    rotated = sh.rotate(h, R)
    assert rotated.dtype == dtype
    np.testing.assert_allclose(sh.evaluate(rotated, d), sh.evaluate(h, back), atol=tolerance)
    if degree > 0:  # the wrong sense of rotation is told apart
        forth = jnp.einsum("nij,nj->ni", R, d)
        assert jnp.abs(sh.evaluate(rotated, d) - sh.evaluate(h, forth)).max() > 0.1


def test_rotations_compose_and_keep_the_norm():
    h = jax.random.normal(jax.random.key(0), (5, 16, 3))
    A, B = quaternion_to_matrix(jax.random.normal(jax.random.key(1), (2, 4)))
    np.testing.assert_allclose(sh.rotate(sh.rotate(h, B), A), sh.rotate(h, A @ B), atol=1e-13)
    np.testing.assert_allclose(
        jnp.linalg.norm(sh.rotate(h, A), axis=1), jnp.linalg.norm(h, axis=1), rtol=1e-13
    )
    np.testing.assert_allclose(sh.rotate(h, jnp.eye(3)), h, atol=1e-14)


def test_gradient_of_evaluate():
    h = jax.random.normal(jax.random.key(0), (3, 16, 3))
    check_grads(sh.evaluate, (h, unit(1, 3)), order=1, modes=["rev"])
    R = quaternion_to_matrix(jax.random.normal(jax.random.key(1), (3, 4)))
    check_grads(sh.rotate, (h, R), order=1, modes=["rev"])


def test_colour_conversion():
    rgb = jnp.array([[0.0, 0.5, 1.0]])
    np.testing.assert_allclose(sh.dc_to_rgb(sh.rgb_to_dc(rgb)), rgb, atol=1e-15)
    np.testing.assert_allclose(sh.rgb_to_dc(rgb)[0, 2], 0.5 / np.sqrt(1 / (4 * np.pi)), rtol=1e-12)


def test_unknown_degree():
    with pytest.raises(ValueError, match="1, 4, 9 or 16"):
        sh.degree_of(25)
    with pytest.raises(ValueError, match="1, 4, 9 or 16"):
        sh.degree_of(3)
