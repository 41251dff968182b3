"""Pictures from text by Stable Diffusion: what it paints shows whether a checkpoint is whole."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.fields import Checked, between
from jaxphys.guidance.diffusion.discrete_schedule import DiscreteSchedule
from jaxphys.guidance.diffusion.samplers import sample_ddim
from jaxphys.guidance.diffusion.schedule import Estimate, guided, interpret
from jaxphys.guidance.published.scheduler_config import SAMPLERS, Sampler, SchedulerConfig
from jaxphys.guidance.published.stable_diffusion import (
    LatentPrior,
    TextStates,
    encode_texts,
    load_decoder,
    load_prior,
)
from jaxphys.networks.autoencoder import Decoder


@dataclass(frozen=True)
class PaintConfig(Checked):
    """How a picture is sampled.

    Attributes:
        steps: of the sampler, at most those of the schedule.
        guidance: `u + s (c - u)`; 1 is none.
        sampler: "ddim" (Song et al. 2021) deterministic, "ddpm" (Ho et al. 2020) ancestral.
        width, height: [pixels], multiples of what a latent stands for (8 in the published
            models); None is the size that the network was trained on.
        attention_slice: queries at a time, see `attend`.
        dtype: of weights and computation.
    """

    steps: int = field(default=50, metadata=between(1, 100_000))
    guidance: float = field(default=7.5, metadata=between(-1e3, 1e3))
    sampler: Sampler = "ddim"
    width: int | None = field(default=None, metadata=between(1, 8192))
    height: int | None = field(default=None, metadata=between(1, 8192))
    attention_slice: int | None = field(default=1024, metadata=between(1, 1_000_000))
    dtype: str = "bfloat16"

    def __post_init__(self):
        super().__post_init__()
        if self.sampler not in SAMPLERS:
            raise InputError(f"sampler {self.sampler!r}: {nearest(self.sampler, SAMPLERS)}")


def clipped(
    schedule: DiscreteSchedule,
    scheduler: SchedulerConfig,
    sampler: Sampler,
    estimate: Estimate,
    noisy: Array,
    time: Array,
) -> Estimate:
    """An estimate with its clean sample clipped as the scheduler asks.

    DDIM goes on with the noise that the network saw, DDPM's mean is one of the clipped sample and
    the noisy one (Ho et al. 2020, eq. 7): with the noise that lies between these.
    """
    if not scheduler.clip_sample:
        return estimate
    limit = scheduler.clip_sample_range
    clean = jnp.clip(estimate.clean, -limit, limit)
    if sampler == "ddim":
        return estimate._replace(clean=clean)
    return interpret(schedule, "clean", clean, noisy, time)


@nnx.jit(static_argnames=("config", "shape"))
def sample_latents(
    prior: LatentPrior, told: Array, untold: Array, key: Array, config: PaintConfig, shape: tuple
) -> Array:
    """Latents (B, *shape) for text states (B, T, D) with and without the prompt, the same ones for
    the same key."""
    schedule, scheduler, kind = prior.schedule, prior.config.scheduler, prior.config.kind
    first, later = jax.random.split(key)
    noisy = jax.random.normal(first, (told.shape[0], *shape), jnp.float32)
    both = TextStates(jnp.concatenate([told, untold]))

    def estimate(noisy: Array, time: Array) -> Estimate:
        prediction = prior(jnp.tile(noisy, (2, 1, 1, 1)), jnp.tile(time, 2), both)
        with_text, without = jnp.split(prediction, 2)
        prediction = guided(with_text, without, config.guidance)
        found = interpret(schedule, kind, prediction, noisy, time)
        return clipped(schedule, scheduler, config.sampler, found, noisy, time)

    spans = scheduler.visited(config.steps, config.sampler)
    times, reached = (jnp.asarray(steps, jnp.float32) / (schedule.count - 1) for steps in spans)
    eta = 0.0 if config.sampler == "ddim" else 1.0
    return sample_ddim(estimate, schedule, noisy, times, reached, key=later, eta=eta)


@nnx.jit
def _decode(decoder: Decoder, latents: Array) -> Array:
    return decoder(latents)


def _side(prior: LatentPrior, name: str, pixels: int | None) -> int:
    """Latents that make up `pixels`."""
    if pixels is None:
        return prior.config.side
    if pixels < 1 or pixels % prior.config.reduction:
        raise InputError(f"{name} = {pixels}: must be a multiple of {prior.config.reduction}")
    return pixels // prior.config.reduction


def paint(
    prompt: str,
    folder: Path,
    *,
    negative: str = "",
    seed: int = 0,
    config: PaintConfig = PaintConfig(),
) -> np.ndarray:
    """A picture (H, W, 3) uint8 of `prompt` by the checkpoint in `folder`; the same for the same
    seed.

    Raises InputError for a bad setting or an unusable checkpoint.
    """
    if not prompt.strip():
        raise InputError("prompt: is empty; say what to paint, for example 'a strawberry'")
    states = encode_texts(folder, [prompt, negative])
    options: dict[str, Any] = {"dtype": config.dtype, "attention_slice": config.attention_slice}
    prior = load_prior(folder, **options)
    decoder = load_decoder(folder, **options)
    sides = [_side(prior, name, getattr(config, name)) for name in ("height", "width")]
    key = jax.random.key(seed)
    latents = sample_latents(prior, states[:1], states[1:], key, config, (*sides, 4))
    latents = (latents / decoder.config.scaling_factor).astype(config.dtype)
    picture = _decode(decoder, latents)[0]
    if not bool(jnp.isfinite(picture).all()):
        raise InputError(f"{folder}: paints no finite picture in {config.dtype}; try float32")
    return np.asarray(jnp.rint(255 * jnp.clip(0.5 * picture + 0.5, 0, 1))).astype(np.uint8)
