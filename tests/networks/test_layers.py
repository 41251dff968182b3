import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from experiments.parity.arrays import pseudo_random
from jaxphys.networks.layers import LEAST_FOR_TAPS, convolve, product

PADDING = ((1, 0), (2, 1))


def plain(x, kernel, padding=PADDING):
    numbers = ("NHWC", "HWIO", "NHWC")
    return lax.conv_general_dilated(x, kernel, (1, 1), padding, dimension_numbers=numbers)


def inputs(channels: int, dtype):
    x = pseudo_random("x", (2, 5, 6, channels))
    kernel = pseudo_random("kernel", (3, 2, channels, 3), channels**-0.5)
    return jnp.asarray(x, dtype), jnp.asarray(kernel, dtype)


def with_gradients(function, x, kernel):
    y, pull = jax.vjp(function, x, kernel)
    return [np.asarray(array, np.float64) for array in (y, *pull(jnp.cos(y)))]


@pytest.mark.parametrize("channels", [LEAST_FOR_TAPS - 1, LEAST_FOR_TAPS])
def test_convolution_of_half_precision_is_one_with_its_gradients(channels):
    """Whichever way it goes: alone the numbers of half precision differ from exact sums."""
    x, kernel = inputs(channels, jnp.bfloat16)
    found = with_gradients(lambda x, kernel: convolve(x, kernel, 1, PADDING), x, kernel)
    exact = with_gradients(plain, x.astype(jnp.float64), kernel.astype(jnp.float64))
    for one, other in zip(found, exact, strict=True):
        assert one.shape == other.shape
        assert np.max(np.abs(one - other)) < 0.02 * np.max(np.abs(other))


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_product_sums_wide(dtype):
    x, matrix = (jnp.asarray(pseudo_random(n, (7, 7)), dtype) for n in ("x", "matrix"))
    assert product(x, matrix).dtype == dtype
    np.testing.assert_allclose(product(x, matrix), np.asarray(x) @ np.asarray(matrix), rtol=1e-4)
    narrow = product(x.astype(jnp.bfloat16), matrix)
    assert narrow.dtype == jnp.float32
    exact = x.astype(jnp.bfloat16).astype(dtype) @ matrix.astype(jnp.bfloat16).astype(dtype)
    np.testing.assert_allclose(narrow, exact, atol=1e-6)
