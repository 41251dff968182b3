"""Many steps in one compiled program: chunks are cut, passes follow one another, a state comes out.

state --cut--> chunks --first pass--> chunks, rows --pass--> ... --last pass--> state
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import compensated
from jaxphys.core.errors import InputError
from jaxphys.core.program import part
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.loop import halo, rigid_body
from jaxphys.mpm.loop.adjoint import Adjoint, Plain, repeat
from jaxphys.mpm.loop.chunks import Cut, cut, cuts, joined, numbers
from jaxphys.mpm.loop.one_pass import Fixed, Inputs, numbers_and_flags
from jaxphys.mpm.loop.particle_step import Flow, Matter, Particles, Shared, velocity_gradient
from jaxphys.mpm.loop.pass_derivative import one_pass
from jaxphys.mpm.loop.placement import gathered
from jaxphys.mpm.loop.rates import slowest
from jaxphys.mpm.loop.replay import check_sequence, replayed
from jaxphys.mpm.loop.status import MOST_PARTICLES, after_step, of_start
from jaxphys.mpm.loop.step_check import checked, stiffening
from jaxphys.mpm.loop.window import extent, followed, hulls, orders_for
from jaxphys.mpm.state import OK, Config, Model, Residual, RigidBody, State, Status
from jaxphys.mpm.stepping.bounds import contact_bound, with_wave_modulus

PLAIN = Plain()


class Chunks(NamedTuple):
    """A state in chunks, on its way from pass to pass. Of particles one for each segment.

    rows, origin: momentum and mass of the nodes for the next step, and their window or slabs;
    below, rates: as in `Seen`; first: () bool, whether no pass was yet; rigid: as in `State`.
    """

    particles: tuple[Particles, ...]
    residuals: tuple[Residual | None, ...]
    rows: Array
    origin: Array
    below: Array | None
    rates: Array | None
    time: Array
    time_residual: Array | None
    status: Status
    first: Array
    rigid: RigidBody | None


def rollout(
    config: Config, model: Model, state: State, *, dt, steps, adjoint: Adjoint = PLAIN
) -> State:
    """The state after `steps` steps of `dt` [s], or `state` with the failure's status if one fails.

    Pure and free of host traffic: jit it, differentiate it. The status tells the first failing
    step and particle; `check` turns it into an exception. Derivatives of a rollout that failed are
    not numbers. `steps` may be traced, so that one program serves any number of them; then there is
    no reverse mode.

    `dt` may also be of each step its own, (M,), of which the first `steps` are taken: a sequence
    that `rollout_adaptively` took, replayed. The gradient is that of these very steps. Traced
    `steps` then have room for M in the program, and reverse mode.

    Unless `Config.check_step` is off, a first `dt` beyond `bounds.hard_limit` of the state fails at
    once.

    Raises:
        InputError: the state does not fit the model, there are too many particles, or fewer `dt`
            than steps.
    """
    end = advance(config, model, state, dt, steps, adjoint, check=config.check_step)
    return keep_good(state, end, steps)


def step(config: Config, model: Model, state: State, dt) -> State:
    """The state one time step `dt` [s] later. Pure; holds only the parts that the scene lists.

    In order: the laws (return map and stress of the trial gradient together), contact, momentum and
    mass to the grid, gravity and what boundaries do on the grid, velocity and its gradient back,
    what they do to particles, x <- x + dt v, F <- (I + dt C) F. The status says what failed first;
    the step itself goes on whatever happens, and addresses no memory outside the grid.

    In float32 the sums x, F and time carry what rounding left out (`State.residual`), without which
    steps of stiff matter are too small to move it. A law that returns another F than it was given
    leaves that of F as it is: right where nothing yields, and off by a rounding of F where it does.
    """
    return advance(config, model, state, dt, 1, PLAIN)


def advance(
    config: Config,
    model: Model,
    state: State,
    dt,
    steps,
    adjoint: Adjoint = PLAIN,
    *,
    check: bool = False,
) -> State:
    """The state `steps` steps of `dt` [s] later, whatever happens on the way; check: whether a `dt`
    that the state does not allow is told in the status.
    """
    dt = jnp.asarray(dt, state.position.dtype)
    check_sequence(dt, steps)
    passes = prepared(config, model, state)
    chunks = passes.cut()
    if check:
        chunks = passes.checked(chunks, dt if dt.ndim == 0 else dt[0])
    if dt.ndim == 0:
        chunks = repeat(adjoint, lambda chunks: passes.run(chunks, dt, dt), chunks, steps)
        return passes.end(chunks, dt)
    chunks, final = replayed(adjoint, passes.run, chunks, dt, steps)
    return passes.end(chunks, final)


class Passes(NamedTuple):
    """Passes over one state and what all of them share. Of particles one for each segment."""

    config: Config
    model: Model
    state: State
    segments: tuple[Cut, ...]
    order: Array
    inverse: Array
    matter: tuple[Matter, ...]
    flags: tuple[Matter, ...]
    flows: tuple[Flow, ...]
    names: tuple[Array, ...]
    boundaries: tuple
    lightest: Array

    def cut(self) -> Chunks:
        """The state in chunks, before the first pass."""
        chunks = cut_state(self.config, self.state, self.segments, self.order)
        F = jax.lax.stop_gradient(self.state.deformation)
        return chunks._replace(status=of_start(chunks.status, F))

    def checked(self, chunks: Chunks, dt: Array) -> Chunks:
        """With the status of a state that is too stiff for `dt` [s]."""
        contact = jax.lax.stop_gradient(contact_bound(self.model, self.config.grid))
        own = (self.matter, self.flags, *stiffening(self.config, chunks.particles), self.names)
        return chunks._replace(
            status=checked(self.config, *own, contact, chunks.status, dt),
        )

    def run(self, chunks: Chunks, dt: Array, ahead: Array, last: bool = False) -> Chunks:
        """One pass: it ends the step of `dt` [s] and begins one of `ahead` [s]; the first one only
        begins, the last one only ends.
        """
        moves = jnp.where(chunks.first, 0, dt)
        later, later_residual = compensated.add(chunks.time, chunks.time_residual, moves)
        boundaries, body = self.boundaries, None
        obstacle = rigid_body.free_one(boundaries)
        if obstacle is not None and chunks.rigid is not None:
            body = rigid_body.moved(obstacle, chunks.rigid, moves)
            boundaries = rigid_body.placed(boundaries, obstacle, body)
        friction = self.model.friction
        shared = Shared(self.model.gravity, boundaries, dt, ahead, chunks.time, later, friction)
        target = followed(self.config, chunks.below, chunks.origin)
        start = None if last else self.flows
        (particles, rows, wrench), (residuals, seen) = one_pass(
            self.config,
            last,
            Inputs(shared, self.matter, start, chunks.particles, chunks.rows),
            Fixed(
                chunks.residuals,
                self.names,
                self.flags,
                chunks.origin,
                target,
                halo.bands(self.config, chunks.below),
                chunks.first,
                jax.lax.stop_gradient(self.lightest),
            ),
        )
        if body is not None and wrench is not None:
            body = rigid_body.pushed(boundaries, body, wrench, self.model.gravity, later, dt, ahead)
        passed = after_step(chunks.status, seen.failure)
        status = Status(
            *(jnp.where(chunks.first, a, b) for a, b in zip(chunks.status, passed, strict=True))
        )
        return Chunks(
            particles,
            # Or the way back would carry their cotangents, all of them zero.
            jax.lax.stop_gradient(residuals),
            rows,
            target,
            seen.below,
            seen.rates,
            later,
            later_residual,
            status,
            jnp.array(False),
            body,
        )

    def end(self, chunks: Chunks, dt: Array) -> State:
        """The state after the last pass, which ends the step of `dt` [s]."""
        chunks = self.run(chunks, dt, dt, last=True)
        return join_state(self.config, self.state, chunks, self.segments, self.inverse)


def prepared(config: Config, model: Model, state: State) -> Passes:
    """The passes over a state.

    Raises:
        InputError: the state does not fit the model, or there are too many particles.
    """
    check_fit(config, model, state)
    model = with_wave_modulus(config, model)
    segments = cuts(config.runs, config.placement)
    order, inverse = orders_for(config, state.position)
    matter, flags = numbers_and_flags(matter_of(config, model, segments, order))
    return Passes(
        config,
        model,
        state,
        segments,
        order,
        inverse,
        matter,
        flags,
        flows_of(config, state, segments, order),
        tuple(numbers(into, order) for into in segments),
        tuple(boundary.shared() for boundary in model.boundaries),
        jnp.finfo(state.position.dtype).eps ** 2 * jnp.max(model.mass),
    )


def check_fit(config: Config, model: Model, state: State) -> None:
    """Raises `InputError` if the state does not fit the model, or particles are too many."""
    rows = sum(boundary.rows for boundary in model.boundaries)
    if rows != (0 if state.slip is None else state.slip.shape[0]):
        raise InputError(
            "State.slip does not fit the boundaries, some of which have friction; give "
            "initial_state(..., boundaries=model.boundaries)."
        )
    if (state.rigid is None) == any(boundary.free for boundary in model.boundaries):
        raise InputError(
            "State.rigid does not fit the boundaries, of which one is free, or none; give "
            "initial_state(..., boundaries=model.boundaries)."
        )
    if (model.field is None) == (config.fields > 1):
        raise InputError(
            f"Model.field does not fit Config.fields, {config.fields}: give the field of every "
            "particle where there are several, and none where there is one."
        )
    if config.particles > MOST_PARTICLES:
        raise InputError(
            f"Config.segments: {config.particles} particles; at most {MOST_PARTICLES} can be told "
            "apart."
        )


def matter_of(config, model, segments, order) -> tuple[Matter, ...]:
    """What no step changes of the particles, one for each run, in chunks."""
    loads = stages.loads(model, config.grid)
    found = []
    for (law, _, _), into in zip(config.runs, segments, strict=True):
        mass, volume, load = cut((model.mass, model.volume, loads), into, order, empty=True)
        parameters = law.prepare({name: model.parameters[name] for name in law.parameters})
        # What is left over moves with the particle that it repeats, lest it stray from the window.
        parameters, field = cut((parameters, model.field), into, order)
        found.append(Matter(mass, volume, parameters, load, field))
    return tuple(found)


def flows_of(config: Config, state: State, segments, order) -> tuple[Flow, ...]:
    """The flow that a state holds, one for each run, in chunks."""
    moment = state.affine * (config.grid.spacing**2 / config.kernel.inverse_inertia)
    # Before the first step no force has acted.
    before = state.velocity if config.transfer.keeps_velocity else None
    # Nothing moves before the first step, so that each particle's share of the volume stays.
    volume = jnp.zeros_like(state.position[0]) if config.shares_volume else None
    flow = Flow(state.velocity, moment, before, volume)
    return tuple(cut(flow, into, order) for into in segments)


def cut_state(config: Config, state: State, segments, order) -> Chunks:
    """A state in chunks, before any pass."""
    particles, residuals = [], []
    rest = None if state.residual is None else state.residual._replace(time=None)
    for (law, _, _), into in zip(config.runs, segments, strict=True):
        own = Particles(state.position, state.deformation, state.total, None, state.slip)
        if config.transfer.keeps_velocity:
            own = own._replace(velocity=state.velocity)
        own = cut(own, into, order)
        if law.history and state.history is not None:
            with part("history"):
                own = own._replace(history=cut(state.history[: len(law.history)], into, order))
        particles.append(own)
        residuals.append(cut(rest, into, order))
    if config.slabs is None:
        below = extent(config, jax.lax.stop_gradient(state.position))
    else:
        below = hulls(config, [jax.lax.stop_gradient(own.position) for own in particles])
    return Chunks(
        tuple(particles),
        tuple(residuals),
        jnp.zeros((config.parts * config.rows, config.columns), state.position.dtype),
        jnp.zeros(3 if config.slabs is None else (config.parts, 3), jnp.int32),
        below,
        slowest(config, *jax.lax.stop_gradient((state.velocity, state.affine))),
        state.time,
        None if state.residual is None else state.residual.time,
        state.status,
        jnp.array(True),
        state.rigid,
    )


def join_state(config: Config, before: State, chunks: Chunks, segments, inverse) -> State:
    """The state that chunks are; their rows hold the flows, as the last pass gives them."""
    particles, flow, residuals = gathered(
        config.placement, (chunks.particles, chunks.rows, chunks.residuals)
    )
    whole = partial(joined, cuts=segments, inverse=inverse)
    flow = whole(list(flow))  # what the last pass gives in place of rows
    histories = [p.history for p in particles]
    particles = whole([p._replace(history=None) for p in particles])
    residual = None
    if before.residual is not None:
        residual = whole(list(residuals))._replace(time=chunks.time_residual)
    history = before.history
    if history is not None:
        count, dtype = history.shape[0], history.dtype
        history = whole(
            [
                _padded(rows, into, count, dtype)
                for rows, into in zip(histories, segments, strict=True)
            ]
        )
    state = State(
        position=particles.position,
        velocity=flow.velocity,
        affine=velocity_gradient(config, flow),
        deformation=particles.deformation,
        total=particles.total,
        history=history,
        time=chunks.time,
        status=chunks.status,
        residual=residual,
        slip=particles.slip,
        rigid=chunks.rigid,
    )
    if config.placement.devices == 1:
        return state
    return jax.lax.with_sharding_constraint(state, config.placement.everywhere())


def _padded(rows: Array | None, into, count: int, dtype) -> Array:
    """Rows of history (K, H, C) with the further ones that only other laws use, as zeros."""
    if rows is None:
        rows = jnp.zeros((into.chunks, 0, into.size), dtype)
    return jnp.pad(rows, ((0, 0), (0, count - rows.shape[1]), (0, 0)))


def keep_good(before: State, after: State, steps) -> State:
    """`after`, or where it failed, or no step was taken, `before` with the status and step count
    of the failure.
    """
    good = (after.status.code == OK) & (steps > 0)
    residual = jax.tree.map(partial(jnp.where, good), after.residual, before.residual)
    without: dict[str, Any] = {"status": None, "residual": None}
    rest = (state._replace(**without) for state in (after, before))
    kept = jax.tree.map(partial(_choose, good), *rest)
    return kept._replace(status=after.status, residual=jax.lax.stop_gradient(residual))


@jax.custom_jvp
def _choose(good: Array, new: Array, old: Array) -> Array:
    """`new` if good, else `old`, whose derivative by anything is then not a number.

    The old value is there to go on from. Its derivative would be a finite answer, zero for all
    that acts in the steps that failed.
    """
    return jnp.where(good, new, old)


@_choose.defjvp
def _choose_jvp(primals, tangents):
    good, new, old = primals
    _, dnew, dold = tangents
    nan = jnp.asarray(jnp.nan, new.dtype)
    # Factors, so that they act on cotangents as they do on tangents.
    return _choose(good, new, old), dnew * jnp.where(good, 1, nan) + dold * jnp.where(good, 0, nan)
