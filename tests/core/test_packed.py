"""Packed symmetric matrices against numpy's full ones."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core import packed


def matrices(n, shift=0.0, count=7):
    random = np.random.default_rng(n)
    A = random.normal(size=(count, n, n))
    A = A + np.swapaxes(A, 1, 2) + shift * np.eye(n)
    return A, packed.pack(jnp.asarray(np.moveaxis(A, 0, -1)))


@pytest.mark.parametrize("n", [3, 9])
def test_packed_matrices_multiply_and_lose_their_negative_part(n):
    A, P = matrices(n)
    assert packed.size(P) == n and P.shape == (n * (n + 1) // 2, len(A))
    v = np.random.default_rng(0).normal(size=(n, len(A)))
    found = jnp.stack(packed.multiply(P, list(jnp.asarray(v))))
    np.testing.assert_allclose(found, np.einsum("pij,jp->ip", A, v), atol=1e-12)
    w, Q = np.linalg.eigh(A)
    assert (w < 0).any()
    expected = np.einsum("pik,pk,pjk->pij", Q, np.maximum(w, 0), Q)
    full = np.moveaxis(np.asarray(packed.positive(P))[packed.places(n)], -1, 0)
    np.testing.assert_allclose(full, expected, atol=1e-12)


@pytest.mark.parametrize("scale", [1.0, 1e-25])
def test_inverse_at_any_scale(scale):
    A, P = matrices(3, shift=8.0)
    found = np.asarray(packed.inverse((scale * P).astype(jnp.float32)))[packed.places(3)]
    expected = np.linalg.inv(A)
    np.testing.assert_allclose(
        scale * np.moveaxis(found, -1, 0), expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max()
    )
    assert not np.any(packed.inverse(jnp.zeros((6, 2))))
