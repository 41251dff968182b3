"""Continuous-time Gaussian diffusion: schedule, parametrisations, guidance.

A noisy sample is `x_t = alpha(t) x + sigma(t) eps`, `alpha^2 + sigma^2 = 1`, with time in [0, 1].
Kingma & Gao 2023 and Karras et al. 2022 (EDM) give the common view that is used here.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError

Kind = Literal["clean", "noise", "velocity"]


@dataclass(frozen=True)
class Schedule:
    """Cosine schedule (Nichol & Dhariwal 2021; continuous form of Salimans & Ho 2022), shifted.

    `sigma / alpha = tan(pi t / 2) / shift`. A shift below 1 spends more of [0, 1] at high noise,
    which data with much redundancy needs (Hoogeboom et al. 2023, eq. 4: log-SNR + 2 log shift).
    """

    shift: float = 1.0

    def alpha_sigma(self, time: Array) -> tuple[Array, Array]:
        """Signal and noise scale at `time` in [0, 1]; same shape as `time`."""
        signal = self.shift * jnp.cos(0.5 * jnp.pi * time)
        noise = jnp.sin(0.5 * jnp.pi * time)
        length = jnp.sqrt(signal**2 + noise**2)
        return signal / length, noise / length

    def log_snr(self, time: Array) -> Array:
        """log(alpha^2 / sigma^2): falls from +inf at 0 to -inf at 1."""
        alpha, sigma = self.alpha_sigma(time)
        return 2.0 * (jnp.log(alpha) - jnp.log(sigma))

    def time_of_ratio(self, ratio: Array) -> Array:
        """Time at which sigma / alpha equals `ratio` >= 0 (inverse of the schedule)."""
        return jnp.arctan(ratio * self.shift) * (2.0 / jnp.pi)


class SignalAndNoise(Protocol):
    """Any schedule, continuous or discrete."""

    def alpha_sigma(self, time: Array) -> tuple[Array, Array]:
        """Signal and noise scale at `time` in [0, 1]; same shape as `time`."""


class Estimate(NamedTuple):
    """What a network believes of a noisy sample; both of the sample's shape."""

    clean: Array
    noise: Array


def expand(scale: Array, like: Array) -> Array:
    """(B,) to (B, 1, ..., 1) so that it broadcasts against `like` (B, ...), in its dtype."""
    return scale.reshape(scale.shape + (1,) * (like.ndim - scale.ndim)).astype(like.dtype)


def add_noise(schedule: SignalAndNoise, clean: Array, noise: Array, time: Array) -> Array:
    """x_t = alpha x + sigma eps for (B, ...) samples and (B,) times."""
    alpha, sigma = schedule.alpha_sigma(time)
    return expand(alpha, clean) * clean + expand(sigma, clean) * noise


def velocity(schedule: SignalAndNoise, clean: Array, noise: Array, time: Array) -> Array:
    """v = alpha eps - sigma x (Salimans & Ho 2022, appendix D)."""
    alpha, sigma = schedule.alpha_sigma(time)
    return expand(alpha, clean) * noise - expand(sigma, clean) * clean


def interpret(
    schedule: SignalAndNoise,
    kind: Kind,
    prediction: Array,
    noisy: Array,
    time: Array,
    *,
    smallest_scale: float = 1e-3,
) -> Estimate:
    """Clean sample and noise from a network output of any kind.

    `smallest_scale` bounds the divisors alpha and sigma away from zero at the ends of [0, 1], where
    the quantity asked for is not determined by the one predicted.
    """
    alpha, sigma = (expand(s, noisy) for s in schedule.alpha_sigma(time))
    if kind == "velocity":
        return Estimate(alpha * noisy - sigma * prediction, sigma * noisy + alpha * prediction)
    if kind == "clean":
        return Estimate(
            prediction, (noisy - alpha * prediction) / jnp.maximum(sigma, smallest_scale)
        )
    if kind == "noise":
        return Estimate(
            (noisy - sigma * prediction) / jnp.maximum(alpha, smallest_scale), prediction
        )
    raise InputError(f"unknown prediction kind {kind!r}: use 'clean', 'noise' or 'velocity'")


def guided(conditional: Array, unconditional: Array, scale: float | Array) -> Array:
    """Classifier-free guidance (Ho & Salimans 2022), `u + s (c - u)`: 1 is the conditional model.

    Linear, and so the same rule for clean, noise and velocity predictions at one noisy sample.
    """
    return unconditional + scale * (conditional - unconditional)


def rescaled(guided_clean: Array, conditional_clean: Array, strength: float | Array) -> Array:
    """Bring the guided sample's spread back to the conditional one's (Lin et al. 2024, eq. 15-16).

    strength: 0 leaves it, 1 matches the standard deviation of each sample exactly. This is what
    keeps strong guidance from oversaturating.
    """
    axes = tuple(range(1, guided_clean.ndim))
    wanted = jnp.std(conditional_clean, axis=axes, keepdims=True)
    found = jnp.std(guided_clean, axis=axes, keepdims=True)
    ratio = wanted / jnp.maximum(found, jnp.finfo(guided_clean.dtype).tiny ** 0.5)
    return guided_clean * (1.0 + strength * (ratio - 1.0))
