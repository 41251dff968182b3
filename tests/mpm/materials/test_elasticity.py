import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials import elasticity
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN

LAWS = [NEO_HOOKEAN, FIXED_COROTATED, HENCKY]
E, NU = 1.3, 0.3
DT = 1e-3
VALUES = {"youngs_modulus": jnp.asarray(E), "poisson_ratio": jnp.asarray(NU)}
MU, LAM = (float(x) for x in elasticity.lame(VALUES))
NONE = jnp.zeros((0, 1))  # no history
SAMPLES = np.eye(3)[:, :, None] + 0.15 * np.random.default_rng(2).normal(size=(3, 3, 20))
SAMPLES[:, :, 0] = np.eye(3)
SAMPLES[:, :, 1] = np.diag([1.2, 1.2, 0.9])


def stress(law, F, values=VALUES):
    return law.update(values, F, jnp.zeros((0, F.shape[-1]), F.dtype), DT)[1]


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_stress_is_the_derivative_of_the_energy(law):
    random = np.random.default_rng(21)
    F = jnp.asarray(SAMPLES)
    P = jax.grad(lambda F: jnp.sum(law.energy(VALUES, F, NONE)))(F)
    np.testing.assert_allclose(stress(law, F), jnp.einsum("ikn,jkn->ijn", P, F), atol=1e-13)
    dF = random.normal(size=F.shape)
    h = 1e-6
    up, down = (law.energy(VALUES, F + side * h * dF, NONE) for side in (1, -1))
    difference = (up - down) / (2 * h)
    np.testing.assert_allclose(jnp.sum(P * dF, (0, 1)), difference, atol=1e-8)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_energy_of_stretches_is_that_of_the_gradient_and_never_negative(law):
    U, s, Vt = np.linalg.svd(np.moveaxis(SAMPLES, -1, 0))
    assert (np.linalg.det(U @ Vt) > 0).all()
    energy = law.energy(VALUES, jnp.asarray(SAMPLES), NONE)
    np.testing.assert_allclose(law.principal_energy(VALUES, s.T), energy, atol=1e-14)
    assert (energy >= 0).all() and energy[0] == 0 and (energy[1:] > 0).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_a_rotation_makes_no_stress_and_turns_what_there_is(law, dtype):
    random = np.random.default_rng(22)
    R = np.linalg.qr(random.normal(size=(3, 3)))[0]
    R = R * np.sign(np.linalg.det(R))
    values = {name: value.astype(dtype) for name, value in VALUES.items()}
    eps = np.finfo(dtype).eps
    still = stress(law, jnp.asarray(R[:, :, None], dtype), values)
    assert still.dtype == dtype and jnp.abs(still).max() < 20 * eps
    F = SAMPLES.astype(dtype)
    turned = stress(law, jnp.asarray(np.einsum("ij,jkn->ikn", R, F).astype(dtype)), values)
    expected = np.einsum("ij,jkn,lk->iln", R, stress(law, jnp.asarray(F), values), R)
    np.testing.assert_allclose(turned, expected, atol=100 * eps)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_small_strains_give_linear_elasticity(law):
    strain = np.array([[2.0, 1.0, 0.0], [1.0, -1.0, 0.5], [0.0, 0.5, 1.0]]) * 1e-7
    F = jnp.asarray((np.eye(3) + strain)[:, :, None])
    linear = 2 * MU * strain + LAM * np.trace(strain) * np.eye(3)
    np.testing.assert_allclose(stress(law, F)[:, :, 0], linear, atol=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_uniaxial_closed_forms(law):
    s = 1.4
    expected = {
        "neo-Hookean": (MU * (s**2 - 1) + LAM * np.log(s), LAM * np.log(s)),
        "fixed corotated": (2 * MU * (s - 1) * s + LAM * (s - 1) * s, LAM * (s - 1) * s),
        "Hencky": ((2 * MU + LAM) * np.log(s), LAM * np.log(s)),
    }[law.name]
    tau = stress(law, jnp.asarray(np.diag([s, 1, 1])[:, :, None]))[:, :, 0]
    np.testing.assert_allclose(tau, np.diag([*expected, expected[1]]), atol=1e-14)


def test_fixed_corotated_pushes_an_inverted_particle_back():
    F = jnp.asarray(np.diag([1.0, 1.0, -0.1])[:, :, None])
    P = jax.grad(lambda F: jnp.sum(FIXED_COROTATED.energy(VALUES, F, NONE)))(F)
    np.testing.assert_allclose(
        stress(FIXED_COROTATED, F)[:, :, 0], (P[:, :, 0] @ F[:, :, 0].T), atol=1e-14
    )
    assert P[2, 2, 0] < 0  # growing F_zz, towards 1, lowers the energy


def test_which_laws_can_be_pressed_to_nothing():
    """Fixed corotated stores mu + lambda / 2 in a sheet; the others ever more, like log(J)^2."""
    sheets = jnp.asarray(np.stack([[1, 1, 1e-6], [1, 1, 1e-12]], axis=-1))
    flat = FIXED_COROTATED.principal_energy(VALUES, sheets)
    np.testing.assert_allclose(flat, MU + LAM / 2, rtol=1e-5)
    for law in (NEO_HOOKEAN, HENCKY):
        once, twice = law.principal_energy(VALUES, sheets)
        assert twice > 2.5 * once > 50 * (MU + LAM / 2)


def test_neo_hookean_reports_inversion_as_not_a_number():
    tau = stress(NEO_HOOKEAN, jnp.asarray(np.diag([1.0, 1.0, -0.1])[:, :, None]))
    assert jnp.isnan(tau).any()


def test_the_transposed_hencky_stress_of_the_paper_is_not_the_derivative():
    """The supplement's tau = V (...) V^T, which the energy refutes."""
    F = SAMPLES[:, :, 5]
    _, s, Vt = np.linalg.svd(F)
    e = np.log(s)
    slip = Vt.T @ np.diag(2 * MU * e + LAM * e.sum()) @ Vt
    assert np.abs(slip - stress(HENCKY, jnp.asarray(F[:, :, None]))[:, :, 0]).max() > 0.01


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_gradients_of_the_stress(law):
    random = np.random.default_rng(23)
    F = jnp.asarray(SAMPLES)
    weight = random.normal(size=F.shape)
    dF = random.normal(size=F.shape)

    def loss(F, values):
        return jnp.sum(weight * stress(law, F, values))

    gF, gv = jax.grad(loss, (0, 1))(F, VALUES)
    h = 1e-6
    along = (loss(F + h * dF, VALUES) - loss(F - h * dF, VALUES)) / (2 * h)
    assert float(jnp.sum(gF * dF)) == pytest.approx(float(along), rel=1e-6)
    for name in VALUES:
        up = loss(F, VALUES | {name: VALUES[name] + h})
        down = loss(F, VALUES | {name: VALUES[name] - h})
        assert float(gv[name]) == pytest.approx(float(up - down) / (2 * h), rel=1e-6)
    low = jax.grad(loss)(F.astype(np.float32), {k: v.astype(np.float32) for k, v in VALUES.items()})
    np.testing.assert_allclose(low, gF, atol=2e-3)
