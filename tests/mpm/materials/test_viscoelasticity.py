import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.viscoelasticity import STANDARD_SOLID

from .driver import drive, values_of

E, NU, RELAXING, TIME = 2.6e4, 0.3, 3e4, 0.2
MU = 1e4
NUMBERS = {
    "youngs_modulus": E,
    "poisson_ratio": NU,
    "relaxing_modulus": RELAXING,
    "relaxation_time": TIME,
}
SIMPLE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
VALUES = values_of(STANDARD_SOLID, NUMBERS)


def test_a_step_of_shear_relaxes_to_the_spring():
    """G(t) = mu + mu_1 exp(-t / T), exactly, whatever the step."""
    g, dt = 1e-5, 0.037
    F = jnp.asarray(np.eye(3) + g * SIMPLE)
    tau, _, _ = drive(STANDARD_SOLID, VALUES, np.zeros((20, 3, 3)), dt, F=F)
    t = dt * np.arange(1, 21)
    np.testing.assert_allclose(tau[:, 0, 1] / g, MU + RELAXING * np.exp(-t / TIME), rtol=1e-6)


def test_the_start_of_a_steady_shear():
    """mu g' t + mu_1 T g' (1 - exp(-t / T))."""
    rate, dt, steps = 1e-4, 1e-3, 600
    tau, _, _ = drive(STANDARD_SOLID, VALUES, np.stack([rate * SIMPLE] * steps), dt)
    t = dt * np.arange(1, steps + 1)
    expected = rate * (MU * t + RELAXING * TIME * (1 - np.exp(-t / TIME)))
    np.testing.assert_allclose(tau[:, 0, 1], expected, rtol=4e-3)


def test_oscillation_gives_storage_and_loss():
    """G' = mu + mu_1 (w T)^2 / (1 + (w T)^2), G'' = mu_1 w T / (1 + (w T)^2)."""
    w, steps, cycles = 7.0, 2000, 8
    dt = 2 * np.pi / w * cycles / (steps * cycles)
    t = dt * np.arange(steps * cycles)
    rates = 1e-5 * w * np.cos(w * (t + dt / 2))[:, None, None] * SIMPLE
    tau, _, _ = drive(STANDARD_SOLID, VALUES, rates, dt)
    last = np.asarray(tau[-steps:, 0, 1]) / 1e-5
    at = w * (t[-steps:] + dt)
    storage, loss = (2 * np.mean(last * wave(at)) for wave in (np.sin, np.cos))
    x = w * TIME
    assert storage == pytest.approx(MU + RELAXING * x**2 / (1 + x**2), rel=2e-3)
    assert loss == pytest.approx(RELAXING * x / (1 + x**2), rel=2e-2)


def test_at_finite_strain_it_ends_where_the_spring_does_and_its_energy_falls():
    F = jnp.asarray(np.eye(3) + 0.3 * np.random.default_rng(3).normal(size=(3, 3)))
    tau, history, _ = drive(STANDARD_SOLID, VALUES, np.zeros((400, 3, 3)), TIME / 8, F=F)
    spring, _, _ = drive(
        NEO_HOOKEAN, values_of(NEO_HOOKEAN, NUMBERS), np.zeros((1, 3, 3)), 1.0, F=F
    )
    np.testing.assert_allclose(tau[-1], spring[0], rtol=1e-6, atol=1e-6)
    energies = [
        float(STANDARD_SOLID.energy(VALUES, F[..., None], h[:, None])[0]) for h in history[:40]
    ]
    assert (np.diff(energies) < 0).all() and energies[0] > 1.2 * energies[-1]
    # The volume of what flows is kept.
    inverse = np.asarray(history[-1]).reshape(3, 3) + np.eye(3)
    assert np.linalg.det(inverse) == pytest.approx(1, rel=1e-9)


def test_it_does_not_matter_how_it_is_turned():
    random = np.random.default_rng(8)
    rates = random.normal(size=(30, 3, 3))
    R = np.linalg.qr(random.normal(size=(3, 3)))[0]
    plain, _, _ = drive(STANDARD_SOLID, VALUES, rates, 5e-3)
    turned, _, _ = drive(STANDARD_SOLID, VALUES, R @ rates @ R.T, 5e-3)
    np.testing.assert_allclose(turned, R @ np.asarray(plain) @ R.T, rtol=1e-9, atol=1e-7)
