"""What the convolutional halves of Stable Diffusion's networks share (Rombach et al. 2022)."""

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array
from jax.ad_checkpoint import checkpoint_name

from jaxphys.networks.layers import Conv2d, GroupNorm, Linear, Padding

COSTLY = "costly"  # what is worth keeping where a gradient computes the rest again


class ResnetBlock(nnx.Module):
    """A residual block (He et al. 2016), normed first, that may be told the time (Ho et al. 2020):
    (B, H, W, inputs) -> (B, H, W, outputs)."""

    def __init__(
        self, inputs: int, outputs: int, *, groups: int, epsilon: float, time: int | None = None
    ):
        self.norm1 = GroupNorm(groups, inputs, epsilon=epsilon)
        self.conv1 = Conv2d(inputs, outputs)
        self.time_emb_proj = Linear(time, outputs) if time else None
        self.norm2 = GroupNorm(groups, outputs, epsilon=epsilon)
        self.conv2 = Conv2d(outputs, outputs)
        self.conv_shortcut = Linear(inputs, outputs) if inputs != outputs else None

    def __call__(self, x: Array, time: Array | None = None) -> Array:
        """time: (B, time), where the block was made to be told."""
        inner = checkpoint_name(self.conv1(jax.nn.silu(self.norm1(x))), COSTLY)
        if self.time_emb_proj is not None:
            assert time is not None
            inner = inner + self.time_emb_proj(jax.nn.silu(time))[:, None, None]
        inner = self.conv2(jax.nn.silu(self.norm2(inner)))
        return inner + (x if self.conv_shortcut is None else self.conv_shortcut(x))


class Downsample(nnx.Module):
    """(B, H, W, C) -> half of it, rounded up; the autoencoder pads below and to the right only."""

    def __init__(self, width: int, *, padding: int | Padding = 1):
        self.conv = Conv2d(width, width, stride=2, padding=padding)

    def __call__(self, x: Array) -> Array:
        return self.conv(x)


class Upsample(nnx.Module):
    """(B, H, W, C) -> (B, 2 H, 2 W, C): every pixel four times, then a convolution."""

    def __init__(self, width: int):
        self.conv = Conv2d(width, width)

    def __call__(self, x: Array, size: tuple[int, int] | None = None) -> Array:
        """size: (height, width) to cut to, where an odd size had been halved."""
        x = jnp.repeat(jnp.repeat(x, 2, axis=1), 2, axis=2)
        return self.conv(x if size is None else x[:, : size[0], : size[1]])
