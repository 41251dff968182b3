"""Score distillation: losses whose gradient is what a diffusion prior would change.

DreamFusion (Poole et al. 2023, eq. 3): noise the rendering, ask the prior which noise it sees, and
move by `w(t) (noise_seen - noise_added)`, without differentiating the prior. The methods differ in
where the noise comes from; all else is one.
"""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol

import jax
import jax.numpy as jnp
from jax import Array, lax

from jaxphys.core.errors import InputError, nearest
from jaxphys.guidance.diffusion.inversion import invert_ddim
from jaxphys.guidance.diffusion.perp_neg import Negatives, steered
from jaxphys.guidance.diffusion.schedule import (
    Estimate,
    add_noise,
    expand,
    guided,
    interpret,
    rescaled,
)

Weight = Literal["sigma_squared", "uniform", "alpha_sigma_squared", "clean"]
WEIGHTS = ("sigma_squared", "uniform", "alpha_sigma_squared", "clean")
Method = Literal["sds", "ism"]
METHODS = ("sds", "ism")


@dataclass(frozen=True)
class DistillationConfig:
    """Choices of one distillation loss.

    Attributes:
        method: where the noise comes from. "sds": it is drawn (score distillation sampling, Poole
            et al. 2023). "ism": DDIM's steps without the prompt find it, from the sample to time s
            and one more to t; the gradient is then `w(t) (eps(x_t, t, prompt) - eps(x_s, s))` and
            holds no drawn noise (interval score matching, LucidDreamer, Liang et al. 2024). It
            asks the prior `inversion` + 3 times where "sds" asks 2.
        interval: of "ism", t - s; less near the lowest times, see `interval_times`.
        inversion: of "ism", the steps from the sample to s, at least 1.
        perp_neg: whether guides that know views move away from those that a picture must not show,
            see `view_prompts`; such a step asks the prior twice more.
        guidance: classifier-free guidance, `u + s (c - u)`; 1 is none.
        rescale: how much of the guided estimate's spread is brought back, in [0, 1].
        weight: w(t) of the gradient. "sigma_squared" sigma^2 (DreamFusion, GSGEN); "uniform" 1;
            "alpha_sigma_squared" alpha sigma^2 (Fantasia3D); "clean" sigma / alpha, which makes the
            gradient the difference of the sample and its clean estimate (as HiFA's image loss).
        time: (lowest, highest at the start, highest at the end) of the noise level, in [0, 1]: the
            range is annealed linearly with progress.
        clip: largest length of one pixel's or point's gradient; None for no limit.
        limit: clean estimates are clipped to [-limit, limit], the range of the data.
    """

    guidance: float = 7.5
    rescale: float = 0.5
    weight: Weight = "sigma_squared"
    time: tuple[float, float, float] = (0.02, 0.98, 0.5)
    clip: float | None = None
    limit: float | None = 1.0
    method: Method = "sds"
    interval: float = 0.05
    inversion: int = 4
    perp_neg: bool = False

    def __post_init__(self):
        if self.method not in METHODS:
            raise InputError(f"unknown method {self.method!r}: {nearest(self.method, METHODS)}")
        if not 0.0 < self.interval < 1.0:
            raise InputError(f"interval = {self.interval}: must be between 0 and 1")
        if self.inversion < 1:
            raise InputError(f"inversion = {self.inversion}: needs at least one step")
        if self.weight not in WEIGHTS:
            raise InputError(f"unknown weight {self.weight!r}: {nearest(self.weight, WEIGHTS)}")
        lowest, start, end = self.time
        if not 0.0 < lowest <= min(start, end) or max(start, end) >= 1.0:
            raise InputError(f"time {self.time} must satisfy 0 < lowest <= highest < 1")


class Distillation(NamedTuple):
    """A loss and what it was made of.

    value: scalar; only its gradient means anything. gradient: g, of the samples' shape, before the
    division by the batch. clean: the prior's guided clean estimate, detached. time: (B,).
    """

    value: Array
    gradient: Array
    clean: Array
    time: Array


def weight_of(kind: Weight, alpha: Array, sigma: Array) -> Array:
    """w(t), see `DistillationConfig`."""
    if kind == "sigma_squared":
        return sigma**2
    if kind == "alpha_sigma_squared":
        return alpha * sigma**2
    if kind == "clean":
        return sigma / alpha
    return jnp.ones_like(alpha)


class Prior(Protocol):
    """A network that denoises at `schedule`; what it predicts is `config.kind`, a `Kind`."""

    config: Any
    schedule: Any

    def __call__(self, noisy: Array, time: Array, condition: Any, /) -> Array:
        """Predicts it for `noisy` (B, ...) at `time` (B,) in [0, 1]."""


def draw_time(key: Array, count: int, config: DistillationConfig, progress: Array | float) -> Array:
    """(B,) noise levels, one in each equal part of the range that `progress` in [0, 1] leaves."""
    lowest, start, end = config.time
    highest = start + (end - start) * jnp.clip(progress, 0.0, 1.0)
    dtype = jnp.result_type(highest, jnp.float32)
    place = (jnp.arange(count, dtype=dtype) + jax.random.uniform(key, (count,), dtype)) / count
    return lowest + (highest - lowest) * place


def interval_times(time: Array, config: DistillationConfig) -> Array:
    """(inversion + 2, B) rising: from half the lowest time in equal steps to s = t - interval, or
    to that half if s would be below, then t (B,)."""
    begin = 0.5 * config.time[0]
    before = jnp.maximum(time - config.interval, begin)
    ramp = jnp.linspace(0.0, 1.0, config.inversion + 1, dtype=time.dtype)[:, None]
    return jnp.concatenate([begin + ramp * (before - begin), time[None]])


def _limited(
    prior: Prior, clean: Array, noisy: Array, time: Array, limit: float | None
) -> Estimate:
    if limit is not None:
        clean = jnp.clip(clean, -limit, limit)
    return interpret(prior.schedule, "clean", clean, noisy, time)


def untold_estimate(
    prior: Prior, noisy: Array, time: Array, unconditional: Any, limit: float | None
) -> Estimate:
    """Clean sample and noise as the prior sees them without the prompt, clipped."""
    prediction = prior(noisy, time, unconditional)
    clean = interpret(prior.schedule, prior.config.kind, prediction, noisy, time).clean
    return _limited(prior, clean, noisy, time, limit)


def guided_estimate(
    prior: Prior,
    noisy: Array,
    time: Array,
    condition: Any,
    unconditional: Any,
    config: DistillationConfig,
    negatives: Negatives | None = None,
) -> Estimate:
    """Clean sample and noise as the guided prior sees them, clipped and rescaled."""
    kind, schedule = prior.config.kind, prior.schedule
    others = negatives.conditions if negatives is not None else ()
    asked = (condition, unconditional, *others)
    every = jax.tree.map(lambda *parts: jnp.concatenate(parts), *asked)
    places, times = (jnp.concatenate([part] * len(asked)) for part in (noisy, time))
    told, untold, *unwanted = jnp.split(prior(places, times, every), len(asked))
    if negatives is None:
        steered_by = guided(told, untold, config.guidance)
    else:
        weights = negatives.weights.astype(told.dtype)
        steered_by = steered(told, untold, tuple(unwanted), weights, config.guidance)
    clean = interpret(schedule, kind, steered_by, noisy, time).clean
    if config.rescale:
        conditional = interpret(schedule, kind, told, noisy, time).clean
        clean = rescaled(clean, conditional, config.rescale)
    return _limited(prior, clean, noisy, time, config.limit)


def score_distillation(
    prior: Prior,
    samples: Array,
    condition: Any,
    unconditional: Any,
    key: Array,
    config: DistillationConfig,
    progress: Array | float = 0.0,
    negatives: Negatives | None = None,
) -> Distillation:
    """The score-distillation loss of (B, ...) samples in the prior's frame.

    Its gradient with respect to the samples is g / B, g = w(t) (noise_seen - noise_added), and is
    zero with respect to all else: the loss is `0.5 |x - stop(x - g)|^2 / B`. With `negatives` the
    prior's guidance steers clear of them.
    """
    count = samples.shape[0]
    time_key, noise_key = jax.random.split(key)
    time = draw_time(time_key, count, config, progress).astype(samples.dtype)
    fixed = lax.stop_gradient(samples)
    if config.method == "ism":
        noisy, noise = invert_ddim(
            lambda noisy, time: untold_estimate(prior, noisy, time, unconditional, config.limit),
            prior.schedule,
            fixed,
            interval_times(time, config),
        )
    else:
        noise = jax.random.normal(noise_key, samples.shape, samples.dtype)
        noisy = add_noise(prior.schedule, fixed, noise, time)
    estimate = guided_estimate(prior, noisy, time, condition, unconditional, config, negatives)
    weight = weight_of(config.weight, *prior.schedule.alpha_sigma(time))
    gradient = expand(weight, samples) * (estimate.noise - noise)
    if config.clip is not None:
        length = jnp.sqrt(jnp.sum(gradient**2, -1, keepdims=True))
        gradient = gradient * (config.clip / jnp.maximum(length, config.clip))
    gradient = lax.stop_gradient(gradient)
    value = 0.5 * jnp.sum((samples - (fixed - gradient)) ** 2) / count
    return Distillation(value, gradient, lax.stop_gradient(estimate.clean), time)
