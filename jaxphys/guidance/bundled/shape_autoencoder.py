"""Coloured surfaces as a few latent vectors, and back: a distance and a colour at any place.

Cross-attention both ways, as 3DShape2VecSet (Zhang et al. 2023): latents read a cloud of oriented
coloured points; any place reads the latents and is told how far from the surface it is and which
colour the surface has near it. The result is a continuous surface without scatter.
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.guidance.bundled.adaptive import (
    NormalisedAttention,
    SquaredPerceptron,
    TrainableLinear,
    normalise,
    spread,
)


@dataclass(frozen=True)
class AutoencoderConfig:
    """Sizes of the network and the frame of its field.

    thickness: half of what thin sheets are given, and by how much every surface is raised, so that
    whatever has a surface has an inside. reach: distances are told up to this. Object lengths.
    """

    width: int = 192
    latents: int = 64
    channels: int = 16
    head_width: int = 64
    hidden: int = 512
    reading: int = 2
    thinking: int = 3
    asking: int = 2
    frequencies: int = 7
    thickness: float = 0.006
    reach: float = 0.1
    dtype: str = "float32"


class Field(NamedTuple):
    """distance: (B, Q) signed, negative inside, zero at `thickness` outside the true surface,
    within +- `reach`; colour: (B, Q, 3) in [0, 1]."""

    distance: Array
    colour: Array


class Layer(nnx.Module):
    """Pre-norm transformer layer: attention to `context`, then a perceptron."""

    def __init__(self, width: int, heads: int, head_width: int, hidden: int, *, rngs: nnx.Rngs):
        self.attention = NormalisedAttention(width, width, heads, head_width, rngs=rngs)
        self.perceptron = SquaredPerceptron(width, hidden, width, rngs=rngs)

    def __call__(self, x: Array, context: Array | None = None) -> Array:
        inner = normalise(x)
        x = x + self.attention(inner, inner if context is None else normalise(context))
        return x + self.perceptron(normalise(x))


def positional(places: Array, frequencies: int) -> Array:
    """Fourier features (Tancik et al. 2020) of (..., 3) places in [-1, 1] beside themselves."""
    rates = 0.5 * jnp.pi * 2.0 ** jnp.arange(frequencies, dtype=places.dtype)
    phase = (places[..., None] * rates).reshape(*places.shape[:-1], 3 * frequencies)
    return jnp.concatenate([places, jnp.sin(phase), jnp.cos(phase)], axis=-1)


class ShapeAutoencoder(nnx.Module):
    """`encode` clouds to latents (B, latents, channels) of unit mean square, `decode` them."""

    def __init__(self, config: AutoencoderConfig, *, rngs: nnx.Rngs):
        self.config = config
        width, place = config.width, 3 + 6 * config.frequencies

        def layer(hidden: int, heads: int, head_width: int) -> Layer:
            return Layer(width, heads, head_width, hidden, rngs=rngs)

        def thinker() -> Layer:
            return layer(config.hidden, width // config.head_width, config.head_width)

        self.embed = TrainableLinear(place + 6, width, rngs=rngs)
        self.queries = nnx.Param(jax.random.normal(rngs.params(), (config.latents, width)))
        self.read = nnx.List(layer(config.hidden, 4, 32) for _ in range(config.reading))
        self.gather = nnx.List(thinker() for _ in range(config.reading))
        self.narrow = TrainableLinear(width, config.channels, rngs=rngs)
        self.widen = TrainableLinear(config.channels, width, rngs=rngs)
        self.place = nnx.Param(jax.random.normal(rngs.params(), (config.latents, width)))
        self.think = nnx.List(thinker() for _ in range(config.thinking))
        self.ask = TrainableLinear(place, width, rngs=rngs)
        self.answer = nnx.List(layer(2 * width, 4, 32) for _ in range(config.asking))
        self.output = TrainableLinear(width, 4, rngs=rngs)

    def _rows(self, rows: nnx.Param, batch: int, dtype) -> Array:
        flat = spread(rows[...].astype(dtype).reshape(1, -1), batch)
        return flat.reshape(batch, *rows.shape)

    def encode(self, points: Array, normals: Array, colours: Array) -> Array:
        """Latents (B, latents, channels) of clouds (B, N, 3): points in the object frame, outward
        unit normals, colours in [0, 1]. The order of points does not matter."""
        dtype = jnp.dtype(self.config.dtype)
        features = positional(2.0 * points, self.config.frequencies)
        features = jnp.concatenate([features, normals, 2.0 * colours - 1.0], -1).astype(dtype)
        tokens = self.embed(features)
        x = self._rows(self.queries, points.shape[0], dtype)
        for read, gather in zip(self.read, self.gather, strict=True):
            x = gather(read(x, tokens))
        return normalise(self.narrow(normalise(x))).astype(points.dtype)

    def unfold(self, latents: Array) -> Array:
        """What places read: tokens (B, latents, width). Once for any number of `field` calls."""
        dtype = jnp.dtype(self.config.dtype)
        x = self.widen(latents.astype(dtype)) + self._rows(self.place, latents.shape[0], dtype)
        for layer in self.think:
            x = layer(x)
        return x

    def field(self, tokens: Array, places: Array) -> Field:
        """The field at places (B, Q, 3) of the object frame, each by itself."""
        dtype = jnp.dtype(self.config.dtype)
        x = self.ask(positional(2.0 * places, self.config.frequencies).astype(dtype))
        for layer in self.answer:
            x = layer(x, tokens)
        found = self.output(normalise(x)).astype(places.dtype)
        distance = self.config.reach * jnp.tanh(found[..., 0])
        return Field(distance, jax.nn.sigmoid(2.0 * found[..., 1:]))

    def decode(self, latents: Array, places: Array) -> Field:
        """`field` of `unfold`."""
        return self.field(self.unfold(latents), places)
