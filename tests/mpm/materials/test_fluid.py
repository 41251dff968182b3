import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.materials.fluid import FLUID, INVISCID
from jaxphys.mpm.stepping.bounds import viscous_bound

from .driver import drive, values_of

NUMBERS = {"bulk_modulus": 7e4, "viscosity": 3.0}
SHEAR = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def test_simple_shear_gives_newtons_stress_and_no_memory_of_shape():
    tau, _, F = drive(FLUID, values_of(FLUID, NUMBERS), np.stack([SHEAR] * 50), 1e-2)
    expected = np.zeros((3, 3))
    expected[0, 1] = expected[1, 0] = 3.0 * 2.0
    np.testing.assert_allclose(tau[-1], expected, atol=1e-9)
    np.testing.assert_allclose(F, np.eye(3), atol=1e-13)  # sheared by 1 in all


def test_a_spin_makes_no_stress():
    spin = np.array([[0.0, -5.0, 0.0], [5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    tau, _, _ = drive(FLUID, values_of(FLUID, NUMBERS), spin[None], 1e-6)
    # The volume of I + dt C is 1 + (5 dt)^2: some 2e-11 of the bulk modulus.
    np.testing.assert_allclose(tau[0], 0, atol=1e-5)


@pytest.mark.parametrize("J", [0.9, 1.0, 1.1])
def test_pressure_is_that_of_tait(J):
    F = J ** (1 / 3) * np.eye(3)
    tau, _, kept = drive(
        FLUID, values_of(FLUID, NUMBERS), np.zeros((1, 3, 3)), 1e-3, F=jnp.array(F)
    )
    pressure = 1e4 * (J**-7 - 1)
    np.testing.assert_allclose(tau[0], -J * pressure * np.eye(3), atol=1e-8)
    np.testing.assert_allclose(kept, F, atol=1e-15)


def test_viscosity_resists_the_change_of_shape_only():
    """Swelling at 0.3/s a direction, with a stretch along x on top."""
    rate = np.diag([0.3 + 0.2, 0.3 - 0.1, 0.3 - 0.1])
    dt = 1e-7
    tau, _, _ = drive(FLUID, values_of(FLUID, NUMBERS), rate[None], dt)
    pressure = 1e4 * ((1 + 0.9 * dt) ** -7 - 1)
    expected = np.diag([0.2, -0.1, -0.1]) * 2 * 3.0 - pressure * np.eye(3)
    np.testing.assert_allclose(tau[0], expected, rtol=1e-5, atol=1e-6)


def test_without_viscosity_nothing_of_it_is_left():
    assert FLUID.reduced({"viscosity": 0.0}) is INVISCID and INVISCID.viscosity is None
    tau, _, _ = drive(INVISCID, values_of(INVISCID, NUMBERS), SHEAR[None], 1e-2)
    np.testing.assert_allclose(tau[0], 0, atol=1e-9)


@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.05, False)])
def test_the_viscous_bound_is_that_of_a_particle_alone(share, stable):
    """Alone, C' = C - dt (4 / dx^2) tau / rho, here with the stress of that very C."""
    spacing, density = 0.1, 1000.0
    values = values_of(FLUID, {"bulk_modulus": 1e-6, "viscosity": 50.0})
    dt = share * float(viscous_bound(FLUID, values, jnp.full(1, density), spacing)[0])
    C = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) * 1e-3
    for _ in range(400):
        tau, _, _ = drive(FLUID, values, C[None], dt)
        C = C - dt * 4 / spacing**2 * np.asarray(tau[0]) / density
    assert (np.abs(C).max() < 1e-3) == stable
