import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys import weights
from jaxphys.guidance.bundled import shape_guide
from jaxphys.guidance.bundled.latent_guide import LatentGuide
from jaxphys.guidance.bundled.latent_prior import LatentPrior, LatentPriorConfig
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, ShapeAutoencoder
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig


@pytest.fixture(scope="module")
def guide():
    small = AutoencoderConfig(
        width=16,
        side=2,
        channels=4,
        cells=4,
        features=4,
        head_width=8,
        hidden=16,
        reading=1,
        writing=1,
        answer=8,
    )
    prior = LatentPriorConfig(
        latents=8,
        channels=4,
        text=12,
        phrases=1,
        width=16,
        layers=1,
        head_width=8,
        hidden=16,
        rank=4,
    )
    return LatentGuide(
        ShapeAutoencoder(small, rngs=nnx.Rngs(0)),
        LatentPrior(prior, rngs=nnx.Rngs(1)),
        jnp.ones((2, 12)) / 12**0.5,
    )


def test_distillation_reaches_points_and_colours_only(guide):
    rng = np.random.default_rng(0)
    points = jnp.asarray(rng.uniform(-0.5, 0.5, (60, 3)), jnp.float32)
    colours = jnp.asarray(rng.uniform(size=(60, 3)), jnp.float32)

    @nnx.jit
    def slopes(guide, points, colours, text):
        def loss(points, colours, text):
            told = guide._replace(text=text)
            key = jax.random.key(0)
            return told.distil(points, colours, key, DistillationConfig(), 0.0).value

        return jax.grad(loss, (0, 1, 2))(points, colours, text)

    to_points, to_colours, to_text = slopes(guide, points, colours, guide.text)
    for part in (to_points, to_colours):
        assert np.isfinite(part).all() and np.mean(np.abs(part).max(1) > 0) > 0.9
    np.testing.assert_array_equal(to_text, 0.0)


def test_points_are_drawn_until_latents_are_trained(monkeypatch):
    monkeypatch.setattr(weights, "manifest", lambda: {"point_prior": {}, "latent_prior": {}})
    assert shape_guide.shape_weights() == ("point_prior",)
    both = {"latent_prior": {}, "shape_autoencoder": {}}
    monkeypatch.setattr(weights, "manifest", lambda: both)
    assert shape_guide.shape_weights() == ("shape_autoencoder", "latent_prior")
