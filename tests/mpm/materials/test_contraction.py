import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.catalogue import get_material, material_values
from jaxphys.mpm.materials.contraction import CONTRACTING_FIBRES, activation
from jaxphys.mpm.materials.fibres import FIBRES
from jaxphys.mpm.stepping.bounds import moduli_of, rest_moduli

LAW = CONTRACTING_FIBRES
NUMBERS = {
    "youngs_modulus": 1.0,
    "poisson_ratio": 0.3,
    "fibre_stiffness": 0.6,
    "fibre_stiffening": 0.8,
    "fibre_azimuth": 0.0,
    "fibre_elevation": 0.0,
    "fibre_tension": 0.5,
    "contraction_period": 0.8,
}
MU, LAM = 1 / 2.6, 0.3 / (1.3 * 0.4)


def values_of(count=1, **changes):
    numbers = NUMBERS | changes
    return LAW.prepare({name: jnp.full(count, numbers[name]) for name in LAW.parameters})


def stress(F, clock, **changes):
    """Of one F (3, 3) at a time after the start."""
    history = jnp.full((1, 1), clock)
    _, tau, after = LAW.update(values_of(**changes), jnp.asarray(F)[..., None], history, 0.0)
    assert after[0, 0] == clock
    return np.asarray(tau[..., 0])


def test_the_pull_begins_slack_is_full_after_half_a_period_and_comes_again():
    clock = jnp.asarray([0.0, 0.2, 0.4, 0.6, 0.8, 1.2])
    np.testing.assert_allclose(
        activation(values_of(6), clock), [0, 0.5, 1, 0.5, 0, 1], rtol=1e-9, atol=1e-12
    )
    # The clock goes with the steps.
    history = LAW.at_start(jnp.zeros(1))
    F = jnp.eye(3)[..., None]
    for _ in range(4):
        _, tau, history = LAW.update(values_of(), F, history, 0.1)
    assert float(history[0, 0]) == pytest.approx(0.4)
    np.testing.assert_allclose(tau[..., 0], np.diag([0.5, 0, 0]), atol=1e-12)


def test_held_at_their_length_they_pull_with_their_tension_along_themselves_alone():
    np.testing.assert_allclose(stress(np.eye(3), 0.4), np.diag([0.5, 0, 0]), atol=1e-12)
    turned = stress(np.eye(3), 0.4, fibre_azimuth=90.0)
    np.testing.assert_allclose(turned, np.diag([0, 0.5, 0]), atol=1e-12)


def test_a_bar_that_is_free_shortens_to_where_the_matrix_bears_the_pull():
    """tau_xx = mu (l^2 - 1) + lambda log J + T l^2 = 0, tau_yy = mu (q^2 - 1) + lambda log J = 0 of
    stretches l along the fibres and q across; l < 1, so that they bear nothing themselves.
    """

    def across(length):
        return brentq(lambda q: MU * (q**2 - 1) + LAM * (np.log(length) + 2 * np.log(q)), 0.5, 2.0)

    def along(length):
        J = length * across(length) ** 2
        return MU * (length**2 - 1) + LAM * np.log(J) + 0.5 * length**2

    length = brentq(along, 0.4, 1.0)
    assert length < 0.8 and across(length) > 1.03
    tau = stress(np.diag([length, across(length), across(length)]), 0.4)
    np.testing.assert_allclose(tau, 0, atol=1e-9)


def test_the_stress_is_the_derivative_of_the_energy():
    rng = np.random.default_rng(0)
    F = jnp.asarray(np.eye(3) + 0.2 * rng.normal(size=(3, 3)))[..., None]
    history, values = jnp.full((1, 1), 0.3), values_of(fibre_azimuth=25.0, fibre_elevation=40.0)
    P = jax.grad(lambda F: LAW.energy(values, F, history).sum())(F)
    _, tau, _ = LAW.update(values, F, history, 0.0)
    np.testing.assert_allclose(tau, algebra.matmul_transpose(P, F), atol=1e-12)


def test_bounds_are_those_of_full_tension():
    """4 k1 and T along the fibres, beside lambda + 2 mu for waves; matter at rest is told the same
    by differentiation.
    """
    wave, _ = rest_moduli(LAW, values_of(), jnp.ones(1))
    assert float(wave[0]) == pytest.approx(LAM + 2 * MU + 4 * 0.6 + 0.5)
    rest = jnp.eye(3)[..., None]
    pulled = float(moduli_of(LAW, values_of(), rest)[1][0])
    slack = float(moduli_of(LAW, values_of(fibre_tension=1e-9), rest)[1][0])
    assert pulled > slack + 0.3


def test_without_tension_it_is_the_law_of_fibres_at_rest():
    muscle = get_material("muscle")
    assert muscle.law.reduced(material_values(muscle)) is LAW
    assert muscle.law.reduced(material_values(muscle, {"fibre_tension": 0.0})) is FIBRES
    passive = get_material("muscle", FIBRES.name, mean_volume=True)
    assert passive.law.shares_volume
    with pytest.raises(InputError, match="unknown parameter 'fibre_tension'"):
        material_values(get_material("muscle", FIBRES.name), {"fibre_tension": 1.0})
    with pytest.raises(InputError, match="remembers"):
        get_material("muscle", mean_volume=True)
