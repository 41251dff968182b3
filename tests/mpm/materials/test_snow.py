import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials.elasticity import FIXED_COROTATED
from jaxphys.mpm.materials.snow import HARDEST, SNOW
from jaxphys.mpm.stepping.bounds import hard_limit

from .driver import drive, values_of

NUMBERS = {
    "youngs_modulus": 1.4e5,
    "poisson_ratio": 0.2,
    "critical_compression": 0.025,
    "critical_stretch": 0.0075,
    "packing_hardening": 10.0,
}
STILL = np.zeros((1, 3, 3))


def pressed(stretches, history=None):
    return drive(
        SNOW, values_of(SNOW, NUMBERS), STILL, 1e-3, jnp.asarray(np.diag(stretches)), history
    )


def test_up_to_the_critical_strains_it_is_elastic():
    F = jnp.asarray(np.diag([0.976, 1.0074, 1.0]))
    tau, history, kept = pressed([0.976, 1.0074, 1.0])
    elastic, _, _ = drive(FIXED_COROTATED, values_of(FIXED_COROTATED, NUMBERS), STILL, 1e-3, F)
    np.testing.assert_allclose(tau, elastic, rtol=1e-9, atol=1e-9)
    assert float(history[0, 0]) == pytest.approx(0, abs=1e-15)
    np.testing.assert_array_equal(kept, F)


def test_uniaxial_packing_hardens_by_what_was_lost_for_good():
    """Pressed to 1 - 2 thc: the elastic part stays 1 - thc, Jp = (1 - 2 thc) / (1 - thc)."""
    tau, history, kept = pressed([0.95, 1.0, 1.0])
    plastic = 0.95 / 0.975
    assert float(np.exp(history[0, 0])) == pytest.approx(plastic, rel=1e-12)
    np.testing.assert_allclose(kept, np.diag([0.975, 1.0, 1.0]), atol=1e-14)
    mu, lam = 1.4e5 / 2.4, 1.4e5 * 0.2 / (1.2 * 0.6)
    factor = np.exp(10 * (1 - plastic))
    along = 2 * mu * (0.975 - 1) * 0.975 + lam * (0.975 - 1) * 0.975
    across = lam * (0.975 - 1) * 0.975
    np.testing.assert_allclose(tau[0], factor * np.diag([along, across, across]), rtol=1e-9)


def test_pulled_apart_it_softens_to_powder():
    values = values_of(SNOW, NUMBERS)
    pulled = np.stack([np.diag([1.0, 1.0, 1.0])] * 200)
    tau, history, _ = drive(SNOW, values, pulled, 5e-3)
    assert float(np.exp(history[-1, 0])) > 2
    assert np.abs(tau[-1]).max() < 1e-3 * np.abs(tau).max()


def test_hardening_ends_somewhere_and_the_bound_knows_it():
    values = values_of(SNOW, NUMBERS)
    matter = (jnp.eye(3)[..., None], jnp.full(1, 400.0), 0.05)
    soft = float(hard_limit(SNOW, values, *matter)[0])
    for lost, factor in ((0.1, np.exp(10 * 0.1)), (0.7, np.exp(HARDEST))):
        history = jnp.full((1, 1), np.log(1 - lost))
        present = SNOW.present(values, history)
        stiff = float(hard_limit(SNOW, present, *matter)[0])
        assert soft / stiff == pytest.approx(np.sqrt(factor), rel=1e-6)
        _, tau, _ = SNOW.update(values, 0.99 * jnp.eye(3)[..., None], history, 1e-3)
        _, fresh, _ = SNOW.update(values, 0.99 * jnp.eye(3)[..., None], 0 * history, 1e-3)
        assert float(tau[0, 0, 0] / fresh[0, 0, 0]) == pytest.approx(factor, rel=1e-9)
