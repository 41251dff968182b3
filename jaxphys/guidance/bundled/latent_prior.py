"""The 3D prior over latents of a surface: a diffusion transformer, told text.

A token per latent vector and one per phrase, with adaLN-zero conditioning (DiT, Peebles & Xie 2023)
by the noise level and the object.
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
from jaxphys.guidance.diffusion.samplers import karras_times, sample_heun
from jaxphys.guidance.diffusion.schedule import Kind, Schedule, guided, interpret


@dataclass(frozen=True)
class LatentPriorConfig:
    """Sizes of the network and of the latents. `phrases` are read beside the object."""

    latents: int = 64
    channels: int = 16
    text: int = 384
    phrases: int = 7
    width: int = 256
    layers: int = 8
    head_width: int = 64
    hidden: int = 768
    rank: int = 32
    shift: float = 1.0
    kind: Kind = "velocity"
    dtype: str = "float32"


class LatentCondition(NamedTuple):
    """text: (B, 1 + phrases, text) unit embeddings of the object and of what else is said of it,
    zeros where nothing is."""

    text: Array


class LatentPrior(nnx.Module):
    """Denoiser of (B, latents, channels) latents in its frame, where those of all objects have zero
    mean and unit variance; `mean` and `deviation` lead from there to the autoencoder's."""

    def __init__(self, config: LatentPriorConfig, *, rngs: nnx.Rngs):
        self.config = config
        self.schedule = Schedule(config.shift)
        width, shape = config.width, (config.latents, config.channels)
        self.mean, self.deviation = nnx.Param(jnp.zeros(shape)), nnx.Param(jnp.ones(shape))
        self.embed = TrainableLinear(config.channels, width, rngs=rngs)
        self.place = nnx.Param(jax.random.normal(rngs.params(), (config.latents, width)))
        self.time = SquaredPerceptron(128, width, width, rngs=rngs)
        self.text = TrainableLinear(config.text, width, rngs=rngs)
        self.phrases = PhraseTokens(config.text, 1 + config.phrases, width, rngs=rngs)
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
        self.output = TrainableLinear(width, config.channels, rngs=rngs, zero=True)

    def __call__(self, noisy: Array, time: Array, condition: LatentCondition) -> Array:
        """Predicts what `config.kind` says of `noisy` at `time` (B,) in [0, 1]."""
        dtype = jnp.dtype(self.config.dtype)
        text = jnp.asarray(condition.text, dtype)
        told = self.time(time_features(time, 128).astype(dtype))
        told = told + self.text(text[:, 0] * self.config.text**0.5)
        told = normalise(told + self.mix(normalise(told)))
        place = spread(self.place[...].astype(dtype).reshape(1, -1), noisy.shape[0])
        x = self.embed(noisy.astype(dtype)) + place.reshape(noisy.shape[0], *self.place.shape)
        x = jnp.concatenate([x, self.phrases(text)], axis=1)
        x = apply_stack(self.layers, lambda layer, x: layer(x, told), x)
        x = modulate(x[:, : self.config.latents], *self.modulation(told))
        return self.output(x).astype(noisy.dtype)


@dataclass(frozen=True)
class LatentSampling:
    """As `point_prior.SamplingConfig`; limit: clean estimates are clipped to +- this."""

    steps: int = 24
    guidance: float = 3.0
    largest: float = 80.0
    smallest: float = 0.02
    rho: float = 7.0
    limit: float = 4.0


@nnx.jit(static_argnames=("config",))
def sample_latents(
    prior: LatentPrior, text: Array, key: Array, *, config: LatentSampling = LatentSampling()
) -> Array:
    """Draws latents (B, latents, channels), as the autoencoder has them, for (B, R, D) text
    embeddings, the same ones for the same key."""
    schedule = prior.schedule
    shape = (text.shape[0], prior.config.latents, prior.config.channels)
    noise = jax.random.normal(key, shape, text.dtype)
    both = LatentCondition(jnp.concatenate([text, jnp.zeros_like(text)]))

    def denoise(noisy: Array, time: Array) -> Array:
        prediction = prior(jnp.tile(noisy, (2, 1, 1)), jnp.tile(time, 2), both)
        told, untold = jnp.split(prediction, 2)
        prediction = guided(told, untold, config.guidance)
        clean = interpret(schedule, prior.config.kind, prediction, noisy, time).clean
        return jnp.clip(clean, -config.limit, config.limit)

    times = karras_times(schedule, config.steps, config.largest, config.smallest, config.rho)
    drawn = sample_heun(denoise, schedule, noise, times.astype(text.dtype))
    return prior.mean[...] + prior.deviation[...] * drawn
