import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core import algebra


def batch(dtype, count=7, seed=3):
    return np.random.default_rng(seed).normal(size=(3, 3, count)).astype(dtype)


def numpy_form(A):
    return np.moveaxis(np.asarray(A), -1, 0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_agrees_with_numpy(dtype):
    A, B, v = batch(dtype), batch(dtype, seed=4), batch(dtype, seed=5)[0]
    a, b = numpy_form(A), numpy_form(B)
    tolerance = {"rtol": 2e-4 if dtype == np.float32 else 1e-11, "atol": 1e-5}

    def close(got, expected):
        np.testing.assert_allclose(numpy_form(got), expected, **tolerance)

    close(algebra.matmul(A, B), a @ b)
    close(algebra.matmul_transpose(A, B), a @ b.swapaxes(1, 2))
    close(algebra.transpose(A), a.swapaxes(1, 2))
    close(algebra.inverse(A), np.linalg.inv(a))
    close(algebra.determinant(A), np.linalg.det(a))
    close(algebra.trace(A), np.trace(a, axis1=1, axis2=2))
    close(algebra.matvec(A, v), np.einsum("nij,nj->ni", a, v.T))
    close(algebra.outer(v, v), np.einsum("ni,nj->nij", v.T, v.T))
    assert algebra.matmul(A, B).dtype == dtype


def test_one_matrix_and_a_batch_give_the_same():
    A, B = batch(np.float64), batch(np.float64, seed=4)
    one = algebra.matmul(A[:, :, 2], B[:, :, 2])
    np.testing.assert_allclose(one, algebra.matmul(A, B)[:, :, 2], rtol=1e-14)


def test_cofactor_of_a_singular_matrix_is_finite_and_its_inverse_is_not():
    A = np.zeros((3, 3))
    A[0, 0] = A[1, 1] = 2.0
    expected = np.zeros((3, 3))
    expected[2, 2] = 4.0
    np.testing.assert_array_equal(algebra.cofactor(A), expected)
    assert not np.isfinite(algebra.inverse(A)).all()


def test_gradient_of_a_determinant_is_the_cofactor():
    A = batch(np.float64, 1)[:, :, 0]
    np.testing.assert_allclose(
        jax.grad(algebra.determinant)(jnp.asarray(A)), algebra.cofactor(A), rtol=1e-12
    )


def test_reverse_mode_splits_each_factor_once_and_pads_nothing():
    A = jnp.asarray(batch(np.float64))
    gradient = jax.grad(lambda A: jnp.sum(algebra.matmul(A, A) ** 2))
    assert "pad[" not in str(jax.make_jaxpr(gradient)(A))
    indexed = jax.grad(lambda A: A[0, 0].sum() + A[1, 1].sum())
    assert "pad[" in str(jax.make_jaxpr(indexed)(A))  # what the test would see otherwise
