"""The few layers that published networks are made of, with the defaults of their originals.

Parameters start as zeros: these modules are filled from checkpoints, never trained from here.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array, lax

Padding = tuple[tuple[int, int], tuple[int, int]]
LEAST_FOR_TAPS = 256  # channels from which on `_by_taps` is the faster way


def _wide(x: Array) -> Array:
    return x.astype(jnp.promote_types(x.dtype, jnp.float32))


def product(x: Array, matrix: Array) -> Array:
    """(..., I) @ (I, O), summed and returned in float32 or better.

    Said of bfloat16, XLA's CPU backend then uses the matrix units; asked for a bfloat16 result, it
    computes in float32 at a quarter of the speed.
    """
    wide = jnp.promote_types(x.dtype, jnp.float32)
    return jnp.dot(x, matrix.astype(x.dtype), preferred_element_type=wide)


class Linear(nnx.Module):
    """x W + b over the last axis of (..., inputs). Stands for 1 x 1 convolutions too."""

    def __init__(self, inputs: int, outputs: int, *, bias: bool = True):
        self.kernel = nnx.Param(jnp.zeros((inputs, outputs)))
        self.bias = nnx.Param(jnp.zeros((outputs,))) if bias else None

    def __call__(self, x: Array) -> Array:
        y = product(x, self.kernel[...])
        return (y if self.bias is None else y + self.bias[...].astype(y.dtype)).astype(x.dtype)


class Conv2d(nnx.Module):
    """Convolution of (B, H, W, inputs) pictures; `padding` in pixels, ((top, bottom), (left,
    right)) or one number for all sides."""

    def __init__(
        self,
        inputs: int,
        outputs: int,
        *,
        size: int = 3,
        stride: int = 1,
        padding: int | Padding = 1,
        bias: bool = True,
    ):
        self.stride = stride
        self.padding = ((padding, padding),) * 2 if isinstance(padding, int) else padding
        self.kernel = nnx.Param(jnp.zeros((size, size, inputs, outputs)))
        self.bias = nnx.Param(jnp.zeros((outputs,))) if bias else None

    def __call__(self, x: Array) -> Array:
        x = convolve(x, self.kernel[...].astype(x.dtype), self.stride, self.padding)
        return x if self.bias is None else x + self.bias[...].astype(x.dtype)


@partial(jax.custom_vjp, nondiff_argnums=(2, 3))
def convolve(x: Array, kernel: Array, stride: int, padding: Padding) -> Array:
    """(B, H, W, I) with a kernel (h, w, I, O), both of one dtype.

    XLA's CPU backend knows no convolution of bfloat16 but by way of float32. With many channels a
    matrix product for every entry of the kernel takes a third to two thirds of the time.
    """
    if x.dtype != jnp.bfloat16 or stride > 1 or kernel.shape[2] < LEAST_FOR_TAPS:
        return _whole(x, kernel, stride, padding)
    whole = partial(_whole, stride=stride, padding=padding)
    by_taps = partial(_by_taps, padding=padding)
    return lax.platform_dependent(x, kernel, cpu=by_taps, default=whole)


def _whole(x: Array, kernel: Array, stride: int, padding: Padding) -> Array:
    return lax.conv_general_dilated(
        x, kernel, (stride, stride), padding, dimension_numbers=("NHWC", "HWIO", "NHWC")
    )


def _by_taps(x: Array, kernel: Array, padding: Padding) -> Array:
    padded = jnp.pad(x, ((0, 0), *padding, (0, 0)))
    height, width = (padded.shape[1 + axis] - kernel.shape[axis] + 1 for axis in range(2))
    total: Array | float = 0.0
    for i, j in np.ndindex(kernel.shape[:2]):
        part = product(padded[:, i : i + height, j : j + width], kernel[i, j])
        total = lax.optimization_barrier(total + part)  # lest all parts be held at once
    return jnp.asarray(total).astype(x.dtype)


def _convolve_forward(
    x: Array, kernel: Array, stride: int, padding: Padding
) -> tuple[Array, tuple[Array, Array]]:
    return convolve(x, kernel, stride, padding), (x, kernel)


def _convolve_backward(
    stride: int, padding: Padding, saved: tuple[Array, Array], gradient: Array
) -> tuple[Array, Array]:
    """Towards the picture a convolution again, by the kernel turned about. XLA must not see that it
    is turned: within loops it would fold that into a convolution twenty times as slow."""
    x, kernel = saved
    turned = lax.optimization_barrier(kernel[::-1, ::-1].swapaxes(2, 3))
    edges = [(0, 0, 0)]
    for axis, (before, _) in enumerate(padding, start=1):
        low = turned.shape[axis - 1] - 1 - before
        spread = (gradient.shape[axis] - 1) * stride + 1
        high = x.shape[axis] + turned.shape[axis - 1] - 1 - spread - low
        edges.append((low, high, stride - 1))
    zero = jnp.zeros((), gradient.dtype)
    to_x = convolve(lax.pad(gradient, zero, [*edges, (0, 0, 0)]), turned, 1, ((0, 0), (0, 0)))
    _, pull = jax.vjp(lambda kernel: _whole(x, kernel, stride, padding), kernel)
    return to_x, pull(gradient)[0]


convolve.defvjp(_convolve_forward, _convolve_backward)


class LayerNorm(nnx.Module):
    """Ba et al. 2016, over the last axis."""

    def __init__(self, width: int, *, epsilon: float = 1e-5):
        self.epsilon = epsilon
        self.scale = nnx.Param(jnp.ones((width,)))
        self.bias = nnx.Param(jnp.zeros((width,)))

    def __call__(self, x: Array) -> Array:
        wide = _wide(x)
        centred = wide - wide.mean(-1, keepdims=True)
        variance = jnp.mean(centred**2, -1, keepdims=True)
        unit = centred * lax.rsqrt(variance + self.epsilon)
        scale, bias = (p[...].astype(wide.dtype) for p in (self.scale, self.bias))
        return (unit * scale + bias).astype(x.dtype)


class GroupNorm(nnx.Module):
    """Wu & He 2018, over pixels and the channels of a group of (B, H, W, C) or (B, T, C)."""

    def __init__(self, groups: int, width: int, *, epsilon: float = 1e-5):
        self.groups, self.epsilon = groups, epsilon
        self.scale = nnx.Param(jnp.ones((width,)))
        self.bias = nnx.Param(jnp.zeros((width,)))

    def __call__(self, x: Array) -> Array:
        grouped = _wide(x).reshape(x.shape[0], -1, self.groups, x.shape[-1] // self.groups)
        centred = grouped - grouped.mean((1, 3), keepdims=True)
        variance = jnp.mean(centred**2, (1, 3), keepdims=True)
        unit = (centred * lax.rsqrt(variance + self.epsilon)).reshape(x.shape)
        scale, bias = (p[...].astype(unit.dtype) for p in (self.scale, self.bias))
        return (unit * scale + bias).astype(x.dtype)


class Embedding(nnx.Module):
    """Rows of a table: integers (...) -> (..., width)."""

    def __init__(self, count: int, width: int):
        self.table = nnx.Param(jnp.zeros((count, width)))

    def __call__(self, ids: Array) -> Array:
        return self.table[...][ids]


def gelu(x: Array) -> Array:
    """Hendrycks & Gimpel 2016, exact: x Phi(x)."""
    return jax.nn.gelu(x, approximate=False)


def quick_gelu(x: Array) -> Array:
    """x sigmoid(1.702 x), as the first CLIP models have it."""
    return x * jax.nn.sigmoid(1.702 * x)
