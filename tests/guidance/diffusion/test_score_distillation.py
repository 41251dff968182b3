from types import SimpleNamespace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.schedule import Schedule, expand
from jaxphys.guidance.diffusion.score_distillation import (
    DistillationConfig,
    draw_time,
    score_distillation,
)

SPREAD = 0.4
PLAIN = DistillationConfig(guidance=1.0, rescale=0.0, limit=None)


class Told(NamedTuple):
    mean: Array


class GaussianPrior:
    """The exact denoiser of N(mean, SPREAD^2), the mean being the condition."""

    def __init__(self, kind):
        self.config = SimpleNamespace(kind=kind)
        self.schedule = Schedule()

    def __call__(self, noisy, time, condition):
        alpha, sigma = (expand(s, noisy) for s in self.schedule.alpha_sigma(time))
        gain = alpha * SPREAD**2 / (alpha**2 * SPREAD**2 + sigma**2)
        clean = condition.mean + gain * (noisy - alpha * condition.mean)
        noise = (noisy - alpha * clean) / sigma
        kinds = {"clean": clean, "noise": noise, "velocity": alpha * noise - sigma * clean}
        return kinds[self.config.kind]


def setting():
    rng = np.random.default_rng(0)
    samples = jnp.asarray(rng.normal(size=(6, 5)))
    told = Told(jnp.full((6, 5), 0.3))
    return samples, told, Told(jnp.zeros((6, 5)))


@pytest.mark.parametrize("kind", ["clean", "noise", "velocity"])
def test_gradient_is_the_closed_form_for_a_gaussian_prior(kind):
    samples, told, untold = setting()
    key = jax.random.key(4)

    def loss(samples):
        found = score_distillation(GaussianPrior(kind), samples, told, untold, key, PLAIN)
        return found.value, found

    gradient, found = jax.grad(loss, has_aux=True)(samples)
    alpha, sigma = (s[:, None] for s in Schedule().alpha_sigma(found.time))
    noise = jax.random.normal(jax.random.split(key)[1], samples.shape, samples.dtype)
    # noise_seen = sigma (x_t - alpha mean) / (alpha^2 s^2 + sigma^2), from the marginal's score
    noisy = alpha * samples + sigma * noise
    seen = sigma * (noisy - alpha * told.mean) / (alpha**2 * SPREAD**2 + sigma**2)
    np.testing.assert_allclose(gradient, sigma**2 * (seen - noise) / len(samples), atol=1e-9)


def test_expected_gradient_points_from_the_mean():
    """Over the noise, E[noise_seen - noise] = sigma alpha (x - mean) / (alpha^2 s^2 + sigma^2)."""
    told = Told(jnp.full((20000, 1), 0.3))
    samples = jnp.full((20000, 1), 0.9)
    config = DistillationConfig(
        guidance=1.0, rescale=0.0, limit=None, weight="uniform", time=(0.499, 0.5, 0.5)
    )
    found = score_distillation(
        GaussianPrior("velocity"), samples, told, told, jax.random.key(0), config
    )
    alpha, sigma = Schedule().alpha_sigma(jnp.array(0.4995))
    wanted = sigma * alpha * 0.6 / (alpha**2 * SPREAD**2 + sigma**2)
    np.testing.assert_allclose(found.gradient.mean(), wanted, rtol=0.03)


def test_descent_reaches_the_guided_mean():
    samples, told, untold = setting()
    prior = GaussianPrior("velocity")

    @jax.jit
    def step(samples, key):
        return jax.grad(
            lambda s: score_distillation(prior, s, told, untold, key, PLAIN, 1.0).value
        )(samples)

    for index in range(300):
        samples = samples - 0.5 * step(samples, jax.random.key(index))
    assert np.abs(samples.mean() - 0.3) < 0.08


def test_weight_clean_gives_the_difference_to_the_clean_estimate():
    samples, told, untold = setting()
    config = DistillationConfig(guidance=4.0, rescale=0.5, weight="clean", time=(0.3, 0.7, 0.7))
    found = score_distillation(
        GaussianPrior("noise"), samples, told, untold, jax.random.key(1), config
    )
    np.testing.assert_allclose(found.gradient, samples - found.clean, atol=1e-9)
    assert np.abs(found.clean).max() <= 1.0


def test_guidance_moves_the_estimate_away_from_the_unconditional():
    samples, told, untold = setting()
    means = [
        score_distillation(
            GaussianPrior("velocity"),
            samples,
            told,
            untold,
            jax.random.key(2),
            DistillationConfig(guidance=scale, rescale=0.0, limit=None),
        ).clean.mean()
        for scale in (0.0, 1.0, 3.0)
    ]
    np.testing.assert_allclose(means[2] - means[0], 3 * (means[1] - means[0]), rtol=1e-9)
    assert means[0] < means[1] < means[2]


def test_times_are_spread_and_annealed():
    config = DistillationConfig(time=(0.02, 0.98, 0.5))
    early = draw_time(jax.random.key(0), 50, config, 0.0)
    late = draw_time(jax.random.key(0), 50, config, 1.0)
    assert 0.02 <= early.min() < 0.05 and 0.95 < early.max() <= 0.98
    assert late.max() <= 0.5
    assert np.all(np.diff(early) > 0)


def test_clip_bounds_each_gradient():
    samples, told, untold = setting()
    config = DistillationConfig(guidance=50.0, rescale=0.0, limit=None, clip=0.1)
    found = score_distillation(
        GaussianPrior("velocity"), samples, told, untold, jax.random.key(3), config
    )
    assert np.linalg.norm(found.gradient, axis=-1).max() <= 0.1 + 1e-9


def test_bad_choices_are_refused():
    with pytest.raises(InputError, match="did you mean"):
        DistillationConfig(weight="sigma_square")
    with pytest.raises(InputError, match="lowest"):
        DistillationConfig(time=(0.5, 0.4, 0.3))
