import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.guidance.bundled.point_prior import (
    PointCondition,
    PointPrior,
    PointPriorConfig,
    SamplingConfig,
    from_frame,
    sample_points,
    to_frame,
)
from jaxphys.networks.parameters import named_parameters, with_parameters

TINY = PointPriorConfig(
    text=12,
    phrases=2,
    width=32,
    latents=8,
    latent_width=32,
    blocks=2,
    latent_layers=1,
    head_width=16,
    hidden=32,
    latent_hidden=32,
    rank=4,
)


@pytest.fixture(scope="module")
def prior():
    """Every parameter random: at initialisation all outputs are zero."""
    rng = np.random.default_rng(0)
    module = PointPrior(TINY, rngs=nnx.Rngs(0))
    parameters = {
        name: jnp.asarray(0.2 * rng.normal(size=value.shape), jnp.float32)
        for name, value in named_parameters(module).items()
    }
    return with_parameters(module, parameters)


def inputs(count=20, seed=0):
    rng = np.random.default_rng(seed)
    noisy = jnp.asarray(rng.normal(size=(2, count, 6)), jnp.float32)
    text = jnp.asarray(rng.normal(size=(2, 3, 12)) / 12**0.5, jnp.float32)
    return noisy, jnp.array([0.3, 0.7], jnp.float32), PointCondition(text)


def test_starts_from_zero_and_keeps_shape_and_dtype():
    noisy, time, condition = inputs()
    found = PointPrior(TINY, rngs=nnx.Rngs(0))(noisy, time, condition)
    assert found.shape == noisy.shape and found.dtype == jnp.float32
    np.testing.assert_array_equal(found, 0.0)


def test_equivariant_to_the_order_of_points(prior):
    noisy, time, condition = inputs()
    order = np.random.default_rng(3).permutation(20)
    found = prior(noisy[:, order], time, condition)
    np.testing.assert_allclose(found, prior(noisy, time, condition)[:, order], atol=2e-5)
    # and not merely because points are looked at one by one
    nudged = prior(noisy.at[:, 0].add(1.0), time, condition)
    assert np.abs(nudged[:, 1:] - prior(noisy, time, condition)[:, 1:]).max() > 1e-4


def test_points_twice_over_change_nothing(prior):
    """What lets it train on few points and draw many: attention is a mean over points."""
    noisy, time, condition = inputs()
    twice = prior(jnp.concatenate([noisy, noisy], 1), time, condition)
    np.testing.assert_allclose(twice[:, :20], prior(noisy, time, condition), atol=2e-5)


def test_depends_on_time_and_text(prior):
    noisy, time, condition = inputs()
    before = prior(noisy, time, condition)
    assert np.abs(prior(noisy, time + 0.1, condition) - before).max() > 1e-3
    assert np.abs(prior(noisy, time, PointCondition(-condition.text)) - before).max() > 1e-3


@pytest.mark.parametrize("row", [0, 1, 2])
def test_every_phrase_counts(prior, row):
    noisy, time, condition = inputs()
    changed = PointCondition(condition.text.at[:, row].set(0.0))
    difference = prior(noisy, time, changed) - prior(noisy, time, condition)
    assert np.abs(difference).max() > 1e-3


def test_frame_round_trip():
    rng = np.random.default_rng(1)
    points, colours = rng.uniform(-0.5, 0.5, (7, 3)), rng.uniform(0, 1, (7, 3))
    samples = to_frame(jnp.asarray(points), jnp.asarray(colours))
    assert np.abs(samples).max() <= 1.0
    back = from_frame(samples)
    np.testing.assert_allclose(back[0], points, atol=1e-12)
    np.testing.assert_allclose(back[1], colours, atol=1e-12)


def test_sampling_is_deterministic_and_in_range(prior):
    text = inputs()[2].text
    config = SamplingConfig(steps=4)
    first = sample_points(prior, text, jax.random.key(0), count=30, config=config)
    again = sample_points(prior, text, jax.random.key(0), count=30, config=config)
    other = sample_points(prior, text, jax.random.key(1), count=30, config=config)
    assert first[0].shape == first[1].shape == (2, 30, 3)
    assert first[0].dtype == jnp.float32
    np.testing.assert_array_equal(first[0], again[0])
    assert np.abs(first[0] - other[0]).max() > 1e-3
    assert np.abs(first[0]).max() <= 0.53 and first[1].min() >= 0 and first[1].max() <= 1


def test_size_of_the_bundled_network():
    prior = nnx.eval_shape(lambda: PointPrior(PointPriorConfig(), rngs=nnx.Rngs(0)))
    count = sum(np.prod(v.shape) for v in jax.tree.leaves(nnx.state(prior, nnx.Param)))
    assert 3e6 < count < 4.2e6
