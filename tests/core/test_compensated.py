import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.compensated import add


def summed(start, term, count, residual):
    """`count` times `term` on top of `start`, compiled: the sum and its residual."""

    def body(_, carry):
        return add(*carry, term)

    return jax.jit(lambda: jax.lax.fori_loop(0, count, body, (start, residual)))()


@pytest.mark.parametrize("place", [0.1, 1.0, 2.4])
@pytest.mark.parametrize("speed", [0.01, 0.03])
def test_a_million_steps_too_small_to_see_arrive(place, speed):
    """What steel does: 1e6 steps of 1e-6 s."""
    start, term = jnp.float32(place), jnp.float32(speed) * jnp.float32(1e-6)
    expected = 1e6 * float(term)
    total, residual = summed(start, term, 1_000_000, jnp.zeros((), jnp.float32))
    assert abs(float(total) - float(start) - expected) < 1e-4 * expected
    # Nor is what it still carries more than a rounding of the sum.
    assert abs(float(residual)) <= np.spacing(np.float32(total))


def test_a_plain_sum_does_not():
    """Control, and that None carries nothing."""
    term = jnp.float32(1e-8)
    total, residual = summed(jnp.float32(1.0), term, 1000, None)
    assert float(total) == 1.0 and residual is None


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_the_residual_is_exact_whichever_is_larger(dtype):
    random = np.random.default_rng(0)
    scales = 10.0 ** random.uniform(-9, 9, size=(2, 500))
    total, term = (jnp.asarray(s * random.normal(size=500), dtype) for s in scales)
    result, residual = jax.jit(add)(total, jnp.zeros(500, dtype), term)
    np.testing.assert_array_equal(result, total + term)
    wide = np.longdouble
    exact = np.asarray(total, wide) + np.asarray(term, wide)
    found = np.asarray(result, wide) + np.asarray(residual, wide)
    if dtype == jnp.float32:
        np.testing.assert_array_equal(found, exact)
    np.testing.assert_allclose(found, exact, rtol=1e-18)


def test_the_derivative_is_that_of_the_sum_and_knows_no_residual():
    primals = tuple(jnp.float32(x) for x in (1.0, 3e-8, 2e-8))
    tangents = tuple(jnp.float32(x) for x in (2.0, 5.0, 7.0))
    (_, residual), (slope, of_residual) = jax.jvp(add, primals, tangents)
    assert float(slope) == 9.0 and float(of_residual) == 0.0
    assert abs(float(residual) - 5e-8) < 1e-13  # 1 + 5e-8 is 1 in float32


def test_a_million_slow_strains_grow_as_their_exponential():
    """F <- (I + dt C) F with C = 1e-2/s: 1e-8 a step, less than a rounding of 1."""
    rate = np.array([[1.0, 0.5, 0.0], [0.2, -1.0, 0.3], [0.0, 0.7, 0.4]])
    change = jnp.asarray(1e-8 * rate, jnp.float32)

    def body(_, carry):
        return add(*carry, change @ carry[0])

    start = jnp.eye(3, dtype=jnp.float32)
    F, rest = jax.jit(lambda: jax.lax.fori_loop(0, 1_000_000, body, (start, 0 * start)))()
    found = np.asarray(F, float) + np.asarray(rest, float) - np.eye(3)
    C = 1e-2 * rate
    expected = C + C @ C / 2 + C @ C @ C / 6 + C @ C @ C @ C / 24
    np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())
