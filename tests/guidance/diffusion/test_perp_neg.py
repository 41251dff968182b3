"""Perp-Neg on vectors, and on a mixture of Gaussians whose score is known."""

from types import SimpleNamespace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from jaxphys.guidance.diffusion.perp_neg import Negatives, perpendicular, steered
from jaxphys.guidance.diffusion.schedule import Schedule, expand
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig, guided_estimate

MEANS = jnp.asarray(np.random.default_rng(0).normal(size=(3, 6)))
SPREAD = 0.6
CONFIG = DistillationConfig(guidance=4.0, rescale=0.0, limit=None)


class Shares(NamedTuple):
    """(B, 3) of the mixture's parts."""

    shares: Array


class MixturePrior:
    """The exact denoiser of sum_k share_k N(MEANS[k], SPREAD^2), the shares being the condition."""

    def __init__(self, kind):
        self.config = SimpleNamespace(kind=kind)
        self.schedule = Schedule()

    def __call__(self, noisy, time, condition):
        alpha, sigma = (expand(s, noisy) for s in self.schedule.alpha_sigma(time))
        variance = alpha**2 * SPREAD**2 + sigma**2
        away = noisy[:, None] - alpha[:, None] * MEANS
        near = -0.5 * jnp.sum(away**2, -1) / variance
        part = jax.nn.softmax(near + jnp.log(condition.shares), axis=1)
        noise = sigma * jnp.sum(part[..., None] * away, 1) / variance
        clean = (noisy - sigma * noise) / alpha
        kinds = {"clean": clean, "noise": noise, "velocity": alpha * noise - sigma * clean}
        return kinds[self.config.kind]


def test_projection_of_known_vectors():
    direction = jnp.array([[3.0, 4.0, 0.0], [1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [2.0, 0.0, 0.0]])
    reference = jnp.array([[5.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    expected = [[0.0, 4.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]
    np.testing.assert_allclose(perpendicular(direction, reference), expected, atol=1e-15)
    # A sample is one vector, whatever its shape.
    square = perpendicular(jnp.ones((1, 2, 2)), jnp.array([[[1.0, 0.0], [0.0, 0.0]]]))
    np.testing.assert_allclose(square, [[[0.0, 1.0], [1.0, 1.0]]])


def test_steering_by_hand():
    """u = (1, 1), d = (2, 0), e - u = (3, 4): half its perpendicular part away, times 10."""
    told, untold, other = jnp.array([[3.0, 1.0]]), jnp.array([[1.0, 1.0]]), jnp.array([[4.0, 5.0]])
    found = steered(told, untold, (other,), jnp.array([[0.5]]), 10.0)
    np.testing.assert_allclose(found, [[21.0, -19.0]])
    np.testing.assert_allclose(steered(told, untold, (other,), jnp.zeros((1, 1)), 10.0), [[21, 1]])


def mixture(kind, weight):
    """Noise told, untold, told of the other part, and steered, at 300 places; all (300, 6)."""
    prior = MixturePrior(kind)
    count = 300
    noisy = jax.random.normal(jax.random.key(0), (count, 6)) * 1.2
    time = jnp.linspace(0.05, 0.95, count)
    one = jnp.ones((count, 1))
    wanted, other = (
        Shares(one * jnp.array([0.9, 0.05, 0.05])),
        Shares(one * jnp.array([0.5, 0.5, 1e-9])),
    )
    anything = Shares(one / 3 * jnp.ones(3))
    negatives = Negatives((other,), jnp.full((1, count), weight))
    found = guided_estimate(prior, noisy, time, wanted, anything, CONFIG, negatives).noise
    alone = [
        guided_estimate(prior, noisy, time, told, told, CONFIG).noise
        for told in (wanted, anything, other)
    ]
    return (*alone, found)


@pytest.mark.parametrize("kind", ["clean", "noise", "velocity"])
def test_steering_never_pushes_against_the_prompt(kind):
    told, untold, other, found = mixture(kind, 3.0)
    toward, change = told - untold, found - untold
    length = (toward**2).sum(1)
    np.testing.assert_allclose(
        (change * toward).sum(1), CONFIG.guidance * length, rtol=1e-6, atol=1e-12
    )
    # Negative control: the negative's whole direction taken away does push against it.
    plain = CONFIG.guidance * (toward - 3.0 * (other - untold))
    assert ((plain * toward).sum(1) < 0).sum() > 30
    # And it does steer: what it adds is against the negative direction.
    beside = change - CONFIG.guidance * toward
    assert ((beside * (other - untold)).sum(1) <= 1e-9).all()
    assert np.abs(beside).max() > 0.1


def test_without_weight_it_is_plain_guidance():
    told, untold, _, found = mixture("noise", 0.0)
    np.testing.assert_allclose(found, untold + CONFIG.guidance * (told - untold), atol=1e-9)
