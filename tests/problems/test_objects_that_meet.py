"""Objects that meet: with a velocity field each they part, slide and stick as theory has it, and
share one in the controls.
"""

import jax
import numpy as np
import pytest

from jaxphys.mpm.loop.adaptive import rollout_adaptively
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.stepping import Adaptive
from jaxphys.problems.catalogue import PROBLEMS
from jaxphys.problems.colliding import Bars, meeting, parted
from jaxphys.problems.discrete import solve
from jaxphys.problems.discs import Discs, colliding, returned
from jaxphys.problems.incline import slid
from jaxphys.problems.stacked import Stack, stacked


def momentum(problem, state):
    """Of each object, (2, 3), over the sum of the sizes of all particles' momenta at the start."""
    mass, field = np.asarray(problem.model.mass), np.asarray(problem.model.field)
    each = [(mass * np.asarray(state.velocity))[:, field == k].sum(axis=1) for k in (0, 1)]
    return np.stack(each) / np.sum(mass * np.linalg.norm(problem.state.velocity, axis=0))


@pytest.mark.slow
def test_bars_part_and_their_momenta_are_exchanged():
    problem = meeting(Bars(), 16, contact=True)
    end = solve(problem)
    assert 0.9 < parted(problem, end) / problem.truth.parted < 1
    before, after = (momentum(problem, state)[:, 0] for state in (problem.state, end))
    np.testing.assert_allclose(before, [0.5, -0.5], atol=1e-12)
    np.testing.assert_allclose(after.sum(), 0, atol=1e-12)
    assert -0.5 < after[0] < -0.45


@pytest.mark.slow
def test_bars_on_one_field_cling():
    assert PROBLEMS["colliding-bars"].error(16, "float64") > 0.9


@pytest.mark.slow
def test_discs_come_back_as_from_a_wall_and_touch_no_sooner_than_they_are_there():
    problem, known = colliding(Discs(), 8), PROBLEMS["colliding-discs"]
    end = solve(problem)
    assert known.norm(problem, end) < 0.04 and returned(problem, end) < 1
    assert np.abs(momentum(problem, end).sum(axis=0)).max() < 1e-14

    def slowed(contact):
        """How much of their speed they have lost a little before they touch."""
        one = colliding(Discs(), 8, contact=contact)
        early = solve(one, steps=int(0.97 * one.truth.touch / one.dt))
        return 1 + returned(one, early)

    # Control: on one field they meet a cell too soon.
    assert slowed(True) < 1e-3 < 0.02 < slowed(False)


def test_a_block_slides_on_a_slab_as_coulomb_has_it_and_stays_where_it_should():
    """On two cells a side; it moves a little before it has settled on the slab."""
    slides, stays = Stack(), Stack(friction=0.8)
    free = Stack(friction=0.0).distance
    for truth, most in ((slides, 0.16 * slides.distance), (stays, 0.16 * free)):
        problem = stacked(truth, 2)
        assert 0 < slid(problem, solve(problem)) - truth.distance < most


@pytest.mark.slow
def test_sliding_converges_to_coulombs_law_and_without_friction_nothing_drags():
    errors = [PROBLEMS["sliding-on-slab"].error(cells, "float64") for cells in (2, 4, 8)]
    assert errors[2] < 0.05 and errors[1] < 0.6 * errors[0] and errors[2] < 0.6 * errors[1]
    problem = stacked(Stack(friction=0.0), 4)
    assert slid(problem, solve(problem)) / problem.truth.distance == pytest.approx(1, abs=0.02)
    # Control: on one field it clings.
    problem = stacked(Stack(friction=0.0), 2, contact=False)
    assert slid(problem, solve(problem)) / problem.truth.distance < 0.1


@pytest.mark.slow
def test_what_sticks_does_not_creep():
    """Two seconds: once it has settled, by less than a hundredth of a cell a second."""
    problem = stacked(Stack(friction=0.8, duration=2.0), 8)
    some = problem.steps // 80

    @jax.jit
    def on(model, state):
        return rollout(problem.config, model, state, dt=problem.dt, steps=some)

    state, moved = problem.state, []
    for _ in range(80):
        state = on(problem.model, state)
        moved.append(slid(problem, state))
    assert int(state.status.code) == 0
    times = some * problem.dt * np.arange(40)
    assert abs(np.polyfit(times, moved[40:], 1)[0]) < 0.01 * problem.spacing


@pytest.mark.slow
def test_steps_that_adapt_slide_as_far():
    """Two that go on together have no mode that is faster than either has: the bounds hold."""
    problem = stacked(Stack(), 2)
    duration = problem.dt * problem.steps
    end, steps = rollout_adaptively(
        problem.config, problem.model, problem.state, Adaptive(), duration=duration
    )
    assert int(end.status.code) == 0 and int(steps.count) > 20
    fixed = slid(problem, solve(problem))
    assert slid(problem, end) == pytest.approx(fixed, rel=0.05)
