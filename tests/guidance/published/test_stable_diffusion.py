import json
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.schedule import add_noise
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.published.stable_diffusion import (
    VIEWS,
    encode_picture,
    encode_texts,
    load_prior,
    stable_diffusion_guide,
    view_index,
)
from jaxphys.guidance.view_prompts import unwanted_views
from tests import checkpoints

CONFIG = DistillationConfig(guidance=7.5, rescale=0.0, limit=None)
VIEW = (jnp.array([0.1, 3.0]), jnp.array([0.2, 0.3]))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return checkpoints.stable_diffusion(tmp_path_factory.mktemp("sd"))


@pytest.fixture(scope="module")
def guide(folder):
    return stable_diffusion_guide("a strawberry", folder, dtype=jnp.float32)


@pytest.fixture(scope="module")
def images(guide):
    size = (2, guide.resolution, guide.resolution, 3)
    return jax.random.uniform(jax.random.key(0), size, jnp.float32)


@partial(nnx.jit, static_argnames="config")
def distil(guide, images, azimuth, elevation, key, config=CONFIG):
    return guide.distil(images, azimuth, elevation, key, config, 0.0)


@nnx.jit
def slope(guide, images, key):
    return jax.grad(lambda images: guide.distil(images, *VIEW, key, CONFIG, 0.0).value)(images)


def test_gradient_passes_the_encoder_and_not_the_denoiser(guide, images):
    """The pictures' gradient is the encoder's transpose of g / B, and nothing else."""
    key = jax.random.key(3)
    result = distil(guide, images, *VIEW, key)
    keys = jax.random.split(jax.random.split(key)[0], 2)

    @nnx.jit
    def transposed(encoder, images, cotangent):
        encode = jax.vmap(lambda image, key: encode_picture(encoder, image, key))
        return jax.vjp(lambda images: encode(images, keys), images)[1](cotangent)[0]

    expected = transposed(guide.encoder, images, result.gradient / 2)
    found = slope(guide, images, key)
    assert np.abs(expected).max() > 0
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_the_noise_is_judged_as_the_prior_says(guide, images):
    """g = sigma^2 (u + s (c - u) - noise), with text c, the negative prompt u."""
    key = jax.random.key(5)
    result = distil(guide, images, *VIEW, key)
    encode_key, score_key = jax.random.split(key)
    encode = jax.vmap(partial(encode_picture, guide.encoder))
    latents = encode(images, jax.random.split(encode_key, 2))
    noise = jax.random.normal(jax.random.split(score_key)[1], latents.shape, latents.dtype)
    prior = guide.prior
    noisy = add_noise(prior.schedule, latents, noise, result.time)
    told, untold = guide.states[jnp.array([0, 2])], jnp.stack([guide.states[4]] * 2)
    steps = prior.schedule.index(result.time)
    run = nnx.jit(lambda network, states: network(noisy, steps, states))
    seen = [run(prior.network, states) for states in (told, untold)]
    seen = seen[1] + 7.5 * (seen[0] - seen[1])
    sigma = prior.schedule.alpha_sigma(result.time)[1].reshape(2, 1, 1, 1)
    expected = sigma**2 * (seen - noise)
    np.testing.assert_allclose(result.gradient, expected, atol=2e-4 * np.abs(expected).max())


def test_each_view_is_told_its_own_prompt(guide, folder, images):
    np.testing.assert_allclose(
        guide.states[2], encode_texts(folder, [f"a strawberry, {VIEWS[2]}"])[0], atol=1e-6
    )
    front = distil(guide, images, jnp.zeros(2), jnp.zeros(2), jax.random.key(0)).gradient
    back = distil(guide, images, jnp.full(2, jnp.pi), jnp.zeros(2), jax.random.key(0)).gradient
    assert np.abs(front - back).max() > 1e-4 * np.abs(front).max()


def test_perp_neg_mixes_prompts_and_steers_clear_of_views(guide, images):
    """At 0.1 rad the prompt is 6 % side view; at 3.0 rad 91 % back view. By hand from the noise
    that the prior sees."""
    key, config = jax.random.key(5), replace(CONFIG, perp_neg=True)
    result = distil(guide, images, *VIEW, key, config)
    encode_key, score_key = jax.random.split(key)
    encode = jax.vmap(partial(encode_picture, guide.encoder))
    latents = encode(images, jax.random.split(encode_key, 2))
    noise = jax.random.normal(jax.random.split(score_key)[1], latents.shape, latents.dtype)
    prior = guide.prior
    noisy = add_noise(prior.schedule, latents, noise, result.time)
    steps = prior.schedule.index(result.time)
    run = nnx.jit(lambda network, states: network(noisy, steps, states))
    front, side, back, _, nothing = guide.states
    near, far = 0.1 / (np.pi / 2), 3.0 / (np.pi / 2) - 1
    told = jnp.stack([(1 - near) * front + near * side, (1 - far) * side + far * back])
    told, front, side, nothing = (
        np.asarray(run(prior.network, states), np.float64)
        for states in (told, *(jnp.stack([s, s]) for s in (front, side, nothing)))
    )
    weights = np.asarray(unwanted_views(*VIEW))
    expected = np.zeros_like(told)
    for n in range(2):
        wanted = told[n] - nothing[n]
        direction = wanted.copy()
        for weight, other in zip(weights[:, n], (front[n], side[n]), strict=True):
            away = other - nothing[n]
            direction -= weight * (away - (away * wanted).sum() / (wanted**2).sum() * wanted)
        expected[n] = nothing[n] + 7.5 * direction - noise[n]
    sigma = np.asarray(prior.schedule.alpha_sigma(result.time)[1]).reshape(2, 1, 1, 1)
    expected *= sigma**2
    np.testing.assert_allclose(result.gradient, expected, atol=5e-4 * np.abs(expected).max())
    plain = distil(guide, images, *VIEW, key).gradient
    assert np.abs(plain - expected).max() > 5e-3 * np.abs(expected).max()


def test_views_are_gsgen_s():
    degrees = [(0, 0), (44, 0), (-44, 20), (46, 0), (-90, 10), (134, 0), (136, 0), (-170, 0)]
    degrees += [(350, 0), (20, 61), (180, 89), (180, -10)]
    azimuth, elevation = jnp.deg2rad(jnp.array(degrees, jnp.float32).T)
    found = [VIEWS[i].split()[0] for i in view_index(azimuth, elevation)]
    expected = ["front"] * 3 + ["side"] * 3 + ["back"] * 2 + ["front", "overhead", "overhead"]
    assert found == [*expected, "back"]


def test_latents_are_samples_scaled_to_unit_spread(guide, images):
    keys = jax.random.split(jax.random.key(0), 400)
    run = nnx.jit(lambda encoder: jax.vmap(partial(encode_picture, encoder, images[0]))(keys))
    drawn = np.asarray(run(guide.encoder)) / guide.encoder.config.scaling_factor
    mean, log_variance = guide.encoder(2 * images[:1] - 1)
    deviation = np.exp(0.5 * np.asarray(log_variance[0]))
    error = (drawn.mean(0) - np.asarray(mean[0])) / deviation * np.sqrt(400)
    assert np.abs(error).max() < 5
    np.testing.assert_allclose(drawn.std(0), deviation, rtol=0.25)


def test_attention_in_slices_and_half_precision(guide, folder, images):
    key = jax.random.key(1)
    whole = distil(guide, images, *VIEW, key).gradient
    options = {"attention_slice": 7, "dtype": jnp.float32}
    sliced = stable_diffusion_guide("a strawberry", folder, **options)
    found = distil(sliced, images, *VIEW, key).gradient
    np.testing.assert_allclose(found, whole, atol=1e-4 * np.abs(whole).max())
    half = stable_diffusion_guide("a strawberry", folder)
    assert half.prior.network.conv_in.kernel[...].dtype == jnp.bfloat16
    found = distil(half, images, *VIEW, key).gradient
    assert found.dtype == jnp.float32
    assert np.abs(found - whole).max() < 0.1 * np.abs(whole).max()


def test_prediction_of_velocity_is_read_from_the_folder(tmp_path):
    folder = checkpoints.stable_diffusion(tmp_path, prediction="v_prediction")
    prior = load_prior(folder, dtype=jnp.float32)
    assert (
        prior.config.kind == "velocity" and prior.config.side == 8 and prior.config.reduction == 2
    )
    (folder / "unet" / "config.json").write_text(json.dumps(checkpoints.UNET | {"act_fn": "gelu"}))
    with pytest.raises(InputError, match=r"unet/config.json: act_fn"):
        load_prior(folder)
