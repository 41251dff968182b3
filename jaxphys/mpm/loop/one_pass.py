"""One pass over all particles, chunk by chunk.

    rows --grid update--> nodes --gather--> move --law, contact--> scatter --> rows of the next step

A chunk's temporaries stay in the cache, and between two passes nothing is stored but what the next
one needs. The last pass ends after `move`; its flow is what a caller sees of the motion. The first
one starts with the flow that the state holds, and moves nothing.

Its derivatives, in both directions, are passes of the same shape: `pass_derivative.py`.

Several devices share the chunks. Each sums up the rows of its own particles and they add them up:
the whole window, or of a slab each what it shares with its neighbours (`halo`).
"""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array
from jax.flatten_util import ravel_pytree

from jaxphys.core.program import part
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.loop import halo
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
from jaxphys.mpm.loop.placement import AXIS, EVERYWHERE, spread
from jaxphys.mpm.loop.rates import slowest
from jaxphys.mpm.loop.status import NO_FAILURE, failure, first_failure
from jaxphys.mpm.loop.window import extent
from jaxphys.mpm.meeting import meet
from jaxphys.mpm.state import Config, Residual
from jaxphys.mpm.transfer import (
    gather,
    scatter,
    stencil,
)


class Inputs(NamedTuple):
    """What a pass may be differentiated by. Of particles one for each segment, in chunks.

    matter: its numbers; start: flow of the state, for the first pass, None in the last one; rows:
    (M, 4), momentum and mass of the nodes, or (M, 8) where they also tell it before any force; of
    slabs one after the other, a device's own on each.
    """

    shared: Shared
    matter: tuple[Matter, ...]
    start: tuple[Flow, ...] | None
    particles: tuple[Particles, ...]
    rows: Array


class Fixed(NamedTuple):
    """What it may not. residuals, numbers of the particles, and flags, the loads that are no
    numbers, of each segment; origin, target: first nodes (3,) int32 of the windows that rows lie in
    before and after, of slabs (S, 3); bands: how these overlap after it; first: () bool; lightest:
    see `update_grid`.
    """

    residuals: tuple[Residual | None, ...]
    numbers: tuple[Array, ...]
    flags: tuple[Matter, ...]
    origin: Array
    target: Array
    bands: halo.Bands | None
    first: Array
    lightest: Array


class Seen(NamedTuple):
    """What a pass tells, besides. All int32, so that less is known of more particles.

    failure: `first_failure`, (); below: the lowest `base_node` of any particle after it, and the
    highest one times -1, (6,), or None where the whole grid is computed; rates: `slowest` of them,
    (2,), or None where nobody asks. Once the devices have told each other, below is of each slab,
    (S, 6).
    """

    failure: Array
    below: Array | None
    rates: Array | None = None

    def also(self, other: "Seen") -> "Seen":
        """Of two sets of particles."""
        return jax.tree.map(jnp.minimum, self, other)


def nothing_seen(config: Config) -> Seen:
    """Of no particles."""
    most = jnp.array(NO_FAILURE, jnp.int32)
    return Seen(
        most,
        jnp.full(6, most) if config.follows else None,
        jnp.full(2, most) if config.tells_rates else None,
    )


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


def at_nodes(config: Config, shared: Shared, rows: Array, fixed: Fixed) -> Array:
    """Velocities of the nodes, as particles see them, (M, 4) or (M, 8)."""

    def updated(common, own):
        shared, lightest = common
        rows, origin = own
        given, rows = rows, update_grid(shared, lightest, rows)

        def held(rows):
            return stages.on_grid(
                shared.boundaries,
                config.grid,
                config.nodes,
                origin.reshape(3),
                rows,
                shared.time,
                shared.dt,
            )

        if config.fields == 1:
            return None, held(rows)
        apart = config.fields, *config.nodes
        with part("contact between objects"):
            velocity = rows.T[:3].reshape(3, *apart)
            velocity = meet(given[:, 3].reshape(apart), velocity, lightest, shared.friction)
            rows = jnp.concatenate([velocity.reshape(3, -1), rows.T[3:]]).T
        each = rows.reshape(config.fields, -1, config.columns)
        return None, jax.lax.map(held, each).reshape(rows.shape)

    if config.slabs is not None:
        updated = spread(config.placement, updated, lambda nothing: nothing)
    return updated((shared, fixed.lightest), (rows, fixed.origin))[1]


def run_pass(config: Config, last: bool, inputs: Inputs, fixed: Fixed):
    """((particles, rows, `Wrench`), (residuals, `Seen`), gathered) after a pass, or of the last one
    ((particles, flow, None), ...). Everything of particles one for each segment, in chunks.

    config, last: static; gathered: the flow that particles had before they moved.
    """
    nodes = at_nodes(config, inputs.shared, inputs.rows, fixed)
    place = halo.where(config)
    run = spread(
        config.placement,
        partial(_forward_chunks, config, last),
        partial(_join_over_devices, config),
        (EVERYWHERE, place, place, place, place, EVERYWHERE),
        (place, EVERYWHERE, EVERYWHERE),
    )
    (rows, wrench, seen), (particles, residuals, flow, gathered) = run(
        (inputs.shared, nodes, fixed.origin, fixed.target, fixed.bands, fixed.first),
        (
            inputs.start,
            inputs.particles,
            fixed.residuals,
            inputs.matter,
            fixed.flags,
            fixed.numbers,
        ),
    )
    return (particles, flow if last else rows, wrench), (residuals, seen), gathered


def _join_over_devices(config: Config, results):
    rows, wrench, seen = results
    # All of them at once: what is small costs a meeting each.
    numbers, whole = ravel_pytree(seen)
    if config.slabs is None:
        return rows, wrench, whole(jax.lax.pmin(numbers, AXIS))
    of_each = jax.vmap(whole)(jax.lax.all_gather(numbers, AXIS))
    of_all = jax.tree.map(lambda x: jnp.min(x, axis=0), of_each)
    return rows, wrench, of_all._replace(below=of_each.below)


def _forward_chunks(config: Config, last: bool, common, own):
    """All chunks of this device."""
    shared, nodes, origin, target, bands, first = common
    origin, target = origin.reshape(3), target.reshape(3)
    highest = halo.highest(config, origin, bands)
    window = config.computed
    rows = None if last else jnp.zeros_like(nodes)
    wrench = None if last else stages.no_wrench(shared.boundaries, nodes.dtype)
    seen, results = nothing_seen(config), []

    def taken(particles, field):
        at = stencil(window, origin, particles.position, field)
        return Flow.of(config, *gather(window, at, nodes))

    def moved(law, matter, numbers, particles, residual, flow):
        before = particles.position
        particles, residual, flow = move(
            config, law, shared, matter, particles, residual, flow, first
        )
        C = velocity_gradient(config, flow)
        code = failure(
            config,
            origin,
            highest,
            before,
            particles.position,
            flow.velocity,
            C,
            particles.deformation,
            shared.dt,
        )
        fault = jnp.where(first, NO_FAILURE, first_failure(code, numbers))
        below, told = extent(config, particles.position), slowest(config, flow.velocity, C)
        return particles, residual, flow, Seen(fault, below, told)

    def of_last(law, seen, chunk):
        matter, flags, numbers, particles, residual = chunk
        flow = taken(particles, flags.field)
        *results, seen_too = moved(law, whole(matter, flags), numbers, particles, residual, flow)
        return seen.also(seen_too), (*results, flow)

    def of_other(law, start, carry, chunk):
        rows, wrench, seen, state = carry
        k, matter, flags, numbers = chunk
        matter = whole(matter, flags)

        # What is read of the state is read within the branches, all at once and before the new one
        # is written in its place: otherwise XLA copies the whole state for each chunk.
        def started():
            particles, residual = jax.tree.map(lambda x: x[k], state)
            return particles, residual, jax.tree.map(lambda x: x[k], start)

        def went_on():
            particles, residual = jax.tree.map(lambda x: x[k], state)
            return particles, residual, taken(particles, matter.field)

        particles, residual, flow = jax.lax.cond(first, started, went_on)
        particles, residual, used, seen_too = moved(law, matter, numbers, particles, residual, flow)
        particles, momentum, affine, own = give(config, law, shared, matter, particles, used)
        at = stencil(window, target, particles.position, matter.field)
        rows = scatter(window, at, rows, matter.mass, momentum, affine)
        state = jax.tree.map(
            lambda whole, x: jax.lax.dynamic_update_index_in_dim(whole, x, k, 0),
            state,
            (particles, residual),
        )
        wrench = jax.tree.map(jnp.add, wrench, own)
        return (rows, wrench, seen.also(seen_too), state), flow

    for (law, _, _), start, particles, residual, *parts in zip(
        config.runs, *for_runs(own, config), strict=True
    ):
        if last:
            seen, result = jax.lax.scan(partial(of_last, law), seen, (*parts, particles, residual))
        else:
            count = jnp.arange(len(parts[-1]))
            (rows, wrench, seen, state), flow = jax.lax.scan(
                partial(of_other, law, start),
                (rows, wrench, seen, (particles, residual)),
                (count, *parts),
            )
            result = (*state, None, flow)
        results.append(result)
    rows, wrench = halo.total(config, target, bands, rows, wrench)
    return (rows, wrench, seen), tuple(zip(*results, strict=True))


def for_runs(parts: tuple, config: Config) -> list[tuple]:
    """Each of some parts for each segment, where one may be None for all of them."""
    return [(None,) * len(config.runs) if part is None else part for part in parts]
