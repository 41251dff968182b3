"""The stochastic sampler of Karras et al. 2022 (EDM), which knows noise by its deviation sigma.

A noisy sample is x + sigma eps: the variance-preserving one of `diffusion` divided by alpha.
"""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array, lax

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.discrete_schedule import DiscreteSchedule
from jaxphys.guidance.diffusion.schedule import interpret

DenoiseAtSigma = Callable[[Array, Array], Array]
"""(noisy (B, ...), its sigma, a scalar) -> estimate of the clean sample (B, ...)."""
MOST_GROWTH = math.sqrt(2.0)


def sample_karras(
    denoise: DenoiseAtSigma,
    noise: Array,
    sigmas: Array,
    *,
    key: Array | None = None,
    churn: float = 0.0,
) -> Array:
    """Clean samples by Heun's steps between `sigmas` and a last one to 0 (EDM, algorithm 2).

    Args:
        denoise: evaluated twice a step, once in the last.
        noise: (B, ...) standard normal.
        sigmas: (steps,) falling, above 0.
        key: of the noise that churning adds; not needed without.
        churn: S_churn; each step first raises sigma by the factor 1 + min(churn / steps,
            sqrt(2) - 1) with fresh noise, which mends errors of the steps before. 0 for none.
    """
    if churn and key is None:
        raise InputError("sample_karras with churn > 0 draws noise: give it a key")
    steps = len(sigmas)
    sigmas = jnp.asarray(sigmas, noise.dtype)
    growth = min(1.0 + churn / steps, MOST_GROWTH)

    def churned(noisy: Array, sigma: Array, index: Array | int) -> tuple[Array, Array]:
        if not churn or key is None:
            return noisy, sigma
        drawn = jax.random.normal(jax.random.fold_in(key, index), noisy.shape, noisy.dtype)
        return noisy + math.sqrt(growth**2 - 1.0) * sigma * drawn, growth * sigma

    def slope(noisy: Array, sigma: Array) -> Array:
        return (noisy - denoise(noisy, sigma)) / sigma

    def step(noisy: Array, span: tuple[Array, Array, Array]) -> tuple[Array, None]:
        sigma, later, index = span
        noisy, sigma = churned(noisy, sigma, index)
        first = slope(noisy, sigma)
        second = slope(noisy + (later - sigma) * first, later)
        return noisy + 0.5 * (later - sigma) * (first + second), None

    spans = (sigmas[:-1], sigmas[1:], jnp.arange(steps - 1))
    noisy, _ = lax.scan(step, sigmas[0] * noise, spans)
    return denoise(*churned(noisy, sigmas[-1], steps - 1))


def discrete_denoiser(
    schedule: DiscreteSchedule, predict: DenoiseAtSigma, *, limit: float = 1.0
) -> DenoiseAtSigma:
    """A network that predicts noise at the steps of a schedule, as a denoiser at any sigma.

    Args:
        schedule: the network's own.
        predict: (variance-preserving noisy (B, ...), time (B,) of a step exactly) -> noise.
        limit: clean estimates are clipped to +- this.

    The step is the one below sigma, and its scales make the clean estimate, not those of sigma.
    """

    def denoise(noisy: Array, sigma: Array) -> Array:
        step = jnp.floor(schedule.step_of_ratio(sigma))
        time = jnp.full(noisy.shape[:1], step / (schedule.count - 1), noisy.dtype)
        noisy = noisy / jnp.sqrt(1.0 + sigma**2)
        clean = interpret(schedule, "noise", predict(noisy, time), noisy, time).clean
        return jnp.clip(clean, -limit, limit)

    return denoise
