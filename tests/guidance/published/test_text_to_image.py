from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.parity.arrays import pseudo_random
from experiments.parity.sampling import FRESH, SHAPE, STEPS, prediction
from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.samplers import sample_ddim
from jaxphys.guidance.diffusion.schedule import interpret
from jaxphys.guidance.published.scheduler_config import SchedulerConfig
from jaxphys.guidance.published.stable_diffusion import LatentPriorConfig
from jaxphys.guidance.published.text_to_image import PaintConfig, sample_latents

GOLDEN = np.load(Path(__file__).parents[2] / "networks" / "golden" / "sampling.npz")
STABLE_DIFFUSION = SchedulerConfig(
    beta_schedule="scaled_linear",
    beta_start=0.00085,
    beta_end=0.012,
    steps_offset=1,
    set_alpha_to_one=False,
    clip_sample=False,
)


def constant_noise(monkeypatch):
    monkeypatch.setattr(
        jax.random, "normal", lambda key, shape, dtype: jnp.full(shape, FRESH, dtype)
    )


def trajectory(sampler: str, predicts: str, steps: int, monkeypatch) -> np.ndarray:
    constant_noise(monkeypatch)
    scheduler = replace(STABLE_DIFFUSION, prediction_type=predicts)
    schedule = scheduler.schedule()

    def estimate(noisy, time):
        predicted = prediction(noisy, time.reshape(-1, 1, 1, 1))
        return interpret(schedule, scheduler.kind, predicted, noisy, time)

    noisy = jnp.asarray(pseudo_random("sampling", SHAPE, 1.7), jnp.float64)
    spans = (jnp.asarray(span[:steps]) / 999 for span in scheduler.visited(STEPS, sampler))
    options = {"key": jax.random.key(0), "eta": float(sampler == "ddpm")}
    return np.asarray(sample_ddim(estimate, schedule, noisy, *spans, **options))


@pytest.mark.parametrize("predicts", ["epsilon", "v_prediction"])
@pytest.mark.parametrize("sampler", ["ddim", "ddpm"])
@pytest.mark.parametrize("steps", [1, 7, STEPS])
def test_trajectories_are_those_of_diffusers(sampler, predicts, steps, monkeypatch):
    expected = GOLDEN[f"{sampler}_{predicts}"][steps - 1]
    found = trajectory(sampler, predicts, steps, monkeypatch)
    # diffusers computes in float32.
    np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())


def test_the_two_samplers_differ(monkeypatch):
    expected = GOLDEN["ddpm_epsilon"][-1]
    found = trajectory("ddim", "epsilon", STEPS, monkeypatch)
    assert np.abs(found - expected).max() > 0.1


class Painter(nnx.Module):
    """A prior that predicts the same simple thing of all latents, whatever it is told."""

    def __init__(self, scheduler):
        self.schedule = scheduler.schedule()
        self.config = LatentPriorConfig(scheduler, 2, 8)

    def __call__(self, noisy, time, condition):
        return prediction(noisy, time.reshape(-1, 1, 1, 1))


def by_hand(scheduler: SchedulerConfig, sampler: str, asked, reached) -> np.ndarray:
    """The latents that start as FRESH, by the papers' formulas with numbers for alpha^2: DDIM (Song
    et al. 2021, eq. 12) with the noise that was predicted, DDPM (Ho et al. 2020, eq. 6 and 7).
    """
    roots = np.linspace(0.00085**0.5, 0.012**0.5, 1000)
    kept = np.append(np.cumprod(1 - roots**2), 1.0)  # the last one stands for step -1
    x = np.full((1, 2, 2, 4), FRESH)
    for now, later in zip(asked, reached, strict=True):
        a, b = kept[now], kept[later]
        said = prediction(x, now / 999)
        if scheduler.prediction_type == "epsilon":
            clean, noise = (x - np.sqrt(1 - a) * said) / np.sqrt(a), said
        elif scheduler.prediction_type == "v_prediction":
            clean, noise = (
                np.sqrt(a) * x - np.sqrt(1 - a) * said,
                np.sqrt(a) * said + np.sqrt(1 - a) * x,
            )
        else:
            clean, noise = said, (x - np.sqrt(a) * said) / np.sqrt(1 - a)
        if scheduler.clip_sample:
            clean = np.clip(clean, -scheduler.clip_sample_range, scheduler.clip_sample_range)
        if sampler == "ddim":
            x = np.sqrt(b) * clean + np.sqrt(1 - b) * noise
        else:
            step = 1 - a / b
            mean = np.sqrt(b) * step * clean + np.sqrt(a / b) * (1 - b) * x
            x = mean / (1 - a) + np.sqrt((1 - b) / (1 - a) * step) * FRESH
    return x


# Four of 1,000 steps, by hand. DDIM goes 250 down from each, DDPM to the next one.
LEADING = ([750, 500, 250, 0], [500, 250, 0, -1])
VISITS = [
    ({}, "ddim", *LEADING),
    ({}, "ddpm", *LEADING),
    ({"set_alpha_to_one": False}, "ddim", LEADING[0], [500, 250, 0, 0]),
    ({"set_alpha_to_one": False}, "ddpm", *LEADING),
    ({"steps_offset": 1}, "ddim", [751, 501, 251, 1], [501, 251, 1, -1]),
    ({"steps_offset": 249}, "ddpm", [999, 749, 499, 249], [749, 499, 249, -1]),
    ({"timestep_spacing": "trailing"}, "ddim", [999, 749, 499, 249], [749, 499, 249, -1]),
    ({"timestep_spacing": "linspace"}, "ddim", [999, 666, 333, 0], [749, 416, 83, -1]),
    ({"timestep_spacing": "linspace"}, "ddpm", [999, 666, 333, 0], [666, 333, 0, -1]),
    ({"clip_sample": True}, "ddim", *LEADING),
    ({"clip_sample": True, "clip_sample_range": 0.2}, "ddim", *LEADING),
    ({"clip_sample": True, "clip_sample_range": 0.2}, "ddpm", *LEADING),
    ({"prediction_type": "sample"}, "ddim", *LEADING),
    ({"prediction_type": "v_prediction"}, "ddpm", *LEADING),
]


@pytest.mark.parametrize(("options", "sampler", "asked", "reached"), VISITS)
def test_latents_are_sampled_as_the_scheduler_says(options, sampler, asked, reached, monkeypatch):
    constant_noise(monkeypatch)
    scheduler = replace(STABLE_DIFFUSION, steps_offset=0, set_alpha_to_one=True)
    scheduler = replace(scheduler, **options)
    for found, expected in zip(scheduler.visited(4, sampler), (asked, reached), strict=True):
        np.testing.assert_array_equal(found, expected)
    told = jnp.zeros((1, 1, 1))
    config = PaintConfig(steps=4, sampler=sampler, guidance=1.0)
    found = sample_latents(Painter(scheduler), told, told, jax.random.key(0), config, (2, 2, 4))
    expected = by_hand(scheduler, sampler, asked, reached)
    np.testing.assert_allclose(found, expected, atol=2e-5)
    # Control: with the options left out, other latents.
    plain = by_hand(replace(scheduler, clip_sample=False), sampler, *LEADING)
    others = {"steps_offset", "timestep_spacing", "clip_sample"} & options.keys()
    assert not others or np.abs(plain - expected).max() > 1e-3


def test_steps_that_do_not_divide_the_schedule():
    scheduler = replace(STABLE_DIFFUSION, timestep_spacing="trailing")
    asked, reached = scheduler.visited(3, "ddim")  # 1000 - 333.3 i, rounded, less one
    np.testing.assert_array_equal(asked, [999, 666, 332])
    np.testing.assert_array_equal(reached, [666, 333, 0])
    assert scheduler.visited(1000, "ddpm")[0][-1] == 0
    assert STABLE_DIFFUSION.visited(1000, "ddim")[0].max() == 999
    for steps in (0, 1001):
        with pytest.raises(InputError, match="1 to 1000"):
            scheduler.visited(steps, "ddim")


def test_unusable_settings_are_refused():
    with pytest.raises(InputError, match="ddim"):
        PaintConfig(sampler="dimm")
    with pytest.raises(InputError, match="at least 1"):
        PaintConfig(steps=0)
