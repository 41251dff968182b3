"""Steps that adapt: what they follow, where they end, how they are replayed and differentiated."""

from dataclasses import replace
from functools import partial
from itertools import islice

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.spectral import left_isotropic
from jaxphys.mpm.boundaries import Box, Damping, Plane, Rotate, Setting, Translate, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop import frames as loop
from jaxphys.mpm.loop.adaptive import rollout_adaptively
from jaxphys.mpm.loop.adjoint import Checkpointed, Plain
from jaxphys.mpm.loop.frames import advance_frame, rollout_frames
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import rollout, step
from jaxphys.mpm.loop.status import SimulationError, check
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, lame
from jaxphys.mpm.state import (
    OK,
    TOO_MANY_STEPS,
    UNSTABLE_STEP,
    Config,
    Model,
    initial_state,
)
from jaxphys.mpm.stepping import Adaptive
from jaxphys.mpm.stepping.adaptive import GROWTH, LEAST, matter_bounds, next_steps
from jaxphys.mpm.stepping.fixed import choose_substep
from jaxphys.pipeline.frames import frames
from tests.mpm.cases import block, count_primitives, simulation_of

ROOM = 24
EVERY = 2
STEPPING = Adaptive(every=EVERY)
DURATION = 0.02
EYE = jnp.eye(3)[..., None]
adapted = jax.jit(partial(rollout_adaptively, stepping=STEPPING, record=ROOM), static_argnums=0)


def stiff(modulus=2e4, **options):
    """The random block, hard enough that a frame takes some ten steps."""
    config, model, state = block(count=40, **options)
    parameters = model.parameters | {
        "youngs_modulus": modulus / 1e3 * model.parameters["youngs_modulus"]
    }
    # What turns this fast is slowed within a frame, and lets the steps grow.
    return config, replace(model, parameters=parameters), state._replace(affine=15 * state.affine)


def limits(config, model, state):
    """(wanted, limit) [s] of each particle of a state of one law."""
    (law, _, _) = config.segments[0]
    density = model.mass / model.volume
    return matter_bounds(law, model.parameters, state.deformation, density, 0.1, STEPPING.safety)


def test_matter_that_is_strained_takes_the_step_of_its_swing():
    """Not shorter than fixed steps would be, though it is stiffer now; no longer than `safety` of
    its limit now.
    """
    config, model, state = stiff()
    config = replace(config, segments=((FIXED_COROTATED, 0, 40),))  # stiffer when stretched
    still = state._replace(velocity=0 * state.velocity, affine=0 * state.affine)
    _, at_rest = limits(config, model, still._replace(deformation=still.deformation * 0 + EYE))
    for stretch, decides in ((1.04, "rest"), (1.2, "now")):
        strained = still._replace(deformation=still.deformation * 0 + stretch * EYE)
        wanted, now = (float(x.min()) for x in limits(config, model, strained))
        expected = {"rest": LEAST * float(at_rest.min()), "now": STEPPING.safety * now}[decides]
        assert wanted < 0.98 * expected
        _, steps = adapted(config, model, strained, duration=DURATION)
        assert expected / 1.25 < float(steps.dt[0]) <= expected * (1 + 1e-6)


@pytest.fixture(scope="module")
def taken():
    """A frame in steps that adapt: (config, model, start, end, steps of it)."""
    config, model, state = stiff()
    end, steps = adapted(config, model, state, duration=DURATION)
    check(end.status)
    return config, model, state, end, np.asarray(steps.dt[: int(steps.count)])


def test_a_frame_is_hit_exactly_in_steps_that_the_bounds_allow(taken):
    config, model, state, end, dt = taken
    assert 4 < len(dt) == int(end.status.taken) < ROOM
    np.testing.assert_allclose([dt.sum(), float(end.time)], DURATION, rtol=1e-12)
    speed = np.linalg.norm(state.velocity, axis=0).max()
    rate = np.linalg.norm(state.affine, axis=(0, 1)).max()
    wanted, _ = limits(config, model, state)
    bound = min(float(wanted.min()), 0.8 * 0.5 * 0.1 / speed, 0.8 * 0.2 / rate)
    assert 0.8 * bound < dt[0] <= bound * (1 + 1e-6)
    assert np.ptp(dt) > 0.2 * dt[0]
    # All steps that one look decides are of one length.
    blocks = [dt[k : k + EVERY] for k in range(0, len(dt), EVERY)]
    assert all(np.ptp(one) == 0 for one in blocks)
    # Nothing is left over for a sliver of a step.
    assert dt.min() > 0.5 * dt.max()
    # Frame after frame, each begins with its own bounds.
    again, steps = adapted(config, model, end, duration=DURATION)
    np.testing.assert_allclose(again.time, 2 * DURATION, rtol=1e-12)
    assert steps.dt[0] <= limits(config, model, end)[0].min()


def test_steps_fill_what_is_left():
    count, dt = next_steps(jnp.array(1.0), jnp.array(0.3), 100)
    assert int(count) == 4 and float(dt) == 0.25
    # A rounding over a whole number is no step more; a bound beyond the end is one step.
    assert int(next_steps(jnp.array(0.9 + 1e-7), jnp.array(0.3), 100)[0]) == 3
    assert [float(x) for x in next_steps(jnp.array(0.2), jnp.array(0.3), 100)] == [1, 0.2]
    assert int(next_steps(jnp.array(1.0), jnp.array(1e-30), 100)[0]) == 101


def test_matter_sets_a_share_between_that_of_fixed_steps_and_the_safety():
    config, model, state = stiff()
    wanted, limit = limits(config, model, state)
    share = np.asarray(wanted / limit)
    assert share.min() >= LEAST * (1 - 1e-12) and share.max() <= STEPPING.safety + 1e-12
    still = state._replace(deformation=jnp.broadcast_to(jnp.eye(3)[..., None], (3, 3, 40)))
    np.testing.assert_allclose(*map(np.asarray, _scaled(limits(config, model, still))))


def _scaled(pair):
    """(wanted, safety * limit): the same of what is not strained."""
    return pair[0], STEPPING.safety * pair[1]


def test_replayed_steps_give_the_same_state(taken):
    config, model, state, end, dt = taken
    padded = jnp.zeros(ROOM).at[: len(dt)].set(dt)
    known = jax.jit(partial(rollout, config, steps=len(dt)))(model, state, dt=padded)
    masked = jax.jit(partial(rollout, config))(model, state, dt=padded, steps=len(dt))
    for other in (known, masked):
        assert [int(x) for x in other.status] == [int(x) for x in end.status]
        np.testing.assert_allclose(other.position, end.position, atol=1e-14)
        np.testing.assert_allclose(other.velocity, end.velocity, atol=1e-12)
        np.testing.assert_allclose(other.time, end.time, rtol=1e-14)
    # One by one they are the same steps too, though each of these is a rollout of its own.
    once, single = jax.jit(step, static_argnums=0), state
    for one in dt:
        single = once(config, model, single, one)
    np.testing.assert_allclose(single.position, end.position, atol=1e-12)
    # Control: equal steps of the same number end elsewhere.
    equal = jnp.full(ROOM, DURATION / len(dt))
    other = jax.jit(partial(rollout, config))(model, state, dt=equal, steps=len(dt))
    assert np.abs(other.position - end.position).max() > 1e-7


def test_too_few_steps_to_replay_are_refused(taken):
    config, model, state, *_ = taken
    with pytest.raises(InputError, match="9 steps, but dt holds 2"):
        rollout(config, model, state, dt=jnp.full(2, 1e-3), steps=9)
    with pytest.raises(InputError, match=r"dt has shape \(2, 2\)"):
        rollout(config, model, state, dt=jnp.full((2, 2), 1e-3), steps=2)


@pytest.fixture(scope="module")
def loss():
    """(loss of velocities, modulus and adjoint; its velocities) over two frames that adapt."""
    config, model, state = stiff()
    simulation = simulation_of(config, model, state, dt=DURATION / 8, steps=8)
    simulation = replace(simulation, stepping=Adaptive(every=EVERY, most_steps=ROOM))

    def of(factor, velocity, adjoint):
        modulus = factor * model.parameters["youngs_modulus"]
        changed = replace(
            simulation,
            model=replace(model, parameters=model.parameters | {"youngs_modulus": modulus}),
            state=state._replace(velocity=velocity),
        )
        motion = rollout_frames(changed, 3, adjoint=adjoint)
        return jnp.sum(motion.position[-1] ** 2), motion

    run = jax.jit(jax.value_and_grad(of, argnums=(0, 1), has_aux=True), static_argnames="adjoint")
    return run, state.velocity


@pytest.mark.slow
def test_the_gradient_is_that_of_the_realised_steps(loss, taken):
    """Against differences of the same steps, replayed; each adjoint gives it."""
    run, velocity = loss
    (value, motion), (slope, to_velocity) = run(1.0, velocity, adjoint=Plain())
    motion.check()
    _, (other, other_velocity) = run(1.0, velocity, adjoint=Checkpointed())
    np.testing.assert_allclose(other, slope, rtol=1e-9)
    np.testing.assert_allclose(other_velocity, to_velocity, rtol=1e-9, atol=1e-12)
    config, model, state, end, dt = taken
    _, second = adapted(config, model, end, duration=DURATION)
    both = [jnp.zeros(ROOM).at[: len(dt)].set(dt), second.dt]
    replay = jax.jit(partial(rollout, config))

    def at(factor, velocity):
        modulus = factor * model.parameters["youngs_modulus"]
        changed = replace(model, parameters=model.parameters | {"youngs_modulus": modulus})
        now = state._replace(velocity=velocity)
        for one, count in zip(both, (len(dt), int(second.count)), strict=True):
            now = replay(changed, now, dt=one, steps=count)
        return float(jnp.sum(now.position**2))

    assert at(1.0, velocity) == pytest.approx(float(value), rel=1e-13)
    h = 1e-5
    assert float(slope) == pytest.approx(
        (at(1 + h, velocity) - at(1 - h, velocity)) / (2 * h), rel=1e-6
    )
    aside = jnp.zeros_like(velocity).at[1, 7].set(1e-4)
    difference = (at(1.0, velocity + aside) - at(1.0, velocity - aside)) / 2e-4
    assert float(to_velocity[1, 7]) == pytest.approx(difference, rel=1e-6)


@pytest.mark.parametrize(
    "adjoint", [Plain(), pytest.param(Checkpointed(), marks=pytest.mark.slow)], ids=repr
)
def test_the_gradient_of_frames_that_failed_is_not_a_number(loss, adjoint):
    run, velocity = loss
    # A thousand times as stiff, it flies apart within the room for steps that there is.
    (value, motion), gradients = run(1e3, velocity, adjoint=adjoint)
    assert np.isnan(value) and all(np.isnan(g).all() for g in gradients)
    first, *others = (int(c) for c in motion.status.code)
    assert first == OK and OK not in others
    with pytest.raises(SimulationError, match=r"frame 1, step \d+: particle \d+"):
        motion.check()
    # Off the grid in the first frame.
    (value, motion), gradients = run(1.0, velocity.at[2].set(-100.0), adjoint=adjoint)
    assert int(motion.status.code[1]) not in (OK, TOO_MANY_STEPS)
    assert np.isnan(value) and all(np.isnan(g).all() for g in gradients)


@pytest.mark.slow
def test_the_gradient_of_a_replay_that_failed_is_not_a_number(taken):
    config, model, state, _, dt = taken

    def end_of(velocity, dt):
        end = rollout(config, model, state._replace(velocity=velocity), dt=dt, steps=3)
        return jnp.sum(end.position**2), end.status

    run = jax.jit(jax.value_and_grad(end_of, has_aux=True))
    long = jnp.array([dt[0], 1.0, dt[0]])  # the second one tears it apart
    (value, status), gradient = run(state.velocity, long)
    assert int(status.code) != OK and np.isfinite(value) and np.isnan(gradient).all()
    (_, status), gradient = run(state.velocity, jnp.full(3, dt[0]))
    assert int(status.code) == OK and np.isfinite(gradient).all()


frame_of_pressed = jax.jit(
    partial(rollout_adaptively, stepping=Adaptive(), record=400), static_argnums=0
)


def _locking_stress(e, moduli):
    mu, _ = moduli
    return (2 * mu * e + 4 * mu * e**3,), ()


def _locking_update(parameters, F, history, dt):
    ((stress,), _) = left_isotropic(_locking_stress, F, lame(parameters))
    return F, stress, history


def _locking_energy(parameters, stretches):
    mu, _ = lame(parameters)
    logs = jnp.log(stretches)
    return mu * jnp.sum(logs**2 + logs**4, axis=0)


# Hencky's law and a fourth power: at a log strain e its stiffness is 1 + 6 e^2 of that at rest.
LOCKING = replace(HENCKY, name="locking", update=_locking_update, principal_energy=_locking_energy)


def pressed():
    """A lattice of what locks, on a floor that holds it, and a plate that comes down on it."""
    line = 0.3 + 0.05 * np.arange(4)
    position = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    volume = np.full(64, 0.05**3)
    floor = Plane((0.0, 0.0, 0.25), surface="sticky")
    plate = Plane((0.0, 0.0, 0.5), (0.0, 0.0, -1.0), surface="sticky", velocity=(0, 0, -1.0))
    grid = Grid((9, 10, 11), 0.1)
    boundaries = prepare((floor, plate), Setting(grid, position, volume, np.dtype(float)))
    config = Config(grid, ((LOCKING, 0, 64),))
    model = Model(
        mass=jnp.asarray(300 * volume),
        volume=jnp.asarray(volume),
        parameters={"youngs_modulus": jnp.full(64, 1.5e4), "poisson_ratio": jnp.zeros(64)},
        gravity=None,
        boundaries=boundaries,
    )
    return config, model, initial_state(config, position, boundaries=boundaries)


def test_a_block_pressed_by_a_plate_does_not_outrun_its_step():
    """It stiffens several times over; a step that stays as it was gets too long, and says so."""
    config, model, state = pressed()
    duration = 0.02
    fixed, steps, _ = choose_substep(config, model, state, duration)
    now = equal = state
    for frame in range(12):
        now, taken = frame_of_pressed(config, model, now, duration=duration)
        check(now.status, frame)
        equal = advance_frame(config, model, equal, fixed, steps)
        if int(equal.status.code) != OK:
            break
    assert int(equal.status.code) == UNSTABLE_STEP
    assert float(jnp.min(limits(config, model, now)[1])) < fixed
    assert int(taken.count) > 1.3 * steps


def test_a_step_grows_by_half_from_look_to_look_and_shrinks_at_once():
    """All particles move as one, and are slowed to a fourteenth in a step."""
    config, model, state = stiff(modulus=1e2)
    setting = Setting(config.grid, state.position.T, model.volume, np.dtype(float))
    model = replace(model, gravity=None, boundaries=prepare((Damping(2000.0),), setting))
    still = jnp.broadcast_to(jnp.eye(3)[..., None], (3, 3, 40))
    velocity = jnp.zeros_like(state.velocity).at[0].set(31.0)
    state = state._replace(velocity=velocity, affine=0 * state.affine, deformation=still)
    end, steps = adapted(config, model, state, duration=DURATION)
    check(end.status)
    dt = np.asarray(steps.dt[: int(steps.count)])
    # Half a cell at 31 m/s, times the safety, sixteen times a frame.
    assert dt[0] == pytest.approx(DURATION / 16) and dt[0] <= 0.8 * 0.05 / 31
    ratios = dt[EVERY::EVERY] / dt[:-EVERY:EVERY]
    assert 1.3 < ratios.max() <= GROWTH * (1 + 1e-3)
    # Back at speed the next frame begins as the first one did.
    _, steps = adapted(config, model, end._replace(velocity=velocity), duration=DURATION)
    assert float(steps.dt[0]) == pytest.approx(dt[0]) and dt[-1] > 1.5 * dt[0]


def moving(boundary, dtype=np.float64):
    config, model, state = stiff(modulus=1e2)
    setting = Setting(config.grid, np.asarray(state.position.T), np.asarray(model.volume), dtype)
    return config, replace(model, boundaries=prepare((boundary,), setting)), state


FAR, SMALL = (0.9, 0.9, 0.9), (0.02, 0.02, 0.02)
PLATE = {"point": (0.0, 0.0, 0.0), "velocity": (0.0, 0.0, 20.0), "friction": 0.0}


@pytest.mark.parametrize(
    ("boundary", "speed"),
    [
        (Plane(**PLATE, acts_on="nodes", start=0.015, end=0.0151), 20.0),
        (Plane(**PLATE, acts_on="nodes", start=0.5), 0.0),
        (Box(FAR, SMALL, (0.0, 12.0, -16.0)), 20.0),
        (Translate(FAR, SMALL, (0.0, 12.0, -16.0)), 20.0),
        (Rotate(FAR, (0.0, 0.0, 2.0), 0.02, 0.01, 1600.0, 12.0), 20.0),
        (Rotate(FAR, (0.0, 0.0, 2.0), 0.02, 0.01, 1600.0, 12.0, end=-1.0), 0.0),
    ],
    ids=lambda value: getattr(value, "type", str(value)),
)
def test_the_speed_of_a_boundary_counts_in_the_frames_in_which_it_acts(boundary, speed):
    _, model, _ = moving(boundary)
    found = model.boundaries[0].fastest(jnp.array(0.0), jnp.array(DURATION))
    assert float(found) == pytest.approx(speed)


def test_no_boundary_moves_half_a_cell_in_a_step():
    config, model, state = moving(Plane(**PLATE, acts_on="nodes", start=0.015, end=0.0151))
    _, steps = adapted(config, model, state, duration=DURATION)
    dt = np.asarray(steps.dt[: int(steps.count)])
    assert dt.min() > 0.5 * 0.8 * 0.05 / 20 and dt.max() <= 0.8 * 0.05 / 20
    # Control: it does not act.
    config, model, state = moving(Plane(**PLATE, acts_on="nodes", start=0.5, end=0.6))
    _, steps = adapted(config, model, state, duration=DURATION)
    assert int(steps.count) < len(dt)


def test_what_gives_no_bound_fails_at_once(taken):
    config, model, state, *_ = taken
    parameters = model.parameters | {
        "youngs_modulus": model.parameters["youngs_modulus"].at[9].set(jnp.nan)
    }
    end, steps = adapted(config, replace(model, parameters=parameters), state, duration=DURATION)
    assert [int(x) for x in end.status[:3]] == [UNSTABLE_STEP, 0, 9] and int(steps.count) == 0
    np.testing.assert_array_equal(end.position, state.position)


def test_a_share_of_the_step_takes_more_of_them(taken):
    config, model, state, _, dt = taken
    end, steps = adapted(config, model, state, duration=DURATION, share=0.7)
    assert int(end.status.code) == OK
    assert 1.2 * len(dt) < int(steps.count) < 1.7 * len(dt) + 2


@pytest.mark.skipif(jax.device_count() < 2, reason="needs two host devices")
def test_devices_take_the_same_steps(taken):
    config, model, state, end, dt = taken
    config = replace(config, placement=Placement(2, 16))
    other, steps = adapted(config, model, state, duration=DURATION)
    np.testing.assert_allclose(steps.dt[: len(dt)], dt, rtol=1e-9)
    assert int(steps.count) == len(dt)
    np.testing.assert_allclose(other.position, end.position, atol=1e-13)


@pytest.mark.slow
def test_float32_hits_the_frame_too():
    config, model, state = stiff(dtype=jnp.float32)
    run = jax.jit(partial(rollout_adaptively, config, stepping=STEPPING, record=ROOM))
    for frame in (1, 2):
        state, steps = run(model, state, duration=DURATION)
        check(state.status)
        assert float(np.sum(np.asarray(steps.dt, np.float64))) == pytest.approx(DURATION, rel=1e-6)
        assert float(state.time) == pytest.approx(frame * DURATION, rel=1e-6)
    assert steps.dt.dtype == state.position.dtype == jnp.float32


def test_a_frame_on_the_host_adapts_and_is_tried_again_with_a_share(monkeypatch):
    config, model, state = stiff()
    simulation = simulation_of(config, model, state, dt=DURATION / 8, steps=8, carriers=3)
    simulation = replace(simulation, stepping=STEPPING)
    _, first, second = islice(frames(simulation), 3)
    end, steps = adapted(config, model, state, duration=DURATION)
    assert first.metrics["steps"] == int(steps.count)
    np.testing.assert_allclose(first.state.position, end.position, atol=1e-14)
    # What a frame is depends on its start alone.
    (again,) = islice(frames(simulation, start=(1, first.state)), 1)
    for a, b in zip(jax.tree.leaves(again.state), jax.tree.leaves(second.state), strict=True):
        assert np.asarray(a).tobytes() == np.asarray(b).tobytes()
    tried, next_frame = [], loop.next_frame

    def failing(simulation, config, model, state, refinement):
        tried.append(refinement)
        after = next_frame(simulation, config, model, state, refinement)
        if refinement != 1:
            return after._replace(status=after.status._replace(code=jnp.int32(UNSTABLE_STEP)))
        return after

    monkeypatch.setattr("jaxphys.pipeline.frames.next_frame", failing)
    _, first = islice(frames(simulation), 2)
    assert tried == [None, 0, 1]
    assert 1.6 * int(steps.count) < first.metrics["steps"] <= 2 * int(steps.count) + 2


def test_what_does_not_adapt_holds_nothing_of_it():
    config, model, state = stiff()
    fixed, told = (
        jax.make_jaxpr(partial(step, replace(config, tells_rates=tells)))(model, state, 1e-3).jaxpr
        for tells in (False, True)
    )
    assert count_primitives(fixed, "bitcast_convert_type") == 0
    # Start, and two passes.
    assert count_primitives(told, "bitcast_convert_type") == 3
    conds = [
        count_primitives(
            jax.make_jaxpr(partial(rollout, config, steps=3))(model, state, dt=dt).jaxpr, "cond"
        )
        for dt in (1e-3, jnp.full(3, 1e-3))
    ]
    assert conds[0] == conds[1]
    masked = jax.make_jaxpr(partial(rollout, config))(
        model, state, dt=jnp.full(3, 1e-3), steps=jnp.int32(2)
    )
    assert count_primitives(masked.jaxpr, "cond") == conds[0] + 1
