"""Newton's method and conjugate gradients for the velocities of an implicit step, and their
derivative.

Stopping, forcing and the node blocks follow Wang et al. (2020), "Hierarchical optimization time
integration for CFL-rate MPM stepping"; curvature is projected only where conjugate gradients meet a
negative one.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.program import part
from jaxphys.mpm.loop.implicit.grid import (
    Nodes,
    allowed,
    characteristic,
    inverse_blocks,
    precondition,
    project,
)
from jaxphys.mpm.loop.implicit.passes import (
    Rest,
    Start,
    Tangents,
    Value,
    evaluate,
    linearise,
    multiply,
    springy,
)
from jaxphys.mpm.state import Config
from jaxphys.mpm.stepping.implicit import Implicit

TRIALS = 12  # of shares of a Newton step, before it counts as none
SHORTER = 0.5  # times the last one at most is the next share
LOOSEST = 0.5  # relative residual with which a linear system is left
SHARE = 0.3  # of the tolerance that is enough for a linear system
ROUNDING = 64  # of these may an energy rise by
LOADS = 1e-2  # of what gravity gives, to which a residual must fall
NOISE = 1.0  # of these is the least strain that a residual tells from rounding in any case
FAINTEST = 0.01  # of these, below which none does


class Effort(NamedTuple):
    """What a solve took, () int32 each: Newton iterations, products with the second derivative, and
    evaluations of the energy, each of which is about one explicit step's work.
    """

    newton: Array
    products: Array
    evaluations: Array

    @classmethod
    def none(cls) -> "Effort":
        """Nothing."""
        return cls(*(jnp.zeros((), jnp.int32) for _ in range(3)))


class Problem(NamedTuple):
    """What is solved: all that stands still."""

    start: Start
    rest: tuple[Rest, ...]
    nodes: Nodes


class Point(NamedTuple):
    """Velocities (M, 4), the energy there (), the size of its terms (), whether it is one (), and
    the residual (M, 4) of all rows.
    """

    velocities: Array
    energy: Array
    size: Array
    sound: Array
    residual: Array


def residual(nodes: Nodes, velocities: Array, value: Value) -> Array:
    """Slope (M, 4) [kg m/s] of the energy by velocities (M, 4), of held rows too."""
    return jnp.where(nodes.filled, nodes.mass * (velocities - nodes.target) + value.rows, 0)


def point(config: Config, problem: Problem, velocities: Array) -> Point:
    """The energy and its slope at velocities (M, 4)."""
    nodes = problem.nodes
    value = evaluate(config, problem.start, problem.rest, velocities)
    kinetic = 0.5 * jnp.sum(nodes.mass * (velocities - nodes.target) ** 2)
    energy = kinetic + value.energy
    sound = jnp.isfinite(energy) & (value.least > 0)
    return Point(
        velocities, energy, kinetic + value.size, sound, residual(nodes, velocities, value)
    )


def curvature(config: Config, problem: Problem, tangents: tuple[Tangents, ...], rows: Array):
    """The second derivative of the energy times free rows (M, 4), of which free ones remain."""
    given = multiply(config, problem.start, problem.rest, tangents, rows)
    return project(problem.nodes, problem.nodes.mass * rows + given)


def conjugate_gradients(product, precondition, norm, right: Array, goal, most: int):
    """(x, products, whether it met no negative curvature) with A x = right to norm(right - A x) <=
    goal. What is found before negative curvature is kept.
    """

    class Carry(NamedTuple):
        x: Array
        r: Array
        p: Array
        rz: Array
        count: Array  # type: ignore[assignment]  # a tuple has a method of that name
        positive: Array

    def going(c: Carry):
        return (c.count < most) & c.positive & (norm(c.r) > goal)

    def body(c: Carry):
        q = product(c.p)
        bend = jnp.vdot(c.p, q)
        positive = bend > 0
        alpha = jnp.where(positive, c.rz / jnp.where(positive, bend, 1), 0)
        x, r = c.x + alpha * c.p, c.r - alpha * q
        z = precondition(r)
        rz = jnp.vdot(r, z)
        p = z + rz / jnp.where(c.rz > 0, c.rz, 1) * c.p
        return Carry(x, r, p, rz, c.count + 1, positive)

    z = precondition(right)
    start = Carry(
        jnp.zeros_like(right),
        right,
        z,
        jnp.vdot(right, z),
        jnp.zeros((), jnp.int32),
        jnp.array(True),
    )
    end = jax.lax.while_loop(going, body, start)
    return end.x, end.count, end.positive


class Search(NamedTuple):
    """Newton's method on its way.

    Attributes:
        at: the best point so far.
        strain: `characteristic` of its free residual.
        direction: (M, 4), along which the next point lies; share: how far.
        trials: of this direction.
        turns: whether a new direction comes next; lost: because this one did not help.
        convex: whether negative curvature was left out of it.
        stuck: whether no direction helps.
        effort: so far.
    """

    at: Point
    strain: Array
    direction: Array
    share: Array
    trials: Array
    turns: Array
    lost: Array
    convex: Array
    stuck: Array
    effort: Effort


def newton(config: Config, stepping: Implicit, problem: Problem) -> tuple[Array, Array, Effort]:
    """(velocities (M, 4), whether they solve the problem (), what it took).

    It starts from the velocities before the step or from those without stress, whichever have less
    energy: matter at rest is where it will be, matter that falls falls on.

    A residual must be small beside stiffness, and beside what changes the motion: gravity, or what
    is unbalanced in the beginning. Of stiff matter both are small ones, and friction with them.
    Where rounding ends it sooner, one step is taken in any case.

    Along a direction steps are shortened until the energy is one and does not rise, or by no more
    than rounding while the residual falls: to where the slopes at both ends say that it is least,
    since a surface that is met may be a million times stiffer than what was before it.
    """
    nodes = problem.nodes
    eps = float(jnp.finfo(nodes.mass.dtype).eps)
    # Where rounding ends it, the reduction need not be reached.
    rounded = max(stepping.tolerance, NOISE * eps)

    def strained(found: Point):
        return characteristic(nodes, project(nodes, found.residual))

    starts = jnp.stack([allowed(nodes, rows) for rows in (nodes.before, nodes.target)])
    both = jax.lax.map(partial(point, config, problem), starts)
    before, falling = (jax.tree.map(lambda x, k=k: x[k], both) for k in (0, 1))
    falls = falling.sound & (~before.sound | (falling.energy < before.energy))
    first = jax.tree.map(partial(jnp.where, falls), falling, before)
    loads = characteristic(nodes, project(nodes, nodes.mass * (nodes.target - nodes.before)))
    changes = jnp.maximum(LOADS * loads, stepping.reduction * strained(first))
    enough = jnp.minimum(stepping.tolerance, changes)
    goal = jnp.maximum(enough, FAINTEST * eps)

    def solved(s: Search):
        ends = (s.strain <= enough) | ((s.strain <= goal) & (s.effort.newton > 0) & s.turns)
        return s.at.sound & (ends | (s.stuck & (s.strain <= rounded)))

    def going(s: Search):
        spent = s.turns & (s.effort.newton >= stepping.newton)
        return s.at.sound & ~s.stuck & ~spent & ~solved(s)

    def better(found: Point, strain, s: Search):
        slack = ROUNDING * eps * s.at.size
        falls = found.energy <= s.at.energy
        level = (found.energy <= s.at.energy + slack) & (strain < s.strain)
        return found.sound & (falls | level)

    def turned(s: Search) -> Search:
        return _turned(config, stepping, problem, goal, s)

    def body(s: Search):
        s = jax.lax.cond(s.turns, turned, lambda s: s, s)
        found = point(config, problem, s.at.velocities + s.share * s.direction)
        strain = strained(found)
        good = better(found, strain, s)
        # Where rounding is all that is left no part of a direction helps, and where it has no
        # negative curvature no other does.
        ends = s.strain <= goal
        lost = ~good & (ends | (s.trials >= TRIALS))
        here, there = (jnp.vdot(s.direction, x.residual) for x in (s.at, found))
        meets = found.sound & (here < 0) & (there > here)
        least = jnp.where(meets, here / jnp.where(meets, here - there, -1), SHORTER)
        return s._replace(
            at=jax.tree.map(partial(jnp.where, good), found, s.at),
            strain=jnp.where(good, strain, s.strain),
            share=jnp.minimum(least, SHORTER) * s.share,
            trials=s.trials + 1,
            turns=good | lost,
            lost=lost,
            stuck=lost & (s.convex | ends),
            effort=s.effort._replace(evaluations=s.effort.evaluations + 1),
        )

    none, no = jnp.zeros((), jnp.int32), jnp.array(False)
    start = Search(
        at=first,
        strain=strained(first),
        direction=jnp.zeros_like(first.velocities),
        share=jnp.ones_like(goal),
        trials=none,
        turns=~no,
        lost=no,
        convex=no,
        stuck=no,
        effort=Effort.none()._replace(evaluations=none + len(starts)),
    )
    end = jax.lax.while_loop(going, body, start)
    return _balanced(problem, end.at), solved(end), end.effort


def _balanced(problem: Problem, at: Point) -> Array:
    """The velocities of a point, shifted as a whole so that the residual has no sum: where nothing
    holds the matter, momentum is kept to round-off whatever the tolerance.
    """
    boundaries, nodes = problem.start.shared.boundaries, problem.nodes
    if nodes.free is not None or springy(boundaries):
        return at.velocities
    mass = jnp.where(nodes.filled, nodes.mass, 0)
    shift = jnp.sum(at.residual, axis=0) / jnp.sum(mass)
    return jnp.where(nodes.filled, at.velocities - shift, at.velocities)


def _turned(config, stepping, problem, goal, s: Search) -> Search:
    """With the direction of a further Newton step to a strain of `goal` (); without negative
    curvature from the first where the last direction was lost.
    """
    nodes = problem.nodes
    norm = partial(characteristic, nodes)
    forcing = jnp.clip(jnp.sqrt(s.strain), SHARE * stepping.reduction, LOOSEST)
    enough = jnp.where(s.strain > goal, SHARE * goal, 0)
    goal = jnp.maximum(forcing * s.strain, enough)

    def body(carry):
        _, convex, _, effort = carry
        blocks, tangents = linearise(config, problem.start, problem.rest, s.at.velocities, convex)
        inverse = inverse_blocks(nodes, blocks)
        with part("linear system"):
            direction, products, positive = conjugate_gradients(
                partial(curvature, config, problem, tangents),
                partial(precondition, nodes, inverse),
                norm,
                project(nodes, -s.at.residual),
                goal,
                stepping.products,
            )
        effort = effort._replace(newton=effort.newton + 1, products=effort.products + products)
        return direction, jnp.array(True), positive | convex, effort

    def going(carry):
        return ~carry[2]

    start = (s.direction, s.lost, jnp.array(False), s.effort)
    direction, _, _, effort = jax.lax.while_loop(going, body, start)
    tried = effort.newton - s.effort.newton
    return s._replace(
        direction=direction,
        share=jnp.ones_like(s.share),
        trials=jnp.zeros_like(s.trials),
        convex=s.lost | (tried > 1),
        effort=effort,
    )


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def attached(
    config: Config, accuracy: tuple[float, int], velocities: Array, free: Array, problem: Problem
) -> Array:
    """`velocities` (M, 4) that solve a problem, with the derivative that this gives them by the
    implicit function theorem: -H^-1 d `free`, H being the true second derivative.

    accuracy: relative, of the linear system, and its most products; free: (M, 4) the projected
    residual at these very velocities as a function of all else. The derivative is not a number
    where the system was not solved.
    """
    return velocities


@attached.defjvp
def _attached_jvp(config, accuracy, primals, tangents):
    velocities, _, problem = primals
    _, change, _ = tangents
    nodes, (relative, most) = problem.nodes, accuracy

    # Both make the second derivative themselves: reverse mode then keeps what it is made from, a
    # state, and not its 45 numbers a particle.
    def linear():
        blocks, found = linearise(config, problem.start, problem.rest, velocities, None)
        return blocks, partial(curvature, config, problem, found)

    def solve(_, right):
        with part("derivative of the solve"):
            blocks, product = linear()
            inverse = inverse_blocks(nodes, blocks)

            def norm(rows):
                return jnp.sqrt(jnp.vdot(rows, precondition(nodes, inverse, rows)))

            right = project(nodes, right)
            goal = relative * norm(right)
            x, count, positive = conjugate_gradients(
                product, partial(precondition, nodes, inverse), norm, right, goal, most
            )
            return jnp.where(positive & (count < most), x, jnp.nan)

    moved = jax.lax.custom_linear_solve(
        lambda rows: linear()[1](rows), -change, solve, symmetric=True
    )
    return velocities, moved
