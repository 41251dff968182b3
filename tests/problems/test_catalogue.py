"""The catalogue's contract: every problem builds at its resolutions, in both precisions, starts on
its reference and is judged by its norm. The orders themselves: `test_verification`.
"""

import math

import jax
import jax.numpy as jnp
import pytest

from jaxphys.problems.catalogue import PROBLEMS
from jaxphys.problems.problem import displacement_error

# Those whose norm is a displacement's have a motion for a reference, others a number.
CELLS = [problem for problem in PROBLEMS.values() if problem.norm is displacement_error]


def test_names_and_what_a_problem_says_of_itself():
    assert set(PROBLEMS) == {
        "free-bar", "held-bar", "sudden-column", "particle", "rotation", "vortex", "cube",
        "ringing-cube", "cantilever", "colliding-bars", "parting-bars", "colliding-discs",
        "spinning-disc", "sliding-block", "sticking-block", "sliding-on-slab",
        "sticking-on-slab", "hertz", "taylor-bar", "poiseuille", "bingham", "taylor-green",
        "dam-break", "grains-1", "grains-2",
    }  # fmt: skip
    for name, problem in PROBLEMS.items():
        assert problem.name == name and problem.source and problem.order in (1, 2, None)
        assert 0 <= problem.floor < 0.5
        assert list(problem.ladder) == sorted(problem.ladder) and len(problem.ladder) >= 3


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=lambda problem: problem.name)
def test_every_array_that_the_solver_is_given_has_the_dtype(problem, dtype):
    built = problem.build(problem.ladder[0], dtype)
    assert {leaf.dtype for leaf in jax.tree.leaves((built.model.mass, built.state.position))} == {
        jnp.dtype(dtype)
    }
    assert {value.dtype for value in built.model.parameters.values()} == {jnp.dtype(dtype)}


@pytest.mark.parametrize("problem", CELLS, ids=lambda problem: problem.name)
def test_norm_is_none_at_the_reference_and_right_beside_it(problem):
    built = problem.build(problem.ladder[0], "float64")
    there = built.state._replace(position=jnp.asarray(built.exact))
    assert problem.norm(built, there) == 0.0
    beside = there._replace(position=there.position.at[1].add(0.3))
    expected = 0.3 * built.spacing / built.scale
    assert math.isclose(problem.norm(built, beside), expected, rel_tol=1e-9)
    failed = there._replace(status=there.status._replace(code=jnp.int32(1)))
    assert problem.norm(built, failed) == math.inf


def test_particles_error_falls_at_its_order():
    problem = PROBLEMS["particle"]
    coarse, fine = (problem.error(steps, "float64") for steps in problem.ladder[:2])
    assert abs(math.log2(coarse / fine) - problem.order) < 0.05, (coarse, fine)
