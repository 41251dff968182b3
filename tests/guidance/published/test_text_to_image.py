from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.parity.arrays import pseudo_random
from experiments.parity.sampling import FRESH, SHAPE, STEPS, prediction
from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.discrete_schedule import DiscreteSchedule
from jaxphys.guidance.diffusion.samplers import sample_ddim
from jaxphys.guidance.diffusion.schedule import interpret
from jaxphys.guidance.published.text_to_image import PaintConfig, sampling_times

GOLDEN = np.load(Path(__file__).parents[2] / "networks" / "golden" / "sampling.npz")
KINDS = {"epsilon": "noise", "v_prediction": "velocity"}


def trajectory(sampler: str, predicts: str, steps: int, monkeypatch) -> np.ndarray:
    monkeypatch.setattr(
        jax.random, "normal", lambda key, shape, dtype: jnp.full(shape, FRESH, dtype)
    )
    schedule = DiscreteSchedule()

    def denoise(noisy, time):
        kind = KINDS[predicts]
        predicted = prediction(noisy, time.reshape(-1, 1, 1, 1))
        return interpret(schedule, kind, predicted, noisy, time).clean

    noisy = jnp.asarray(pseudo_random("sampling", SHAPE, 1.7), jnp.float64)
    times = sampling_times(schedule, STEPS, sampler).astype(jnp.float64)[: steps + 1]
    key, eta = jax.random.key(0), float(sampler == "ddpm")
    return np.asarray(sample_ddim(denoise, schedule, noisy, times, key=key, eta=eta))


@pytest.mark.parametrize("predicts", KINDS)
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


def test_times_are_the_published_schedulers():
    schedule = DiscreteSchedule()
    times = np.asarray(sampling_times(schedule, 4, "ddim")) * 999
    np.testing.assert_allclose(times, [751, 501, 251, 1, 0], rtol=1e-6)
    assert np.asarray(sampling_times(schedule, 4, "ddpm"))[-1] < 0
    assert sampling_times(schedule, 1000, "ddim").max() <= 1
    for steps in (0, 1001):
        with pytest.raises(InputError, match="1 to 1000"):
            sampling_times(schedule, steps, "ddim")


def test_unusable_settings_are_refused():
    with pytest.raises(InputError, match="ddim"):
        PaintConfig(sampler="dimm")
    with pytest.raises(InputError, match="at least one"):
        PaintConfig(steps=0)
