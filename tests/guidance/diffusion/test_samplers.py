import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.samplers import karras_times, sample_ddim, sample_heun
from jaxphys.guidance.diffusion.schedule import (
    Schedule,
    add_noise,
    guided,
    interpret,
    rescaled,
    velocity,
)

TIMES = jnp.linspace(0.01, 0.99, 25)


@pytest.mark.parametrize("shift", [1.0, 0.5, 2.0])
def test_schedule_keeps_variance_and_loses_signal(shift):
    schedule = Schedule(shift)
    alpha, sigma = schedule.alpha_sigma(TIMES)
    np.testing.assert_allclose(alpha**2 + sigma**2, 1.0, atol=1e-12)
    assert np.all(np.diff(schedule.log_snr(TIMES)) < 0)
    np.testing.assert_allclose(schedule.time_of_ratio(sigma / alpha), TIMES, atol=1e-12)
    plain = Schedule().log_snr(TIMES)
    np.testing.assert_allclose(schedule.log_snr(TIMES) - plain, 2 * np.log(shift), atol=1e-9)


def test_unshifted_schedule_is_the_cosine_one():
    alpha, _ = Schedule().alpha_sigma(TIMES)
    np.testing.assert_allclose(alpha**2, np.cos(0.5 * np.pi * TIMES) ** 2, atol=1e-12)


@pytest.mark.parametrize("kind", ["clean", "noise", "velocity"])
def test_every_parametrisation_gives_back_clean_and_noise(kind):
    schedule, rng = Schedule(0.7), np.random.default_rng(0)
    clean, noise = jnp.asarray(rng.normal(size=(2, 25, 4, 3)))
    noisy = add_noise(schedule, clean, noise, TIMES)
    prediction = {
        "clean": clean,
        "noise": noise,
        "velocity": velocity(schedule, clean, noise, TIMES),
    }[kind]
    found = interpret(schedule, kind, prediction, noisy, TIMES)
    np.testing.assert_allclose(found.clean, clean, atol=1e-9)
    np.testing.assert_allclose(found.noise, noise, atol=1e-9)


def test_unknown_kind_is_refused():
    with pytest.raises(InputError, match="velocity"):
        interpret(Schedule(), "score", jnp.ones((1, 2)), jnp.ones((1, 2)), jnp.ones(1))


def test_interpret_is_finite_at_both_ends():
    x = jnp.ones((2, 3))
    for kind in ("clean", "noise", "velocity"):
        estimate = interpret(Schedule(), kind, x, 2 * x, jnp.array([0.0, 1.0]))
        assert np.isfinite(estimate.clean).all() and np.isfinite(estimate.noise).all()


def test_guidance_algebra():
    told, untold = jnp.array([1.0, 2.0]), jnp.array([0.5, 3.0])
    np.testing.assert_allclose(guided(told, untold, 0.0), untold)
    np.testing.assert_allclose(guided(told, untold, 1.0), told)
    np.testing.assert_allclose(guided(told, untold, 3.0), 3 * told - 2 * untold)


def test_guidance_commutes_with_the_parametrisation():
    rng, schedule = np.random.default_rng(1), Schedule()
    told, untold, noisy = jnp.asarray(rng.normal(size=(3, 25, 6)))
    mixed = interpret(schedule, "velocity", guided(told, untold, 4.0), noisy, TIMES)
    parts = [interpret(schedule, "velocity", p, noisy, TIMES) for p in (told, untold)]
    np.testing.assert_allclose(mixed.clean, guided(parts[0].clean, parts[1].clean, 4.0), atol=1e-9)
    np.testing.assert_allclose(mixed.noise, guided(parts[0].noise, parts[1].noise, 4.0), atol=1e-9)


def test_rescaling_restores_the_spread():
    rng = np.random.default_rng(2)
    told = jnp.asarray(rng.normal(size=(3, 50)))
    strong = 4.0 * told
    np.testing.assert_allclose(np.std(rescaled(strong, told, 1.0), 1), np.std(told, 1), rtol=1e-12)
    np.testing.assert_array_equal(rescaled(strong, told, 0.0), strong)
    assert np.isfinite(rescaled(jnp.zeros((1, 4)), jnp.zeros((1, 4)), 1.0)).all()


def test_times_fall_to_zero():
    times = karras_times(Schedule(0.5), 10, 80.0, 0.01, 7.0)
    assert times.shape == (11,) and times[-1] == 0.0 and np.all(np.diff(times) < 0)
    alpha, sigma = Schedule(0.5).alpha_sigma(times)
    np.testing.assert_allclose((sigma / alpha)[jnp.array([0, 9])], [80.0, 0.01], rtol=1e-6)
    with pytest.raises(InputError, match="at least one"):
        karras_times(Schedule(), 0, 80.0, 0.01, 7.0)


MEAN, SPREAD = jnp.array([0.7, -0.3]), jnp.array([0.5, 0.1])


def exact(schedule):
    """The best denoiser of samples from N(MEAN, SPREAD^2)."""

    def denoise(noisy, time):
        alpha, sigma = (s[:, None] for s in schedule.alpha_sigma(time))
        gain = alpha * SPREAD**2 / (alpha**2 * SPREAD**2 + sigma**2)
        return MEAN + gain * (noisy - alpha * MEAN)

    return denoise


def along(denoise, schedule, noisy, times, **options):
    """`sample_ddim` from each time to the next, with the noise that a clean sample means."""

    def estimate(noisy, time):
        return interpret(schedule, "clean", denoise(noisy, time), noisy, time)

    return sample_ddim(estimate, schedule, noisy, times[:-1], times[1:], **options)


@pytest.mark.parametrize("shift", [1.0, 0.5])
def test_heun_and_ddim_recover_a_gaussian(shift):
    schedule, count = Schedule(shift), 4000
    noise = jax.random.normal(jax.random.key(0), (count, 2))
    times = karras_times(schedule, 40, 200.0, 0.002, 7.0)
    heun = sample_heun(exact(schedule), schedule, noise, times)
    ddim = along(exact(schedule), schedule, noise, times)
    # The flow of a Gaussian is affine: every sample's end is known, not only the distribution.
    wanted = MEAN + SPREAD * noise
    assert np.abs(heun - wanted).max() < 0.05
    assert np.abs(ddim - wanted).max() < 0.25
    assert np.abs(heun - wanted).max() < 0.4 * np.abs(ddim - wanted).max()


def test_heun_is_of_second_order():
    schedule = Schedule()
    noise = jax.random.normal(jax.random.key(1), (64, 2))

    def error(steps):
        # Both ends where the denoiser is nearly constant, so that only the steps' error is left.
        times = karras_times(schedule, steps, 500.0, 1e-4, 7.0)
        return np.abs(
            sample_heun(exact(schedule), schedule, noise, times) - MEAN - SPREAD * noise
        ).max()

    coarse, fine = error(32), error(64)
    assert 2.5 < coarse / fine < 6.5


def test_ancestral_ddim_recovers_mean_and_spread():
    schedule = Schedule()
    noise = jax.random.normal(jax.random.key(2), (20000, 2))
    times = karras_times(schedule, 120, 80.0, 0.01, 7.0)
    drawn = along(exact(schedule), schedule, noise, times, key=jax.random.key(3), eta=1.0)
    np.testing.assert_allclose(drawn.mean(0), MEAN, atol=0.02)
    # First order in the step: 120 of them leave some 6% of the spread.
    np.testing.assert_allclose(drawn.std(0), SPREAD, rtol=0.08)
    assert np.abs(np.corrcoef(drawn[:, 0], noise[:, 0])[0, 1]) < 0.5  # the noise was redrawn
    with pytest.raises(InputError, match="key"):
        along(exact(schedule), schedule, noise, times, eta=1.0)


def test_samplers_keep_float32():
    schedule = Schedule()

    def denoise(noisy, time):
        assert noisy.dtype == time.dtype == jnp.float32
        return 0.5 * noisy

    noise = jnp.ones((2, 3), jnp.float32)
    times = karras_times(schedule, 4, 50.0, 0.01, 7.0)
    assert sample_heun(denoise, schedule, noise, times).dtype == jnp.float32
    assert along(denoise, schedule, noise, times).dtype == jnp.float32
