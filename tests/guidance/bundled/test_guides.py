"""The bundled guides' distillations: gradients reach the samples and nothing else."""

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx

from jaxphys.guidance.bundled.pixel_guide import image_distillation
from jaxphys.guidance.bundled.pixel_prior import PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.point_guide import point_distillation
from jaxphys.guidance.bundled.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.views import view_features


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
