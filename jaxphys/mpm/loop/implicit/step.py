"""One implicit step, and a state taken apart for it."""

from typing import Any, NamedTuple, cast

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import compensated
from jaxphys.core.errors import InputError
from jaxphys.core.program import part
from jaxphys.mpm.loop.chunks import cuts, numbers, orders
from jaxphys.mpm.loop.implicit.grid import allowed, prepared, project, released
from jaxphys.mpm.loop.implicit.passes import Start, begin, evaluate, finish, stiffnesses
from jaxphys.mpm.loop.implicit.solve import Effort, Problem, attached, newton, residual
from jaxphys.mpm.loop.particle_step import Flow, Matter, Particles, Shared
from jaxphys.mpm.loop.rollout import check_fit, cut_state, flows_of, join_state, matter_of
from jaxphys.mpm.loop.status import NO_FAILURE
from jaxphys.mpm.loop.window import extent, followed
from jaxphys.mpm.state import CODES, NOT_CONVERGED, OK, Config, Model, Residual, State, Status
from jaxphys.mpm.stepping.bounds import with_wave_modulus
from jaxphys.mpm.stepping.implicit import Implicit
from jaxphys.mpm.transfer.schemes import Transfer

DEFAULT = Implicit()


class Bodies(NamedTuple):
    """All that no step changes of the particles, one for each run, in chunks."""

    matter: tuple[Matter, ...]
    numbers: tuple[Array, ...]
    stiffness: tuple[Array, ...]
    lightest: Array


def check_implicit(config: Config, model: Model) -> None:
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
    if config.fields > 1:
        raise InputError(
            "Implicit: contact between objects needs explicit steps; set contact to null, or take "
            "adaptive or fixed steps"
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
        found, solved, effort = newton(config, stepping, still)
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
    config: Config, model: Model, state: State, dt, stepping: Implicit = DEFAULT
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


def taken_apart(config: Config, model: Model, state: State):
    """(bodies, moving, put), where `put(moving, time, status)` is the state `time` [s] later."""
    check_fit(config, model, state)
    check_implicit(config, model)
    model = with_wave_modulus(config, model)
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
