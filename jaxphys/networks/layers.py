"""The few layers that published networks are made of, with the defaults of their originals.

Parameters start as zeros: these modules are filled from checkpoints, never trained from here.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from flax import nnx
from jax import lax

Array = jax.Array
Padding = tuple[tuple[int, int], tuple[int, int]]


def _wide(x: Array) -> Array:
    return x.astype(jnp.promote_types(x.dtype, jnp.float32))


class Linear(nnx.Module):
    """x W + b over the last axis of (..., inputs). Stands for 1 x 1 convolutions too."""

    def __init__(self, inputs: int, outputs: int, *, bias: bool = True):
        self.kernel = nnx.Param(jnp.zeros((inputs, outputs)))
        self.bias = nnx.Param(jnp.zeros((outputs,))) if bias else None

    def __call__(self, x: Array) -> Array:
        product = x @ self.kernel[...].astype(x.dtype)
        return product if self.bias is None else product + self.bias[...].astype(x.dtype)


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
        x = lax.conv_general_dilated(
            x,
            self.kernel[...].astype(x.dtype),
            window_strides=(self.stride, self.stride),
            padding=self.padding,
            dimension_numbers=("NHWC", "HWIO", "NHWC"),
        )
        return x if self.bias is None else x + self.bias[...].astype(x.dtype)


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
