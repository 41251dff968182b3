from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.discrete_schedule import DiscreteSchedule
from jaxphys.guidance.diffusion.samplers import sample_ddim
from jaxphys.guidance.diffusion.schedule import add_noise, interpret

GOLDEN = Path(__file__).parents[2] / "networks" / "golden" / "schedules.npz"
SCALE = 1000 / 1024
SCHEDULES = {
    "stable_diffusion": DiscreteSchedule(),
    "stable_diffusion_ddpm": DiscreteSchedule("scaled_linear", 1000, 0.00085, 0.012),
    "point_e_base": DiscreteSchedule("cosine", 1024),
    "point_e_upsampler": DiscreteSchedule("linear", 1024, SCALE * 1e-4, SCALE * 0.02),
}


@pytest.mark.parametrize("name", SCHEDULES)
def test_tables_are_those_of_diffusers(name):
    kept = SCHEDULES[name].alphas_cumulative()
    with np.load(GOLDEN) as golden:
        assert kept.shape == golden[name].shape
        np.testing.assert_allclose(kept, golden[name], atol=1e-6)
        wrong = DiscreteSchedule("linear", len(kept)).alphas_cumulative()
        assert np.abs(wrong - golden[name]).max() > 0.02
    assert kept.dtype == np.float64 and np.all(np.diff(kept) < 0)


def test_table_cannot_be_changed_by_accident():
    with pytest.raises(ValueError, match="read-only"):
        DiscreteSchedule().alphas_cumulative()[0] = 1.0


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("schedule", SCHEDULES.values(), ids=SCHEDULES)
def test_every_step_is_reached_by_its_time_and_by_its_ratio(schedule, dtype):
    steps = np.arange(schedule.count)
    times = jnp.asarray(steps / (schedule.count - 1), dtype)
    kept = schedule.alphas_cumulative()
    np.testing.assert_array_equal(schedule.index(times), steps)
    alpha, sigma = jax.jit(schedule.alpha_sigma)(times)
    assert alpha.dtype == sigma.dtype == dtype and alpha.shape == times.shape
    np.testing.assert_array_equal(alpha, np.sqrt(kept).astype(dtype))
    np.testing.assert_array_equal(sigma, np.sqrt(1 - kept).astype(dtype))
    ratio = jnp.asarray(np.sqrt(1 / kept - 1), dtype)
    found = schedule.time_of_ratio(ratio)
    assert found.dtype == dtype
    np.testing.assert_allclose(found, times, atol=1e-9 if dtype == jnp.float64 else 1e-5)


def test_times_between_steps_belong_to_the_nearest_and_beyond_the_ends_to_the_last():
    schedule = DiscreteSchedule("linear", 5)
    times = jnp.array([-0.2, 0.0, 0.12, 0.13, 0.5, 0.99, 1.0, 1.3])
    np.testing.assert_array_equal(schedule.index(times), [0, 0, 0, 1, 2, 4, 4, 4])
    assert schedule.index(times).dtype == jnp.int32
    assert schedule.alpha_sigma(0.5)[0].shape == ()


def test_ratios_between_steps_are_interpolated_and_beyond_the_ends_held():
    schedule = DiscreteSchedule("linear", 5)
    kept = schedule.alphas_cumulative()
    middle = 0.25 * kept[2] + 0.75 * kept[3]
    np.testing.assert_allclose(schedule.step_of_ratio(np.sqrt(1 / middle - 1)), 2.75)
    np.testing.assert_allclose(schedule.time_of_ratio(np.sqrt(1 / middle - 1)), 2.75 / 4)
    np.testing.assert_array_equal(schedule.time_of_ratio(jnp.array([0.0, jnp.inf])), [0, 1])


def test_log_snr_is_that_of_the_scales_and_finite():
    schedule = SCHEDULES["point_e_base"]
    times = jnp.linspace(0, 1, 200)
    alpha, sigma = schedule.alpha_sigma(times)
    np.testing.assert_allclose(schedule.log_snr(times), 2 * jnp.log(alpha / sigma), rtol=1e-9)
    assert np.isfinite(schedule.log_snr(times)).all()
    assert np.all(np.diff(schedule.log_snr(times)) < 0)


def test_noise_that_was_added_is_taken_away_again():
    schedule, rng = DiscreteSchedule(), np.random.default_rng(0)
    clean, noise = jnp.asarray(rng.normal(size=(2, 6, 3)))
    time = jnp.linspace(0.02, 0.98, 6)
    noisy = add_noise(schedule, clean, noise, time)
    np.testing.assert_allclose(
        interpret(schedule, "noise", noise, noisy, time).clean, clean, atol=1e-9
    )


def test_ddim_runs_down_the_steps_to_the_data():
    """The clean sample of a single point is that point: any number of steps ends beside it."""
    schedule, point = DiscreteSchedule(), jnp.array([0.3, -0.7])
    times = jnp.arange(1000)[::-50] / 999
    noisy = jax.random.normal(jax.random.key(0), (4, 2))

    def estimate(noisy, time):
        return interpret(schedule, "clean", jnp.zeros_like(noisy) + point, noisy, time)

    found = sample_ddim(estimate, schedule, noisy, times[:-1], times[1:])
    alpha, sigma = schedule.alpha_sigma(times[-1])
    assert np.abs(found - alpha * point).max() < 4 * sigma


def test_equal_schedules_are_one_to_jit():
    assert hash(DiscreteSchedule()) == hash(DiscreteSchedule("scaled_linear", 1000))
    traced = []

    @jax.jit
    def scale(time):
        traced.append(1)
        return DiscreteSchedule().alpha_sigma(time)[0]

    scale(jnp.ones(3)), scale(jnp.zeros(3))
    assert len(traced) == 1


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"kind": "scaled"}, "scaled_linear"),
        ({"count": 1}, "two steps"),
        ({"first": 0.5}, "first <= last"),
        ({"last": 1.0}, "last < 1"),
    ],
)
def test_impossible_schedules_are_refused(change, told):
    with pytest.raises(InputError, match=told):
        DiscreteSchedule(**change)
