"""Samplers of continuous-time diffusion: from noise to what a denoiser takes for clean."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array, lax

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.schedule import Estimate, Schedule, SignalAndNoise

Denoise = Callable[[Array, Array], Array]
"""(noisy (B, ...), time (B,)) -> estimate of the clean sample (B, ...)."""
EstimateAt = Callable[[Array, Array], Estimate]
"""(noisy (B, ...), time (B,)) -> estimates of the clean sample and of the noise."""


def karras_ratios(steps: int, largest: float, smallest: float, rho: float) -> Array:
    """(steps,) ratios sigma / alpha falling from `largest` to `smallest`, as EDM's eq. 5."""
    if steps < 1:
        raise InputError(f"sampling needs at least one step, got {steps}")
    ramp = jnp.linspace(0.0, 1.0, steps)
    return (largest ** (1 / rho) + ramp * (smallest ** (1 / rho) - largest ** (1 / rho))) ** rho


def karras_times(
    schedule: Schedule, steps: int, largest: float, smallest: float, rho: float
) -> Array:
    """(steps + 1,) times falling to 0, at `karras_ratios`."""
    ratios = karras_ratios(steps, largest, smallest, rho)
    return jnp.concatenate([schedule.time_of_ratio(ratios), jnp.zeros(1)])


def _as_batch(time: Array, noisy: Array) -> Array:
    return jnp.full(noisy.shape[:1], time, noisy.dtype)


def sample_ddim(
    estimate: EstimateAt,
    schedule: SignalAndNoise,
    noisy: Array,
    times: Array,
    reached: Array,
    *,
    key: Array | None = None,
    eta: float = 0.0,
) -> Array:
    """DDIM (Song et al. 2021, eq. 12 and 16): from each of `times` to the one in `reached`.

    Args:
        estimate: what the network believes, asked once a step.
        noisy: (B, ...) sample at `times[0]`.
        times: (steps,) falling.
        reached: (steps,) where each step leads, not always exactly where the next one starts.
        eta: 0 deterministic, 1 ancestral (then `key` is needed).
    """
    if eta and key is None:
        raise InputError("sample_ddim with eta > 0 draws noise: give it a key")

    def step(noisy: Array, spans: tuple[Array, Array, Array]) -> tuple[Array, None]:
        now, later, index = spans
        alpha, sigma = (s.astype(noisy.dtype) for s in schedule.alpha_sigma(now))
        alpha_next, sigma_next = (s.astype(noisy.dtype) for s in schedule.alpha_sigma(later))
        clean, noise = estimate(noisy, _as_batch(now, noisy))
        if eta and key is not None:
            kept = jnp.maximum(1.0 - (alpha / alpha_next) ** 2, 0.0)
            fresh = jnp.minimum(eta * sigma_next / sigma * jnp.sqrt(kept), sigma_next)
            drawn = jax.random.normal(jax.random.fold_in(key, index), noisy.shape, noisy.dtype)
            noise = jnp.sqrt(sigma_next**2 - fresh**2) * noise + fresh * drawn
        else:
            noise = sigma_next * noise
        return alpha_next * clean + noise, None

    return lax.scan(step, noisy, (times, reached, jnp.arange(len(times))))[0]


def sample_heun(denoise: Denoise, schedule: SignalAndNoise, noisy: Array, times: Array) -> Array:
    """Second-order deterministic sampler (Karras et al. 2022, algorithm 1) in x / alpha.

    noisy: (B, ...) sample at `times[0]` (in the variance-preserving scaling). The last interval,
    which ends at time 0, is one Euler step, as there.
    """
    noisy_dtype = noisy.dtype

    def scales(time: Array) -> tuple[Array, Array]:
        alpha, sigma = schedule.alpha_sigma(time)
        return alpha.astype(noisy_dtype), (sigma / alpha).astype(noisy_dtype)

    def slope(scaled: Array, time: Array) -> Array:
        alpha, ratio = scales(time)
        return (scaled - denoise(alpha * scaled, _as_batch(time, scaled))) / ratio

    def step(scaled: Array, span: tuple[Array, Array]) -> tuple[Array, None]:
        now, later = span
        length = scales(later)[1] - scales(now)[1]
        first = slope(scaled, now)
        second = slope(scaled + length * first, later)
        return scaled + 0.5 * length * (first + second), None

    scaled = noisy / scales(times[0])[0]
    scaled, _ = lax.scan(step, scaled, (times[:-2], times[1:-1]))
    last = times[-2]
    return denoise(scales(last)[0] * scaled, _as_batch(last, scaled))
