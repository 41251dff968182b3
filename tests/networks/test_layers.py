import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from experiments.parity.arrays import pseudo_random
from jaxphys.networks.layers import LEAST_FOR_TAPS, convolve, product

PADDING = ((1, 0), (2, 1))


def plain(x, kernel, stride, padding):
    numbers = ("NHWC", "HWIO", "NHWC")
    return lax.conv_general_dilated(x, kernel, (stride,) * 2, padding, dimension_numbers=numbers)


def with_gradients(function, channels: int, stride: int, padding, dtype) -> list[np.ndarray]:
    """The result, and its product's gradients to the picture and the kernel."""
    x = jnp.asarray(pseudo_random("x", (2, 5, 6, channels)), dtype)
    kernel = jnp.asarray(pseudo_random("kernel", (3, 2, channels, 3), channels**-0.5), dtype)
    y, pull = jax.vjp(lambda x, kernel: function(x, kernel, stride, padding), x, kernel)
    gradients = pull(jnp.asarray(pseudo_random("gradient", y.shape), dtype))
    return [np.asarray(array, np.float64) for array in (y, *gradients)]


@pytest.mark.parametrize("stride", [1, 2])
@pytest.mark.parametrize("padding", [PADDING, ((0, 0), (0, 0)), ((0, 1), (0, 1))])
def test_convolution_and_its_gradients(stride, padding):
    case = (2, stride, padding, jnp.float64)
    found, expected = (with_gradients(function, *case) for function in (convolve, plain))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


@pytest.mark.parametrize("channels", [LEAST_FOR_TAPS - 1, LEAST_FOR_TAPS])
def test_convolution_of_half_precision_is_one_whichever_way_it_goes(channels):
    found = with_gradients(convolve, channels, 1, PADDING, jnp.bfloat16)
    expected = with_gradients(plain, channels, 1, PADDING, jnp.float64)
    for one, other in zip(found, expected, strict=True):
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
