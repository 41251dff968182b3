import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials.cohesion import WET_SAND
from jaxphys.mpm.materials.plasticity import DRUCKER_PRAGER

from .driver import drive, values_of

NUMBERS = {
    "youngs_modulus": 1e6,
    "poisson_ratio": 0.3,
    "friction_angle": 30.0,
    "cohesion": 2e3,
}
STILL = np.zeros((1, 3, 3))


def strained(e, **changes):
    values = values_of(WET_SAND, NUMBERS | changes)
    return drive(WET_SAND, values, STILL, 1e-3, jnp.asarray(np.diag(np.exp(e))))


@pytest.mark.parametrize("angle", [0.0, 20.0, 40.0])
def test_triaxial_compression_follows_mohr_and_coulomb(angle):
    """Pressed along z: (s1 - s3) = (s1 + s3) sin(phi) + 2 c cos(phi), pressures positive."""
    tau, _, _ = strained([0.01, 0.01, -0.05], friction_angle=angle)
    side, _, axial = -np.diagonal(np.asarray(tau[0]))
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    assert axial - side == pytest.approx((axial + side) * sine + 2 * 2e3 * cosine, rel=1e-9)
    assert axial > side > 0


def test_without_cohesion_it_is_dry_sand():
    assert WET_SAND.reduced({"cohesion": 0.0}) is DRUCKER_PRAGER
    rates = np.random.default_rng(1).normal(size=(60, 3, 3))
    dry, kept, _ = drive(DRUCKER_PRAGER, values_of(DRUCKER_PRAGER, NUMBERS), rates, 2e-3)
    values = values_of(WET_SAND, NUMBERS | {"cohesion": 0.0})
    ours, also, _ = drive(WET_SAND, values, rates, 2e-3)
    np.testing.assert_allclose(ours, dry, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(also, kept, rtol=1e-9, atol=1e-12)
    assert float(jnp.max(kept)) > 0  # it has come apart on the way


def test_it_comes_apart_beyond_the_tip_of_the_cone_and_holds_again_once_pressed():
    """The tip: a tension of c cot(phi), a log strain of that over 3 lambda + 2 mu a direction."""
    tip = 2e3 / np.tan(np.radians(30)) / (1e6 / 0.4)
    tau, history, _ = strained([0.99 * tip] * 3)
    np.testing.assert_allclose(tau[0], 0.99 * 2e3 / np.tan(np.radians(30)) * np.eye(3), rtol=1e-9)
    assert float(history[0, 0]) == 0
    tau, history, F = strained([1.01 * tip] * 3)
    np.testing.assert_allclose(tau[0], 0, atol=1e-9)
    np.testing.assert_allclose(F, np.eye(3), atol=1e-12)
    assert float(history[0, 0]) == pytest.approx(3.03 * tip)
    values = values_of(WET_SAND, NUMBERS)
    squeezed, again = (jnp.asarray(np.exp(e) * np.eye(3)) for e in (-0.5 * tip, -1.02 * tip))
    for F, whole in ((squeezed, False), (again, True)):
        tau, after, F = drive(WET_SAND, values, STILL, 1e-3, F, history.T)
        assert (float(after[0, 0]) == 0) == whole == bool(np.abs(tau).max() > 1)
    pulled, _, _ = drive(WET_SAND, values, STILL, 1e-3, np.exp(0.5 * tip) * F, after.T)
    assert float(pulled[0, 0, 0]) > 0


def test_it_bears_shear_without_pressure():
    small, _, _ = strained([5e-4, -5e-4, 0.0])
    large, _, _ = strained([0.05, -0.05, 0.0])
    mu = 1e6 / 2.6
    np.testing.assert_allclose(
        np.diagonal(small[0]), 2 * mu * np.array([5e-4, -5e-4, 0]), atol=1e-6
    )
    size = np.sqrt(np.sum(np.asarray(large[0]) ** 2))
    sine = 0.5
    assert size == pytest.approx(np.sqrt(2 / 3) * 6 * 2e3 * np.sqrt(0.75) / (3 - sine), rel=1e-9)
