import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.guidance.bundled.latent_prior import (
    LatentCondition,
    LatentPrior,
    LatentPriorConfig,
    LatentSampling,
    sample_latents,
)
from jaxphys.networks.parameters import named_parameters, with_parameters

TINY = LatentPriorConfig(
    latents=5,
    channels=3,
    text=12,
    phrases=2,
    width=32,
    layers=2,
    head_width=16,
    hidden=32,
    rank=4,
)


@pytest.fixture(scope="module")
def prior():
    """Every parameter random: at initialisation all outputs are zero."""
    rng = np.random.default_rng(0)
    module = LatentPrior(TINY, rngs=nnx.Rngs(0))
    parameters = {
        name: jnp.asarray(0.2 * rng.normal(size=value.shape), jnp.float32)
        for name, value in named_parameters(module).items()
    }
    return with_parameters(module, parameters)


def inputs():
    rng = np.random.default_rng(1)
    noisy = jnp.asarray(rng.normal(size=(2, 5, 3)), jnp.float32)
    text = jnp.asarray(rng.normal(size=(2, 3, 12)) / 12**0.5, jnp.float32)
    return noisy, jnp.array([0.3, 0.7], jnp.float32), LatentCondition(text)


def test_starts_from_zero():
    noisy, time, condition = inputs()
    found = LatentPrior(TINY, rngs=nnx.Rngs(0))(noisy, time, condition)
    assert found.shape == noisy.shape and found.dtype == jnp.float32
    np.testing.assert_array_equal(found, 0.0)


@pytest.mark.parametrize("row", [0, 1, 2])
def test_every_phrase_counts(prior, row):
    noisy, time, condition = inputs()
    changed = LatentCondition(condition.text.at[:, row].set(0.0))
    difference = prior(noisy, time, changed) - prior(noisy, time, condition)
    assert np.abs(difference).max() > 1e-3


def test_depends_on_time_and_knows_its_latents_apart(prior):
    noisy, time, condition = inputs()
    before = prior(noisy, time, condition)
    assert np.abs(prior(noisy, time + 0.1, condition) - before).max() > 1e-3
    assert np.abs(prior(noisy[:, ::-1], time, condition)[:, ::-1] - before).max() > 1e-3


def test_samples_are_repeatable_and_in_the_autoencoder_s_units(prior):
    text = inputs()[2].text
    config = LatentSampling(steps=3)
    first = sample_latents(prior, text, jax.random.key(0), config=config)
    again = sample_latents(prior, text, jax.random.key(0), config=config)
    other = sample_latents(prior, text, jax.random.key(1), config=config)
    assert first.shape == (2, 5, 3)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-4
    moved = with_parameters(
        prior, {n: v + 7 if n == "mean" else v for n, v in named_parameters(prior).items()}
    )
    shifted = sample_latents(moved, text, jax.random.key(0), config=config)
    np.testing.assert_allclose(shifted, first + 7, atol=1e-4)
