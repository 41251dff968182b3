import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.fibres import FIBRES, fibre_direction
from jaxphys.mpm.stepping.bounds import rest_moduli

from .driver import drive, values_of

NUMBERS = {
    "youngs_modulus": 1e4,
    "poisson_ratio": 0.3,
    "fibre_stiffness": 5e3,
    "fibre_stiffening": 0.7,
    "fibre_azimuth": 30.0,
    "fibre_elevation": 50.0,
}
STILL = np.zeros((1, 3, 3))


def stress(law, F, numbers=NUMBERS):
    return np.asarray(drive(law, values_of(law, numbers), STILL, 1e-3, jnp.asarray(F))[0][0])


def direction(azimuth, elevation):
    a, b = np.radians([azimuth, elevation])
    return np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])


def test_angles_are_those_of_a_globe():
    values = values_of(FIBRES, NUMBERS)
    np.testing.assert_allclose(fibre_direction(values)[:, 0], direction(30, 50), atol=1e-15)
    raw = {name: jnp.asarray(NUMBERS[name]) for name in NUMBERS}
    np.testing.assert_allclose(fibre_direction(raw), direction(30, 50), atol=1e-15)


def test_stretched_along_the_fibres_in_closed_form():
    """tau = neo-Hookean + 2 k1 (s^2 - 1) exp(k2 (s^2 - 1)^2) s^2 along them."""
    a, s = direction(30, 50), 1.2
    F = np.eye(3) + (s - 1) * np.outer(a, a)
    added = 2 * 5e3 * (s**2 - 1) * np.exp(0.7 * (s**2 - 1) ** 2) * s**2
    expected = stress(NEO_HOOKEAN, F) + added * np.outer(a, a)
    np.testing.assert_allclose(stress(FIBRES, F), expected, rtol=1e-12, atol=1e-9)


def test_pressed_along_them_or_stretched_across_they_bear_nothing():
    a = direction(30, 50)
    across = np.cross(a, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    for F in (np.eye(3) - 0.2 * np.outer(a, a), np.eye(3) + 0.3 * np.outer(across, across)):
        np.testing.assert_allclose(stress(FIBRES, F), stress(NEO_HOOKEAN, F), rtol=1e-12, atol=1e-9)


def test_the_matter_has_a_direction_and_the_world_has_none():
    random = np.random.default_rng(0)
    F = np.eye(3) + 0.2 * random.normal(size=(3, 3))
    R = np.linalg.qr(random.normal(size=(3, 3)))[0]
    R *= np.sign(np.linalg.det(R))
    np.testing.assert_allclose(stress(FIBRES, R @ F), R @ stress(FIBRES, F) @ R.T, atol=1e-8)
    assert np.abs(stress(FIBRES, F @ R) - stress(FIBRES, F)).max() > 100


@pytest.mark.parametrize("stretch", [1.0, 1.3])
def test_its_modulus_is_the_largest_resistance_to_any_strain(stretch):
    """By differences of the stress over nine displacements, and at rest with what is stretched."""
    a = direction(30, 50)
    F = np.eye(3) + (stretch - 1) * np.outer(a, a)
    values = values_of(FIBRES, NUMBERS)
    if stretch == 1:
        F = F + 1e-4 * np.outer(a, a)
    columns = []
    for k in range(9):
        H = np.zeros(9)
        H[k] = 1e-6
        moved = [stress(FIBRES, (np.eye(3) + side * H.reshape(3, 3)) @ F) for side in (1, -1)]
        columns.append((moved[0] - moved[1]).reshape(9) / 2e-6)
    tangent = np.stack(columns, axis=1)
    expected = np.linalg.eigvalsh((tangent + tangent.T) / 2)[-1]
    found = float(FIBRES.moduli(values, jnp.asarray(F)[..., None])[1][0])
    assert expected < found < 1.05 * expected
    if stretch == 1:
        wave, lone = (float(x[0]) for x in rest_moduli(FIBRES, values, jnp.ones(1)))
        mu, lam = 1e4 / 2.6, 1e4 * 0.3 / (1.3 * 0.4)
        assert wave == pytest.approx(lam + 2 * mu + 4 * 5e3)
        assert 0.98 * expected < lone < 1.35 * expected
