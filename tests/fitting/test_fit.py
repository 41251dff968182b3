"""Fits, from a simulation with other numbers to the numbers that were observed."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.checkpoints import Checkpoints
from jaxphys.core.errors import InputError
from jaxphys.fitting import (
    LBFGS,
    Adam,
    Bounded,
    Field,
    Free,
    Log,
    Memory,
    Own,
    Stage,
    Tracks,
    fit,
    layout,
    problem,
    solved,
)
from jaxphys.fitting.motion import motion_at, steps_for
from jaxphys.fitting.problem import Program
from jaxphys.mpm.boundaries import Ball, Plane, Steady
from jaxphys.scene.build import build
from tests.mpm.cases import block, simulation_of
from tests.pipeline.test_animate import small_scene, sphere

COUNT = 40
TIMES = (0.0, 0.01, 0.03)
DT = 1e-3
TRUTH = {"youngs_modulus": 2500.0, "poisson_ratio": 0.25, "velocity": (0.3, -0.1, 0.2)}


@pytest.fixture(scope="module")
def simulation():
    config, model, state = block(COUNT)
    even = {"youngs_modulus": jnp.full(COUNT, 1000.0), "poisson_ratio": jnp.full(COUNT, 0.3)}
    model = replace(model, parameters=even)
    return simulation_of(config, model, state, dt=DT, steps=10)


@pytest.fixture(scope="module")
def truth(simulation):
    """In the steps that a fit takes at these numbers: its own method's error is no part of it."""
    moved = simulation.with_(**TRUTH)
    steps = steps_for(moved, 0.02)
    return np.asarray(jax.jit(lambda s: motion_at(s, TIMES, steps).position)(moved))


FREE = {
    "youngs_modulus": Log(900.0),
    "poisson_ratio": Bounded(0.35, 0.0, 0.49),
    "velocity": Free((0.0, 0.0, 0.0), size=0.3),
}


@pytest.mark.slow
def test_a_motion_at_times_is_the_rollout_to_them(simulation):
    """Free flight under gravity, of the middle of mass: x + v t + g t^2 / 2 to the step's order."""
    moved = simulation.with_(velocity=(0.3, -0.1, 0.2))
    motion = jax.jit(lambda s: motion_at(s, TIMES, 20))(moved)
    mass = np.asarray(moved.model.mass)
    middle = np.einsum("n,tnc->tc", mass, motion.position) / mass.sum()
    g = np.asarray(moved.model.gravity)
    for time, place in zip(TIMES, middle, strict=True):
        wanted = middle[0] + time * np.array([0.3, -0.1, 0.2]) + 0.5 * g * time**2
        # Symplectic Euler is ahead by dt g t / 2, with steps of half a millisecond and a whole one.
        np.testing.assert_allclose(place, wanted + 0.5 * 1e-3 * g * time, atol=3e-5)
    np.testing.assert_allclose(motion.time, TIMES, atol=1e-12)
    nearer = jax.jit(lambda s, h: motion_at(s, TIMES, 20, horizon=h))(moved, 2)
    np.testing.assert_array_equal(nearer.position[1], motion.position[1])
    np.testing.assert_array_equal(nearer.position[2], motion.position[1])
    traced = jax.jit(lambda s, steps: motion_at(s, TIMES, steps))(moved, 20)
    for one, other in zip(jax.tree.leaves(traced), jax.tree.leaves(motion), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14)


def test_the_loss_has_the_slope_of_its_differences(simulation, truth):
    numbers = layout(FREE, simulation, None)
    asked = problem(simulation, numbers, (Tracks(truth, np.array(TIMES), noise=1e-2),))
    data, program = asked.data(), Program(20, (0,))
    start = numbers.start() + 0.1
    loss = lambda v: float(asked.compare(v, data, 3, program).loss)  # noqa: E731
    value, slope = asked.call("gradient", program)(asked.cast(start), data, 3)
    value = float(value)
    assert value == pytest.approx(loss(start), rel=1e-12)
    direction = np.random.default_rng(0).normal(size=numbers.size)
    h = 1e-5
    difference = (loss(start + h * direction) - loss(start - h * direction)) / (2 * h)
    assert float(slope @ direction) == pytest.approx(difference, rel=1e-6)
    residuals = asked.compare(start, data, 3, program).residuals
    assert value == pytest.approx(0.5 * float(np.sum(residuals[0] ** 2)), rel=1e-12)
    normal = asked.call("normal", program)(asked.cast(start), data, 3)
    assert float(normal[0]) == pytest.approx(value, rel=1e-12)
    np.testing.assert_allclose(normal[1], slope, rtol=1e-8, atol=1e-10 * value)
    # J^T J, by differences of the residuals along the direction.
    ahead, behind = (
        asked.compare(start + s * h * direction, data, 3, program).residuals[0] for s in (1, -1)
    )
    along = np.sum(((ahead - behind) / (2 * h)) ** 2)
    assert float(direction @ normal[2] @ direction) == pytest.approx(float(along), rel=1e-6)


def test_gauss_newton_finds_all_five_numbers_without_noise(simulation, truth):
    found = fit(simulation, FREE, Tracks(truth, np.array(TIMES), noise=1e-3))
    assert "gauss-newton" in found.search
    assert found.values["youngs_modulus"] == pytest.approx(2500, rel=1e-3)
    assert found.values["poisson_ratio"] == pytest.approx(0.25, abs=1e-3)
    np.testing.assert_allclose(found.values["velocity"], TRUTH["velocity"], atol=1e-4)
    (misfit,) = found.misfits
    assert misfit.fit < 1e-6 < misfit.start
    assert misfit.still == pytest.approx(np.sqrt(np.mean((truth[1:] - truth[0]) ** 2)), rel=1e-9)
    assert found.history[-1]["loss"] < 1e-4 * found.history[0]["loss"]
    np.testing.assert_allclose(found.motion.position, truth, atol=1e-5)
    moved = found.simulation.model.parameters["youngs_modulus"]
    np.testing.assert_allclose(moved, 2500, rtol=1e-3)


def test_noise_gives_intervals_that_hold_the_truth(simulation, truth):
    noisy = truth + 1e-3 * np.random.default_rng(5).normal(size=truth.shape)
    found = fit(simulation, FREE, Tracks(noisy, np.array(TIMES), noise=1e-3), level=0.99)
    low, high = found.uncertainty["youngs_modulus"]
    assert low < 2500 < high and high / low < 4
    assert all(
        found.uncertainty[f"velocity.{axis}"][0] < value < found.uncertainty[f"velocity.{axis}"][1]
        for axis, value in zip("xyz", TRUTH["velocity"], strict=True)
    )
    assert found.uncertainty.independent > 50
    assert found.misfits[0].fit == pytest.approx(1e-3, rel=0.1)


def test_what_nothing_depends_on_is_reported(simulation, truth):
    """At time 0 nothing has felt its stiffness, and only then it was seen."""
    seen = np.zeros(truth.shape[:2], bool)
    seen[0] = True
    tracks = Tracks(truth, np.array(TIMES), seen=seen)
    with pytest.raises(InputError, match=r"'youngs_modulus'.*nothing that was observed"):
        fit(simulation, FREE, tracks)


@pytest.mark.parametrize(
    "change, told",
    [
        ({"free": {}}, "nothing is free"),
        ({"free": {"youngs_modulu": Log(1.0)}}, "youngs_modulus"),
        ({"free": {"youngs_modulus": 3.0}}, "give Free, Log"),
        ({"free": {"gaussians.harmonics": Free(0.0)}}, "needs look="),
        ({"free": {"gaussians.colour": Free(0.0)}}, "harmonics"),
        ({"free": {"density": Log(1.0, groups=np.zeros(3, int))}}, "3 entries, but there are 40"),
        ({"free": {"boundaries.0.velocity": Free((0.0, 0.0, 0.0))}}, r"boundaries\[0\]"),
        ({"observed": ()}, "nothing was observed"),
        ({"stages": [Stage(("density",))]}, "'density' is not free"),
    ],
)
def test_what_cannot_be_fitted_is_said(change, told, simulation, truth):
    given = {"free": FREE, "observed": Tracks(truth, np.array(TIMES))} | change
    with pytest.raises(InputError, match=told):
        fit(simulation, **given)


class Killed(Exception):
    pass


def killed_after(evaluations: int):
    left = iter(range(1, evaluations))

    def watch():
        if next(left, None) is None:
            raise Killed

    return watch


def test_a_fit_that_was_killed_ends_the_same(simulation, truth, tmp_path):
    """Killed after 3, 7 and 8 evaluations: the same to the last bit, and nothing is asked twice."""
    noisy = truth + 1e-3 * np.random.default_rng(6).normal(size=truth.shape)
    tracks = Tracks(noisy, np.array(TIMES), noise=1e-3)
    search = LBFGS(iterations=8)
    whole = fit(simulation, FREE, tracks, search=search)
    total = 0
    for budget in (3, 4, 1, 10**6):
        memory = Memory(Checkpoints(tmp_path / "evaluations", "a fit"))
        watch = killed_after(budget)
        try:
            found = fit(simulation, FREE, tracks, search=search, memory=memory, watch=watch)
        except Killed:
            memory.save()
        assert memory.replayed == total
        total += budget
    np.testing.assert_array_equal(found.vector, whole.vector)
    assert found.to_json() == whole.to_json()


def test_adam_takes_a_loss_of_ones_own(simulation, truth):
    """A spring that pulls the mean place to where it was: no squares, so Adam, and no intervals."""
    goal = truth[2].mean(axis=0)

    def pulled(motion, look):
        return 1e4 * jnp.sum((motion.position[0].mean(axis=0) - goal) ** 2)

    free = {"velocity": Free((0.0, 0.0, 0.0), size=0.3)}
    own = Own(pulled, np.array([0.03]), is_loss=True)
    found = fit(simulation, free, own, search=Adam(iterations=40, rate=0.1))
    # What a constant velocity for 0.03 s must be; deformation hardly moves the plain mean.
    np.testing.assert_allclose(found.values["velocity"], TRUTH["velocity"], atol=0.05)
    assert found.uncertainty is None


def test_a_field_and_groups_reach_their_particles(simulation):
    rest = np.asarray(simulation.state.position).T
    half = (rest[:, 0] > 0.425).astype(int)
    free = {
        "youngs_modulus": Field(Log(1000.0), nodes=(2, 2, 2)),
        "density": Log(500.0, groups=half),
    }
    numbers = layout(free, simulation, None)
    assert numbers.labels == [f"youngs_modulus[{i}]" for i in range(8)] + [
        "density[0]",
        "density[1]",
    ]
    vector = np.log([1000.0] * 4 + [4000.0] * 4 + [300.0, 600.0])
    np.testing.assert_allclose(numbers.vector(numbers.values(jnp.asarray(vector))), vector)
    moved, _ = numbers.applied(simulation, None, jnp.asarray(vector))
    density = np.asarray(moved.model.mass / moved.model.volume)
    np.testing.assert_allclose(density, np.where(half, 600, 300))
    low, high = rest[:, 0].min(), rest[:, 0].max()
    wanted = 1000 * 4 ** ((rest[:, 0] - low) / (high - low))
    np.testing.assert_allclose(moved.model.parameters["youngs_modulus"], wanted)
    (rough,) = numbers.roughness(jnp.asarray(vector))
    # Four pairs along x differ by log10 4 decades, over the 0.3 that are expected.
    assert float(jnp.sum(rough**2)) == pytest.approx(4 * (np.log10(4) / 0.3) ** 2)


def test_how_a_boundary_moves_may_be_free():
    pusher = Ball((0.5, 0.5, 0.2), radius=0.1, motion=Steady(velocity=(0.0, 0.0, 1.0)))
    scene = small_scene(boundaries=(Plane((0.5, 0.5, 0.2)), pusher))
    made, _ = build(scene, sphere())
    free = {
        "boundaries.1.motion.velocity": Free((0.0, 0.0, 1.0)),
        "boundaries.1.motion.spin": Free((0.0, 0.0, 0.0)),
        "boundaries.0.friction": Log(0.3),
    }
    numbers = layout(free, made, None)
    vector = jnp.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, np.log(0.7)])
    plane, ball = numbers.applied(made, None, vector)[0].model.boundaries
    np.testing.assert_allclose(ball.motion.velocity, (1, 2, 3))
    np.testing.assert_allclose(ball.motion.spin, (4, 5, 6))
    assert float(plane.friction) == pytest.approx(0.7)
    for name in ("boundaries.friction", "boundaries.first.friction", "boundaries.0."):
        with pytest.raises(InputError, match=r"names no number of a boundary: write"):
            layout({name: Free(0.3)}, made, None)


@pytest.mark.slow
def test_a_number_whose_best_is_beyond_its_bound_ends_beside_it(simulation, truth):
    """The truth is 0.25 and at most 0.2 is allowed: the fit ends there, finite and converged."""
    free = {"poisson_ratio": Bounded(0.1, 0.0, 0.2), "youngs_modulus": Log(2000.0)}
    moved = simulation.with_(velocity=TRUTH["velocity"])
    found = fit(moved, free, Tracks(truth, np.array(TIMES), noise=1e-3))
    assert found.values["poisson_ratio"] == pytest.approx(0.2, abs=1e-3)
    assert found.reason in ("converged", "nothing left to gain")
    assert np.all(np.isfinite(found.vector))


def test_a_start_that_is_too_stiff_for_the_step_gets_more_steps_or_one_line(simulation, truth):
    """A hundred times stiffer takes ten times the steps; what would take millions is refused."""
    tracks = Tracks(truth, np.array(TIMES), noise=1e-3)
    soft, stiff = (
        problem(s, layout({"youngs_modulus": Log(E)}, s, None), (tracks,))
        for s, E in ((simulation, 1e7), (simulation, 1e9))
    )
    fewer, more = (p.program(p.layout.start()).steps for p in (soft, stiff))
    assert 7 * fewer < more < 15 * fewer  # the ladder has two rungs to a doubling
    for stiffness, told in ((1e14, "of them between two times"), (1e16, "steps a frame")):
        with pytest.raises(InputError, match=told) as caught:
            fit(simulation, {"youngs_modulus": Log(stiffness)}, tracks)
        assert "\n" not in str(caught.value)


def test_steps_that_are_asked_for_are_taken(simulation, truth):
    tracks = Tracks(truth, np.array(TIMES), noise=1e-3)
    asked = problem(simulation, layout(FREE, simulation, None), (tracks,), steps=37)
    assert asked.program(asked.layout.start()).steps == 37
    with pytest.raises(InputError, match="steps: is 0"):
        problem(simulation, layout(FREE, simulation, None), (tracks,), steps=0)


@pytest.mark.slow
def test_a_fit_that_diverges_keeps_the_best_and_says_why(simulation, truth):
    """A rate that throws the block out of the domain: its start was better than all after it."""
    free = {"velocity": Free((0.0, 0.0, 0.0), size=300.0)}
    tracks = Tracks(truth, np.array(TIMES), noise=1e-3)
    moved = simulation.with_(youngs_modulus=TRUTH["youngs_modulus"], poisson_ratio=0.25)
    found = fit(moved, free, tracks, search=Adam(iterations=30, rate=1.0), steps=20)
    losses = [row["loss"] for row in found.history if row["loss"] is not None]
    assert found.reason == "the simulation fails"
    assert found.loss == pytest.approx(min(losses), rel=1e-6)


def test_problems_that_see_other_numbers_share_their_programs(simulation, truth):
    tracks = Tracks(truth, np.array(TIMES), noise=1e-3)
    asked = problem(simulation, layout(FREE, simulation, None), (tracks,), steps=20)
    noisy = truth + 1e-3 * np.random.default_rng(7).normal(size=truth.shape)
    other = asked.observing((Tracks(noisy, np.array(TIMES), noise=1e-3),))
    solved(asked)
    programs = dict(other._compiled)
    shared = solved(other)
    place, data = asked.layout.start(), asked.data()
    twenty, forty = (asked.compare(place, data, 3, Program(n, (0,))) for n in (20, 40))
    assert 0 < np.abs(twenty.motion.position - forty.motion.position).max() < 3e-4
    assert other._compiled == programs
    alone = fit(simulation, FREE, Tracks(noisy, np.array(TIMES), noise=1e-3), steps=20)
    np.testing.assert_array_equal(shared.vector, alone.vector)
    with pytest.raises(InputError, match="other shapes"):
        asked.observing((Tracks(truth[:, :5], np.array(TIMES), np.arange(5)),))
