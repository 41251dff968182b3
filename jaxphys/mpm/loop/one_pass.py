"""One pass over all particles, chunk by chunk, and its transpose.

    rows --grid update--> nodes --gather--> move --law, contact--> scatter --> rows of the next step

A chunk's temporaries stay in the cache, and between two passes nothing is stored but what the next
one needs. The last pass ends after `move`; its flow is what a caller sees of the motion. The first
one starts with the flow that the state holds, and moves nothing.

The way back is a pass of the same shape: gather the cotangent of the rows, the law's own transpose,
slopes at the old place, scatter into the cotangent of the nodes. It keeps, of every step, where it
started, the rows, and what the particles gathered. What rounding left out of the sums is not kept,
so that the way back sees the places where particles are to within a rounding.

Several devices share the chunks. Each sums up the rows of its own particles and they add them up.
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.flatten_util import ravel_pytree

from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.loop.particle_step import (
    Flow,
    Matter,
    Particles,
    Shared,
    give,
    move,
    update_grid,
    velocity_gradient,
)
from jaxphys.mpm.loop.placement import AXIS, spread
from jaxphys.mpm.loop.status import NO_FAILURE, failure, first_failure, least
from jaxphys.mpm.state import Config, Residual
from jaxphys.mpm.transfer import (
    base_node,
    gather,
    gather_slopes,
    scatter,
    scatter_transpose,
    stencil,
)


class Inputs(NamedTuple):
    """What a pass may be differentiated by. Of particles one for each segment, in chunks.

    matter: its numbers; start: flow of the state, for the first pass, None in the last one; rows:
    (M, 4), momentum and mass of the nodes.
    """

    shared: Shared
    matter: tuple[Matter, ...]
    start: tuple[Flow, ...] | None
    particles: tuple[Particles, ...]
    rows: Array


class Fixed(NamedTuple):
    """What it may not. residuals, numbers of the particles, and flags, the loads that are no
    numbers, of each segment; origin, target: first nodes (3,) int32 of the windows that rows lie in
    before and after; first: () bool; lightest: see `update_grid`.
    """

    residuals: tuple[Residual | None, ...]
    numbers: tuple[Array, ...]
    flags: tuple[Matter, ...]
    origin: Array
    target: Array
    first: Array
    lightest: Array


class Seen(NamedTuple):
    """What a pass tells, besides. All int32, so that less is known of more particles.

    failure: `first_failure`, (); below: the lowest `base_node` of any particle after it, and the
    highest one times -1, (6,), or None where the whole grid is computed.
    """

    failure: Array
    below: Array | None

    def also(self, other: "Seen") -> "Seen":
        """Of two sets of particles."""
        return jax.tree.map(jnp.minimum, self, other)


def nothing_seen(config: Config) -> Seen:
    """Of no particles."""
    most = jnp.array(NO_FAILURE, jnp.int32)
    return Seen(most, None if config.window is None else jnp.full(6, most))


def extent(config: Config, position: Array) -> Array | None:
    """`Seen.below` of particles (3, N)."""
    if config.window is None:
        return None
    base = base_node(position, config.grid.spacing, config.grid.shape)
    return least(jnp.concatenate([base, -base]))


def numbers_and_flags(tree: Any) -> tuple[Any, Any]:
    """A pytree twice: with its floating-point leaves alone, and with the others; None elsewhere."""

    def kept(floating: bool):
        return lambda x: x if jnp.issubdtype(x.dtype, jnp.floating) == floating else None

    return jax.tree.map(kept(True), tree), jax.tree.map(kept(False), tree)


def whole(numbers: Any, flags: Any) -> Any:
    """The pytree of which `numbers_and_flags` made two."""
    return jax.tree.map(
        lambda a, b: b if a is None else a, numbers, flags, is_leaf=lambda x: x is None
    )


@partial(jax.custom_vjp, nondiff_argnums=(0, 1))
def one_pass(config: Config, last: bool, inputs: Inputs, fixed: Fixed):
    """((particles, rows), (residuals, `Seen`)) after a pass, or of the last one ((particles, flow),
    ...). Everything of particles one for each segment, in chunks.

    config, last: static; see `Inputs` and `Fixed`.
    """
    return _forward(config, last, inputs, fixed)[:2]


def _one_pass_forward(config, last, inputs, fixed):
    results, told, gathered = _forward(config, last, inputs, fixed)
    # Residuals are no part of the way back, nor are the particles' numbers.
    return (results, told), (inputs, fixed._replace(residuals=None, numbers=None), gathered)


def _one_pass_backward(config, last, kept, cotangents):
    inputs, fixed, gathered = kept
    (particles, rows_or_flow), _ = cotangents
    nodes, through_grid = jax.vjp(
        lambda shared, rows: _nodes(config, shared, rows, fixed), inputs.shared, inputs.rows
    )
    run = spread(config.placement, partial(_backward_chunks, config, last), _sum_over_devices)
    rows, flow = (None, rows_or_flow) if last else (rows_or_flow, None)
    (shared, nodes), (matter, start, particles) = run(
        (inputs.shared, nodes, rows, fixed.origin, fixed.target, fixed.first),
        (inputs.matter, fixed.flags, inputs.particles, gathered, particles, flow),
    )
    through_shared, rows = through_grid(nodes)
    shared = jax.tree.map(jnp.add, shared, through_shared)
    return Inputs(shared, matter, None if last else start, particles, rows), None


one_pass.defvjp(_one_pass_forward, _one_pass_backward)


def _nodes(config: Config, shared: Shared, rows: Array, fixed: Fixed) -> Array:
    """Velocities of the nodes, as particles see them, (M, 4)."""
    rows = update_grid(shared, fixed.lightest, rows)
    return stages.on_grid(
        shared.boundaries,
        config.grid,
        config.nodes,
        fixed.origin,
        rows,
        shared.time,
        shared.dt,
    )


def _forward(config: Config, last: bool, inputs: Inputs, fixed: Fixed):
    nodes = _nodes(config, inputs.shared, inputs.rows, fixed)
    run = spread(config.placement, partial(_forward_chunks, config, last), _join_over_devices)
    (rows, seen), (particles, residuals, flow, gathered) = run(
        (inputs.shared, nodes, fixed.origin, fixed.target, fixed.first),
        (
            inputs.start,
            inputs.particles,
            fixed.residuals,
            inputs.matter,
            fixed.flags,
            fixed.numbers,
        ),
    )
    return (particles, flow if last else rows), (residuals, seen), gathered


def _sum_over_devices(results):
    return jax.lax.psum(results, AXIS)


def _join_over_devices(results):
    rows, seen = results
    rows = rows if rows is None else jax.lax.psum(rows, AXIS)
    # All of them at once: what is small costs a meeting each.
    numbers, whole = ravel_pytree(seen)
    return rows, whole(jax.lax.pmin(numbers, AXIS))


def _forward_chunks(config: Config, last: bool, common, own):
    """All chunks of this device, forth."""
    shared, nodes, origin, target, first = common
    window, grid = config.computed, config.grid
    rows = None if last else jnp.zeros_like(nodes)
    seen, results = nothing_seen(config), []

    def taken(particles):
        sums, moment = gather(window, stencil(window, origin, particles.position), nodes)
        return Flow(sums[:3], moment)

    def moved(matter, numbers, particles, residual, flow):
        before = particles.position
        particles, residual, flow = move(grid, shared, matter, particles, residual, flow, first)
        code = failure(
            config,
            origin,
            before,
            particles.position,
            flow.velocity,
            velocity_gradient(grid, flow),
            particles.deformation,
            shared.dt,
        )
        fault = jnp.where(first, NO_FAILURE, first_failure(code, numbers))
        return particles, residual, flow, Seen(fault, extent(config, particles.position))

    def of_last(seen, chunk):
        matter, flags, numbers, particles, residual = chunk
        flow = taken(particles)
        *results, seen_too = moved(whole(matter, flags), numbers, particles, residual, flow)
        return seen.also(seen_too), (*results, flow)

    def of_other(law, start, carry, chunk):
        rows, seen, state = carry
        k, matter, flags, numbers = chunk
        matter = whole(matter, flags)

        # What is read of the state is read within the branches, all at once and before the new one
        # is written in its place: otherwise XLA copies the whole state for each chunk.
        def started():
            particles, residual = jax.tree.map(lambda x: x[k], state)
            return particles, residual, jax.tree.map(lambda x: x[k], start)

        def went_on():
            particles, residual = jax.tree.map(lambda x: x[k], state)
            return particles, residual, taken(particles)

        particles, residual, flow = jax.lax.cond(first, started, went_on)
        particles, residual, used, seen_too = moved(matter, numbers, particles, residual, flow)
        particles, momentum, affine = give(grid, law, shared, matter, particles, used)
        at = stencil(window, target, particles.position)
        rows = scatter(window, at, rows, matter.mass, momentum, affine)
        state = jax.tree.map(
            lambda whole, x: jax.lax.dynamic_update_index_in_dim(whole, x, k, 0),
            state,
            (particles, residual),
        )
        return (rows, seen.also(seen_too), state), flow

    for (law, _, _), start, particles, residual, *parts in zip(
        config.runs, *_segments(own, config), strict=True
    ):
        if last:
            seen, result = jax.lax.scan(of_last, seen, (*parts, particles, residual))
        else:
            count = jnp.arange(len(parts[-1]))
            (rows, seen, state), flow = jax.lax.scan(
                partial(of_other, law, start),
                (rows, seen, (particles, residual)),
                (count, *parts),
            )
            result = (*state, None, flow)
        results.append(result)
    return (rows, seen), tuple(zip(*results, strict=True))


def _backward_chunks(config: Config, last: bool, common, own):
    """All chunks of this device, back: cotangents in, cotangents out."""
    shared, nodes, rows, origin, target, first = common
    window, grid = config.computed, config.grid
    total, results = (jax.tree.map(jnp.zeros_like, (shared, nodes))), []

    def of_chunk(law, carry, chunk):
        to_shared, to_nodes = carry
        matter, flags, particles, gathered, to_particles, to_flow = chunk

        def between(shared, matter, particles, flow):
            matter = whole(matter, flags)
            moved, _, flow = move(grid, shared, matter, particles, None, flow, first)
            if last:
                return moved, flow
            return give(grid, law, shared, matter, moved, flow)

        results, transpose = jax.vjp(between, shared, matter, particles, gathered)
        if last:
            own_shared, to_matter, to_before, to_gathered = transpose((to_particles, to_flow))
        else:
            after, momentum, affine = results
            at = stencil(window, target, after.position)
            to_position, to_mass, to_momentum, to_affine = scatter_transpose(
                window, at, rows, matter.mass, momentum, affine
            )
            to_after = to_particles._replace(position=to_particles.position + to_position)
            own_shared, to_matter, to_before, to_gathered = transpose(
                (to_after, to_momentum, to_affine)
            )
            to_matter = to_matter._replace(mass=to_matter.mass + to_mass)
        to_start = None
        if not last:
            to_start = jax.tree.map(lambda x: jnp.where(first, x, 0), to_gathered)
            to_gathered = jax.tree.map(lambda x: jnp.where(first, 0, x), to_gathered)
        at = stencil(window, origin, particles.position)
        slopes = gather_slopes(window, at, nodes, gathered.velocity, *to_gathered)
        to_nodes = scatter(window, at, to_nodes, None, *to_gathered)
        to_before = to_before._replace(position=to_before.position + slopes)
        to_shared = jax.tree.map(jnp.add, to_shared, own_shared)
        return (to_shared, to_nodes), (to_matter, to_start, to_before)

    for (law, _, _), *parts in zip(config.runs, *_segments(own, config), strict=True):
        total, result = jax.lax.scan(partial(of_chunk, law), total, tuple(parts))
        results.append(result)
    return total, tuple(zip(*results, strict=True))


def _segments(parts: tuple, config: Config) -> list[tuple]:
    """Each of some parts for each segment, where one may be None for all of them."""
    return [(None,) * len(config.runs) if part is None else part for part in parts]
