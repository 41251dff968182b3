"""Point-E's two denoisers of coloured point clouds (Nichol et al. 2022): a plain transformer.

One token per point, and what the network is told as more tokens in front. Points have no places in
a sequence, so there is no position embedding: the result is equivariant to their order.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.networks.attention import attend, join_heads, split_heads
from jaxphys.networks.layers import LayerNorm, Linear, gelu

CHANNELS = 6
HEAD = 64
LONGEST_PERIOD = 10_000.0


@dataclass(frozen=True)
class PointEConfig:
    """Sizes; the defaults are those of the published models of 40 million parameters.

    Attributes:
        width, layers, heads: of the transformer.
        text: length of the text embedding that the base is told.
        grid: (tokens, width) of the picture that the upsampler is told.
        slice_size: queries at a time, see `attend`.
    """

    width: int = 512
    layers: int = 12
    heads: int = 8
    text: int = 768
    grid: tuple[int, int] = (256, 1024)
    slice_size: int | None = None

    @classmethod
    def of_arrays(
        cls, arrays: Mapping[str, np.ndarray], source: str, slice_size: int | None = None
    ) -> Self:
        """The sizes of a checkpoint, whose heads are 64 wide as in every published one.

        Raises InputError, naming `source`, if it is of another kind of network.
        """
        block = re.compile(r"backbone\.resblocks\.(\d+)\.")
        layers = {match[1] for match in map(block.match, arrays) if match}
        try:
            width = arrays["ln_pre.weight"].shape[0]
            # The base is told a text; the upsampler tokens of a picture, after a norm of its own.
            told = "clip_embed.weight" if "clip_embed.weight" in arrays else "clip_embed.1.weight"
            depth = arrays[told].shape[1]
        except (KeyError, IndexError):
            raise InputError(
                f"{source}: is no checkpoint of Point-E's; get the file again"
            ) from None
        heads = max(1, width // HEAD)
        if told == "clip_embed.weight":
            return cls(width, len(layers), heads, text=depth, slice_size=slice_size)
        grid = (cls.grid[0], depth)
        return cls(width, len(layers), heads, grid=grid, slice_size=slice_size)


class FusedAttention(nnx.Module):
    """Self-attention over (B, T, width). Each head has its queries, keys and values side by side in
    the one projection."""

    def __init__(self, config: PointEConfig):
        self.heads, self.slice_size = config.heads, config.slice_size
        self.c_qkv = Linear(config.width, 3 * config.width)
        self.c_proj = Linear(config.width, config.width)

    def __call__(self, x: Array) -> Array:
        queries, keys, values = jnp.split(split_heads(self.c_qkv(x), self.heads), 3, axis=-1)
        return self.c_proj(join_heads(attend(queries, keys, values, slice_size=self.slice_size)))


class PointEPerceptron(nnx.Module):
    """Two linear layers, four times as wide in between."""

    def __init__(self, width: int):
        self.c_fc = Linear(width, 4 * width)
        self.c_proj = Linear(4 * width, width)

    def __call__(self, x: Array) -> Array:
        return self.c_proj(gelu(self.c_fc(x)))


class PointEBlock(nnx.Module):
    """Attention and a perceptron, each added to what it read; norms come first."""

    def __init__(self, config: PointEConfig):
        self.ln_1 = LayerNorm(config.width)
        self.attn = FusedAttention(config)
        self.ln_2 = LayerNorm(config.width)
        self.mlp = PointEPerceptron(config.width)

    def __call__(self, x: Array) -> Array:
        x = x + self.attn(self.ln_1(x))
        return x + self.mlp(self.ln_2(x))


class Backbone(nnx.Module):
    """The blocks one after another."""

    def __init__(self, config: PointEConfig):
        self.resblocks = nnx.List([PointEBlock(config) for _ in range(config.layers)])

    def __call__(self, x: Array) -> Array:
        for block in self.resblocks:
            x = block(x)
        return x


class PointTransformer(nnx.Module):
    """What both denoisers share: points and what they are told to noise and its variance."""

    def __init__(self, config: PointEConfig):
        self.config = config
        self.time_embed = PointEPerceptron(config.width)
        self.input_proj = Linear(CHANNELS, config.width)
        self.ln_pre = LayerNorm(config.width)
        self.backbone = Backbone(config)
        self.ln_post = LayerNorm(config.width)
        self.output_proj = Linear(config.width, 2 * CHANNELS)

    def embed_step(self, step: Array, dtype: jnp.dtype) -> Array:
        """(B,) steps of the schedule -> one token (B, 1, width)."""
        return self.time_embed(step_waves(step, self.config.width).astype(dtype))[:, None]

    def transform(self, told: list[Array], noisy: Array) -> Array:
        """Tokens (B, *, width) and points (B, N, 6) -> (B, N, 12)."""
        tokens = jnp.concatenate([*told, self.input_proj(noisy)], axis=1)
        tokens = self.ln_post(self.backbone(self.ln_pre(tokens)))
        return self.output_proj(tokens[:, -noisy.shape[1] :])


class PointEBase(PointTransformer):
    """Denoiser of whole clouds, told a text."""

    def __init__(self, config: PointEConfig = PointEConfig()):
        super().__init__(config)
        self.clip_embed = Linear(config.text, config.width)

    def __call__(self, noisy: Array, step: Array, text: Array) -> Array:
        """Noise in (B, N, 6) points, then 6 channels that place its variance between two bounds.

        Args:
            noisy: (B, N, 6) positions and colours; N was 1,024 in training.
            step: (B,) steps of the schedule.
            text: (B, text) CLIP embeddings of length 1; zeros for any text.
        """
        scaled = text.astype(noisy.dtype) * math.sqrt(text.shape[-1])
        told = [self.clip_embed(scaled)[:, None], self.embed_step(step, noisy.dtype)]
        return self.transform(told, noisy)


class PointEUpsampler(PointTransformer):
    """Denoiser of points that are to be added to a coarse cloud."""

    def __init__(self, config: PointEConfig = PointEConfig()):
        super().__init__(config)
        width = config.grid[1]
        self.clip_embed = nnx.List([LayerNorm(width), Linear(width, config.width)])
        self.cond_point_proj = Linear(CHANNELS, config.width)
        self.channel_scales = nnx.Param(jnp.ones((CHANNELS,)))
        self.channel_biases = nnx.Param(jnp.zeros((CHANNELS,)))

    def __call__(self, noisy: Array, step: Array, low: Array, grid: Array | None = None) -> Array:
        """Noise in (B, N, 6) points, then 6 channels for its variance, as of `PointEBase`.

        Args:
            noisy: (B, N, 6) of the points to add; N was 3,072 in training.
            step: (B,) steps of the schedule.
            low: (B, M, 6) the coarse cloud, clean, before any scaling: positions within +-0.5,
                colours 0 to 255; M was 1,024 in training.
            grid: (B, tokens, width) of CLIP's picture tokens; None for no picture.
        """
        if grid is None:
            grid = jnp.zeros((noisy.shape[0], *self.config.grid), noisy.dtype)
        normalise, project = self.clip_embed
        scales, biases = (
            p[...].astype(low.dtype) for p in (self.channel_scales, self.channel_biases)
        )
        told = [
            self.embed_step(step, noisy.dtype),
            project(normalise(grid.astype(noisy.dtype))),
            self.cond_point_proj((low * scales + biases).astype(noisy.dtype)),
        ]
        return self.transform(told, noisy)


def step_waves(step: Array, width: int) -> Array:
    """(B,) -> (B, width): cosines, then sines, of falling rates (Vaswani et al. 2017)."""
    step = step.astype(jnp.promote_types(step.dtype, jnp.float32))
    rates = LONGEST_PERIOD ** -(jnp.arange(width // 2, dtype=step.dtype) / (width // 2))
    phase = step[:, None] * rates
    return jnp.concatenate([jnp.cos(phase), jnp.sin(phase)], axis=-1)
