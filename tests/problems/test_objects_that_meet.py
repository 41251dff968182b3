"""Objects that meet: with a velocity field each they part as theory has it, and share one in the
controls.
"""

import numpy as np

from jaxphys.problems.catalogue import PROBLEMS
from jaxphys.problems.colliding import Bars, meeting, parted
from jaxphys.problems.discrete import solve
from jaxphys.problems.discs import Discs, colliding, returned
from jaxphys.problems.stacked import Stack, slid, stacked


def momentum(problem, state):
    """Of each object, (2, 3), over the sum of the sizes of all particles' momenta at the start."""
    mass, field = np.asarray(problem.model.mass), np.asarray(problem.model.field)
    each = [(mass * np.asarray(state.velocity))[:, field == k].sum(axis=1) for k in (0, 1)]
    return np.stack(each) / np.sum(mass * np.linalg.norm(problem.state.velocity, axis=0))


def test_bars_part_and_their_momenta_are_exchanged():
    problem = meeting(Bars(), 16, contact=True)
    end = solve(problem)
    assert 0.75 < parted(problem, end) / problem.truth.parted < 1
    before, after = (momentum(problem, state)[:, 0] for state in (problem.state, end))
    np.testing.assert_allclose(before, [0.5, -0.5], atol=1e-12)
    np.testing.assert_allclose(after.sum(), 0, atol=1e-12)
    assert -0.5 < after[0] < -0.45
    # Control: on one field they cling.
    assert PROBLEMS["colliding-bars"].error(16, "float64") > 0.9


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


def test_a_block_slides_on_a_slab_and_is_slowed_by_friction():
    """Dragged at its edges (docs/validation.md): what is asserted is the order of things."""

    def distance(friction, contact=True):
        problem = stacked(Stack(friction=friction), 2, contact=contact)
        return slid(problem, solve(problem)) / Stack(friction=0.0).distance

    smooth, rough, rougher = (distance(friction) for friction in (0.0, 0.3, 0.8))
    assert 1 > smooth > 0.7 and smooth > 1.5 * rough and rough > 1.5 * rougher
    assert distance(0.0, contact=False) < 0.1
