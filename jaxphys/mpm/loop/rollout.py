"""Many steps in one compiled program: chunks are cut, passes follow one another, a state comes out.

state --cut--> chunks --first pass--> chunks, rows --pass--> ... --last pass--> state
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import compensated
from jaxphys.core.errors import InputError
from jaxphys.core.program import part
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.adjoint import Adjoint, Plain, repeat
from jaxphys.mpm.loop.chunks import cut, cuts, joined, numbers, orders
from jaxphys.mpm.loop.one_pass import Fixed, Inputs, extent, numbers_and_flags, one_pass
from jaxphys.mpm.loop.particle_step import Flow, Matter, Particles, Shared, velocity_gradient
from jaxphys.mpm.loop.placement import gathered
from jaxphys.mpm.loop.status import MOST_PARTICLES, after_step
from jaxphys.mpm.loop.step_check import checked
from jaxphys.mpm.materials.elasticity import with_moduli
from jaxphys.mpm.state import OK, Config, Model, Residual, State, Status
from jaxphys.mpm.stepping.bounds import contact_bound

PLAIN = Plain()


class Chunks(NamedTuple):
    """A state in chunks, on its way from pass to pass. Of particles one for each segment.

    rows, origin: momentum and mass of the nodes for the next step, and their window; below: as in
    `Seen`; first: () bool, whether no pass was yet.
    """

    particles: tuple[Particles, ...]
    residuals: tuple[Residual | None, ...]
    rows: Array
    origin: Array
    below: Array | None
    time: Array
    time_residual: Array | None
    status: Status
    first: Array


def rollout(
    config: Config, model: Model, state: State, *, dt, steps, adjoint: Adjoint = PLAIN
) -> State:
    """The state after `steps` steps of `dt` [s], or `state` with the failure's status if one fails.

    Pure and free of host traffic: jit it, differentiate it. The status tells the first failing
    step and particle; `check` turns it into an exception. Derivatives of a rollout that failed are
    not numbers. `steps` may be traced, so that one program serves any number of them; then there is
    no reverse mode.

    Unless `Config.check_step` is off, a `dt` beyond `bounds.hard_limit` of the state fails at
    once.

    Raises:
        InputError: the state does not fit the model, or there are too many particles.
    """
    end = advance(config, model, state, dt, steps, adjoint, check=config.check_step)
    return _keep_good(state, end, steps)


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
    _check_fit(config, model, state)
    dtype = state.position.dtype
    dt = jnp.asarray(dt, dtype)
    segments = cuts(config.runs, config.placement)
    order, inverse = orders(state.position, config.grid, config.runs)
    matter, flags = numbers_and_flags(_matter(config, model, segments, order))
    start = _flows(config.grid, state, segments, order)
    names = tuple(numbers(into, order) for into in segments)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)
    lightest = jnp.finfo(dtype).eps ** 2 * jnp.max(model.mass)

    def run(chunks: Chunks, last: bool):
        moves = jnp.where(chunks.first, 0, dt)
        later, later_residual = compensated.add(chunks.time, chunks.time_residual, moves)
        shared = Shared(model.gravity, boundaries, dt, chunks.time, later)
        target = _target(config, chunks)
        (particles, rows), (residuals, seen) = one_pass(
            config,
            last,
            Inputs(shared, matter, None if last else start, chunks.particles, chunks.rows),
            Fixed(
                chunks.residuals,
                names,
                flags,
                chunks.origin,
                target,
                chunks.first,
                jax.lax.stop_gradient(lightest),
            ),
        )
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
            later,
            later_residual,
            status,
            jnp.array(False),
        )

    chunks = _cut_state(config, state, segments, order)
    if check:
        deformation = tuple(particles.deformation for particles in chunks.particles)
        contact = jax.lax.stop_gradient(contact_bound(model, config.grid))
        status = checked(config, matter, flags, deformation, names, contact, chunks.status, dt)
        chunks = chunks._replace(status=status)
    chunks = repeat(adjoint, partial(run, last=False), chunks, steps)
    return _join_state(config, state, run(chunks, last=True), segments, inverse)


def _check_fit(config: Config, model: Model, state: State) -> None:
    rows = sum(boundary.rows for boundary in model.boundaries)
    if rows != (0 if state.slip is None else state.slip.shape[0]):
        raise InputError(
            "State.slip does not fit the boundaries, some of which have friction; give "
            "initial_state(..., boundaries=model.boundaries)."
        )
    if config.particles > MOST_PARTICLES:
        raise InputError(
            f"Config.segments: {config.particles} particles; at most {MOST_PARTICLES} can be told "
            "apart."
        )


def _matter(config, model, segments, order) -> tuple[Matter, ...]:
    loads = stages.loads(model, config.grid)
    found = []
    for (law, _, _), into in zip(config.runs, segments, strict=True):
        mass, volume, load = cut((model.mass, model.volume, loads), into, order, empty=True)
        parameters = with_moduli({name: model.parameters[name] for name in law.parameters})
        found.append(Matter(mass, volume, cut(parameters, into, order), load))
    return tuple(found)


def _flows(grid: Grid, state: State, segments, order) -> tuple[Flow, ...]:
    moment = state.affine * (grid.spacing**2 / 4)
    return tuple(cut(Flow(state.velocity, moment), into, order) for into in segments)


def _cut_state(config: Config, state: State, segments, order) -> Chunks:
    particles, residuals = [], []
    rest = None if state.residual is None else state.residual._replace(time=None)
    for (law, _, _), into in zip(config.runs, segments, strict=True):
        own = Particles(state.position, state.deformation, state.total, None, state.slip)
        own = cut(own, into, order)
        if law.history and state.history is not None:
            with part("history"):
                own = own._replace(history=cut(state.history[: len(law.history)], into, order))
        particles.append(own)
        residuals.append(cut(rest, into, order))
    return Chunks(
        tuple(particles),
        tuple(residuals),
        jnp.zeros((config.computed.nodes, 4), state.position.dtype),
        jnp.zeros(3, jnp.int32),
        extent(config, jax.lax.stop_gradient(state.position)),
        state.time,
        None if state.residual is None else state.residual.time,
        state.status,
        jnp.array(True),
    )


def _target(config: Config, chunks: Chunks) -> Array:
    """First node of the window for the places after this pass: as much room on either side."""
    if chunks.below is None:
        return chunks.origin
    lowest, highest = chunks.below[:3], -chunks.below[3:]
    shape = np.array(config.nodes, np.int32)
    room = np.array(config.grid.shape, np.int32) - shape
    free = shape - 3 - (highest - lowest)
    return jnp.clip(lowest - jnp.maximum(free, 0) // 2, 0, room)


def _join_state(config: Config, before: State, chunks: Chunks, segments, inverse) -> State:
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
        affine=velocity_gradient(config.grid, flow),
        deformation=particles.deformation,
        total=particles.total,
        history=history,
        time=chunks.time,
        status=chunks.status,
        residual=residual,
        slip=particles.slip,
    )
    if config.placement.devices == 1:
        return state
    return jax.lax.with_sharding_constraint(state, config.placement.everywhere())


def _padded(rows: Array | None, into, count: int, dtype) -> Array:
    """Rows of history (K, H, C) with the further ones that only other laws use, as zeros."""
    if rows is None:
        rows = jnp.zeros((into.chunks, 0, into.size), dtype)
    return jnp.pad(rows, ((0, 0), (0, count - rows.shape[1]), (0, 0)))


def _keep_good(before: State, after: State, steps) -> State:
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
