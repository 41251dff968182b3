import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.guidance.bundled.pixel_prior import PixelCondition, PixelPrior, PixelPriorConfig
from jaxphys.guidance.views import view_features
from jaxphys.networks.parameters import named_parameters, with_parameters

TINY = PixelPriorConfig(
    resolution=16, patch=4, text=12, phrases=2, width=32, layers=2, head_width=16, hidden=48, rank=4
)


def randomised(module, seed=0):
    """The module with every parameter random: at initialisation most outputs are zero."""
    rng = np.random.default_rng(seed)
    parameters = {
        name: jnp.asarray(0.3 * rng.normal(size=value.shape), jnp.float32)
        for name, value in named_parameters(module).items()
    }
    return with_parameters(module, parameters)


def inputs(batch=2, seed=0, text=12):
    rng = np.random.default_rng(seed)
    noisy = jnp.asarray(rng.normal(size=(batch, 16, 16, 3)), jnp.float32)
    told = jnp.asarray(rng.normal(size=(batch, 3, text)) / text**0.5, jnp.float32)
    view = jnp.asarray(view_features(rng.normal(size=batch), rng.normal(size=batch)), jnp.float32)
    return noisy, jnp.linspace(0.2, 0.8, batch, dtype=jnp.float32), PixelCondition(told, view)


def test_starts_from_zero_and_keeps_shape_and_dtype():
    prior = PixelPrior(TINY, rngs=nnx.Rngs(0))
    noisy, time, condition = inputs()
    found = prior(noisy, time, condition)
    assert found.shape == noisy.shape and found.dtype == jnp.float32
    np.testing.assert_array_equal(found, 0.0)


def test_windows_are_cut_around_their_patches_and_summed():
    prior = PixelPrior(TINY, rngs=nnx.Rngs(0))
    noisy, _, _ = inputs()
    windows = prior._windows(noisy)
    assert windows.shape == (2, 16, 192)
    # The second patch of the first row, rows 0-3 and columns 4-7: its window reaches 2 beyond.
    window = np.zeros((8, 8, 3), np.float32)
    window[2:] = noisy[0, :6, 2:10]
    quarters = windows[0, 1].reshape(2, 2, 4, 4, 3).transpose(0, 2, 1, 3, 4).reshape(8, 8, 3)
    np.testing.assert_array_equal(quarters, window)
    # Each pixel lies in four windows, those along the edge in two, in the corners in one.
    times = np.full(16, 2.0)
    times[[0, 1, 14, 15]] = 1.0
    np.testing.assert_allclose(
        prior._pictures(windows), noisy * np.outer(times, times)[None, :, :, None], rtol=1e-6
    )


@pytest.mark.parametrize("part", ["noisy", "time", "text", "view"])
def test_depends_on_all_it_is_told(part):
    prior = randomised(PixelPrior(TINY, rngs=nnx.Rngs(0)))
    noisy, time, condition = inputs()
    before = prior(noisy, time, condition)
    after = {
        "noisy": lambda: prior(noisy + 0.1, time, condition),
        "time": lambda: prior(noisy, time + 0.1, condition),
        "text": lambda: prior(noisy, time, condition._replace(text=-condition.text)),
        "view": lambda: prior(noisy, time, condition._replace(view=-condition.view)),
    }[part]()
    assert np.abs(after - before).max() > 1e-3


@pytest.mark.parametrize("row", [0, 1, 2])
def test_every_phrase_counts(row):
    prior = randomised(PixelPrior(TINY, rngs=nnx.Rngs(0)))
    noisy, time, condition = inputs()
    changed = condition._replace(text=condition.text.at[:, row].set(0.0))
    difference = prior(noisy, time, changed) - prior(noisy, time, condition)
    assert np.abs(difference).max() > 1e-3


def test_samples_of_a_batch_do_not_mix():
    prior = randomised(PixelPrior(TINY, rngs=nnx.Rngs(0)))
    noisy, time, condition = inputs(3)
    alone = [
        prior(
            noisy[i : i + 1], time[i : i + 1], jax.tree.map(lambda c, i=i: c[i : i + 1], condition)
        )
        for i in range(3)
    ]
    np.testing.assert_allclose(prior(noisy, time, condition), jnp.concatenate(alone), atol=5e-5)


def test_bfloat16_is_close_to_float32():
    prior = randomised(PixelPrior(TINY, rngs=nnx.Rngs(0)))
    narrow = PixelPrior(dataclasses.replace(TINY, dtype="bfloat16"), rngs=nnx.Rngs(0))
    narrow = with_parameters(narrow, named_parameters(prior))
    wide, short = prior(*inputs()), narrow(*inputs())
    assert short.dtype == jnp.float32
    assert 0 < np.abs(short - wide).max() < 0.1 * np.abs(wide).max()


def test_gradients_agree_with_central_differences():
    prior = randomised(PixelPrior(dataclasses.replace(TINY, dtype="float64"), rngs=nnx.Rngs(0)))
    parameters = {k: v.astype(jnp.float64) for k, v in named_parameters(prior).items()}
    noisy, time, condition = jax.tree.map(lambda a: a.astype(jnp.float64), inputs())

    @jax.jit
    def loss(parameters):
        return jnp.mean(with_parameters(prior, parameters)(noisy, time, condition) ** 2)

    rng = np.random.default_rng(5)
    way = {k: jnp.asarray(rng.normal(size=v.shape)) for k, v in parameters.items()}
    slope = sum(jnp.sum(g * way[k]) for k, g in jax.jit(jax.grad(loss))(parameters).items())
    ends = [loss({k: v + s * way[k] for k, v in parameters.items()}) for s in (1e-5, -1e-5)]
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / 2e-5, rtol=1e-6)


def test_size_of_the_bundled_network():
    prior = nnx.eval_shape(lambda: PixelPrior(PixelPriorConfig(), rngs=nnx.Rngs(0)))
    count = sum(np.prod(v.shape) for v in jax.tree.leaves(nnx.state(prior, nnx.Param)))
    assert 3.5e6 < count < 4.5e6
