"""The bundled guides' distillations: gradients reach the samples and nothing else."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx

from jaxphys.guidance.bundled.pixel_guide import (
    PixelGuide,
    bundled_image_guide,
    image_distillation,
)
from jaxphys.guidance.bundled.pixel_prior import PixelCondition, PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.point_guide import point_distillation
from jaxphys.guidance.bundled.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.schedule import add_noise, interpret
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.view_prompts import unwanted_views
from jaxphys.guidance.views import view_features
from jaxphys.networks.parameters import named_parameters, with_parameters

LEVELS = (0.4, 0.6, 0.6)


def test_image_distillation_reaches_pictures_only():
    config = PixelPriorConfig(
        resolution=16, patch=4, text=12, width=32, layers=1, head_width=16, hidden=32, rank=4
    )
    prior = PixelPrior(config, rngs=nnx.Rngs(0))
    rng = np.random.default_rng(0)
    images = jnp.asarray(rng.uniform(size=(2, 16, 16, 3)), jnp.float32)
    text = jnp.ones((2, 1, 12), jnp.float32) / 12**0.5
    view = jnp.asarray(view_features(jnp.array([0.1, 2.0]), jnp.array([0.3, 0.3])), jnp.float32)

    def loss(images, text):
        return image_distillation(
            prior, images, text, view, jax.random.key(0), DistillationConfig()
        ).value

    to_images, to_text = jax.jit(jax.grad(loss, (0, 1)))(images, text)
    assert np.isfinite(to_images).all() and np.abs(to_images).max() > 0
    np.testing.assert_array_equal(to_text, 0.0)


def test_guidance_moves_away_from_what_is_negative():
    """g = w (n + s (c - n) - noise): the negative prompt stands where no prompt stood; and Perp-Neg
    asks of the front and the side what `unwanted_views` says."""
    config = PixelPriorConfig(
        resolution=16, patch=4, text=12, width=32, layers=1, head_width=16, hidden=32, rank=4
    )
    prior = PixelPrior(config, rngs=nnx.Rngs(0))
    # A new prior's last layer is zero, and answers the same to all.
    prior = with_parameters(
        prior,
        {
            name: jax.random.normal(jax.random.key(n), value.shape, value.dtype) / 4
            for n, (name, value) in enumerate(sorted(named_parameters(prior).items()))
        },
    )
    rng = np.random.default_rng(0)
    images = jnp.asarray(rng.uniform(size=(2, 16, 16, 3)), jnp.float32)
    text, negative = (jnp.asarray(rng.normal(size=(1, 12)), jnp.float32) for _ in range(2))
    turns = (jnp.array([0.4, -2.0], jnp.float32), jnp.array([0.3, 0.3], jnp.float32))
    key = jax.random.key(0)
    plain = DistillationConfig(guidance=5.0, rescale=0.0, limit=None, weight="uniform", time=LEVELS)

    def distil(negative=None, perp_neg=False):
        guide = PixelGuide(prior, text, negative)
        return guide.distil(images, *turns, key, replace(plain, perp_neg=perp_neg), 0.0)

    def seen(text, azimuth):
        """The noise that the prior sees, told a text and a view; and the noise that was added."""
        found = distil()
        noise = jax.random.normal(jax.random.split(key)[1], images.shape, images.dtype)
        noisy = add_noise(prior.schedule, 2 * images - 1, noise, found.time)
        view = jnp.asarray(view_features(azimuth, turns[1], xp=jnp), jnp.float32)
        told = PixelCondition(jnp.broadcast_to(text, (2, 1, 12)), view)
        answer = prior(noisy, found.time, told)
        return interpret(prior.schedule, "clean", answer, noisy, found.time).noise, noise

    told, noise = seen(text, turns[0])
    for other, found in ((jnp.zeros((1, 12)), distil()), (negative, distil(negative))):
        untold, _ = seen(other, turns[0])
        expected = untold + 5.0 * (told - untold) - noise
        np.testing.assert_allclose(found.gradient, expected, atol=1e-3 * np.abs(expected).max())
        assert np.abs(5.0 * (told - untold)).max() > 0.02 * np.abs(expected).max()

    untold, _ = seen(jnp.zeros((1, 12)), turns[0])
    wanted, away = told - untold, jnp.zeros_like(told)
    views = (jnp.zeros(2), jnp.array([np.pi / 2, -np.pi / 2]))
    for weight, azimuth in zip(unwanted_views(*turns), views, strict=True):
        other = seen(text, azimuth)[0] - untold
        along = (other * wanted).sum((1, 2, 3)) / (wanted**2).sum((1, 2, 3))
        beside = other - along[:, None, None, None] * wanted
        away = away + weight[:, None, None, None] * beside
    expected = untold + 5.0 * (wanted - away) - noise
    largest = np.abs(expected).max()
    assert np.abs(5.0 * away).max() > 0.02 * largest
    np.testing.assert_allclose(distil(perp_neg=True).gradient, expected, atol=1e-3 * largest)


def test_bundled_priors_read_a_negative_prompt():
    guide = bundled_image_guide("a mug", "a red cake")
    expected = prompt_embeddings("a red cake", guide.prior.config.phrases)
    np.testing.assert_array_equal(guide.negative, expected)
    assert bundled_image_guide("a mug", " ").negative is None


def test_point_distillation_reaches_points_and_colours_only():
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
    text = jnp.ones((1, 12), jnp.float32) / 12**0.5

    def loss(points, colours, text):
        config = DistillationConfig()
        return point_distillation(prior, points, colours, text, jax.random.key(0), config).value

    to_points, to_colours, to_text = jax.jit(jax.grad(loss, (0, 1, 2)))(points, colours, text)
    for part in (to_points, to_colours):
        assert np.isfinite(part).all() and np.all(np.abs(part).max(1) > 0)
    np.testing.assert_array_equal(to_text, 0.0)
