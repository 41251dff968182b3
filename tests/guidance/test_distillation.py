from types import SimpleNamespace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion import Schedule, expand
from jaxphys.guidance.distillation import (
    DistillationConfig,
    draw_time,
    image_distillation,
    point_distillation,
    score_distillation,
)
from jaxphys.guidance.pixel_prior import PixelPrior, PixelPriorConfig
from jaxphys.guidance.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.views import view_features

SPREAD = 0.4
PLAIN = DistillationConfig(guidance=1.0, rescale=0.0, limit=None)


class Told(NamedTuple):
    mean: jax.Array


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


def test_image_distillation_reaches_pictures_only():
    config = PixelPriorConfig(
        resolution=16, patch=4, text=12, width=32, layers=1, head_width=16, hidden=32, rank=4
    )
    prior = PixelPrior(config, rngs=nnx.Rngs(0))
    rng = np.random.default_rng(0)
    images = jnp.asarray(rng.uniform(size=(2, 16, 16, 3)), jnp.float32)
    text = jnp.ones((2, 12), jnp.float32) / 12**0.5
    view = jnp.asarray(view_features(jnp.array([0.1, 2.0]), jnp.array([0.3, 0.3])), jnp.float32)

    def loss(images, text):
        return image_distillation(prior, images, text, view, jax.random.key(0)).value

    to_images, to_text = jax.jit(jax.grad(loss, (0, 1)))(images, text)
    assert np.isfinite(to_images).all() and np.abs(to_images).max() > 0
    np.testing.assert_array_equal(to_text, 0.0)


def test_point_distillation_judges_a_random_subset_in_the_prior_frame():
    config = PointPriorConfig(
        text=12,
        width=32,
        latents=8,
        latent_width=32,
        blocks=1,
        latent_layers=1,
        head_width=16,
        hidden=32,
        latent_hidden=32,
        rank=4,
    )
    prior = PointPrior(config, rngs=nnx.Rngs(0))
    rng = np.random.default_rng(0)
    points = jnp.asarray(rng.uniform(-0.5, 0.5, (40, 3)), jnp.float32)
    colours = jnp.asarray(rng.uniform(0, 1, (40, 3)), jnp.float32)
    text = jnp.ones(12, jnp.float32) / 12**0.5

    def loss(points, colours, count):
        return point_distillation(
            prior, points, colours, text, jax.random.key(0), count=count, copies=1
        ).value

    some = jax.grad(loss, (0, 1))(points, colours, 10)
    every = jax.grad(loss, (0, 1))(points, colours, None)
    for part, whole in zip(some, every, strict=True):
        assert np.isfinite(whole).all()
        assert np.sum(np.abs(part).max(1) > 0) == 10
        assert np.sum(np.abs(whole).max(1) > 0) == 40
