"""The elastic response of every law at a standing history, by differences of its own energy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core import packed
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN, lame
from jaxphys.mpm.materials.fracture import FRACTURE
from jaxphys.mpm.materials.plasticity import DRUCKER_PRAGER, VON_MISES
from jaxphys.mpm.materials.trial import pulled_back, rest_stiffness, tangent

LAWS = (NEO_HOOKEAN, FIXED_COROTATED, HENCKY, VON_MISES, DRUCKER_PRAGER, FRACTURE)
VALUES = {
    "youngs_modulus": 1e3,
    "poisson_ratio": 0.3,
    "yield_stress": 1.0,
    "hardening": 0.0,
    "friction_angle": 30.0,
    "fracture_strain": 0.1,
    "softening_strain": 0.1,
}
MU, LAM = 1e3 / 2.6, 1e3 * 0.3 / (1.3 * 0.4)
# Particles: at rest, two equal stretches, all different; a turn that is none, and one that is.
random = np.random.default_rng(0)
TURN = np.linalg.qr(random.normal(size=(3, 3)))[0]
STARTS = [np.eye(3), TURN @ np.diag([1.1, 1.1, 0.9]), TURN @ np.diag([1.2, 0.95, 1.05])]
F = jnp.asarray(np.stack([*STARTS, *STARTS], axis=-1))
TURNS = jnp.asarray(
    np.concatenate([np.zeros((3, 3, 3)), 0.1 * random.normal(size=(3, 3, 3))], axis=-1)
)


def parts(law):
    parameters = {name: jnp.asarray(VALUES[name]) for name in law.parameters}
    rows = len(law.history)
    history = jnp.broadcast_to(jnp.asarray([0.4, 0.0])[:rows, None], (rows, 6))
    return parameters, history


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_response_is_the_slope_of_energy_and_the_tangent_that_of_the_response(law):
    """Also at rest and at two equal stretches, where eigenvectors are no functions of F."""
    parameters, history = parts(law)

    def energy(turn):
        G = turn + jnp.eye(3)[..., None]
        return law.energy(parameters, jnp.einsum("ijp,jkp->ikp", G, F), history)

    both = jax.jit(lambda turn: tangent(law, parameters, F, history, turn))
    stored = jax.jit(energy)
    response, second = both(TURNS)
    full = np.asarray(second)[packed.places(9)]
    h = 1e-5
    for k, (i, j) in enumerate((i, j) for i in range(3) for j in range(3)):
        way = jnp.zeros((3, 3, 1)).at[i, j].set(h)
        slope = (stored(TURNS + way) - stored(TURNS - way)) / (2 * h)
        # A second derivative that jumps leaves a difference h / 4 of the jump away.
        close = 1e-5 if law is FRACTURE else 1e-6
        np.testing.assert_allclose(response[i, j], slope, atol=close * 1e3)
        change = (both(TURNS + way)[0] - both(TURNS - way)[0]) / (2 * h)
        if law is FRACTURE:
            # Tension starts at a strain of zero: no second derivative there.
            change, here = change[..., 2:3], full[k][:, 2:3]
        else:
            here = full[k]
        np.testing.assert_allclose(here, change.reshape(9, -1), atol=1e-5 * 1e3)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_stiffness_at_rest_in_closed_form(law):
    parameters, _ = parts(law)
    expected = np.sqrt(9 * LAM**2 + 12 * LAM * MU + 24 * MU**2)
    found = jax.jit(lambda F: rest_stiffness(law, parameters, F))(F[..., :2])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_response_includes_the_change_of_frame():
    """Not the stress itself: tau(G F) G^-T."""
    parameters, history = parts(NEO_HOOKEAN)
    found = pulled_back(NEO_HOOKEAN, parameters, F, history, TURNS)
    G = np.moveaxis(np.asarray(TURNS), -1, 0) + np.eye(3)
    after = G @ np.moveaxis(np.asarray(F), -1, 0)
    mu, lam = (float(x) for x in lame(parameters))
    b = after @ np.swapaxes(after, 1, 2)
    tau = mu * (b - np.eye(3)) + lam * np.log(np.linalg.det(after))[:, None, None] * np.eye(3)
    expected = tau @ np.swapaxes(np.linalg.inv(G), 1, 2)
    np.testing.assert_allclose(np.moveaxis(np.asarray(found), -1, 0), expected, atol=1e-9)
