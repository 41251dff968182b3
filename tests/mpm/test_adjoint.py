from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adjoint import Checkpointed, Plain, for_frames, split
from jaxphys.mpm.loop.frames import rollout_frames
from jaxphys.mpm.loop.rollout import rollout

from . import reference
from .cases import block, count_in_transfers, public, simulation_of

DT = 2e-3


def loss_of(state):
    x, v, C, F = public(state)
    return jnp.sum(x**2) + jnp.sum(jnp.sin(v)) + 1e-2 * jnp.sum(C**2) + jnp.sum(F**3)


def problem(config, steps, adjoint):
    def loss(numbers, model, state):
        E, position, velocity = numbers
        model = type(model)(
            model.mass,
            model.volume,
            {**model.parameters, "youngs_modulus": E},
            model.gravity,
        )
        state = state._replace(position=position, velocity=velocity)
        return loss_of(rollout(config, model, state, dt=DT, steps=steps, adjoint=adjoint))

    return loss


@pytest.fixture(scope="module")
def plain():
    config, model, state = block(count=30)
    numbers = (model.parameters["youngs_modulus"], state.position, state.velocity)
    value, gradient = jax.jit(jax.value_and_grad(problem(config, 7, Plain())))(
        numbers, model, state
    )
    return config, model, state, numbers, value, gradient


def test_gradient_is_that_of_the_plain_step(plain):
    config, model, state, numbers, value, gradient = plain

    def loss(numbers):
        E, position, velocity = numbers
        parts = {
            "mass": model.mass,
            "volume": model.volume,
            "E": E,
            "nu": model.parameters["poisson_ratio"],
            "gravity": model.gravity,
        }
        now = (position.T, velocity.T, *public(state)[2:])
        x, v, C, F = jax.lax.fori_loop(
            0, 7, lambda _, now: reference.step(config.grid, parts, *now, DT), now
        )
        return jnp.sum(x**2) + jnp.sum(jnp.sin(v)) + 1e-2 * jnp.sum(C**2) + jnp.sum(F**3)

    expected_value, expected = jax.jit(jax.value_and_grad(loss))(numbers)
    np.testing.assert_allclose(value, expected_value, rtol=1e-12)
    for a, b in zip(gradient, expected, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-10 * float(jnp.abs(b).max()))


def test_gradient_is_the_central_difference_to_second_order(plain):
    config, model, state, numbers, _, gradient = plain
    random = np.random.default_rng(8)
    scales = (1e3, 1e-2, 0.5)
    direction = tuple(
        s * jnp.asarray(random.normal(size=n.shape)) for s, n in zip(scales, numbers, strict=True)
    )
    slope = sum(jnp.sum(g * d) for g, d in zip(gradient, direction, strict=True))
    loss = jax.jit(problem(config, 7, Plain()))

    def error(h):
        def at(step):
            moved = jax.tree.map(lambda n, d: n + step * d, numbers, direction)
            return loss(moved, model, state)

        return abs(float((at(h) - at(-h)) / (2 * h) - slope)) / abs(float(slope))

    coarse, fine = error(1e-3), error(1e-4)
    assert fine < 1e-6
    assert coarse / fine > 50  # 100 for an exact gradient, 1 for a wrong one


def slow(*values):
    """Each compiles a gradient of its own."""
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


@pytest.mark.parametrize("segments", [7, *slow(None, 1, 2, 3, 50)])
def test_checkpointed_gradient_is_the_plain_one(plain, segments):
    config, model, state, numbers, value, gradient = plain
    loss = problem(config, 7, Checkpointed(segments))
    other_value, other = jax.jit(jax.value_and_grad(loss))(numbers, model, state)
    np.testing.assert_allclose(other_value, value, rtol=1e-14)
    for a, b in zip(other, gradient, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-13 * float(jnp.abs(b).max()))


@pytest.mark.parametrize("adjoint", [Checkpointed(6), *slow(Plain(), Checkpointed())])
def test_gradient_through_frames(plain, adjoint):
    config, model, state, numbers, _, _ = plain

    def loss(position, adjoint):
        start = state._replace(position=position)
        simulation = simulation_of(config, model, start, dt=DT, steps=3)
        motion = rollout_frames(simulation, 3, adjoint=adjoint)
        first, last = motion.position[1], motion.position[2]
        return jnp.sum(first**3) + jnp.sum(last**2) + jnp.sum(motion.deformation[1:] ** 2)

    def expected(position):
        start = state._replace(position=position)
        middle = rollout(config, model, start, dt=DT, steps=3)
        end = rollout(config, model, middle, dt=DT, steps=3)
        deformations = jnp.sum(middle.deformation**2) + jnp.sum(end.deformation**2)
        return jnp.sum(middle.position**3) + jnp.sum(end.position**2) + deformations

    a = jax.jit(jax.grad(partial(loss, adjoint=adjoint)))(numbers[1])
    b = jax.jit(jax.grad(expected))(numbers[1])
    np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.abs(b).max()))


def test_backward_pass_turns_gathers_into_one_scatter_only():
    config, model, state = block(count=10)

    def loss(position):
        return loss_of(rollout(config, model, state._replace(position=position), dt=DT, steps=2))

    jaxpr = jax.make_jaxpr(jax.grad(loss))(state.position).jaxpr
    # Forth 9 scatters and 9 gathers, and 9 gathers of the last pass, each in a loop of three. Back:
    # the transpose of the scatter gathers once (sums and slopes together), that of the gather
    # scatters once and gathers once, and so does the last pass. No transfer is done again.
    assert count_in_transfers(jaxpr, "scatter-add") == (1 + 1 + 1) * 9
    assert count_in_transfers(jaxpr, "gather") == (2 + 2 + 1) * 9


def memory(steps, adjoint):
    config, model, state = block(count=30, shape=(8, 8, 8))
    loss = problem(config, steps, adjoint)
    numbers = (model.parameters["youngs_modulus"], state.position, state.velocity)
    compiled = jax.jit(jax.grad(loss)).lower(numbers, model, state).compile()
    return compiled.memory_analysis().temp_size_in_bytes


@pytest.mark.slow
def test_checkpoints_save_memory():
    assert memory(400, Checkpointed()) < 0.2 * memory(400, Plain())


def test_a_step_keeps_its_start_and_its_transfers_only():
    a_step = (memory(800, Plain()) - memory(400, Plain())) / 400
    particles, nodes = 30, 8**3
    # x, F, what a particle gathered, and the rows of the grid. In bytes of float64.
    least = 8 * (24 * particles + 4 * nodes)
    assert least <= a_step < 1.2 * least


@pytest.mark.parametrize("length", [1, 2, 7, 12, 97, 2000])
@pytest.mark.parametrize("segments", [None, 1, 3, 5000])
def test_split_covers_every_step(length, segments):
    inner, outer, rest = split(length, segments)
    assert inner * outer + rest == length and inner >= 1 and rest >= 0
    if segments is None:
        assert max(inner, outer, rest) <= 2 * length**0.5 + 2


def test_frames_serve_as_segments_where_there_are_enough():
    assert for_frames(Plain(), 10, 10) == (Plain(), False)
    assert for_frames(Checkpointed(), 100, 10) == (Plain(), True)
    assert for_frames(Checkpointed(), 2, 2000) == (Checkpointed(32), False)
    with pytest.raises(InputError, match="segments"):
        Checkpointed(0)
