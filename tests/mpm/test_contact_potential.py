"""The potential of contact: its slope is the push that explicit steps give, and its friction is
Coulomb's.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.boundaries import Plane, Setting, prepare
from jaxphys.mpm.boundaries.potential import has_potential, lags, pushed, slipped
from jaxphys.mpm.grid import Grid

COUNT, RADIUS, K = 9, 0.05, 3.0
HEIGHTS = np.linspace(-0.06, 0.14, COUNT)
DT = 0.01


def floor(surface, friction):
    points = np.stack([np.full(COUNT, 0.5), np.full(COUNT, 0.5), 0.5 + HEIGHTS], axis=1)
    volume = np.full(COUNT, (2 * RADIUS) ** 3)
    setting = Setting(Grid((11, 11, 11), 0.2), points, volume, np.dtype(np.float64))
    plane = Plane((0.0, 0.0, 0.5), (0.0, 0.0, 1.0), surface, friction, acts_on="particles")
    (made,) = prepare((plane,), setting)
    loads = {"particle_radius": made.particle_radius, "stiffness": jnp.full(COUNT, K)}
    return made, loads, jnp.asarray(points.T)


@pytest.mark.parametrize(
    "surface, friction", [("separate", None), ("separate", 0.5), ("slip", 0.5), ("sticky", None)]
)
def test_force_is_the_slope_and_pressure_that_of_explicit_steps(surface, friction):
    plane, loads, x = floor(surface, friction)
    assert has_potential(plane)
    slip = jnp.asarray(np.random.default_rng(0).normal(size=(plane.rows, COUNT))) * 0.01
    slip = slip if plane.rows else None
    found = lags(plane, loads, x, None, jnp.zeros(()))
    start = jnp.asarray(np.random.default_rng(1).normal(size=(3, COUNT)))

    def energy(velocity):
        place = x + DT * velocity
        return pushed(plane, loads, found, slip, place, None, velocity, jnp.zeros(()), DT)

    slope = jax.grad(lambda v: jnp.sum(energy(v)[0]))(start)
    _, force = energy(start)
    np.testing.assert_allclose(-slope / DT, force, atol=1e-12)
    assert np.abs(force).max() > 0.01
    given, _ = plane.impulse(x + DT * start, 0 * start, slip, loads, jnp.zeros(()), DT, 0.0)
    np.testing.assert_allclose(force[2], given[2] / DT, atol=1e-12)


def test_friction_bears_what_pressure_allows():
    plane, loads, x = floor("separate", 0.5)
    found = lags(plane, loads, x, None, jnp.zeros(()))
    fast = jnp.zeros((3, COUNT)).at[0].set(100.0)
    slip = jnp.zeros((3, COUNT))
    _, force = pushed(plane, loads, found, slip, x, None, fast, jnp.zeros(()), DT)
    pressure = K * np.maximum(RADIUS - HEIGHTS, 0)
    np.testing.assert_allclose(force[2], pressure, atol=1e-12)
    np.testing.assert_allclose(force[0], -0.5 * pressure, atol=1e-12)
    after = slipped(plane, loads, slip, x, None, fast, jnp.zeros(()), DT)
    np.testing.assert_allclose(after[0], 0.5 * pressure / K, atol=1e-12)


def test_what_rounding_left_out_of_a_place_presses_too():
    """Of stiff matter at rest that is all there is: less than the last digit of its place."""
    plane, loads, x = floor("separate", 0.5)
    resting = x.at[2].set(0.5 + RADIUS)
    lost = jnp.array([1e-3, 0.0, -1e-9])[:, None] + jnp.zeros((3, COUNT))
    (lag,) = lags(plane, loads, resting, lost, jnp.zeros(()))
    np.testing.assert_allclose(lag.longest, 0.5e-9, rtol=1e-6)
    still = jnp.zeros((3, COUNT))
    _, force = pushed(plane, loads, (lag,), still, resting, lost, still, jnp.zeros(()), DT)
    np.testing.assert_allclose(force[2], K * 1e-9, rtol=1e-6)
