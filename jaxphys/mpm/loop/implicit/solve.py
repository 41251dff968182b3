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

HALVINGS = 12  # of a Newton step, before it counts as none
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
        at: the best point so far, in the beginning none.
        strain: `characteristic` of its free residual; goal: what it must fall to.
        direction: (M, 4), along which the next point lies; share: how far.
        taken: points that were better than the one before; -1 before the first.
        halvings: of this direction.
        convex: whether negative curvature was left out of it.
        stuck: whether no direction helps; spent: whether the iterations are.
        effort: so far.
    """

    at: Point
    strain: Array
    goal: Array
    direction: Array
    share: Array
    taken: Array
    halvings: Array
    convex: Array
    stuck: Array
    spent: Array
    effort: Effort


def newton(config: Config, stepping: Implicit, problem: Problem) -> tuple[Array, Array, Effort]:
    """(velocities (M, 4), whether they solve the problem (), what it took).

    A residual must be small beside stiffness, beside what it was and beside gravity: of stiff
    matter gravity itself, and friction with it, is a small one, and so it is beside what a floor
    gives that a step would pass. To what rounding lets one see, one step is taken in any case.

    Along a direction steps are halved until the energy is one and does not rise, or by no more than
    rounding while the residual falls.
    """
    nodes = problem.nodes
    eps = float(jnp.finfo(nodes.mass.dtype).eps)
    # Where rounding ends it, the reduction need not be reached.
    rounded = max(stepping.tolerance, NOISE * eps)
    loads = characteristic(nodes, project(nodes, nodes.mass * (nodes.target - nodes.before)))
    enough = jnp.where(
        loads > 0, jnp.minimum(stepping.tolerance, LOADS * loads), stepping.tolerance
    )

    def solved(s: Search):
        ends = (s.strain <= s.goal) & (s.taken > 0)
        return s.at.sound & (ends | (s.stuck & (s.strain <= rounded)))

    def going(s: Search):
        return ~s.stuck & ~s.spent & ~solved(s)

    def better(found: Point, strain, s: Search):
        slack = ROUNDING * eps * s.at.size
        falls = found.energy <= s.at.energy
        level = (found.energy <= s.at.energy + slack) & (strain < s.strain)
        return found.sound & (falls | level)

    def body(s: Search):
        found = point(config, problem, s.at.velocities + s.share * s.direction)
        strain = characteristic(nodes, project(nodes, found.residual))
        good = better(found, strain, s)
        least = jnp.minimum(enough, stepping.reduction * strain)
        goal = jnp.where(s.taken < 0, jnp.maximum(least, FAINTEST * eps), s.goal)
        s = s._replace(
            at=jax.tree.map(partial(jnp.where, good), found, s.at),
            strain=jnp.where(good, strain, s.strain),
            goal=goal,
            taken=s.taken + good.astype(jnp.int32),
            share=0.5 * s.share,
            halvings=s.halvings + 1,
            effort=s.effort._replace(evaluations=s.effort.evaluations + 1),
        )
        # The start has no direction to halve; where rounding is all that is left, none helps; one
        # without negative curvature is the last to try.
        ends = (s.taken < 0) | (s.at.sound & (s.strain <= s.goal))
        lost = ~good & (ends | (s.halvings >= HALVINGS))
        turns = (good | lost) & ~solved(s)
        stuck = lost & (s.convex | ends)
        spent = s.spent | (turns & (s.effort.newton >= stepping.newton))
        return jax.lax.cond(
            turns & ~stuck & ~spent,
            partial(_turned, config, stepping, problem, lost),
            lambda s: s._replace(stuck=stuck, spent=spent),
            s,
        )

    nothing = allowed(nodes, nodes.target)
    zero, none, no = jnp.zeros_like(nodes.scale[0, 0]), jnp.zeros((), jnp.int32), jnp.array(False)
    start = Search(
        at=Point(nothing, zero + jnp.inf, zero, no, jnp.zeros_like(nothing)),
        strain=zero + jnp.inf,
        goal=zero,
        direction=jnp.zeros_like(nothing),
        share=zero + 1,
        taken=none - 1,
        halvings=none,
        convex=no,
        stuck=no,
        spent=no,
        effort=Effort.none(),
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


def _turned(config, stepping, problem, convex, s: Search) -> Search:
    """With the direction of a further Newton step; convex: () bool, whether to leave out negative
    curvature from the first.
    """
    nodes = problem.nodes
    norm = partial(characteristic, nodes)
    forcing = jnp.clip(jnp.sqrt(s.strain), SHARE * stepping.reduction, LOOSEST)
    enough = jnp.where(s.strain > s.goal, SHARE * s.goal, 0)
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

    start = (s.direction, convex, jnp.array(False), s.effort)
    direction, _, _, effort = jax.lax.while_loop(going, body, start)
    tried = effort.newton - s.effort.newton
    return s._replace(
        direction=direction,
        share=jnp.ones_like(s.share),
        halvings=jnp.zeros_like(s.halvings),
        convex=convex | (tried > 1),
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
