import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials.plasticity import PERFECT_VON_MISES
from jaxphys.mpm.materials.viscoplasticity import HERSCHEL_BULKLEY, PLASTICINE, shear_rate

from .driver import drive, values_of

MU, BULK = 1e5, 1e6
CREAM = {
    "bulk_modulus": BULK,
    "shear_modulus": MU,
    "shear_yield_stress": 30.0,
    "consistency": 20.0,
    "flow_index": 0.5,
}
PURE = np.array([[0.0, 0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])  # of shear rate 1/s
SIMPLE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize("kind", ["pure", "simple"])
@pytest.mark.parametrize("index", [0.5, 1.0, 1.8])
@pytest.mark.parametrize("rate", [0.1, 4.0])
def test_steady_shear_is_what_a_rheometer_measures(kind, index, rate):
    values = values_of(HERSCHEL_BULKLEY, CREAM | {"flow_index": index})
    C = rate * (PURE if kind == "pure" else SIMPLE)
    tau, _, F = drive(HERSCHEL_BULKLEY, values, np.stack([C] * 3000), 2e-4 / rate)
    expected = 30.0 + 20.0 * rate**index
    # The elastic strain is tau / mu; simple shear turns it by as much.
    assert float(tau[-1, 0, 1]) == pytest.approx(expected, rel=2e-3)
    np.testing.assert_allclose(np.linalg.det(F), 1, atol=1e-4)


def test_below_yield_it_is_elastic():
    values = values_of(HERSCHEL_BULKLEY, CREAM)
    tau, _, F = drive(HERSCHEL_BULKLEY, values, PURE[None], 2.9e-4)
    assert float(tau[0, 0, 1]) == pytest.approx(MU * 2.9e-4, rel=1e-6)
    np.testing.assert_array_equal(F, np.eye(3) + 2.9e-4 * PURE)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_rate_solves_its_equation(dtype):
    random = np.random.default_rng(4)
    excess, stiffness, consistency = (
        10.0 ** random.uniform(low, high, 400).astype(dtype)
        for low, high in ((-3, 5), (-2, 4), (-3, 4))
    )
    index = random.uniform(0.15, 3.5, 400).astype(dtype)
    rate = np.asarray(shear_rate(excess, stiffness, consistency, index))
    assert rate.dtype == dtype and (rate > 0).all()
    left = np.float64(consistency) * np.float64(rate) ** index + np.float64(stiffness) * rate
    np.testing.assert_allclose(left, excess, rtol=400 * np.finfo(dtype).eps)
    assert not shear_rate(-excess, stiffness, consistency, index).any()


def test_derivatives_of_the_rate():
    at = tuple(jnp.array(x) for x in ([2.0, 7.0], [3.0, 0.1], [1.5, 4.0], [0.4, 1.7]))
    for k in range(4):
        h = 1e-6
        moved = [tuple(x + side * h * (i == k) for i, x in enumerate(at)) for side in (1, -1)]
        slope = (shear_rate(*moved[0]) - shear_rate(*moved[1])) / (2 * h)
        tangents = tuple(jnp.full(2, float(i == k)) for i in range(4))
        np.testing.assert_allclose(jax.jvp(shear_rate, at, tangents)[1], slope, rtol=1e-7)
    # At the yield edge a thinning fluid starts to flow with a slope of zero.
    gradient = jax.grad(lambda x: shear_rate(x, jnp.array(3.0), jnp.array(1.0), jnp.array(0.5)))
    assert float(gradient(jnp.array(0.0))) == 0 and 0 < float(gradient(jnp.array(1e-9))) < 1e-8


def test_an_index_of_one_is_binghams_fluid_which_plasticine_is():
    """The shear yield stress is the uniaxial one over sqrt(3)."""
    E, nu = 9 * BULK * MU / (3 * BULK + MU), (3 * BULK - 2 * MU) / (2 * (3 * BULK + MU))
    plasticine = values_of(
        PLASTICINE,
        {"youngs_modulus": E, "poisson_ratio": nu, "yield_stress": 30 * np.sqrt(3),
         "plastic_viscosity": 20.0},
    )  # fmt: skip
    cream = values_of(HERSCHEL_BULKLEY, CREAM | {"flow_index": 1.0})
    rates = np.random.default_rng(0).normal(size=(60, 3, 3))
    ours, _, _ = drive(HERSCHEL_BULKLEY, cream, rates, 1e-3)
    theirs, _, _ = drive(PLASTICINE, plasticine, rates, 1e-3)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-8)


CLAY = {"youngs_modulus": 1e5, "poisson_ratio": 0.3, "yield_stress": 300.0}


def test_plasticine_without_viscosity_is_perfectly_plastic():
    rates = np.random.default_rng(0).normal(size=(40, 3, 3))
    clay = values_of(PLASTICINE, CLAY | {"plastic_viscosity": 0.0})
    ours, _, _ = drive(PLASTICINE, clay, rates, 1e-3)
    theirs, _, _ = drive(PERFECT_VON_MISES, values_of(PERFECT_VON_MISES, CLAY), rates, 1e-3)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def test_plasticine_creeps_back_to_its_yield_stress():
    """Held at a strain, what exceeds the yield stress decays as exp(-2 mu t / (2 eta))."""
    eta = 500.0
    clay = values_of(PLASTICINE, CLAY | {"plastic_viscosity": eta})
    mu = 1e5 / 2.6
    time = eta / mu
    dt = 1e-3 * time
    e = 0.05
    F = jnp.asarray(np.diag([np.exp(e), np.exp(-e), 1.0]))
    tau, _, _ = drive(PLASTICINE, clay, np.zeros((2000, 3, 3)), dt, F=F)
    size = np.sqrt(np.sum(np.asarray(tau) ** 2, axis=(1, 2)))
    edge = np.sqrt(2 / 3) * 300.0
    t = dt * np.arange(1, 2001)
    expected = edge + (2 * mu * e * np.sqrt(2) - edge) * np.exp(-t / time)
    np.testing.assert_allclose(size, expected, rtol=2e-3)
