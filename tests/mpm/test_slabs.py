"""A device's slab of the grid in a rollout: it follows its particles, and loses none."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.loop.placement import Placement, Slabs
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.state import LEFT_WINDOW, OK

from .cases import block, count_primitives, long_block

DEVICES = 4
DT = 2e-3
pytestmark = pytest.mark.skipif(
    jax.device_count() < DEVICES, reason=f"needs {DEVICES} host devices: see tests/conftest.py"
)


@partial(jax.jit, static_argnums=0)
def run(config, model, state, steps):
    return rollout(config, model, state, dt=DT, steps=steps)


def whole(config):
    """The same on one device."""
    return replace(config, placement=Placement(), slabs=None, window=None)


@pytest.fixture(scope="module")
def stretching():
    """A long block whose ends fly apart while it drifts along x by three cells, on four slabs."""
    config, model, state = long_block(devices=4)
    middle = jnp.mean(state.position, axis=1, keepdims=True)
    velocity = (state.position - middle) * jnp.array([[1.0], [0.0], [0.0]])
    state = state._replace(velocity=velocity + jnp.array([[8.0], [0.0], [0.0]]))
    return windowed(config, state), model, state


def test_slabs_follow_their_particles(stretching):
    config, model, state = stretching
    assert config.slabs is not None and config.slabs.planes < 20
    ours, theirs = run(config, model, state, 20), run(whole(config), model, state, 20)
    assert int(ours.status.code) == int(theirs.status.code) == OK
    assert float(jnp.mean(ours.position[0] - state.position[0])) > 0.3
    for name in ("position", "velocity", "affine", "deformation"):
        a, b = getattr(ours, name), getattr(theirs, name)
        np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.max(jnp.abs(b))))
    # And to the byte, from run to run.
    again = run(config, model, state, 20)
    jax.tree.map(np.testing.assert_array_equal, again, ours)


def test_no_device_adds_windows_up(stretching):
    config, model, state = stretching

    def sums(config):
        program = jax.make_jaxpr(partial(rollout, config, dt=DT, steps=3))(model, state)
        return tuple(count_primitives(program.jaxpr, name) for name in ("psum", "ppermute"))

    hops = len(config.slabs.bands)
    assert sums(config) == (0, 2 * hops)
    added, passed = sums(replace(config, slabs=None))
    assert added > 0 == passed


def test_no_mass_is_lost_on_slabs_of_devices_without_particles():
    """Of five particles two devices have none. The centre of mass of matter that is thrown falls
    as a stone does.
    """
    slabs = Slabs(9, (8, 8, 8))
    config, model, state = block(5, placement=Placement(4, 16), slabs=slabs, check_step=False)
    end = run(config, model, state, 5)
    assert int(end.status.code) == OK
    mass, total = model.mass, jnp.sum(model.mass)
    start_speed, speed = (jnp.sum(mass * s.velocity, axis=1) / total for s in (state, end))
    np.testing.assert_allclose(speed, start_speed + 5 * DT * model.gravity, atol=1e-12)


def test_a_particle_that_outruns_its_slab_is_named_and_nothing_moves(stretching):
    """One flies through three sub-boxes. What is lost there is the whole motion, and no mass."""
    config, model, state = stretching
    runner = 3
    state = state._replace(
        position=state.position.at[1, runner].set(0.8),
        velocity=state.velocity.at[:, runner].set(jnp.array([45.0, 0.0, 0.0])),
        affine=state.affine.at[..., runner].set(0.0),
    )
    end = run(config, model, state, 25)
    assert (int(end.status.code), int(end.status.particle)) == (LEFT_WINDOW, runner)
    assert 2 < int(end.status.step) < 20
    np.testing.assert_array_equal(end.position, state.position)
    # One device has room for it: the frame can be done.
    there = run(whole(config), model, state, 20)
    assert int(there.status.code) == OK
    assert float(there.position[0, runner] - state.position[0, runner]) > 1.3


@pytest.mark.slow
def test_scenes_over_a_batch_axis(stretching):
    config, model, state = stretching
    speeds = jnp.stack([state.velocity, -state.velocity])

    def end(velocity):
        return run(config, model, state._replace(velocity=velocity), 2).position

    together = jax.jit(jax.vmap(end))(speeds)
    for i in range(2):
        np.testing.assert_allclose(together[i], end(speeds[i]), atol=1e-14)
