from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop import rollout as rollouts
from jaxphys.mpm.loop.frames import advance_frame, rollout_frames
from jaxphys.mpm.loop.pass_derivative import one_pass
from jaxphys.mpm.loop.rollout import rollout, step
from jaxphys.mpm.loop.sorting import cell_order, inverse_order
from jaxphys.mpm.loop.status import SimulationError, check
from jaxphys.mpm.state import LEFT_GRID

from .cases import block, public, simulation_of

DT = 1e-3


def test_rollout_is_its_steps():
    config, model, state = block()
    once = jax.jit(step, static_argnums=0)
    expected = state
    for _ in range(6):
        expected = once(config, model, expected, DT)
    end = jax.jit(partial(rollout, config, steps=6))(model, state, dt=DT)
    for a, b in zip(public(end), public(expected), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-13)
    assert int(end.status.taken) == 6


def test_frames_are_the_states_between():
    config, model, state = block()
    simulation = simulation_of(config, model, state, dt=DT, steps=3)
    motion = jax.jit(partial(rollout_frames, frames=3))(simulation)
    run = jax.jit(partial(rollout, config, steps=3))
    middle = run(model, state, dt=DT)
    end = run(model, middle, dt=DT)
    assert motion.position.shape == (3, 60, 3) and motion.deformation.shape == (3, 60, 3, 3)
    np.testing.assert_allclose(motion.time, [0, 3 * DT, 6 * DT], rtol=1e-12)
    for k, expected in enumerate((state, middle, end)):
        np.testing.assert_allclose(motion.position[k], public(expected)[0], atol=1e-14)
        np.testing.assert_allclose(motion.deformation[k], public(expected)[3], atol=1e-13)


def test_one_compilation_and_one_trace_of_the_step(monkeypatch):
    config, model, state = block()
    traces = []

    def counted(config, last, *arguments):
        traces.append(last)
        return one_pass(config, last, *arguments)

    monkeypatch.setattr(rollouts, "one_pass", counted)
    run = jax.jit(partial(rollout_frames, frames=4))
    for factor in (1, 2):
        faster = state._replace(velocity=factor * state.velocity)
        run(simulation_of(config, model, faster, dt=DT, steps=4))
    assert run._cache_size() == 1
    assert traces == [False, True]


def test_a_frame_compiles_once_for_any_number_of_steps():
    config, model, state = block()
    expected = jax.jit(partial(rollout, config, steps=6))(model, state, dt=DT)
    before = advance_frame._cache_size()
    for steps in (4, 2):
        state = advance_frame(config, model, state, DT, steps)
    assert advance_frame._cache_size() == before + 1
    np.testing.assert_allclose(state.position, expected.position, atol=1e-14)
    check(state.status, 1)


def falling():
    """A block that leaves the grid through the floor at step 5."""
    config, model, state = block(count=20)
    velocity = state.velocity.at[2].set(-5.0)
    position = state.position.at[2].set(0.0825 + 1e-3 * jnp.arange(20)[::-1])
    return (
        config,
        model,
        state._replace(position=position, velocity=velocity, affine=0 * state.affine),
    )


def test_failure_keeps_the_last_good_state_and_names_the_first_step():
    config, model, state = falling()
    run = jax.jit(partial(rollout, config, steps=4))
    good = run(model, state, dt=DT)
    end = run(model, good, dt=DT)
    once = jax.jit(step, static_argnums=0)
    single, history = state, [state]
    while int(single.status.code) == 0:
        single = once(config, model, single, DT)
        history.append(single)
    failing = len(history) - 2
    assert 4 <= failing < 8, failing
    np.testing.assert_array_equal(end.position, good.position)
    assert [int(x) for x in end.status[:3]] == [int(x) for x in single.status[:3]]
    assert int(end.status.step) == failing and int(end.status.code) == LEFT_GRID
    with pytest.raises(SimulationError, match=r"frame 1, step \d: particle \d+ left the grid") as e:
        check(end.status, 1)
    assert (e.value.frame, e.value.step, e.value.code) == (1, failing, LEFT_GRID)
    assert isinstance(e.value, InputError)
    with pytest.raises(SimulationError, match="enlarge the domain"):
        check(end.status)


def test_frames_after_a_failure_are_not_numbers_and_neither_are_gradients():
    config, model, state = falling()
    simulation = simulation_of(config, model, state, dt=DT, steps=4)

    @jax.jit
    def loss(speed):
        motion = rollout_frames(replace(simulation, state=state._replace(velocity=speed)), 4)
        return jnp.sum(motion.position[-1] ** 2), motion

    (value, motion), gradient = jax.value_and_grad(loss, has_aux=True)(state.velocity)
    assert np.isfinite(motion.position[:2]).all() and np.isnan(motion.position[2:]).all()
    assert np.isnan(motion.deformation[2:]).all() and np.isnan(value)
    assert np.isnan(gradient).all()
    motion[1].check(1)
    with pytest.raises(SimulationError, match=r"frame 2, step \d: particle \d+ left the grid"):
        motion.check()
    # Slow enough, the same program has a gradient.
    (_, motion), gradient = jax.value_and_grad(loss, has_aux=True)(0.01 * state.velocity)
    motion.check()
    assert np.isfinite(gradient).all() and np.any(gradient != 0)


def test_a_motion_is_in_the_order_of_the_object():
    config, model, state = block()
    order = np.random.default_rng(3).permutation(60)
    simulation = simulation_of(config, model, state, dt=DT, steps=2, order=order, carriers=7)
    motion = rollout_frames(simulation, 2)
    expected = np.asarray(state.position).T[order]
    np.testing.assert_array_equal(motion.position[0], expected)
    position, deformation = motion[0].carried()
    np.testing.assert_array_equal(position, expected[:7])
    np.testing.assert_array_equal(deformation, np.asarray(public(state)[3])[order[:7]])
    # Frames that hold the carriers alone say the same.
    alone = simulation.frame(state, simulation.carriers)
    assert alone.position.shape == (7, 3)
    np.testing.assert_array_equal(alone.carried()[0], position)
    with pytest.raises(IndexError, match="of a motion of 2 frames"):
        motion[2]


def test_two_runs_give_the_same_bytes():
    config, model, state = block(dtype=jnp.float32)
    run = jax.jit(partial(rollout, config, steps=5))
    first, second = (run(model, state, dt=DT) for _ in range(2))
    for a, b in zip(jax.tree.leaves(first), jax.tree.leaves(second), strict=True):
        assert np.asarray(a).tobytes() == np.asarray(b).tobytes()


def test_cell_order_sorts_within_segments_and_is_undone():
    config, _, state = block()
    position = np.asarray(state.position.T)
    order = cell_order(position, config.grid)
    cells = np.floor(position / 0.1 - 0.5)[order]
    keys = [tuple(cell) for cell in cells]
    assert keys == sorted(keys)
    np.testing.assert_array_equal(position[order][inverse_order(order)], position)
    parts = cell_order(position, config.grid, ((None, 0, 25), (None, 25, 60)))
    assert sorted(parts[:25]) == list(range(25)) and sorted(parts[25:]) == list(range(25, 60))


def test_order_of_particles_changes_only_round_off():
    config, model, state = block()
    order = cell_order(np.asarray(state.position.T), config.grid)
    sort = partial(jax.tree.map, lambda a: a[..., order] if a.ndim and a.shape[-1] == 60 else a)
    once = jax.jit(step, static_argnums=0)
    a = once(config, model, state, DT)
    b = once(config, sort(model), sort(state), DT)
    for x, y in zip(public(sort(a)), public(b), strict=True):
        np.testing.assert_allclose(x, y, atol=1e-13)
