"""The 2D prior: a diffusion transformer over patches of a small picture, told text and view.

A plain ViT with adaLN-zero conditioning (DiT, Peebles & Xie 2023) that predicts the clean picture,
which lets patches be as large as a token is wide (Li & He 2025, "Back to basics"). Tokens read and
write windows that overlap by half, so that no seams show between patches.
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.guidance.bundled.adaptive import (
    AdaptiveLayer,
    Modulation,
    PhraseTokens,
    SquaredPerceptron,
    TrainableLinear,
    apply_stack,
    modulate,
    normalise,
    spread,
    stack,
    time_features,
)
from jaxphys.guidance.diffusion.schedule import Kind, Schedule
from jaxphys.guidance.views import FEATURES

QUARTERS = ((0, 0), (0, 1), (1, 0), (1, 1))


@dataclass(frozen=True)
class PixelPriorConfig:
    """Sizes of the network and the frame of its data. `phrases` are read beside the object."""

    resolution: int = 64
    patch: int = 8
    text: int = 384
    phrases: int = 0
    width: int = 256
    layers: int = 5
    head_width: int = 64
    hidden: int = 768
    rank: int = 32
    shift: float = 1.0
    kind: Kind = "clean"
    dtype: str = "float32"


class PixelCondition(NamedTuple):
    """text: (B, 1 + phrases, text) unit embeddings of the object and of what else is said of it,
    zeros where nothing is; view: (B, 4), see views.py."""

    text: Array
    view: Array


class PixelPrior(nnx.Module):
    """Denoiser of (B, resolution, resolution, 3) pictures in [-1, 1] on any opaque background."""

    def __init__(self, config: PixelPriorConfig, *, rngs: nnx.Rngs):
        self.config = config
        self.schedule = Schedule(config.shift)
        width, window = config.width, 4 * 3 * config.patch**2
        tokens = (config.resolution // config.patch) ** 2
        self.embed = TrainableLinear(window, width, rngs=rngs)
        self.position = nnx.Param(0.02 * jax.random.normal(rngs.params(), (tokens, width)))
        self.time = SquaredPerceptron(128, width, width, rngs=rngs)
        self.text = TrainableLinear(config.text, width, rngs=rngs)
        rows = 1 + config.phrases
        self.phrases = PhraseTokens(config.text, rows, width, rngs=rngs) if config.phrases else None
        self.view = SquaredPerceptron(FEATURES, 64, width, rngs=rngs)
        self.mix = SquaredPerceptron(width, width, width, rngs=rngs)

        def layer(rngs: nnx.Rngs) -> AdaptiveLayer:
            return AdaptiveLayer(
                width,
                context=None,
                heads=width // config.head_width,
                head_width=config.head_width,
                hidden=config.hidden,
                condition=width,
                rank=config.rank,
                rngs=rngs,
            )

        self.layers = stack(layer, config.layers, rngs)
        self.modulation = Modulation(width, width, config.rank, 2, rngs=rngs)
        self.output = TrainableLinear(width, window, rngs=rngs, zero=True)

    def _windows(self, pictures: Array) -> Array:
        """(B, R, R, 3) -> (B, tokens, 4 p p 3): around each patch a window twice as wide, as four
        quarters. What lies beyond the picture is zero."""
        p, size = self.config.patch, self.config.resolution
        side, half = size // p, p // 2
        padded = jnp.pad(pictures, ((0, 0), (half, half), (half, half), (0, 0)))
        quarters = []
        for row, column in QUARTERS:
            cut = padded[:, row * p : row * p + size, column * p : column * p + size]
            cut = cut.reshape(-1, side, p, side, p, 3).transpose(0, 1, 3, 2, 4, 5)
            quarters.append(cut.reshape(-1, side * side, p * p * 3))
        return jnp.concatenate(quarters, -1)

    def _pictures(self, windows: Array) -> Array:
        """(B, tokens, 4 p p 3) -> (B, R, R, 3): the sum of overlapping windows."""
        p, size = self.config.patch, self.config.resolution
        side, half = size // p, p // 2
        padded: Array | float = 0.0
        for (row, column), cut in zip(QUARTERS, jnp.split(windows, 4, -1), strict=True):
            cut = cut.reshape(-1, side, side, p, p, 3).transpose(0, 1, 3, 2, 4, 5)
            margins = ((row * p, p - row * p), (column * p, p - column * p))
            padded += jnp.pad(cut.reshape(-1, size, size, 3), ((0, 0), *margins, (0, 0)))
        return jnp.asarray(padded)[:, half : half + size, half : half + size]

    def __call__(self, noisy: Array, time: Array, condition: PixelCondition) -> Array:
        """Predicts what `config.kind` says of `noisy` (B, R, R, 3) at `time` (B,) in [0, 1]."""
        dtype = jnp.dtype(self.config.dtype)
        text, view = (jnp.asarray(c, dtype) for c in condition)
        told = self.time(time_features(time, 128).astype(dtype))
        told = told + self.text(text[:, 0] * self.config.text**0.5) + self.view(view)
        told = told + self.mix(normalise(told))
        told = normalise(told)
        position = self.position[...].astype(dtype).reshape(1, -1)
        x = self.embed(self._windows(noisy.astype(dtype)))
        x = x + spread(position, x.shape[0]).reshape(x.shape)
        patches = x.shape[1]
        if self.phrases is not None:
            x = jnp.concatenate([x, self.phrases(text)], axis=1)
        x = apply_stack(self.layers, lambda layer, x: layer(x, told), x)[:, :patches]
        shift, scale = self.modulation(told)
        return self._pictures(self.output(modulate(x, shift, scale)).astype(noisy.dtype))
