import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Box, Damping, Setting, Translate, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.state import (
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_FINITE,
    OK,
    STEP_TOO_LARGE,
    Config,
    Model,
    initial_state,
)

from . import reference
from .cases import block, count_in_transfers, count_primitives, public

DT = 1e-3
jit_step = jax.jit(step, static_argnums=0)


def test_step_is_the_plain_step():
    config, model, state = block()
    plain = {
        "mass": model.mass,
        "volume": model.volume,
        "E": model.parameters["youngs_modulus"],
        "nu": model.parameters["poisson_ratio"],
        "gravity": model.gravity,
    }
    expected = public(state)
    for _ in range(3):
        expected = jax.jit(partial(reference.step, config.grid))(plain, *expected, DT)
        state = jit_step(config, model, state, DT)
    for ours, theirs in zip(public(state), expected, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12 * float(jnp.abs(theirs).max()))
    assert int(state.status.code) == OK and int(state.status.taken) == 3
    np.testing.assert_allclose(state.time, 3 * DT)


def test_float32_follows_float64():
    config, model, state = block()
    config32, model32, state32 = block(dtype=jnp.float32)
    assert config32 == config
    state, state32 = jit_step(config, model, state, DT), jit_step(config, model32, state32, DT)
    for wide, narrow in zip(public(state), public(state32), strict=True):
        assert narrow.dtype == jnp.float32
        np.testing.assert_allclose(wide, narrow, atol=1e-5 * float(jnp.abs(wide).max()))


def test_window_changes_nothing():
    config, model, state = block()
    small, _, _ = block(window=(7, 7, 7))
    for a, b in zip(
        public(jit_step(config, model, state, DT)),
        public(jit_step(small, model, state, DT)),
        strict=True,
    ):
        np.testing.assert_allclose(a, b, atol=1e-14)


def test_window_too_small_is_flagged_and_harmless():
    config, model, state = block(window=(4, 7, 7))
    end = jit_step(config, model, state, DT)
    assert int(end.status.code) == LEFT_WINDOW and int(end.status.step) == 0
    assert all(bool(jnp.isfinite(a).all()) for a in public(end))


def test_single_particle_falls_freely():
    config = Config(Grid((6, 6, 6), 0.5), ((NEO_HOOKEAN, 0, 1),))
    model = Model(
        jnp.array([2.0]),
        jnp.array([0.1]),
        {"youngs_modulus": jnp.array([1e4]), "poisson_ratio": jnp.array([0.3])},
        jnp.array([0.0, 0.0, -10.0]),
    )
    state = initial_state(config, np.array([[1.3, 1.2, 1.6]]), velocity=np.array([[0.5, 0, 0]]))
    for _ in range(10):
        state = jit_step(config, model, state, 0.01)
    np.testing.assert_allclose(state.velocity[:, 0], [0.5, 0, -1.0], atol=1e-13)
    # Symplectic Euler: x_n = x_0 + g dt^2 n (n + 1) / 2.
    np.testing.assert_allclose(state.position[:, 0], [1.35, 1.2, 1.6 - 0.055], atol=1e-13)
    np.testing.assert_allclose(state.deformation[..., 0], np.eye(3), atol=1e-13)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_coincident_particles_and_their_gradients_are_finite(dtype):
    config, model, state = block(count=5, dtype=dtype)
    # On a node, and where weights vanish: half-way between nodes.
    for x in (0.3, 0.35):
        placed = state._replace(position=jnp.full((3, 5), x, dtype))

        def loss(model, state):
            return sum(jnp.sum(a**2) for a in public(step(config, model, state, DT)))

        value, gradients = jax.jit(jax.value_and_grad(loss, allow_int=True))(model, placed)
        assert jnp.isfinite(value)
        assert all(bool(jnp.isfinite(g).all()) for g in jax.tree.leaves(gradients))


def break_position(state, value):
    return state._replace(position=state.position.at[1, 7].set(value))


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_failures_name_the_first_step_and_particle(dtype):
    config, model, state = block(count=20, dtype=dtype)
    good = jit_step(config, model, state, DT)
    assert [int(x) for x in good.status] == [OK, -1, -1, 1]
    fast = good._replace(velocity=good.velocity.at[:, 3:].multiply(1e4))
    nan = good._replace(deformation=good.deformation.at[0, 0, 11].set(jnp.nan))
    for broken, code in (
        (break_position(good, 0.04), LEFT_GRID),
        (break_position(good, -1e6), LEFT_GRID),
        (fast, STEP_TOO_LARGE),
        (nan, NOT_FINITE),
    ):
        status = jit_step(config, model, broken, DT).status
        assert int(status.code) == code
        assert int(status.step) == 1
    assert int(jit_step(config, model, break_position(good, 0.04), DT).status.particle) == 7
    # The first failure stays, whatever follows.
    failed = jit_step(config, model, break_position(good, 0.04), DT)
    later = jit_step(config, model, failed._replace(velocity=failed.velocity * jnp.nan), DT)
    assert [int(x) for x in later.status] == [LEFT_GRID, 1, 7, 3]


def remembering(rows, plastic=False):
    """A law that counts its calls in its last history row; plastic: forgets all deformation."""

    def update(parameters, F, history, dt):
        if rows:
            history = history.at[-1].add(1.0)
        if plastic:
            F = jnp.broadcast_to(jnp.eye(3, dtype=F.dtype)[..., None], F.shape)
        return F, jnp.zeros_like(F), history

    initial = tuple(float(10 * (r + 1)) for r in range(rows))
    names = tuple(f"row{r}" for r in range(rows))
    nothing = lambda *_: 0.0  # noqa: E731
    return Law("remembering", (), initial, names, update, nothing, nothing, plastic)


def test_segments_use_their_own_law_parameters_and_history():
    config, model, state = block(count=30)
    laws = (NEO_HOOKEAN, remembering(1), remembering(3))
    mixed = Config(
        config.grid, ((laws[0], 0, 10), (laws[1], 10, 18), (laws[2], 18, 30)), track_total=True
    )
    start = initial_state(mixed, state.position.T, state.velocity.T)
    assert start.history.shape == (3, 30) and start.total is None
    end = jit_step(mixed, model, start, DT)
    np.testing.assert_array_equal(end.history[:, :10], 0.0)
    np.testing.assert_array_equal(end.history[:, 10:18].T, [[11.0, 0.0, 0.0]] * 8)
    np.testing.assert_array_equal(end.history[:, 18:].T, [[10.0, 20.0, 31.0]] * 12)


def test_total_gradient_is_kept_where_a_law_is_plastic():
    config, model, state = block(count=30)
    plastic = Config(config.grid, ((remembering(0, plastic=True), 0, 30),), track_total=True)
    start = initial_state(plastic, state.position.T, state.velocity.T)
    end = jit_step(plastic, model, start, DT)
    np.testing.assert_allclose(end.total, end.deformation, atol=1e-15)
    end = jit_step(plastic, model, end, DT)
    once = np.eye(3)[..., None] + DT * np.asarray(end.affine)
    np.testing.assert_allclose(end.deformation, once, atol=1e-14)
    assert float(jnp.abs(end.total - end.deformation).max()) > 1e-4


def primitives(config, model, state):
    return partial(
        count_primitives, jax.make_jaxpr(step, static_argnums=0)(config, model, state, DT).jaxpr
    )


def test_a_step_holds_only_what_the_scene_lists():
    config, model, state = block()
    count = primitives(config, model, state)
    jaxpr = jax.make_jaxpr(step, static_argnums=0)(config, model, state, DT).jaxpr
    # In loops of three. One pass gathers and scatters, the last one gathers.
    assert count_in_transfers(jaxpr, "scatter-add") == 9
    assert count_in_transfers(jaxpr, "gather") == 2 * 9
    for absent in ("svd", "eigh", "while", "dot_general"):
        assert count(absent) == 0, absent
    assert count("concatenate") == primitives(*block(count=3))("concatenate")
    assert state.history is None and state.total is None
    tracked, _, start = block(track_total=True)
    assert start.total is None  # nothing plastic: the same program
    assert primitives(tracked, model, start)("mul") == count("mul")
    windowed, _, _ = block(window=(8, 8, 8))
    assert primitives(windowed, model, state)("reduce_min") > count("reduce_min")


def test_wrong_input_is_named():
    grid = Grid((8, 8, 8), 0.1)
    with pytest.raises(InputError, match="without gaps"):
        Config(grid, ((NEO_HOOKEAN, 0, 5), (NEO_HOOKEAN, 6, 9)))
    with pytest.raises(InputError, match="empty"):
        Config(grid, ())
    with pytest.raises(InputError, match="window"):
        Config(grid, ((NEO_HOOKEAN, 0, 5),), window=(9, 8, 8))
    with pytest.raises(InputError, match="shape"):
        Grid((2, 8, 8), 0.1)
    with pytest.raises(InputError, match="spacing"):
        Grid((8, 8, 8), 0.0)
    config = Config(grid, ((NEO_HOOKEAN, 0, 5),))
    with pytest.raises(InputError, match=r"position has shape \(4, 3\)"):
        initial_state(config, np.zeros((4, 3)))
    with pytest.raises(InputError, match="dtype"):
        initial_state(config, np.zeros((5, 3), int))


def with_boundaries(config, model, state, *boundaries):
    setting = Setting(config.grid, state.position.T, model.volume, model.mass.dtype)
    return dataclasses.replace(model, boundaries=prepare(boundaries, setting))


@pytest.mark.parametrize("window", [None, (8, 8, 8)])
def test_grid_boundary_acts_on_the_nodes_it_names(window):
    config, model, state = block(window=window)
    # Everything is inside the box, so that every node and thus every particle moves with it.
    everywhere = Box((0.5, 0.5, 0.5), (2, 2, 2), velocity=(0.1, 0.2, 0.3))
    end = jit_step(config, with_boundaries(config, model, state, everywhere), state, DT)
    np.testing.assert_allclose(end.velocity.T, np.tile([0.1, 0.2, 0.3], (60, 1)), atol=1e-14)
    # A box around three planes of nodes pins the particles between them, and no others.
    pinned = Box((0.3, 0.5, 0.5), (0.11, 2, 2))
    end = jit_step(config, with_boundaries(config, model, state, pinned), state, DT)
    still = np.asarray(jnp.max(jnp.abs(end.velocity), axis=0) == 0)
    x = np.asarray(state.position[0])
    np.testing.assert_array_equal(still, (x >= 0.25) & (x < 0.35))
    assert 0 < still.sum() < 60


def test_particle_boundary_acts_on_the_particles_it_names():
    config, model, state = block()
    pull = Translate((0.3, 0.5, 0.5), (0.1, 2, 2), velocity=(0.5, 0, 0))
    rest = state.position
    free = jit_step(config, model, state, DT)
    end = jit_step(config, with_boundaries(config, model, state, pull), state, DT)
    chosen = np.abs(np.asarray(rest[0]) - 0.3) < 0.1
    assert 0 < chosen.sum() < 60
    expected = np.where(chosen, np.array([[0.5], [0], [0]]), free.velocity)
    np.testing.assert_allclose(end.velocity, expected, atol=1e-14)
    np.testing.assert_allclose(end.position, rest + DT * expected, atol=1e-14)


def test_boundary_code_is_there_only_with_boundaries():
    config, model, state = block()
    without = primitives(config, model, state)
    damped = primitives(config, with_boundaries(config, model, state, Damping(1.0)), state)
    assert without("exp") == 0 and damped("exp") == 2  # one for each of two passes
