"""Implicit steps: the potential and its slopes, closed forms, conservation, failure, gradients."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Impulse, Plane, Setting, Translate, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.implicit.grid import allowed, prepared, project
from jaxphys.mpm.loop.implicit.passes import Start, begin, linearise
from jaxphys.mpm.loop.implicit.rollout import implicit_rollout, implicit_steps
from jaxphys.mpm.loop.implicit.solve import Problem, curvature, point
from jaxphys.mpm.loop.implicit.step import implicit_step, taken_apart
from jaxphys.mpm.loop.particle_step import Shared
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.loop.status import SimulationError, check
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.plasticity import UNIAXIAL, VON_MISES
from jaxphys.mpm.state import NOT_CONVERGED, Config, Model, initial_state
from jaxphys.mpm.stepping.implicit import Implicit
from jaxphys.problems.bar import Bar, free_bar, line_room
from jaxphys.problems.column import Column, sudden_column
from jaxphys.problems.discrete import energy
from tests.mpm.cases import block

pytestmark = pytest.mark.slow  # each compiles a solve, some with its derivative

DT = 2e-3
YIELD = {"yield_stress": 60.0, "hardening": 100.0}


def mixed():
    """Sixty particles, two thirds of them plastic, strained, moving; with a slippery and a sticky
    side, a floor with friction, particles whose velocity is given, and a push.
    """
    config, model, state = block()
    config = Config(config.grid, ((NEO_HOOKEAN, 0, 20), (VON_MISES, 20, 60)))
    full = {name: jnp.full(60, value) for name, value in YIELD.items()}
    rest = np.asarray(state.position.T)
    setting = Setting(config.grid, rest, np.asarray(model.volume), np.dtype(np.float64))
    listed = (
        Plane((0.0, 0.0, 0.29), (0.0, 0.0, 1.0), "separate", 0.4),
        Plane((0.26, 0.0, 0.0), (1.0, 0.0, 0.0), "slip", None, acts_on="nodes"),
        Plane((0.0, 0.27, 0.0), (0.0, 1.0, 0.0), "sticky", velocity=(0.1, 0.0, 0.2)),
        Translate((0.5, 0.55, 0.5), (0.1, 0.1, 0.1), (0.2, 0.0, 0.0)),
        Impulse((0.4, 0.4, 0.4), (0.1, 0.1, 0.1), (3.0, 0.0, 1.0)),
    )
    made = prepare(listed, setting)
    model = replace(model, parameters=model.parameters | full, boundaries=made)
    fields = (state.position, state.velocity, state.deformation, state.affine)
    position, velocity, F, C = (jnp.moveaxis(x, -1, 0) for x in fields)
    return config, model, initial_state(config, position, velocity, F, C, boundaries=made)


@partial(jax.jit, static_argnums=0)
def pieces(config, model, state, u, direction):
    """(energy, residual, projected direction, its curvature) of a step, at allowed velocities."""
    bodies, moving, _ = taken_apart(config, model, state)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)
    dt = jnp.asarray(DT)
    shared = Shared(model.gravity, boundaries, dt, dt, state.time, state.time + dt)
    start = Start(shared, jnp.zeros(3, jnp.int32), 0.7 * dt)
    rows, heavy, rest = begin(
        config,
        start,
        bodies.matter,
        moving.particles,
        moving.residuals,
        moving.flows,
        bodies.stiffness,
    )
    nodes = prepared(
        config,
        boundaries,
        model.gravity,
        bodies.lightest,
        rows,
        heavy,
        start.origin,
        state.time,
        dt,
        start.stage,
    )
    problem = Problem(start, rest, nodes)
    u, direction = allowed(nodes, nodes.target + u), project(nodes, direction)
    found = point(config, problem, u)
    _, tangents = linearise(config, start, rest, u, None)
    bent = curvature(config, problem, tangents, direction)
    return found.energy, project(nodes, found.residual), direction, bent, found.sound


@pytest.fixture(scope="module")
def directions():
    """Two random directions of node rows, and what the step is made of."""
    scene = mixed()
    random = np.random.default_rng(3)
    rows = random.normal(size=(3, scene[0].computed.nodes, 4))
    rows[..., 3] = 0
    return *scene, jnp.asarray(rows)


def test_the_residual_is_the_slope_of_the_potential(directions):
    """Laws, contact with friction, given velocities and held nodes, by central differences."""
    *scene, (at, way, _) = directions
    at = 0.05 * at
    _, slope, way, *_, sound = pieces(*scene, at, way)
    assert bool(sound) and float(jnp.abs(slope).max()) > 0.1
    h = 1e-4
    ends = [pieces(*scene, at + side * h * way, way)[0] for side in (1, -1)]
    expected = float(ends[0] - ends[1]) / (2 * h)
    assert float(jnp.vdot(slope, way)) == pytest.approx(expected, rel=1e-6)


def test_the_curvature_is_the_slope_of_the_residual_and_symmetric(directions):
    *scene, (at, way, other) = directions
    at = 0.05 * at
    *_, way, bent, _ = pieces(*scene, at, way)
    *_, other, bent_other, _ = pieces(*scene, at, other)
    assert float(jnp.vdot(other, bent)) == pytest.approx(
        float(jnp.vdot(way, bent_other)), rel=1e-11
    )
    h = 1e-5
    ends = [pieces(*scene, at + side * h * way, way)[1] for side in (1, -1)]
    np.testing.assert_allclose(
        bent, (ends[0] - ends[1]) / (2 * h), atol=2e-6 * float(jnp.abs(bent).max())
    )


STEP = Implicit(theta=0.7, tolerance=1e-11)


@partial(jax.jit, static_argnums=0)
def one(config, model, state, dt):
    return implicit_step(config, model, state, dt, STEP)


explicit = jax.jit(step, static_argnums=0)


def test_a_short_step_is_the_explicit_one():
    """They differ by the square of dt in velocity and F, by its third power in position."""
    config, model, state = block()
    gaps = []
    for dt in (1e-4, 5e-5):
        a, b = one(config, model, state, dt), explicit(config, model, state, dt)
        assert int(a.status.code) == 0
        gaps.append(
            [
                float(jnp.abs(getattr(a, name) - getattr(b, name)).max())
                for name in ("position", "velocity", "deformation")
            ]
        )
    coarse, fine = np.array(gaps)
    np.testing.assert_allclose(np.log2(coarse / fine), [2, 2, 2], atol=0.1)


def test_momentum_is_kept():
    """Linear momentum to round-off, in steps that are long for this matter, however well they were
    solved; angular momentum by its error's order, the square of a step.
    """
    config, model, state = block()
    model = replace(model, gravity=jnp.zeros(3))
    D = config.grid.spacing**2 / 4

    def momenta(state):
        x, v, m = np.asarray(state.position), np.asarray(state.velocity), np.asarray(model.mass)
        C = np.asarray(state.affine)
        spin = np.array([C[2, 1] - C[1, 2], C[0, 2] - C[2, 0], C[1, 0] - C[0, 1]])
        return (m * v).sum(1), (m * (np.cross(x.T, v.T).T + D * spin)).sum(1)

    p0, l0 = momenta(state)
    lost = []
    for dt in (0.02, 2e-3, 1e-3):
        after = one(config, model, state, dt)
        assert int(after.status.code) == 0
        p1, l1 = momenta(after)
        np.testing.assert_allclose(p1, p0, atol=1e-13)
        lost.append(np.abs(l1 - l0).max())
    assert np.abs(after.velocity - state.velocity).max() > 0.1
    assert np.log2(lost[1] / lost[2]) == pytest.approx(2, abs=0.2)
    assert lost[1] < 1e-3 * np.abs(l0).max()


ROOM = line_room(16 * 2)
LINE = {theta: Implicit(theta=theta, tolerance=1e-10) for theta in (1.0, 0.5)}


@partial(jax.jit, static_argnums=(0, 4))
def along(config, model, state, lengths, stepping):
    return implicit_steps(config, model, state, lengths, stepping)


def padded(dt, steps, room=40):
    return jnp.where(jnp.arange(room) < steps, dt, 0.0)


def in_neo_hookean(problem):
    """The same problem with the law that compiles soonest: strains are small."""
    config = replace(problem.config, segments=((NEO_HOOKEAN, 0, ROOM.particles),))
    return replace(problem, config=config)


def test_a_hanging_bar_at_a_hundred_times_the_explicit_step():
    """Stress is rho g times what hangs below: of each cell, since nodes feel no more of the two
    particles in it, and past the first, which is held by springs at its particles.
    """
    column = Column(gravity=1e-3)
    problem = in_neo_hookean(sudden_column(column, 16, room=ROOM))
    dt = 100 * problem.spacing / column.wave_speed
    assert dt > 100 * problem.dt
    after = along(problem.config, problem.model, problem.state, padded(dt, 40), LINE[1.0])
    check(after.status)
    n = problem.count
    X = (np.arange(n) + 0.5) / n * column.height
    stress = column.youngs * np.log(np.asarray(after.deformation)[0, 0, :n])
    exact = np.asarray(column.static_stress(X))
    of_cells = (stress - exact).reshape(-1, 2).mean(axis=1)[1:]
    assert np.sqrt(np.mean(of_cells**2)) < 0.01 * np.abs(exact).max()
    shift = (np.asarray(after.position - problem.state.position)[0, :n]) * problem.spacing
    expected = np.asarray(column.static_displacement(X))
    np.testing.assert_allclose(shift, expected, atol=0.07 * np.abs(expected).max())


@pytest.mark.parametrize("theta, kept", [(1.0, np.exp(-4 * np.pi**2 / 40)), (0.5, 1.0)])
def test_energy_kept_in_a_period(theta, kept):
    """Of the bar's first mode in N = 40 steps: exp(-4 pi^2 / N) by backward Euler, all of it by the
    midpoint rule, but for what transfers take.
    """
    bar = Bar()
    problem = in_neo_hookean(free_bar(bar, 16, staggered=False, room=ROOM))
    stepping = LINE[theta]
    after = along(
        problem.config, problem.model, problem.state, padded(bar.period / 40, 40), stepping
    )
    check(after.status)
    assert energy(problem, after) / energy(problem, problem.state) == pytest.approx(kept, abs=0.01)


STIFF = Implicit()


def resting(dtype=jnp.float32, modulus=1e9):
    """A block of 4 x 4 x 4 cells of matter like a metal just above a floor with friction."""
    grid, cells, dx = Grid((12, 12, 12), 0.1), 3, 0.1
    line = (np.arange(2 * cells) + 0.5) * dx / 2
    corner = np.array([0.4, 0.4, 0.401])
    position = np.stack(np.meshgrid(line, line, line), -1).reshape(-1, 3) + corner
    count = len(position)
    volume = np.full(count, dx**3 / 8)
    floor = Plane((0.0, 0.0, 0.4), (0.0, 0.0, 1.0), "separate", 0.3)
    boundaries = prepare((floor,), Setting(grid, position, volume, np.dtype(dtype)))
    config = Config(grid, ((NEO_HOOKEAN, 0, count),), check_step=False)
    model = Model(
        mass=jnp.asarray(1000 * volume, dtype),
        volume=jnp.asarray(volume, dtype),
        parameters={
            "youngs_modulus": jnp.full(count, modulus, dtype),
            "poisson_ratio": jnp.full(count, 0.3, dtype),
        },
        gravity=jnp.asarray([1.0, 0.0, -9.8], dtype),
        boundaries=boundaries,
    )
    return config, model, initial_state(config, position, dtype=dtype, boundaries=boundaries)


@pytest.fixture(scope="module")
def stiff():
    config, model, state = resting()
    run = jax.jit(partial(implicit_rollout, config, stepping=STIFF))
    return model, state, run


def test_a_stiff_block_comes_to_rest(stiff):
    """In float32, with steps some hundred times the explicit one; friction holds it on a slope
    that is less steep than its coefficient.
    """
    model, state, run = stiff
    after, report = run(model, state, time=0.2)
    check(after.status)
    bound = 0.1 / np.sqrt(1.35e9 / 1000)
    assert float(report.lengths.max()) > 100 * bound
    assert float(jnp.sum(report.lengths)) == pytest.approx(0.2, rel=1e-5)
    assert float(after.time) == pytest.approx(0.2, rel=1e-6)
    moved = np.asarray(after.position - state.position)
    assert np.abs(np.asarray(after.velocity)).max() < 0.02
    np.testing.assert_allclose(moved[2], -0.001, atol=4e-4)
    # The step in which it meets the floor has no friction yet; without any it would be 0.02.
    assert np.abs(moved[:2]).max() < 8e-3
    strain = np.asarray(after.deformation) - np.eye(3)[..., None]
    assert np.abs(strain).max() < 1e-3


def test_rest_costs_little_however_stiff():
    """In float64 friction holds metal too, and once the block has landed a step takes few products:
    from velocities that its floor would have to stop it took hundreds.
    """
    run = None
    for modulus in (1e8, 1e11):
        config, model, state = resting(jnp.float64, modulus)
        run = run or jax.jit(partial(implicit_rollout, config, stepping=STIFF))
        after, counts = state, []
        for _ in range(10):
            after, report = run(model, after, time=0.02)
            counts.append(int(report.effort.products))
        check(after.status)
        moved = np.asarray(after.position - state.position)
        assert np.abs(moved[:2]).max() < 8e-3 and np.abs(after.velocity).max() < 1e-4
        assert max(counts) > 40 and max(counts[5:]) < 40


def test_one_that_cannot_be_solved_is_told(stiff):
    """Here because float32 has no number for its energy. Steps are halved down to a thousandth."""
    model, state, run = stiff
    hard = model.parameters | {"youngs_modulus": 1e28 * model.parameters["youngs_modulus"]}
    after, report = run(replace(model, parameters=hard), state, time=0.01)
    assert int(after.status.code) == NOT_CONVERGED
    np.testing.assert_array_equal(after.position, state.position)
    assert int(report.steps) == 0 and int(report.rejected) == 10
    with pytest.raises(SimulationError, match=r"implicit step were not solved.*tolerance"):
        check(after.status)


LONG = Implicit(tolerance=1e-9)


@partial(jax.jit, static_argnums=0)
def long_step(config, model, state):
    return implicit_step(config, model, state, DT, LONG)


@pytest.fixture(scope="module")
def after_long_step():
    config, model, state = mixed()
    return config, model, state, long_step(config, model, state)


def test_held_nodes_and_given_velocities_hold(after_long_step):
    """What a sticky side covers has its velocity, what is given one moves with it."""
    _, model, state, after = after_long_step
    assert int(after.status.code) == 0
    given = np.asarray(model.boundaries[3].chosen)
    assert given.any()
    moved = np.asarray(after.position - state.position)[:, given] / DT
    np.testing.assert_allclose(moved, np.array([[0.2], [0], [0]]) + 0 * moved, atol=1e-12)


def test_a_plastic_law_is_within_yield_at_the_end(after_long_step):
    """The step's end is a trial state, as everywhere: mapped back it lies on the cylinder that has
    hardened, and plastic strain has grown.
    """
    _, model, _, after = after_long_step
    metal = slice(20, 60)
    values = {
        name: model.parameters[name][metal]
        for name in ("youngs_modulus", "poisson_ratio", "yield_stress", "hardening")
    }
    F, history = after.deformation[..., metal], after.history[:1, metal]
    _, stress, hardened = VON_MISES.update(values, F, history, jnp.zeros(()))
    deviator = stress - jnp.trace(stress) / 3 * jnp.eye(3)[..., None]
    norm = jnp.sqrt(jnp.sum(deviator**2, axis=(0, 1)))
    radius = UNIAXIAL * (values["yield_stress"] + values["hardening"] * hardened[0])
    assert float(jnp.max(norm / radius)) < 1 + 1e-9
    assert float(history.max()) > 0.01 and float(jnp.max(hardened - history)) > 0


def test_chunks_devices_and_a_window_change_nothing():
    config, model, state = block()
    expected = one(config, model, state, DT)
    spread = replace(config, placement=Placement(devices=2, chunk=16), window=(8, 8, 8))
    found = one(spread, model, state, DT)
    assert int(found.status.code) == 0
    for name in ("position", "velocity", "affine", "deformation"):
        want = np.asarray(getattr(expected, name))
        np.testing.assert_allclose(
            getattr(found, name), want, atol=1e-8 * np.abs(want).max(), err_msg=name
        )


EXACT = Implicit(theta=0.7, tolerance=1e-12)
NAMES = ("youngs_modulus", "poisson_ratio", "density", "velocity", "gravity")


@pytest.fixture(scope="module")
def loss():
    """A smooth function of where two long steps lead, with its slope: value_and_grad by what scales
    each of `NAMES`.
    """
    config, model, state = block(count=24)
    weights = jnp.asarray(np.random.default_rng(5).normal(size=(2, 3, 24)))

    def of(scales):
        values = dict(model.parameters)
        for name in NAMES[:2]:
            values[name] = values[name] * (1 + scales[name])
        changed = replace(
            model,
            parameters=values,
            mass=model.mass * (1 + scales["density"]),
            gravity=model.gravity * (1 + scales["gravity"]),
        )
        started = state._replace(velocity=state.velocity * (1 + scales["velocity"]))
        end = implicit_steps(config, changed, started, jnp.array([6e-3, 8e-3]), EXACT)
        return jnp.sum(weights[0] * end.position) + 0.02 * jnp.sum(weights[1] * end.velocity)

    compiled = jax.jit(jax.value_and_grad(of))
    zero = {name: jnp.zeros(()) for name in NAMES}
    return compiled, zero, compiled(zero)


@pytest.mark.parametrize("name", NAMES)
def test_gradient_is_that_of_central_differences(loss, name):
    compiled, zero, (_, slope) = loss
    h = 1e-4
    ends = [compiled(zero | {name: jnp.asarray(side * h)})[0] for side in (1, -1)]
    expected = float(ends[0] - ends[1]) / (2 * h)
    assert abs(expected) > 1e-4
    assert float(slope[name]) == pytest.approx(expected, rel=1e-5)


def test_taylor_remainder_is_of_second_order(loss):
    compiled, _, (value, slope) = loss
    way = dict(zip(NAMES, (1.0, 0.5, -0.7, 0.4, 2.0), strict=True))
    first = sum(float(slope[name]) * w for name, w in way.items())
    remainders = [
        abs(
            float(compiled({name: jnp.asarray(h * w) for name, w in way.items()})[0] - value)
            - h * first
        )
        for h in (4e-2, 2e-2, 1e-2)
    ]
    rates = np.log2(np.array(remainders[:-1]) / np.array(remainders[1:]))
    np.testing.assert_allclose(rates, 2, atol=0.15)


@pytest.mark.parametrize(
    "values", [{"theta": 0.4}, {"tolerance": 0.0}, {"newton": 0}, {"dt": -1.0}]
)
def test_numbers_out_of_range_are_refused(values):
    with pytest.raises(InputError, match=rf"{next(iter(values))}: .* must be"):
        Implicit(**values)
