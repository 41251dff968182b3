"""The passes over all particles of an implicit step, chunk by chunk, on every device its own.

Particles stand still while a step is solved, so that transfers are linear maps of the velocities u
of the nodes. What is solved is the stationary point of

    E(u) = sum_i m_i |u_i - u*_i|^2 / 2 + sum_p V psi((I + h C_p(u)) F_p) + potentials of contact

with C the velocity gradient that also updates F, so that E's slope is exactly what nodes feel (Gast
et al. 2015; Wang et al. 2020). h is the time from the start of the step to the velocities that are
solved for.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra, compensated, packed
from jaxphys.core.program import part
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.boundaries.potential import Lag, has_potential, lags, pushed, slipped
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop import halo
from jaxphys.mpm.loop.particle_step import (
    Flow,
    Matter,
    Particles,
    Shared,
    move,
    velocity_gradient,
)
from jaxphys.mpm.loop.placement import AXIS, spread
from jaxphys.mpm.loop.status import NO_FAILURE, failure, first_failure
from jaxphys.mpm.materials.trial import pulled_back, rest_stiffness, tangent
from jaxphys.mpm.state import Config, Residual
from jaxphys.mpm.transfer import gather, scatter, stencil
from jaxphys.mpm.transfer.blocks import scatter_blocks
from jaxphys.mpm.transfer.rules import to_nodes, to_particles

# How much heavier than its mass and its stiffness together a particle is whose velocity is given.
HELD = 100.0


class Start(NamedTuple):
    """What a step finds, and all that is the same for all particles.

    shared: see `Shared`; origin: (3,) int32 first node of the window; stage: [s] h.
    """

    shared: Shared
    origin: Array
    stage: Array


class Rest(NamedTuple):
    """What stands still of some particles: their matter, themselves past their law, what rounding
    left out of their places (3, N) [m], the norm of their stiffness at rest (N,) [Pa], and what
    each boundary's contact found.
    """

    matter: Matter
    particles: Particles
    lost: Array | None
    stiffness: Array
    lags: tuple[tuple[Lag, ...], ...]


class Tangents(NamedTuple):
    """Second derivatives of the energy of some particles by the velocities at them: by the sum of
    w u d^T, packed (45, N), and by that of w u, packed (6, N) or None.
    """

    stiffness: Array
    spring: Array | None


class Value(NamedTuple):
    """The energy of all particles () [J], the size of its terms (), its slope (M, 4) [kg m/s], and
    the least of det(I + h C) and of det F () (-inf where something is not finite).
    """

    energy: Array
    size: Array
    rows: Array
    least: Array


def passed(config: Config, body: Callable, sums: Any, least: Any, common: Any, own: tuple):
    """(sums, least, results) of `body(law, common, carry, chunk) -> carry, result` over all chunks,
    where carry is (sums, least): what devices add up, and what they take the smallest of.
    """

    def on_device(common, own):
        carry, common = common
        results = []
        for (law, _, _), chunks in zip(config.runs, own, strict=True):
            step = jax.checkpoint(partial(body, law, common), prevent_cse=False)
            carry, result = jax.lax.scan(step, carry, chunks)
            results.append(result)
        return carry, tuple(results)

    def joined(carry):
        return jax.lax.psum(carry[0], AXIS), jax.lax.pmin(carry[1], AXIS)

    (sums, least), results = spread(config.placement, on_device, joined)(
        ((sums, least), common), own
    )
    return sums, least, results


def stiffnesses(config: Config, matter: tuple[Matter, ...], like: tuple[Array, ...]):
    """`rest_stiffness` of each run, in chunks (K, C)."""

    def body(law, _, carry, chunk):
        matter, F = chunk
        return carry, rest_stiffness(law, matter.parameters, F)

    return passed(config, body, None, None, None, tuple(zip(matter, like, strict=True)))[2]


def begin(
    config: Config,
    start: Start,
    matter: tuple[Matter, ...],
    particles: tuple[Particles, ...],
    residuals: tuple[Residual | None, ...],
    flows: tuple[Flow, ...],
    stiffness: tuple[Array, ...],
) -> tuple[Array, Array, tuple[Rest, ...]]:
    """Momentum and mass rows (M, 4), mass times stiffness of nodes (M, 1), and what stands still:
    laws are past their return map, pushes are given.
    """
    window = config.computed

    def body(law, start, carry, chunk):
        (rows, heavy), none = carry
        matter, particles, residual, flow, stiffness = chunk
        lost = None if residual is None else residual.position
        shared = start.shared
        if law.plastic or law.history:
            with part(f"law {law.name}"):
                F, _, history = law.update(
                    matter.parameters,
                    particles.deformation,
                    _history(particles, matter),
                    shared.dt,
                )
            particles = particles._replace(deformation=F)
            if particles.history is not None:
                particles = particles._replace(history=history)
        momentum = matter.mass * flow.velocity
        pushes = [
            (boundary, loads)
            for boundary, loads in zip(shared.boundaries, matter.loads, strict=True)
            if boundary.acts_in("impulse") and not has_potential(boundary)
        ]
        if pushes:
            boundaries, loads = zip(*pushes, strict=True)
            given, _, _ = stages.impulses(
                boundaries,
                loads,
                particles.position,
                flow.velocity,
                None,
                shared.time,
                shared.dt,
                shared.dt,
            )
            momentum = momentum + given
        affine = matter.mass * velocity_gradient(config, flow)
        place = particles.position
        rows = to_nodes(window, start.origin, place, rows, matter.mass, momentum, affine)
        fixed = jax.lax.stop_gradient((place, matter.mass, stiffness))
        at = stencil(window, start.origin, fixed[0])
        nothing = jnp.zeros_like(fixed[0])
        heavy = scatter(
            window, at, heavy, fixed[1] * fixed[2], nothing, jnp.zeros_like(flow.moment)
        )
        found = tuple(
            lags(boundary, loads, place, lost, shared.time) if has_potential(boundary) else ()
            for boundary, loads in zip(shared.boundaries, matter.loads, strict=True)
        )
        return ((rows, heavy), none), Rest(matter, particles, lost, stiffness, found)

    dtype = particles[0].position.dtype
    empty = jnp.zeros((window.nodes, 4), dtype)
    own = tuple(zip(matter, particles, residuals, flows, stiffness, strict=True))
    (rows, heavy), _, rest = passed(config, body, (empty, empty), None, start, own)
    return rows, heavy[:, 3:], rest


def _history(particles: Particles, matter: Matter) -> Array:
    if particles.history is None:
        return jnp.zeros((0, *matter.mass.shape), matter.mass.dtype)
    return particles.history


def springy(boundaries: tuple) -> bool:
    """Whether some boundary is a part of the potential."""
    return any(has_potential(b) or b.acts_in("on_particles") for b in boundaries)


def springs(grid: Grid, start: Start, rest: Rest, velocity: Array) -> tuple[Array, Array]:
    """Energy (N,) [J] of contact and of particles whose velocity is given, and its slope (3, N)
    by their velocity (3, N) [m/s].
    """
    shared, h = start.shared, start.stage
    matter, particles = rest.matter, rest.particles
    energy, slope = jnp.zeros_like(matter.mass), jnp.zeros_like(velocity)
    first = 0
    for boundary, loads, found in zip(shared.boundaries, matter.loads, rest.lags, strict=True):
        if not has_potential(boundary):
            continue
        slip = particles.slip
        if slip is not None:
            slip = slip[first : first + boundary.rows]
            first += boundary.rows
        place, lost = compensated.add(particles.position, rest.lost, h * velocity)
        stored, force = pushed(
            boundary, loads, found, slip, place, lost, velocity, shared.time + h, h
        )
        energy, slope = energy + stored, slope - h * force
    if stages.acting(shared.boundaries, "on_particles"):
        given = [
            stages.on_particles(
                shared.boundaries,
                matter.loads,
                particles.position,
                jnp.full_like(velocity, value),
                shared.time,
                shared.dt,
            )
            for value in (0, 1)
        ]
        told = jnp.all(given[0] == given[1], axis=0)
        stiff = (4 / grid.spacing**2) * h**2 * matter.volume * rest.stiffness
        heavy = matter.mass + jax.lax.stop_gradient(stiff)
        weight = jnp.where(told, HELD * heavy, 0)
        error = velocity - given[0]
        energy = energy + 0.5 * weight * jnp.sum(error**2, axis=0)
        slope = slope + weight * error
    return energy, slope


def evaluate(config: Config, start: Start, rest: tuple[Rest, ...], velocities: Array) -> Value:
    """Energy of the particles and its slope at velocities (M, 4) [m/s] of the nodes."""
    window, grid, h = config.computed, config.grid, start.stage

    def body(law, common, carry, rest):
        (rows, energy, size), least = carry
        start, velocities = common
        matter, particles = rest.matter, rest.particles
        F, history = particles.deformation, _history(particles, matter)
        place = particles.position
        velocity, moment = to_particles(window, start.origin, place, velocities)
        turn = start.stage * velocity_gradient(config, Flow(velocity, moment))
        with part(f"law {law.name}"):
            response = pulled_back(law, matter.parameters, F, history, turn)
            after = algebra.matmul(turn, F) + F
            density = law.energy(matter.parameters, after, history)
        stored, slope = springs(grid, start, rest, velocity)
        affine = (4 / grid.spacing**2) * h * matter.volume * response
        rows = to_nodes(window, start.origin, place, rows, None, slope, affine)
        stored = stored + matter.volume * density
        # Places without a particle have neither mass nor volume, but may have no number either.
        stored = jnp.where(matter.mass > 0, stored, 0)
        turned = algebra.determinant(turn + algebra.identity_like(turn))
        volume = jnp.minimum(turned, algebra.determinant(after))
        sound = jnp.isfinite(stored) & jnp.isfinite(volume)
        worst = jnp.min(jnp.where(sound, volume, -jnp.inf))
        energy, size = energy + jnp.sum(stored), size + jnp.sum(jnp.abs(stored))
        return ((rows, energy, size), jnp.minimum(least, worst)), None

    zero = jnp.zeros((), velocities.dtype)
    most = jnp.full((), jnp.inf, velocities.dtype)
    sums = (jnp.zeros_like(velocities), zero, zero)
    (rows, energy, size), least, _ = passed(config, body, sums, most, (start, velocities), rest)
    return Value(energy, size, rows, least)


def linearise(
    config: Config, start: Start, rest: tuple[Rest, ...], velocities: Array, positive: Array | None
) -> tuple[Array, tuple[Tangents, ...]]:
    """Blocks (M, 6) of the second derivative at velocities (M, 4), and what `multiply` needs.

    positive: () bool, whether to leave out the negative curvature of each particle; None: never.
    """
    window, grid = config.computed, config.grid

    def body(law, common, carry, rest):
        blocks, none = carry
        start, velocities = common
        matter, particles, h = rest.matter, rest.particles, start.stage
        F, history = particles.deformation, _history(particles, matter)
        place, D = particles.position, 4 / grid.spacing**2
        velocity, moment = to_particles(window, start.origin, place, velocities)
        turn = h * velocity_gradient(config, Flow(velocity, moment))
        with part(f"law {law.name}"):
            _, stiffness = tangent(law, matter.parameters, F, history, turn)
        stiffness = jnp.where(matter.mass > 0, (h * D) ** 2 * matter.volume * stiffness, 0)
        spring = _spring(grid, start, rest, velocity)
        if positive is not None:
            stiffness, spring = jax.lax.cond(
                positive,
                lambda both: jax.tree.map(packed.positive, both),
                lambda both: both,
                (stiffness, spring),
            )
        at = stencil(window, start.origin, place)
        blocks = scatter_blocks(window, at, blocks, stiffness, spring)
        return (blocks, none), Tangents(stiffness, spring)

    empty = jnp.zeros((window.nodes, 6), velocities.dtype)
    blocks, _, tangents = passed(config, body, empty, None, (start, velocities), rest)
    return blocks, tangents


def _spring(grid: Grid, start: Start, rest: Rest, velocity: Array) -> Array | None:
    """The second derivative of `springs`, packed (6, N), or None without any."""
    if not springy(start.shared.boundaries):
        return None

    def slope(velocity):
        return springs(grid, start, rest, velocity)[1]

    units = jnp.broadcast_to(jnp.eye(3, dtype=velocity.dtype)[..., None], (3, *velocity.shape))
    columns = jax.vmap(lambda d: jax.jvp(slope, (velocity,), (d,))[1])(units)
    return jnp.where(rest.matter.mass > 0, packed.pack(columns), 0)


def multiply(
    config: Config,
    start: Start,
    rest: tuple[Rest, ...],
    tangents: tuple[Tangents, ...],
    rows: Array,
) -> Array:
    """The second derivative of the particles' energy times rows (M, 4): one pass."""
    window = config.computed

    def body(law, common, carry, chunk):
        total, none = carry
        (origin, rows), (place, tangents) = common, chunk
        at = stencil(window, origin, place)
        sums, moment = gather(window, at, rows)
        entries = packed.multiply(tangents.stiffness, algebra.numbers(moment))
        affine = algebra.stack_matrix([entries[3 * i : 3 * i + 3] for i in range(3)])
        momentum = jnp.zeros_like(place)
        if tangents.spring is not None:
            momentum = jnp.stack(packed.multiply(tangents.spring, algebra.components(sums[:3])))
        return (scatter(window, at, total, None, momentum, affine), none), None

    places = tuple(one.particles.position for one in rest)
    own = tuple(zip(places, tangents, strict=True))
    return passed(config, body, jnp.zeros_like(rows), None, (start.origin, rows), own)[0]


def finish(
    config: Config,
    start: Start,
    rest: tuple[Rest, ...],
    residuals: tuple[Residual | None, ...],
    numbers: tuple[Array, ...],
    velocities: Array,
    end: Array | None,
) -> tuple[Array, tuple[Particles, ...], tuple[Residual | None, ...], tuple[Flow, ...]]:
    """(`first_failure` (), particles, residuals, flows) after the step.

    velocities: (M, 4) [m/s] that move and deform; end: (M, 4) those at the end of the step, which
    particles keep, or None where they are the same.
    """
    window = config.computed

    def body(law, common, carry, chunk):
        none, fault = carry
        start, velocities, end = common
        rest, residual, numbers = chunk
        shared, matter, before = start.shared, rest.matter, rest.particles
        place = before.position
        flow = Flow(*to_particles(window, start.origin, place, velocities))
        after, residual, flow = move(config, law, shared, matter, before, residual, flow, False)
        code = failure(
            config,
            start.origin,
            halo.highest(config, start.origin, None),
            place,
            after.position,
            flow.velocity,
            velocity_gradient(config, flow),
            after.deformation,
            shared.dt,
        )
        fault = jnp.minimum(fault, first_failure(code, numbers))
        after = after._replace(slip=_slip(shared, matter, before, after, residual, flow))
        if end is not None:
            flow = Flow(*to_particles(window, start.origin, place, end))
            kept = stages.on_particles(
                shared.boundaries, matter.loads, place, flow.velocity, shared.time, shared.dt
            )
            flow = flow._replace(velocity=kept)
        return (none, fault), (after, residual, flow)

    own = tuple(zip(rest, residuals, numbers, strict=True))
    least = jnp.array(NO_FAILURE, jnp.int32)
    _, fault, results = passed(config, body, None, least, (start, velocities, end), own)
    particles, residuals, flows = zip(*results, strict=True)
    return fault, particles, residuals, flows


def _slip(
    shared: Shared,
    matter: Matter,
    before: Particles,
    after: Particles,
    residual: Residual | None,
    flow: Flow,
) -> Array | None:
    if before.slip is None:
        return None
    lost = None if residual is None else residual.position
    rows, first = [], 0
    for boundary, loads in zip(shared.boundaries, matter.loads, strict=True):
        if not boundary.rows:
            continue
        own = before.slip[first : first + boundary.rows]
        first += boundary.rows
        rows.append(
            slipped(
                boundary,
                loads,
                own,
                after.position,
                lost,
                flow.velocity,
                shared.later,
                shared.dt,
            )
        )
    return jnp.concatenate(rows)
