from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm import rollout as rollouts
from jaxphys.mpm.rollout import SimulationError, check, frame_step, rollout, rollout_frames
from jaxphys.mpm.sorting import cell_order, inverse_order
from jaxphys.mpm.state import LEFT_GRID
from jaxphys.mpm.step import step

from .cases import block, public

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
    end, frames = jax.jit(partial(rollout_frames, config, steps_per_frame=3, frames=2))(
        model, state, dt=DT
    )
    middle = jax.jit(partial(rollout, config, steps=3))(model, state, dt=DT)
    assert frames.position.shape == (2, 60, 3) and frames.deformation.shape == (2, 60, 3, 3)
    for k, expected in enumerate((middle, end)):
        np.testing.assert_array_equal(frames.position[k], public(expected)[0])
        np.testing.assert_array_equal(frames.deformation[k], public(expected)[3])


def test_one_compilation_and_one_trace_of_the_step(monkeypatch):
    config, model, state = block()
    traces = []

    def counted(*arguments):
        traces.append(1)
        return step(*arguments)

    monkeypatch.setattr(rollouts, "step", counted)
    run = jax.jit(partial(rollout_frames, config, steps_per_frame=4, frames=3))
    for dt in (1e-3, 5e-4):
        state, _ = run(model, state, dt=dt)
    assert run._cache_size() == 1
    assert len(traces) == 1


def test_frame_step_advances_in_place_and_compiles_once():
    config, model, state = block()
    expected = jax.jit(partial(rollout, config, steps=6))(model, state, dt=DT)
    advance = frame_step(config, 3)
    first = state.position
    for _ in range(2):
        state = advance(model, state, DT)
    assert advance._cache_size() == 1
    assert first.is_deleted()
    np.testing.assert_array_equal(state.position, expected.position)
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


def test_failure_keeps_the_last_good_frame_and_names_the_first_step():
    config, model, state = falling()
    run = jax.jit(partial(rollout_frames, config, steps_per_frame=4, frames=3))
    end, frames = run(model, state, dt=DT)
    once = jax.jit(step, static_argnums=0)
    single, history = state, [state]
    while int(single.status.code) == 0:
        single = once(config, model, single, DT)
        history.append(single)
    failing = len(history) - 2
    assert 4 <= failing < 8, failing
    np.testing.assert_array_equal(end.position, history[4].position)
    np.testing.assert_array_equal(frames.position[2], frames.position[0])
    assert [int(x) for x in end.status[:3]] == [int(x) for x in single.status[:3]]
    assert int(end.status.step) == failing and int(end.status.code) == LEFT_GRID
    with pytest.raises(SimulationError, match=r"frame 1, step \d: particle \d+ left the grid") as e:
        check(end.status, 1)
    assert (e.value.frame, e.value.step, e.value.code) == (1, failing, LEFT_GRID)
    assert isinstance(e.value, InputError)
    with pytest.raises(SimulationError, match="enlarge the domain"):
        check(end.status)


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
