"""The one rule of differentiation of a pass, for both directions.

A pass's derivative is a pass of the same shape, which is linear in what it takes along: forward it
gathers the tangent of the nodes, takes it through move and law, and scatters it into the tangent of
the rows; back it gathers the cotangent of the rows, and scatters into that of the nodes.

Both start from what a pass keeps: where it started, the rows, and what the particles gathered. What
rounding left out of the sums is not kept, so that they see the places where particles are to within
a rounding. `core.linear_map` holds the two together.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.linear_map import linear_map, zero_tangent
from jaxphys.core.own_rule import own_rule
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.loop import halo
from jaxphys.mpm.loop.one_pass import Fixed, Inputs, at_nodes, for_runs, run_pass, whole
from jaxphys.mpm.loop.particle_step import Flow, give, move
from jaxphys.mpm.loop.placement import AXIS, EVERYWHERE, spread
from jaxphys.mpm.state import Config
from jaxphys.mpm.transfer import (
    gather_slopes,
    gather_tangent,
    scatter,
    scatter_tangent,
    scatter_transpose,
    stencil,
)

# No two alike, nor the mean of the others, so that it splits stretches whatever their directions.
APART = 1.0, 0.17, -0.83


def one_pass(config: Config, last: bool, inputs: Inputs, fixed: Fixed):
    """((particles, rows, `Wrench`), (residuals, `Seen`)) after a pass, or of the last one
    ((particles, flow, None), ...). Everything of particles one for each segment, in chunks.
    Differentiable by `inputs` in both directions, to any order that the laws are.

    config, last: static; see `Inputs` and `Fixed`.
    """
    return _pass(config, last, inputs, fixed)[:2]


def _pass(config: Config, last: bool, inputs: Inputs, fixed: Fixed):
    """`run_pass`. What was gathered is among the results, since the derivative's own derivative
    must know how it changes.
    """
    return own_rule(
        partial(run_pass, config, last), partial(_pass_jvp, config, last), inputs, fixed
    )


def _pass_jvp(config, last, primals, tangents):
    inputs, fixed = primals
    results, told, gathered = _pass(config, last, inputs, fixed)
    # Residuals are no part of the derivative, nor are the particles' numbers.
    kept = inputs, fixed._replace(residuals=None, numbers=None), gathered
    *rates, of_gathered = linear_map(
        partial(_tangent, config, last),
        partial(_cotangent, config, last),
        kept,
        tangents[0],
        (*results, gathered),
        near=partial(_with_stretches_apart, config),
    )
    return (results, told, gathered), (tuple(rates), zero_tangent(told), of_gathered)


def _with_stretches_apart(config: Config, kept):
    """What a second derivative starts from: laws that decompose the deformation have none where
    principal stretches are equal (`core.spectral`), as they are at rest. The root of a rounding
    apart they do, right to that root.
    """
    if not any(law.spectral for law, _, _ in config.runs):
        return kept
    inputs, *rest = kept

    def apart(F: Array) -> Array:
        columns = 1 + jnp.sqrt(jnp.finfo(F.dtype).eps) * jnp.asarray(APART, F.dtype)
        return F * columns[:, None]

    particles = tuple(
        own._replace(deformation=apart(own.deformation)) if law.spectral else own
        for (law, _, _), own in zip(config.runs, inputs.particles, strict=True)
    )
    return inputs._replace(particles=particles), *rest


def _tangent(config: Config, last: bool, kept, tangents: tuple):
    """Tangents of particles, of rows or flow, of the wrench, and of what was gathered, from those
    of `Inputs`.
    """
    inputs, fixed, gathered = kept
    shared, matter, start, particles, rows = (
        zero_tangent(own) if rate is None else rate
        for own, rate in zip(inputs, tangents, strict=True)
    )
    nodes, of_nodes = jax.jvp(
        lambda shared, rows: at_nodes(config, shared, rows, fixed),
        (inputs.shared, inputs.rows),
        (shared, rows),
    )
    place = halo.where(config)
    run = spread(
        config.placement,
        partial(_tangent_chunks, config, last),
        lambda sums: sums,
        (EVERYWHERE, place, place, place, place, EVERYWHERE, EVERYWHERE, place),
        (place, EVERYWHERE),
    )
    (rows, wrench), (particles, flow, of_gathered) = run(
        (
            inputs.shared,
            nodes,
            fixed.origin,
            fixed.target,
            fixed.bands,
            fixed.first,
            shared,
            of_nodes,
        ),
        (inputs.matter, fixed.flags, inputs.particles, gathered, matter, start, particles),
    )
    return particles, flow if last else rows, wrench, of_gathered


def _cotangent(config: Config, last: bool, kept, cotangents: tuple):
    """Cotangents of `Inputs`, from those of particles, of rows or flow, of the wrench, and of what
    was gathered, the last of which nothing asks for in a first derivative.
    """
    inputs, fixed, gathered = kept
    particles, rows_or_flow, wrench, to_gathered = cotangents
    particles = zero_tangent(inputs.particles) if particles is None else particles
    if rows_or_flow is None:
        rows_or_flow = zero_tangent(gathered if last else inputs.rows)
    if wrench is None and not last:
        wrench = stages.no_wrench(inputs.shared.boundaries, inputs.rows.dtype)
    nodes, through_grid = jax.vjp(
        lambda shared, rows: at_nodes(config, shared, rows, fixed), inputs.shared, inputs.rows
    )
    place = halo.where(config)
    run = spread(
        config.placement,
        partial(_cotangent_chunks, config, last),
        partial(_sum_over_devices, config),
        (EVERYWHERE, place, place, EVERYWHERE, place, place, place, EVERYWHERE),
        (EVERYWHERE, place),
    )
    rows, flow = (None, rows_or_flow) if last else (rows_or_flow, None)
    (shared, nodes), (matter, start, particles) = run(
        (
            inputs.shared,
            nodes,
            rows,
            wrench,
            fixed.origin,
            fixed.target,
            fixed.bands,
            fixed.first,
        ),
        (inputs.matter, fixed.flags, inputs.particles, gathered, particles, flow, to_gathered),
    )
    through_shared, rows = through_grid(nodes)
    shared = jax.tree.map(jnp.add, shared, through_shared)
    return shared, matter, None if last else start, particles, rows


def _sum_over_devices(config: Config, results):
    """Of a slab each device knows all that its own particles ask of its copy of the nodes."""
    if config.slabs is None:
        return jax.lax.psum(results, AXIS)
    shared, nodes = results
    return jax.lax.psum(shared, AXIS), nodes


def _between(config: Config, last: bool, law, flags, first: Array):
    """What a pass does to some particles between its transfers, as a function of the rest."""

    def between(shared, matter, particles, flow: Flow):
        matter = whole(matter, flags)
        moved, _, flow = move(config, law, shared, matter, particles, None, flow, first)
        if last:
            return moved, flow
        return give(config, law, shared, matter, moved, flow)

    return between


def _tangent_chunks(config: Config, last: bool, common, own):
    """All chunks of this device: tangents in, tangents out."""
    shared, nodes, origin, target, bands, first, of_shared, of_nodes = common
    origin, target = origin.reshape(3), target.reshape(3)
    window = config.computed
    rows = None if last else jnp.zeros_like(nodes)
    wrench = None if last else stages.no_wrench(shared.boundaries, nodes.dtype)
    sums, results = (rows, wrench), []

    def of_chunk(law, sums, chunk):
        matter, flags, particles, gathered, of_matter, of_start, of_particles = chunk
        at = stencil(window, origin, particles.position, flags.field)
        moved = of_particles.position
        flow = Flow.of(config, *gather_tangent(window, at, nodes, moved, of_nodes))
        if not last:
            flow = jax.tree.map(lambda a, b: jnp.where(first, a, b), of_start, flow)
        results, rates = jax.jvp(
            _between(config, last, law, flags, first),
            (shared, matter, particles, gathered),
            (of_shared, of_matter, of_particles, flow),
        )
        if last:
            return sums, (*rates, flow)
        (after, *given, _), (of_after, *of_given, of_wrench) = results, rates
        rows, wrench = sums
        at = stencil(window, target, after.position, flags.field)
        rows = scatter_tangent(
            window, at, rows, (matter.mass, *given), of_after.position, (of_matter.mass, *of_given)
        )
        wrench = jax.tree.map(jnp.add, wrench, of_wrench)
        return (rows, wrench), (of_after, None, flow)

    for (law, _, _), *parts in zip(config.runs, *for_runs(own, config), strict=True):
        sums, result = jax.lax.scan(partial(of_chunk, law), sums, tuple(parts))
        results.append(result)
    sums = halo.total(config, target, bands, *sums)
    return sums, tuple(zip(*results, strict=True))


def _cotangent_chunks(config: Config, last: bool, common, own):
    """All chunks of this device, back: cotangents in, cotangents out."""
    shared, nodes, rows, to_wrench, origin, target, bands, first = common
    origin, target = origin.reshape(3), target.reshape(3)
    if rows is not None and bands is not None:
        rows = halo.exchanged(config, target, bands, rows)
    window = config.computed
    total, results = (jax.tree.map(jnp.zeros_like, (shared, nodes))), []

    def of_chunk(law, carry, chunk):
        to_shared, to_nodes = carry
        matter, flags, particles, gathered, to_particles, to_flow, asked = chunk
        results, transpose = jax.vjp(
            _between(config, last, law, flags, first), shared, matter, particles, gathered
        )
        if last:
            own_shared, to_matter, to_before, to_gathered = transpose((to_particles, to_flow))
        else:
            after, momentum, affine, _ = results
            at = stencil(window, target, after.position, flags.field)
            to_position, to_mass, to_momentum, to_affine = scatter_transpose(
                window, at, rows, matter.mass, momentum, affine
            )
            to_after = to_particles._replace(position=to_particles.position + to_position)
            own_shared, to_matter, to_before, to_gathered = transpose(
                (to_after, to_momentum, to_affine, to_wrench)
            )
            to_matter = to_matter._replace(mass=to_matter.mass + to_mass)
        if asked is not None:
            to_gathered = jax.tree.map(jnp.add, to_gathered, asked)
        to_start = None
        if not last:
            to_start = jax.tree.map(lambda x: jnp.where(first, x, 0), to_gathered)
            to_gathered = jax.tree.map(lambda x: jnp.where(first, 0, x), to_gathered)
        at = stencil(window, origin, particles.position, flags.field)
        slopes = gather_slopes(window, at, nodes, gathered.vectors[0], *to_gathered.vectors)
        to_nodes = scatter(window, at, to_nodes, None, *to_gathered.vectors)
        to_before = to_before._replace(position=to_before.position + slopes)
        to_shared = jax.tree.map(jnp.add, to_shared, own_shared)
        return (to_shared, to_nodes), (to_matter, to_start, to_before)

    for (law, _, _), *parts in zip(config.runs, *for_runs(own, config), strict=True):
        total, result = jax.lax.scan(partial(of_chunk, law), total, tuple(parts))
        results.append(result)
    return total, tuple(zip(*results, strict=True))
