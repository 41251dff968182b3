"""Implicit steps: velocities of the grid are solved for, so that stiffness bounds no step.

A step of the theta scheme finds velocities u a share theta of it ahead,

    u = v + theta dt (g + f((I + theta dt C(u)) F) / m),

then x <- x + dt u, F <- (I + dt C(u)) F and v <- v + (u - v) / theta. theta = 1 is backward Euler,
which damps; theta = 1/2 the midpoint rule, which keeps the energy of small motion. Laws map back
once a step and are elastic within it.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import compensated
from jaxphys.core.errors import InputError
from jaxphys.core.program import part
from jaxphys.mpm.loop.adjoint import Adjoint, Plain, repeat
from jaxphys.mpm.loop.chunks import cuts, numbers, orders
from jaxphys.mpm.loop.particle_step import Flow, Matter, Particles, Shared
from jaxphys.mpm.loop.rollout import (
    check_fit,
    cut_state,
    flows_of,
    join_state,
    keep_good,
    matter_of,
)
from jaxphys.mpm.loop.status import NO_FAILURE
from jaxphys.mpm.loop.window import extent, followed
from jaxphys.mpm.state import (
    CODES,
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_CONVERGED,
    OK,
    Config,
    Model,
    Residual,
    State,
    Status,
)
from jaxphys.mpm.stepping.implicit_grid import allowed, prepared, project, released
from jaxphys.mpm.stepping.implicit_passes import Start, begin, evaluate, finish, stiffnesses
from jaxphys.mpm.stepping.implicit_solve import (
    Controls,
    Effort,
    Problem,
    attached,
    newton,
    residual,
)
from jaxphys.mpm.transfer.schemes import Transfer

ADVECTION = 0.6  # cells that a particle may cross in a step (Wang et al. 2020)
GRADIENT = 0.5  # by which it may be deformed
GROWTH = 1.5  # of a step after one that was solved
PLAIN = Plain()


@dataclass(frozen=True)
class Implicit:
    """How implicit steps are taken. Static.

    Attributes:
        theta: from 1/2, the midpoint rule, to 1, backward Euler.
        tolerance: of the equations, as a strain: root mean square over nodes of what forces are not
            balanced by, over the stiffness there. float32 ends at 1e-7.
        reduction: of what that was in the beginning, to which it must fall besides, unless rounding
            ends it.
        newton: most iterations of Newton's method in a step.
        products: most products with the second derivative in one of them.
        dt: largest step [s]; None: what speeds allow, and the frame.
        most_steps: in one call of `implicit_rollout`.
        adjoint_tolerance: relative, of the linear system of a derivative; None: 1e-10 in float64
            and 1e-5 in float32.
    """

    theta: float = 1.0
    tolerance: float = 1e-6
    reduction: float = 1e-3
    newton: int = 20
    products: int = 2000
    dt: float | None = None
    most_steps: int = 1000
    adjoint_tolerance: float | None = None

    def __post_init__(self):
        if not 0.5 <= self.theta <= 1:
            raise InputError(
                f"Implicit.theta is {self.theta}: give 0.5 (midpoint) to 1 (backward Euler)."
            )
        for name in ("tolerance", "reduction", "adjoint_tolerance", "dt"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"Implicit.{name} is {value}: give a positive number.")
        for name in ("newton", "products", "most_steps"):
            if getattr(self, name) < 1:
                raise InputError(f"Implicit.{name} is {getattr(self, name)}: give at least 1.")

    @property
    def controls(self) -> Controls:
        """What a solve needs."""
        return Controls(self.tolerance, self.reduction, self.newton, self.products)


class ImplicitReport(NamedTuple):
    """What a rollout took. Arrays () but for `lengths`.

    steps: taken; rejected: tried and taken shorter; effort: of all of them; lengths: (most_steps,)
    [s] of the steps taken, 0 from then on.
    """

    steps: Array
    rejected: Array
    effort: Effort
    lengths: Array


class Bodies(NamedTuple):
    """All that no step changes of the particles, one for each run, in chunks."""

    matter: tuple[Matter, ...]
    numbers: tuple[Array, ...]
    stiffness: tuple[Array, ...]
    lightest: Array


def _refuse(config: Config, model: Model) -> None:
    """Raises `InputError` for what no implicit step can take."""
    if config.transfer != Transfer():
        raise InputError(
            "Implicit: steps are solved with APIC and quadratic splines; leave Config.transfer as "
            "it is, or take explicit steps"
        )
    if config.slabs is not None:
        raise InputError(
            "Implicit: every device has the window as a whole in implicit steps; set Config.slabs "
            "to None"
        )
    for law, _, _ in config.runs:
        if law.energy is None or law.viscosity is not None:
            raise InputError(
                f"Implicit: the law {law.name!r} has a stress that no energy gives; take explicit "
                "steps"
            )
    if any(boundary.free for boundary in model.boundaries):
        raise InputError("Implicit: a rigid body that is pushed back needs explicit steps")


class Moving(NamedTuple):
    """What a step changes, one for each run, in chunks."""

    particles: tuple[Particles, ...]
    residuals: tuple[Residual | None, ...]
    flows: tuple[Flow, ...]


class Attempt(NamedTuple):
    """A step that was tried: what it led to, whether it was solved, `first_failure`, effort."""

    moving: Moving
    solved: Array
    failure: Array
    effort: Effort


def attempt(
    config: Config,
    stepping: Implicit,
    bodies: Bodies,
    boundaries: tuple,
    gravity: Array | None,
    moving: Moving,
    time: Array,
    dt: Array,
) -> Attempt:
    """One step of `dt` [s] from `time` [s], whatever comes of it. Differentiable."""
    theta = stepping.theta
    stage = theta * dt
    origin = followed(config, _extent(config, moving.particles), jnp.zeros(3, jnp.int32))
    shared = Shared(gravity, boundaries, dt, dt, time, time + dt)
    start = Start(shared, origin, stage)
    with part("implicit step"):
        rows, heavy, rest = begin(
            config, start, bodies.matter, moving.particles, moving.flows, bodies.stiffness
        )
        nodes = prepared(
            config,
            boundaries,
            gravity,
            bodies.lightest,
            rows,
            heavy,
            origin,
            time,
            dt,
            stage,
        )
        problem = Problem(start, rest, nodes)
        still = jax.lax.stop_gradient(problem)
        found, solved, effort = newton(config, stepping.controls, still)
        found = jax.lax.stop_gradient(found)
        eps = float(jnp.finfo(found.dtype).eps)
        accuracy = stepping.adjoint_tolerance or (1e-10 if eps < 1e-10 else 1e-5)
        # Where held parts move with what is differentiated, the solution does.
        u = allowed(nodes, found)
        unbalanced = residual(nodes, u, evaluate(config, start, rest, u))
        free = project(nodes, unbalanced)
        u = u + (attached(config, (accuracy, stepping.products), found, free, still) - found)
        u = released(config, boundaries, nodes, u, unbalanced, origin, time + stage, stage)
        end = None
        if theta != 1:
            end = nodes.before + (u - nodes.before) / theta
            end = allowed(nodes, end) if nodes.free is not None else end
        failure, particles, residuals, flows = finish(
            config, start, rest, moving.residuals, bodies.numbers, u, end
        )
    return Attempt(Moving(particles, residuals, flows), solved, failure, effort)


def _extent(config: Config, particles: tuple[Particles, ...]) -> Array | None:
    if config.window is None:
        return None
    places = [
        jnp.moveaxis(jax.lax.stop_gradient(one.position), 1, 0).reshape(3, -1) for one in particles
    ]
    return extent(config, jnp.concatenate(places, axis=1))


def implicit_step(
    config: Config, model: Model, state: State, dt, stepping: Implicit = Implicit()
) -> State:
    """The state one implicit step of `dt` [s] later, however long that is.

    Pure; differentiable in reverse mode by everything but `dt`'s choice. A step that could not be
    solved shows in the status, NOT_CONVERGED, and goes on whatever came out.

    Raises:
        InputError: the state does not fit the model, or there are too many particles.
    """
    bodies, moving, put = taken_apart(config, model, state)
    dt = jnp.asarray(dt, state.position.dtype)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)
    tried = attempt(config, stepping, bodies, boundaries, model.gravity, moving, state.time, dt)
    return put(tried.moving, dt, told(state.status, tried))


def implicit_steps(
    config: Config,
    model: Model,
    state: State,
    lengths,
    stepping: Implicit = Implicit(),
    adjoint: Adjoint = PLAIN,
) -> State:
    """The state after steps of given `lengths` (K,) [s], those of 0 left out; or `state` with the
    failure's status if one fails.

    This is how a rollout is differentiated: its lengths, as `implicit_rollout` reports them, are
    taken again. The gradient is that of these steps, not of how they were chosen.
    """
    bodies, moving, put = taken_apart(config, model, state)
    lengths = jnp.asarray(lengths, state.position.dtype)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)

    def taken(carry):
        moving, status, past, k = carry
        tried = attempt(
            config,
            stepping,
            bodies,
            boundaries,
            model.gravity,
            moving,
            state.time + past,
            lengths[k],
        )
        return tried.moving, told(status, tried), past + lengths[k], k + 1

    def body(carry):
        k = carry[-1]
        return jax.lax.cond(lengths[k] > 0, taken, lambda c: (*c[:-1], c[-1] + 1), carry)

    count = lengths.shape[0]
    carry = (moving, state.status, jnp.zeros_like(state.time), jnp.zeros((), jnp.int32))
    moving, status, past, _ = repeat(adjoint, body, carry, count)
    return keep_good(state, put(moving, past, status), count)


def implicit_rollout(
    config: Config, model: Model, state: State, *, time, stepping: Implicit = Implicit()
) -> tuple[State, ImplicitReport]:
    """The state exactly `time` [s] later, and what it took; or `state` with the failure's status.

    Steps are as long as speeds allow: no particle crosses more than ADVECTION cells or is deformed
    by more than GRADIENT. One that cannot be solved is tried again with half the length. One loop
    without host traffic; for derivatives see `implicit_steps`.
    """
    bodies, moving, put = taken_apart(config, model, state)
    dtype = state.position.dtype
    time = jnp.asarray(time, dtype)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)
    most = stepping.most_steps
    longest = time if stepping.dt is None else jnp.minimum(time, stepping.dt)
    shortest = longest / most

    class Carry(NamedTuple):
        moving: Moving
        status: Status
        left: Array
        wanted: Array
        report: ImplicitReport

    def going(c: Carry):
        return (c.left > 0) & (c.status.code == OK)

    def body(c: Carry):
        wanted = jnp.minimum(c.wanted, _speed_limit(config, model, c.moving.flows))
        # All that are left of one length; the last one ends where the time does.
        count = jnp.maximum(jnp.ceil(c.left / wanted - 1e-4), 1)
        dt = c.left / count
        now = state.time + (time - c.left)
        tried = attempt(config, stepping, bodies, boundaries, model.gravity, c.moving, now, dt)
        lost = tried.failure % CODES
        hopeless = (tried.failure < NO_FAILURE) & ((lost == LEFT_GRID) | (lost == LEFT_WINDOW))
        good = tried.solved & (tried.failure == NO_FAILURE)
        last = ~good & (hopeless | (0.5 * dt < shortest))
        full = good & (c.report.steps + 1 >= most) & (count > 1)
        status = jax.tree.map(partial(jnp.where, good | last), told(c.status, tried), c.status)
        status = status._replace(
            code=jnp.where(full, NOT_CONVERGED, status.code),
            step=jnp.where(full, c.report.steps, status.step),
        )
        effort = jax.tree.map(jnp.add, c.report.effort, tried.effort)
        report = ImplicitReport(
            c.report.steps + good.astype(jnp.int32),
            c.report.rejected + (~good).astype(jnp.int32),
            effort,
            c.report.lengths.at[c.report.steps].set(jnp.where(good, dt, 0), mode="drop"),
        )
        return Carry(
            jax.tree.map(partial(jnp.where, good), tried.moving, c.moving),
            status,
            jnp.where(good, jnp.where(count > 1, c.left - dt, 0), c.left),
            jnp.where(good, jnp.minimum(GROWTH * jnp.maximum(dt, 0), longest), 0.5 * dt),
            report,
        )

    none = jnp.zeros((), jnp.int32)
    report = ImplicitReport(none, none, Effort.none(), jnp.zeros(most, dtype))
    end = jax.lax.while_loop(going, body, Carry(moving, state.status, time, longest, report))
    after = put(end.moving, time, end.status)
    return keep_good(state, after, jnp.ones((), jnp.int32)), end.report


def told(status: Status, tried: Attempt) -> Status:
    """The status after a step: a particle's failure, or else that the step was not solved."""
    fails = (status.code == OK) & ((tried.failure < NO_FAILURE) | ~tried.solved)
    of_particle = tried.failure < NO_FAILURE
    code = jnp.where(of_particle, tried.failure % CODES, NOT_CONVERGED)
    particle = jnp.where(of_particle, tried.failure // CODES, -1)
    return Status(
        code=jnp.where(fails, code, status.code),
        step=jnp.where(fails, status.taken, status.step),
        particle=jnp.where(fails, particle, status.particle),
        taken=status.taken + 1,
    )


def _speed_limit(config: Config, model: Model, flows: tuple[Flow, ...]) -> Array:
    """How long a step may be for the speeds of now and what gravity adds to them [s], ()."""
    dx = config.grid.spacing
    speed = jnp.sqrt(jnp.max(jnp.stack([jnp.max(_squares(f.velocity, 1)) for f in flows])))
    rates = [jnp.max(_squares(f.moment, (1, 2))) for f in flows]
    rate = 4 / dx**2 * jnp.sqrt(jnp.max(jnp.stack(rates)))
    # dt (speed + g dt) = ADVECTION dx
    g = 0.0 if model.gravity is None else jnp.sqrt(jnp.sum(model.gravity**2))
    room = ADVECTION * dx
    tiny = jnp.finfo(speed.dtype).tiny ** 0.5
    crossing = 2 * room / (speed + jnp.sqrt(speed**2 + 4 * g * room) + tiny)
    return jnp.minimum(crossing, GRADIENT / (rate + tiny))


def _squares(x: Array, axes) -> Array:
    return jnp.sum(x * x, axis=axes)


def taken_apart(config: Config, model: Model, state: State):
    """(bodies, moving, put), where `put(moving, time, status)` is the state `time` [s] later."""
    check_fit(config, model, state)
    _refuse(config, model)
    segments = cuts(config.runs, config.placement)
    order, inverse = orders(state.position, config.grid, config.runs)
    matter = matter_of(config, model, segments, order)
    chunks = cut_state(config, state, segments, order)
    still = jax.lax.stop_gradient((matter, tuple(p.deformation for p in chunks.particles)))
    bodies = Bodies(
        matter,
        tuple(numbers(into, order) for into in segments),
        stiffnesses(config, *still),
        jax.lax.stop_gradient(jnp.finfo(state.position.dtype).eps ** 2 * jnp.max(model.mass)),
    )
    flows = flows_of(config, state, segments, order)
    moving = Moving(chunks.particles, chunks.residuals, flows)

    def put(moving: Moving, time, status: Status) -> State:
        later, rest = compensated.add(state.time, chunks.time_residual, time)
        done = chunks._replace(
            particles=moving.particles,
            residuals=jax.lax.stop_gradient(moving.residuals),
            rows=cast(Any, moving.flows),  # as the last pass of explicit steps leaves them
            time=later,
            time_residual=rest,
            status=status,
        )
        return join_state(config, state, done, segments, inverse)

    return bodies, moving, put
