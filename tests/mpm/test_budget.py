"""The budget of a gradient: what is planned fits, what is measured fits, the gradient is the same.

And the gradient that is cut off on purpose.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adjoint import Checkpointed, Plain, Truncated, planned, repeat, split
from jaxphys.mpm.loop.budget import Cost, cost_of
from jaxphys.mpm.loop.frames import rollout_frames
from jaxphys.mpm.loop.rollout import rollout

from .cases import block, count_primitives, simulation_of

DT, STEPS = 5e-4, 100


def most_kept(cost, length, again, levels):
    """Bytes that a plan keeps at its worst moment, counted segment by segment."""
    if not levels or length < 2:
        return length * cost.step
    kept = (length - again) * cost.step if again < length else 0
    inner, outer, rest = split(again, levels[0])
    inside = max(most_kept(cost, n, n, levels[1:]) for n in (inner, rest))
    return kept + (outer + (rest > 0)) * cost.state + inside


@pytest.mark.parametrize("cost", [Cost(10, 10), Cost(10, 100), Cost(70, 20)])
@pytest.mark.parametrize("length", [2, 7, 100, 1013])
def test_a_plan_fits_its_budget(cost, length):
    with pytest.raises(InputError, match="need at least") as error:
        planned(cost, length, Checkpointed(bytes=1))
    least = int(str(error.value).split("at least ")[1].split(";")[0])
    with pytest.raises(InputError):
        planned(cost, length, Checkpointed(bytes=least - 1))
    runs = []
    everything = cost.work + length * cost.step
    for budget in np.linspace(least, everything, 9).astype(int):
        again, levels = planned(cost, length, Checkpointed(bytes=int(budget)))
        assert most_kept(cost, length, again, levels) + cost.work <= budget
        runs.append(again * len(levels))
    # More room, less to be run again, but for what does not divide.
    assert max(np.diff(runs)) <= 2 + length // 20 and runs[-1] == 0
    assert runs[0] == 2 * length or length < 20


def test_a_budget_shared_with_others():
    cost = Cost(10, 10)
    alone = planned(cost, 50, Checkpointed(bytes=400))
    assert planned(cost, 50, Checkpointed(bytes=440, besides=40)) == alone
    with pytest.raises(InputError, match="at least 13"):
        planned(cost, 50, Checkpointed(bytes=1200, besides=1100))


def test_cost_is_read_off_the_program():
    shared = jnp.arange(5.0)

    def body(x):
        return jnp.sin(x) * shared  # keeps cos x; the shared numbers are kept once for all

    assert cost_of(body, jnp.ones(5)) == Cost(state=40, step=40)


@pytest.fixture(scope="module")
def thrown():
    config, model, state = block(count=300, shape=(12, 12, 12))

    def loss(x, adjoint, steps=STEPS):
        start = state._replace(velocity=state.velocity * x)
        end = rollout(config, model, start, dt=DT, steps=steps, adjoint=adjoint)
        return jnp.sum(end.position**2) + jnp.sum(jnp.sin(end.velocity))

    # A step keeps x, F and what was gathered, 24 numbers a particle, and 4 a node.
    return loss, 8 * (24 * 300 + 4 * 12**3)


def gradient(loss, adjoint):
    compiled = jax.jit(jax.grad(partial(loss, adjoint=adjoint))).lower(1.0).compile()
    return compiled(1.0), compiled.memory_analysis().temp_size_in_bytes


@pytest.fixture(scope="module")
def expected(thrown):
    """The plain gradient and what it keeps."""
    return gradient(thrown[0], Plain())


# Enough for half of the steps; for segments; for segments of segments.
@pytest.mark.parametrize(
    "steps",
    [pytest.param(66, marks=pytest.mark.slow), pytest.param(35, marks=pytest.mark.slow), 28],
)
def test_the_measured_peak_fits_and_the_gradient_is_the_same(thrown, expected, steps):
    loss, a_step = thrown
    plain, everything = expected
    found, peak = gradient(loss, Checkpointed(bytes=steps * a_step))
    np.testing.assert_allclose(found, plain, rtol=1e-12)
    assert peak <= steps * a_step < everything
    with pytest.raises(InputError, match=r"Checkpointed\.bytes .* need at least"):
        gradient(loss, Checkpointed(bytes=20 * a_step))


@pytest.mark.parametrize(("frames", "room"), [(11, 22), (41, 38)])
@pytest.mark.slow
def test_frames_in_a_budget(thrown, frames, room):
    """The starts of all frames, and of groups of frames."""
    config, model, state = block(count=300, shape=(12, 12, 12))

    def loss(x, adjoint):
        start = state._replace(velocity=state.velocity * x)
        simulation = simulation_of(config, model, start, dt=DT, steps=6)
        return jnp.sum(rollout_frames(simulation, frames, adjoint=adjoint).position ** 2)

    expected, everything = gradient(loss, Plain())
    found, peak = gradient(loss, Checkpointed(bytes=room * thrown[1]))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert peak <= room * thrown[1] < everything


@pytest.mark.slow
def test_truncated_is_the_gradient_of_the_last_steps():
    config, model, state = block(count=20)
    modulus = model.parameters["youngs_modulus"]

    def end(scale, start, steps, adjoint=None):
        parameters = model.parameters | {"youngs_modulus": modulus * scale}
        changed = type(model)(model.mass, model.volume, parameters, model.gravity)
        return rollout(config, changed, start, dt=DT, steps=steps, adjoint=adjoint or Plain())

    def value(state):
        return jnp.sum(state.position**2) + jnp.sum(jnp.sin(state.velocity))

    def cut(scale):
        return value(end(scale, state, 7, Truncated(3)))

    def whole(scale, adjoint):
        return value(end(scale, state, 7, adjoint))

    ours, forward = jax.jit(lambda s: (jax.grad(cut)(s), jax.jvp(cut, (s,), (1.0,))))(1.0)
    full = jax.jit(jax.value_and_grad(partial(whole, adjoint=Plain())))(1.0)
    np.testing.assert_allclose(forward, (full[0], ours), rtol=1e-12)
    middle = jax.jit(lambda: end(1.0, state, 4))()
    expected = jax.jit(jax.grad(lambda s: value(end(s, middle, 3))))(1.0)
    np.testing.assert_allclose(ours, expected, rtol=1e-9)
    assert abs(ours - full[1]) > 0.1 * abs(full[1])
    # A window over all of it cuts nothing.
    covered = jax.jit(jax.grad(partial(whole, adjoint=Truncated(9))))(1.0)
    np.testing.assert_allclose(covered, full[1], rtol=1e-12)


def test_truncated_steps_are_not_differentiated():
    def end(rate, adjoint):
        return repeat(adjoint, lambda x: x + jnp.sin(rate * x), jnp.ones(3), 9).sum()

    def cosines(adjoint):
        return count_primitives(
            jax.make_jaxpr(jax.grad(end), static_argnums=1)(1.0, adjoint).jaxpr, "cos"
        )

    assert cosines(Truncated(2)) == cosines(Plain()) == 1
    with pytest.raises(InputError, match=r"Truncated\.window is 0"):
        Truncated(0)
    with pytest.raises(InputError, match="traced"):
        jax.jit(lambda n: repeat(Truncated(2), jnp.sin, 1.0, n))(3)
    for wrong in ({"bytes": 0}, {"bytes": 9, "segments": 2}):
        with pytest.raises(InputError, match="bytes"):
            Checkpointed(**wrong)
