"""The 3D prior: diffusion over coloured point clouds of any size, told text.

Two streams: a token per point, and a few latent tokens that do the thinking. Latents read the
points by cross-attention, attend to one another, and are read back by the points (Jabri et al.
2023; for point clouds PointInfinity, Huang et al. 2024, which trains on few and samples many).
The cost is linear in the number of points, and the result equivariant to their order.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

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
from jaxphys.guidance.diffusion.samplers import karras_times, sample_heun
from jaxphys.guidance.diffusion.schedule import Kind, Schedule, guided, interpret

CHANNELS = 6
_FREQUENCIES = 4


@dataclass(frozen=True)
class PointPriorConfig:
    """Sizes of the network and the frame of its data. `phrases` are read beside the object."""

    text: int = 384
    phrases: int = 0
    width: int = 128
    latents: int = 64
    latent_width: int = 192
    blocks: int = 3
    latent_layers: int = 2
    head_width: int = 64
    hidden: int = 256
    latent_hidden: int = 384
    rank: int = 32
    shift: float = 0.5
    kind: Kind = "velocity"
    dtype: str = "float32"


class PointCondition(NamedTuple):
    """text: (B, 1 + phrases, text) unit embeddings of the object and of what else is said of it,
    zeros where nothing is."""

    text: Array


def to_frame(points: Array, colours: Array) -> Array:
    """The (..., 6) samples that the prior diffuses, all in [-1, 1].

    points: (..., 3) in the object frame: centred, z up, front +x, longest side 1. colours: (..., 3)
    in [0, 1].
    """
    return jnp.concatenate([2.0 * points, 2.0 * colours - 1.0], axis=-1)


def from_frame(samples: Array) -> tuple[Array, Array]:
    """Inverse of `to_frame`; colours are clipped to [0, 1]."""
    return 0.5 * samples[..., :3], jnp.clip(0.5 * samples[..., 3:] + 0.5, 0.0, 1.0)


class _Block(nnx.Module):
    """Latents read the points, think, and are read by the points."""

    def __init__(self, config: PointPriorConfig, *, rngs: nnx.Rngs):
        width, rank = config.latent_width, config.rank
        common: dict[str, Any] = {"condition": width, "rank": rank, "rngs": rngs}
        latent = {"width": width, "hidden": config.latent_hidden, **common}
        self.read = AdaptiveLayer(**latent, context=config.width, heads=4, head_width=32)
        heads = config.latent_width // config.head_width
        self.think = nnx.List(
            AdaptiveLayer(**latent, context=None, heads=heads, head_width=config.head_width)
            for _ in range(config.latent_layers)
        )
        self.write = AdaptiveLayer(
            config.width,
            context=config.latent_width,
            heads=4,
            head_width=32,
            hidden=config.hidden,
            **common,
        )

    def __call__(self, points: Array, latents: Array, told: Array) -> tuple[Array, Array]:
        latents = self.read(latents, told, points)
        for layer in self.think:
            latents = layer(latents, told)
        return self.write(points, told, latents), latents


class PointPrior(nnx.Module):
    """Denoiser of (B, N, 6) coloured points in [-1, 1], see `to_frame`."""

    def __init__(self, config: PointPriorConfig, *, rngs: nnx.Rngs):
        self.config = config
        self.schedule = Schedule(config.shift)
        width, wide = config.width, config.latent_width
        self.embed = TrainableLinear(CHANNELS + 6 * _FREQUENCIES, width, rngs=rngs)
        self.latents = nnx.Param(jax.random.normal(rngs.params(), (config.latents, wide)))
        self.time = SquaredPerceptron(128, wide, wide, rngs=rngs)
        self.text = TrainableLinear(config.text, wide, rngs=rngs)
        rows = 1 + config.phrases
        self.phrases = PhraseTokens(config.text, rows, wide, rngs=rngs) if config.phrases else None
        self.mix = SquaredPerceptron(wide, wide, wide, rngs=rngs)
        self.blocks = stack(lambda rngs: _Block(config, rngs=rngs), config.blocks, rngs)
        self.modulation = Modulation(wide, width, config.rank, 2, rngs=rngs)
        self.output = TrainableLinear(width, CHANNELS, rngs=rngs, zero=True)

    def _features(self, noisy: Array) -> Array:
        """Fourier features of the positions (Tancik et al. 2020) beside the raw channels."""
        rates = 0.5 * jnp.pi * 2.0 ** jnp.arange(_FREQUENCIES, dtype=noisy.dtype)
        phase = (noisy[..., :3, None] * rates).reshape(*noisy.shape[:-1], 3 * _FREQUENCIES)
        return jnp.concatenate([noisy, jnp.sin(phase), jnp.cos(phase)], axis=-1)

    def __call__(self, noisy: Array, time: Array, condition: PointCondition) -> Array:
        """Predicts what `config.kind` says of `noisy` (B, N, 6) at `time` (B,) in [0, 1]."""
        dtype = jnp.dtype(self.config.dtype)
        told = self.time(time_features(time, 128).astype(dtype))
        text = jnp.asarray(condition.text, dtype)
        told = told + self.text(text[:, 0] * self.config.text**0.5)
        told = told + self.mix(normalise(told))
        told = normalise(told)
        points = self.embed(self._features(noisy).astype(dtype))
        latents = spread(self.latents[...].astype(dtype).reshape(1, -1), noisy.shape[0])
        latents = latents.reshape(noisy.shape[0], *self.latents.shape)
        if self.phrases is not None:
            latents = jnp.concatenate([latents, self.phrases(text)], axis=1)
        points, _ = apply_stack(
            self.blocks, lambda block, streams: block(*streams, told), (points, latents)
        )
        shift, scale = self.modulation(told)
        return self.output(modulate(points, shift, scale)).astype(noisy.dtype)


@dataclass(frozen=True)
class SamplingConfig:
    """How clouds are drawn: Heun's steps (two evaluations each), guidance, and the noise span.

    largest, smallest: sigma / alpha at the first and the last step; rho spaces those between
    (Karras et al. 2022). limit: clean estimates are clipped to +- this.
    """

    steps: int = 32
    guidance: float = 3.0
    largest: float = 80.0
    smallest: float = 0.01
    rho: float = 7.0
    limit: float = 1.05


@nnx.jit(static_argnames=("count", "config"))
def sample_points(
    prior: PointPrior,
    text: Array,
    key: Array,
    *,
    count: int = 2048,
    config: SamplingConfig = SamplingConfig(),
) -> tuple[Array, Array]:
    """Draws coloured clouds for (B, R, D) text embeddings, the same ones for the same key.

    Returns points (B, count, 3) in the object frame (centred, z up, front +x, longest side about 1)
    and colours (B, count, 3) in [0, 1].
    """
    schedule = prior.schedule
    noise = jax.random.normal(key, (text.shape[0], count, CHANNELS), text.dtype)
    both = PointCondition(jnp.concatenate([text, jnp.zeros_like(text)]))

    def denoise(noisy: Array, time: Array) -> Array:
        prediction = prior(jnp.tile(noisy, (2, 1, 1)), jnp.tile(time, 2), both)
        told, untold = jnp.split(prediction, 2)
        prediction = guided(told, untold, config.guidance)
        clean = interpret(schedule, prior.config.kind, prediction, noisy, time).clean
        return jnp.clip(clean, -config.limit, config.limit)

    times = karras_times(schedule, config.steps, config.largest, config.smallest, config.rho)
    return from_frame(sample_heun(denoise, schedule, noise, times.astype(text.dtype)))
