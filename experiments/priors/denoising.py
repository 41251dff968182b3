"""The loss of a diffusion network and its held-out error, whatever it diffuses."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.guidance.diffusion.schedule import add_noise, interpret
from jaxphys.networks.parameters import with_parameters

Batch = dict[str, Any]
Prepare = Callable[[Batch, Array], tuple[Array, Any]]
EVALUATION_TIMES = (0.1, 0.3, 0.5, 0.7, 0.9)
UNTOLD = 0.1  # share of samples that are told nothing


def silence(condition: Any, keep: Array) -> Any:
    """The condition without its text where `keep` (B,) is false."""
    return condition._replace(text=condition.text * keep[:, None, None])


def denoising_error(
    module: nnx.Module, clean: Array, condition: Any, noise: Array, times: Array
) -> tuple[Array, Array]:
    """Mean squared error per sample of the velocity and of the clean sample, (B,) each.

    The velocity's is the clean one's divided by sigma^2 (Salimans & Ho 2022), for which sigma is
    kept from 0.05 up.
    """
    schedule = module.schedule
    noisy = add_noise(schedule, clean, noise, times)
    prediction = module(noisy, times, condition)
    estimate = interpret(schedule, module.config.kind, prediction, noisy, times)
    axes = tuple(range(1, clean.ndim))
    error = jnp.mean((estimate.clean - clean) ** 2, axes)
    sigma = schedule.alpha_sigma(times)[1]
    return error / jnp.maximum(sigma, 0.05) ** 2, error


def spread_times(key: Array, count: int, latest: float = 1.0) -> Array:
    """One time in each of `count` equal parts of [0, latest] (Kingma et al. 2021), shuffled."""
    shuffle, offset = jax.random.split(key)
    times = latest * (jnp.arange(count) + jax.random.uniform(offset, (count,))) / count
    return jax.random.permutation(shuffle, times)


def denoising_loss(prepare: Prepare, latest: float = 1.0):
    """A function (module, batch, key) -> loss; `prepare` makes (clean samples, condition), and
    noise levels go up to `latest`.
    """

    def loss(module: nnx.Module, batch: Batch, key: Array) -> Array:
        ready, told, noise, times = jax.random.split(key, 4)
        clean, condition = prepare(batch, ready)
        condition = silence(condition, jax.random.uniform(told, clean.shape[:1]) > UNTOLD)
        drawn = jax.random.normal(noise, clean.shape)
        velocity, _ = denoising_error(
            module, clean, condition, drawn, spread_times(times, clean.shape[0], latest)
        )
        return velocity.mean()

    return loss


def denoising_evaluator(module: nnx.Module, prepare: Prepare, held_out: Batch):
    """A function of parameters: held-out error of the clean sample by noise level, with the text
    and without.
    """

    @jax.jit
    def errors(parameters: dict[str, Array], batch: Batch, time: Array) -> tuple[Array, Array]:
        filled = with_parameters(module, parameters)
        ready, noise = jax.random.split(jax.random.key(17))
        clean, condition = prepare(batch, ready)
        count = clean.shape[0]
        drawn, times = jax.random.normal(noise, clean.shape), jnp.full((count,), time)
        nothing = silence(condition, jnp.zeros((count,), bool))
        _, told = denoising_error(filled, clean, condition, drawn, times)
        _, untold = denoising_error(filled, clean, nothing, drawn, times)
        return told.mean(), untold.mean()

    def evaluate(parameters: dict[str, Array]) -> dict[str, dict[str, float]]:
        rows = {t: errors(parameters, held_out, jnp.float32(t)) for t in EVALUATION_TIMES}
        return {
            "held_out": {str(t): round(float(told), 6) for t, (told, _) in rows.items()},
            "held_out_no_text": {
                str(t): round(float(untold), 6) for t, (_, untold) in rows.items()
            },
        }

    return evaluate
