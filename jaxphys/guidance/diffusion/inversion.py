"""DDIM inversion: the noise in which a deterministic sampler would have found a clean sample."""

import jax.numpy as jnp
from jax import Array, lax

from jaxphys.guidance.diffusion.samplers import EstimateAt
from jaxphys.guidance.diffusion.schedule import SignalAndNoise, expand


def invert_ddim(
    estimate: EstimateAt, schedule: SignalAndNoise, samples: Array, times: Array
) -> tuple[Array, Array]:
    """DDIM's steps (Song et al. 2021, eq. 13) taken towards more noise, one for each pair of times.

    They follow the probability flow, whose paths do not cross: no noise is drawn. An error of first
    order in the length of the steps is left.

    Args:
        estimate: what the network believes, asked once a step.
        samples: (B, ...) clean. The first step takes them for samples at `times[0]` that happen to
            hold no noise: at no noise at all a network that predicts clean samples says nothing of
            the noise.
        times: (steps + 1, B) rising, the first above 0.

    Returns:
        The samples (B, ...) at `times[-1]`, and the noise that was seen in them at `times[-2]`.
    """

    def step(state: tuple[Array, Array], span: tuple[Array, Array]):
        now, later = span
        clean, noise = estimate(state[0], now)
        alpha, sigma = (expand(s, samples) for s in schedule.alpha_sigma(later))
        return (alpha * clean + sigma * noise, noise), None

    start = expand(schedule.alpha_sigma(times[0])[0], samples) * samples
    return lax.scan(step, (start, jnp.zeros_like(start)), (times[:-1], times[1:]))[0]
