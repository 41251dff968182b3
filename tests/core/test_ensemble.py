import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.ensemble import over_devices
from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.rollout import rollout
from tests.mpm.cases import block


@pytest.mark.parametrize("in_turn", [False, True])
@pytest.mark.parametrize("members", [1, 3, 4, 9])
def test_any_number_of_members_on_any_number_of_devices(members, in_turn):
    x = jnp.arange(2.0 * members).reshape(members, 2)
    for devices in {1, jax.device_count()}:
        many = over_devices(
            lambda v, w: {"sum": jnp.sum(v) * w, "twice": 2 * v}, devices, in_turn=in_turn
        )
        found = many(x, x[:, 0])
        np.testing.assert_allclose(found["sum"], np.asarray(x).sum(1) * np.asarray(x[:, 0]))
        np.testing.assert_array_equal(found["twice"], 2 * x)


def test_gradients_go_through():
    x = jnp.array([0.3, -1.2, 2.0])
    slope = jax.grad(lambda x: jnp.sum(over_devices(jnp.sin)(x) ** 2))(x)
    np.testing.assert_allclose(slope, np.sin(2 * x), rtol=1e-12)


@pytest.mark.parametrize("in_turn", [False, True])
def test_gradients_reach_what_is_closed_over(in_turn):
    x = jnp.array([0.3, -1.2, 2.0, 0.7, 1.1])

    def total(a):
        return jnp.sum(over_devices(lambda x: jnp.sin(a * x), in_turn=in_turn)(x))

    for slope in (jax.grad(total), jax.jit(jax.grad(total)), jax.jacfwd(total)):
        np.testing.assert_allclose(slope(2.0), np.sum(x * np.cos(2 * x)), rtol=1e-12)


def test_a_sweep_of_simulations_is_each_of_them():
    config, model, state = block(count=20)

    def fallen(speed):
        start = state._replace(velocity=speed * state.velocity)
        return rollout(config, model, start, dt=1e-3, steps=4).position

    speeds = jnp.array([0.0, 0.5, 1.0, 2.0, -1.0])
    together, alone = over_devices(fallen)(speeds), jax.jit(fallen)
    for one, speed in zip(together, speeds, strict=True):
        np.testing.assert_allclose(one, alone(speed), atol=1e-14)


def test_members_are_on_all_devices():
    count = jax.device_count()
    found = over_devices(lambda x: x + jax.lax.axis_index("members"))(jnp.zeros(count))
    np.testing.assert_array_equal(found, np.arange(count))


def test_what_does_not_fit_is_named():
    with pytest.raises(InputError, match="over_devices: 99 devices"):
        over_devices(jnp.sin, 99)
    with pytest.raises(InputError, match="same leading axis"):
        over_devices(jnp.add)(jnp.zeros(3), jnp.zeros(4))
    with pytest.raises(InputError, match="same leading axis"):
        over_devices(jnp.sin)(1.0)
