"""Interval score matching where the score is known: a Gaussian with a full covariance."""

from types import SimpleNamespace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.guidance.diffusion.inversion import invert_ddim
from jaxphys.guidance.diffusion.schedule import Schedule, expand, interpret
from jaxphys.guidance.diffusion.score_distillation import (
    DistillationConfig,
    interval_times,
    score_distillation,
)

RANDOM = np.random.default_rng(3)
ROOT = RANDOM.normal(size=(4, 4)) / 2
COVARIANCE = ROOT @ ROOT.T + 0.05 * np.eye(4)
SPREADS, AXES = np.linalg.eigh(COVARIANCE)
SAMPLES = RANDOM.normal(size=(5, 4))
TOLD, UNTOLD = np.array([0.6, -0.2, 0.1, 0.4]), np.array([0.1, 0.0, -0.3, 0.2])
TIME, INTERVAL = 0.5, 0.1
PLAIN = DistillationConfig(
    method="ism",
    guidance=1.0,
    rescale=0.0,
    limit=None,
    weight="uniform",
    time=(TIME, TIME, TIME),
    interval=INTERVAL,
)


class Told(NamedTuple):
    mean: Array


class GaussianPrior:
    """The exact denoiser of N(mean, COVARIANCE), the mean being the condition."""

    def __init__(self, kind):
        self.config = SimpleNamespace(kind=kind)
        self.schedule = Schedule()

    def __call__(self, noisy, time, condition):
        alpha, sigma = (expand(s, noisy) for s in self.schedule.alpha_sigma(time))
        away = (noisy - alpha * condition.mean) @ AXES
        noise = (sigma * away / (alpha**2 * SPREADS + sigma**2)) @ AXES.T
        clean = (noisy - sigma * noise) / alpha
        kinds = {"clean": clean, "noise": noise, "velocity": alpha * noise - sigma * clean}
        return kinds[self.config.kind]


def scales(time):
    return np.cos(0.5 * np.pi * time), np.sin(0.5 * np.pi * time)


def noise_in(noisy, time, mean):
    """-sigma times the score of the noised Gaussian."""
    alpha, sigma = scales(time)
    covariance = alpha**2 * COVARIANCE + sigma**2 * np.eye(4)
    return sigma * np.linalg.solve(covariance, (noisy - alpha * mean).T).T


def flow(samples, time, later, mean):
    """Where the probability flow takes samples: each principal part grows as its spread does."""
    (alpha, sigma), (then, grown) = scales(time), scales(later)
    ratio = np.sqrt((then**2 * SPREADS + grown**2) / (alpha**2 * SPREADS + sigma**2))
    return then * mean + ((samples - alpha * mean) @ AXES * ratio) @ AXES.T


def wanted(samples, guidance=1.0):
    """ISM's g without discretisation before s: equation 17 by hand."""
    begin, before = 0.5 * TIME, TIME - INTERVAL
    start = scales(begin)[0] * samples
    noisy = flow(start, begin, before, UNTOLD)
    seen = noise_in(noisy, before, UNTOLD)
    (alpha, sigma), (then, grown) = scales(before), scales(TIME)
    noisy = then * (noisy - sigma * seen) / alpha + grown * seen
    told, untold = (noise_in(noisy, TIME, mean) for mean in (TOLD, UNTOLD))
    return untold + guidance * (told - untold) - seen


def distilled(config, key=0, kind="velocity", told=TOLD, samples=SAMPLES):
    samples = jnp.asarray(samples)
    told, untold = (Told(jnp.broadcast_to(mean, samples.shape)) for mean in (told, UNTOLD))
    prior = GaussianPrior(kind)
    return score_distillation(prior, samples, told, untold, jax.random.key(key), config)


def changed(**values):
    return DistillationConfig(**(vars(PLAIN) | values))


@pytest.mark.parametrize("kind", ["clean", "noise", "velocity"])
def test_gradient_converges_to_the_closed_form(kind):
    """Of first order, as DDIM's steps are."""
    errors = [
        np.abs(distilled(changed(inversion=n, guidance=3.0), 0, kind).gradient - wanted(SAMPLES, 3))
        for n in (40, 80)
    ]
    coarse, fine = (error.max() for error in errors)
    assert fine < 2e-3 * np.abs(wanted(SAMPLES, 3)).max()
    assert 1.8 < coarse / fine < 2.2


def test_gradient_is_not_the_one_of_another_interval():
    """Negative control of the test above: what it allows is far less than what it is about."""
    found = distilled(changed(inversion=80, interval=0.12)).gradient
    assert np.abs(found - wanted(SAMPLES)).max() > 0.02 * np.abs(wanted(SAMPLES)).max()


def test_inversion_follows_the_flow():
    times = jnp.broadcast_to(jnp.linspace(0.2, 0.7, 201)[:, None], (201, 5))
    prior = GaussianPrior("noise")
    told = Told(jnp.broadcast_to(UNTOLD, SAMPLES.shape))

    def estimate(noisy, time):
        return interpret(prior.schedule, "noise", prior(noisy, time, told), noisy, time)

    noisy, seen = invert_ddim(estimate, prior.schedule, jnp.asarray(SAMPLES), times)
    expected = flow(scales(0.2)[0] * SAMPLES, 0.2, 0.7, UNTOLD)
    np.testing.assert_allclose(noisy, expected, atol=5e-3)
    np.testing.assert_allclose(seen, noise_in(noisy, 0.7, UNTOLD), atol=0.02)


def test_no_noise_is_drawn():
    """Given sample and level ISM's gradient is certain. SDS's is spread as
    `-w alpha^2 Sigma (alpha^2 Sigma + sigma^2)^-1 noise`."""
    first, second = (distilled(PLAIN, key).gradient for key in (0, 1))
    np.testing.assert_array_equal(first, second)
    many = np.broadcast_to(SAMPLES[0], (40_000, 4))
    drawn = distilled(changed(method="sds"), samples=many).gradient
    alpha, sigma = scales(TIME)
    spread = alpha**2 * SPREADS / (alpha**2 * SPREADS + sigma**2)
    expected = (AXES * spread**2) @ AXES.T
    np.testing.assert_allclose(np.cov(np.asarray(drawn).T), expected, atol=0.03 * expected.max())
    same = distilled(PLAIN, samples=many).gradient
    assert np.ptp(same, axis=0).max() < 1e-12


def test_weight_clean_is_the_difference_of_two_clean_estimates():
    """The pseudo ground truth at t against the one at s: as DDIM's step to t keeps the latter."""
    found = distilled(changed(weight="clean", guidance=4.0))
    prior = GaussianPrior("velocity")
    times = interval_times(found.time, PLAIN)[:-1]
    told = Told(jnp.broadcast_to(UNTOLD, SAMPLES.shape))

    def estimate(noisy, time):
        return interpret(prior.schedule, "velocity", prior(noisy, time, told), noisy, time)

    noisy, _ = invert_ddim(estimate, prior.schedule, jnp.asarray(SAMPLES), times)
    before = estimate(noisy, times[-1]).clean
    np.testing.assert_allclose(found.gradient, before - found.clean, atol=1e-10)


def test_told_nothing_only_the_interval_is_left():
    """Without guidance ISM asks for nothing as the interval closes; SDS still pulls to the mean."""
    sizes = [
        np.abs(distilled(changed(interval=interval, inversion=200), told=UNTOLD).gradient).max()
        for interval in (0.04, 0.02)
    ]
    assert 1.8 < sizes[0] / sizes[1] < 2.2
    many = np.broadcast_to(SAMPLES[0], (20_000, 4))
    pull = distilled(changed(method="sds"), told=UNTOLD, samples=many).gradient.mean(0)
    assert np.abs(pull).max() > 4 * sizes[1]


def test_intervals_stay_above_no_noise():
    config = changed(time=(0.02, 0.9, 0.9), interval=0.05, inversion=3)
    times = np.asarray(interval_times(jnp.array([0.02, 0.04, 0.5]), config))
    np.testing.assert_allclose(times[:, 2], [0.01, 0.01 + 0.44 / 3, 0.01 + 0.88 / 3, 0.45, 0.5])
    np.testing.assert_allclose(times[:, 0], [0.01, 0.01, 0.01, 0.01, 0.02])
    found = distilled(changed(time=(0.02, 0.02, 0.02)))
    assert np.isfinite(found.gradient).all()


def test_bad_choices_are_refused():
    for values, match in (
        ({"method": "imm"}, "did you mean"),
        ({"interval": 0.0}, "interval"),
        ({"inversion": 0}, "inversion"),
    ):
        with pytest.raises(InputError, match=match):
            DistillationConfig(**values)
