"""Frames on the host: windows, retries, devices."""

from dataclasses import replace
from itertools import islice

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.state import LEFT_WINDOW
from jaxphys.pipeline.frames import frames, wider
from tests.mpm.cases import block, long_block, simulation_of

DT, STEPS = 2e-3, 30


@pytest.fixture(scope="module")
def bursting():
    """A small block in the middle of a large grid that swells to several times its size."""
    config, model, state = block(count=60, shape=(44, 44, 44), check_step=False)
    position = state.position + 1.6
    centre = jnp.mean(position, axis=1, keepdims=True)
    model = replace(
        model, gravity=None, parameters=model.parameters | {"youngs_modulus": jnp.full(60, 1.0)}
    )
    velocity = 60 * (position - centre)
    affine = jnp.broadcast_to(60 * jnp.eye(3)[..., None], (3, 3, 60))
    state = state._replace(position=position, velocity=velocity, affine=affine)
    return simulation_of(config, model, state, dt=DT, steps=STEPS, carriers=60)


def test_a_frame_that_outgrows_its_window_is_computed_on_the_whole_grid(bursting):
    config, model, state = bursting.config, bursting.model, bursting.state
    part = windowed(config, state)
    assert part.window is not None and np.prod(part.window) < 0.1 * np.prod(config.grid.shape)
    lost = jax.jit(rollout, static_argnums=0)(part, model, state, dt=DT, steps=STEPS)
    assert int(lost.status.code) == LEFT_WINDOW
    whole = jax.jit(rollout, static_argnums=0)(config, model, state, dt=DT, steps=STEPS)
    _, first = islice(frames(bursting), 2)
    assert int(first.frame.status.taken) == STEPS
    np.testing.assert_allclose(first.frame.position, whole.position.T, atol=1e-12)


def test_the_window_is_left_out_where_it_is_no_gain(bursting):
    small, _, state = block(count=400)
    assert windowed(small, state).window is None
    # What it is depends on the state alone.
    config = bursting.config
    again = windowed(replace(config, window=(40, 40, 40)), bursting.state)
    assert again == windowed(config, bursting.state)


@pytest.fixture(scope="module")
def crossing():
    """A long block, and one particle that flies past it from end to end in a frame."""
    config, model, state = long_block()
    state = state._replace(
        position=state.position.at[1, 3].set(0.8),
        velocity=state.velocity.at[:, 3].set(jnp.array([40.0, 0.0, 0.0])),
        affine=state.affine.at[..., 3].set(0.0),
    )
    return simulation_of(config, model, state, dt=DT, steps=STEPS, carriers=200)


@pytest.mark.skipif(jax.device_count() < 4, reason="needs four host devices")
def test_a_particle_that_crosses_slabs_in_a_frame_is_not_lost(crossing):
    """The frame is computed with the window on every device; the next one may have slabs again, and
    any number of devices.
    """
    many = replace(crossing, config=replace(crossing.config, placement=Placement(4, 16)))
    first = windowed(many.config, many.state)
    assert first.slabs is not None and len(wider(first)) == 1 + (first.window is not None)
    lost = jax.jit(rollout, static_argnums=0)(first, many.model, many.state, dt=DT, steps=STEPS)
    assert (int(lost.status.code), int(lost.status.particle)) == (LEFT_WINDOW, 3)
    _, ours = islice(frames(many), 2)
    _, theirs = islice(frames(crossing), 2)
    assert int(ours.frame.status.taken) == STEPS
    assert theirs.frame.position[3, 0] > 1.5 + crossing.state.position[0, 3]
    np.testing.assert_allclose(ours.frame.position, theirs.frame.position, atol=1e-12)
    for total in ("mass", "momentum"):
        np.testing.assert_allclose(ours.metrics[total], theirs.metrics[total], rtol=1e-6, atol=1e-6)


@pytest.mark.skipif(jax.device_count() < 4, reason="needs four host devices")
def test_a_run_goes_on_with_another_number_of_devices():
    still = simulation_of(*long_block(), dt=DT, steps=STEPS)
    many = replace(still, config=replace(still.config, placement=Placement(4, 16)))
    assert windowed(many.config, many.state).slabs is not None
    *_, end = islice(frames(still), 3)
    *_, middle = islice(frames(many), 2)
    kept = jax.tree.map(np.asarray, middle.state)  # as a checkpoint has it
    (last,) = islice(frames(still, start=(1, kept)), 1)
    assert last.number == 2
    np.testing.assert_allclose(last.frame.position, end.frame.position, atol=1e-13)
