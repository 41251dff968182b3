from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.parity.arrays import pseudo_random
from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.discrete_schedule import DiscreteSchedule
from jaxphys.guidance.diffusion.karras import discrete_denoiser, sample_karras
from jaxphys.guidance.diffusion.samplers import karras_ratios

GOLDEN = Path(__file__).parents[2] / "networks" / "golden" / "karras.npz"
SPREAD = 0.4


def gaussian(noisy, sigma):
    """The exact denoiser of data with mean 0.1 and deviation `SPREAD`."""
    return 0.1 + (noisy - 0.1) * SPREAD**2 / (SPREAD**2 + sigma**2)


def two_heaps(noisy, sigma):
    """The exact denoiser of numbers about +0.5 or -0.5, with deviation 0.2."""
    variance = 0.2**2 + sigma**2
    return (0.2**2 * noisy + sigma**2 * 0.5 * jnp.tanh(0.5 * noisy / variance)) / variance


@pytest.mark.parametrize(("dtype", "tolerance"), [(jnp.float32, 1e-5), (jnp.float64, 1e-12)])
def test_without_churning_it_is_the_plain_loop(dtype, tolerance):
    with np.load(GOLDEN) as golden:
        sigmas = karras_ratios(12, 80.0, 1e-2, 7.0)
        np.testing.assert_allclose(sigmas, golden["sigmas"][:-1], rtol=1e-12)
        noise = jnp.asarray(pseudo_random("noise", (4, 3), 2.0), dtype)
        found = jax.jit(lambda noise: sample_karras(two_heaps, noise, sigmas))(noise)
        assert found.dtype == dtype
        np.testing.assert_allclose(found, golden["clean"], atol=tolerance)


def test_error_falls_with_the_square_of_the_steps():
    noise = jnp.linspace(-2, 2, 9)[None]
    largest = 5.0
    exact = 0.1 + (largest * noise - 0.1) * SPREAD / np.hypot(SPREAD, largest)
    errors = [
        np.abs(
            sample_karras(gaussian, noise, karras_ratios(steps, largest, 1e-5, 7.0)) - exact
        ).max()
        for steps in (20, 40, 80)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.2)


@pytest.mark.parametrize("churn", [0.0, 3.0, 1000.0])
def test_samples_have_the_spread_of_the_data(churn):
    noise = jax.random.normal(jax.random.key(0), (20_000,))
    sigmas = karras_ratios(120, 80.0, 1e-3, 7.0)
    found = sample_karras(gaussian, noise, sigmas, key=jax.random.key(1), churn=churn)
    np.testing.assert_allclose(found.mean(), 0.1, atol=0.015)
    np.testing.assert_allclose(found.std(), SPREAD, rtol=0.02)


@pytest.mark.parametrize(("churn", "growth"), [(0.0, 1.0), (0.2, 1.2), (0.5, 2**0.5), (7, 2**0.5)])
def test_churning_raises_sigma_by_its_share_up_to_the_root_of_two(churn, growth):
    def tell_sigma(noisy, sigma):
        return jnp.zeros_like(noisy) + sigma

    key = jax.random.key(0)
    found = sample_karras(tell_sigma, jnp.ones((1, 2)), jnp.array([3.0]), key=key, churn=churn)
    np.testing.assert_allclose(found, 3.0 * growth)


def test_churning_forgets_its_noise_and_follows_its_key():
    noise = jax.random.normal(jax.random.key(0), (2000,))
    sigmas = karras_ratios(40, 80.0, 1e-3, 7.0)

    def sample(key, churn):
        return sample_karras(gaussian, noise, sigmas, key=jax.random.key(key), churn=churn)

    np.testing.assert_array_equal(sample(1, 8.0), sample(1, 8.0))
    assert np.abs(sample(1, 8.0) - sample(2, 8.0)).max() > 0.1
    np.testing.assert_array_equal(sample(1, 0.0), sample(2, 0.0))
    kept = [np.corrcoef(noise, sample(1, churn))[0, 1] for churn in (0.0, 2.0, 8.0)]
    assert kept[0] > 0.999 and kept[0] > kept[1] + 0.05 and kept[1] > kept[2] + 0.05


def test_churning_without_a_key_is_refused():
    with pytest.raises(InputError, match="give it a key"):
        sample_karras(gaussian, jnp.ones((1, 2)), jnp.array([1.0]), churn=1.0)


def test_one_step_is_one_estimate():
    noise = jnp.ones((1, 2))
    np.testing.assert_allclose(
        sample_karras(gaussian, noise, jnp.array([3.0])), gaussian(3.0 * noise, 3.0)
    )


def test_a_scan_compiles_the_network_once_for_any_number_of_steps():
    traced = []

    def counting(noisy, sigma):
        traced.append(1)
        return gaussian(noisy, sigma)

    sample_karras(counting, jnp.ones((1, 2)), karras_ratios(50, 80.0, 1e-3, 7.0))
    assert len(traced) == 3  # two in the step, one at the end


@pytest.mark.parametrize(
    "schedule",
    [DiscreteSchedule("cosine", 1024), DiscreteSchedule("linear", 1024, 1e-4, 0.02)],
    ids=["cosine", "linear"],
)
@pytest.mark.parametrize("sigma", [1e-3, 0.3, 1.0, 7.7, 100.0, 1e6])
def test_networks_of_a_table_are_asked_at_the_step_below_sigma(schedule, sigma):
    """As published: the step interpolated and cut off; its scales make the clean estimate."""
    kept = schedule.alphas_cumulative()
    wanted = 1 / (1 + sigma**2)
    step = max(0, np.sum(kept >= wanted) - 1)
    asked = []

    def predict(noisy, time):
        asked.append((noisy, time))
        return 0.5 * noisy

    noisy = jnp.linspace(-0.9, 0.9, 6).reshape(2, 3)
    clean = discrete_denoiser(schedule, predict)(noisy, jnp.asarray(sigma))
    [(scaled, time)] = asked
    np.testing.assert_array_equal(time, [step / 1023] * 2)
    np.testing.assert_array_equal(schedule.index(time), [step] * 2)
    np.testing.assert_allclose(scaled, noisy / np.sqrt(1 + sigma**2), rtol=1e-12)
    expected = scaled * (1 - 0.5 * np.sqrt(1 - kept[step])) / max(np.sqrt(kept[step]), 1e-3)
    np.testing.assert_allclose(clean, np.clip(expected, -1, 1), rtol=1e-9)


def test_clean_estimates_are_clipped():
    schedule = DiscreteSchedule("cosine", 1024)
    denoise = discrete_denoiser(schedule, lambda noisy, time: -noisy, limit=0.7)
    found = denoise(jnp.array([[-9.0, 0.1, 9.0]]), jnp.asarray(1.0))
    np.testing.assert_allclose(found[0, [0, 2]], [-0.7, 0.7])
    assert 0.1 < found[0, 1] < 0.7


def test_the_exact_network_of_a_table_draws_the_data():
    """A network that knows the noise in Gaussian data at each step gives that data back."""
    schedule = DiscreteSchedule("cosine", 1024)

    def predict(noisy, time):
        alpha, sigma = (scale[:, None] for scale in schedule.alpha_sigma(time))
        clean = 0.1 + (noisy - 0.1 * alpha) * alpha * SPREAD**2 / (alpha**2 * SPREAD**2 + sigma**2)
        return (noisy - alpha * clean) / sigma

    noise = jax.random.normal(jax.random.key(0), (4, 5000))
    denoise = discrete_denoiser(schedule, predict, limit=3.0)
    sigmas = karras_ratios(64, 120.0, 1e-3, 7.0)
    found = sample_karras(denoise, noise, sigmas, key=jax.random.key(1), churn=3.0)
    np.testing.assert_allclose(found.mean(), 0.1, atol=0.02)
    np.testing.assert_allclose(found.std(), SPREAD, rtol=0.03)
