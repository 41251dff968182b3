"""The nodes of an implicit solve: what they start from, what holds them, and how residuals count.

Boundaries on the grid map node velocities one by one. Sticky and slip nodes, and those separate
ones that what comes at them presses, are held: their map is a projection and an offset, found by
differentiating the map itself, so that no boundary is known by its kind here. A map that is no
projection (a layer that is slowed) is applied as a step finds it. Friction comes after the solve,
from what the held nodes really press with.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra, packed
from jaxphys.core.program import part
from jaxphys.mpm.boundaries import Boundary, Contact, Damping, stages
from jaxphys.mpm.state import Config

PROJECTION = 1e-3  # by how much the square of a projection may differ from itself
SURFACE = 24.0  # dx^2: of a cube of two cells, to which the stress at a node is summed up


class Nodes(NamedTuple):
    """Nodes of the window, rows (M, ...), while a step is solved.

    mass: (M, 1) [kg]; filled: (M, 1) bool, whether there is any; before: (M, 4) velocities that the
    step starts from [m/s]; target: (M, 4) those without stress [m/s]; pushed: (M, 4), what the
    boundaries took of them; free: (M, 3, 3) projection on what is not held, or None for all; held:
    (M, 4) the velocity of the rest, or None; scale: (M, 1) [kg m/s], a residual of strain 1;
    active: () how many are filled.
    """

    mass: Array
    filled: Array
    before: Array
    target: Array
    pushed: Array | None
    free: Array | None
    held: Array | None
    scale: Array
    active: Array


def frictionless(boundaries: tuple[Boundary, ...]) -> tuple[Boundary, ...]:
    """The boundaries that hold nodes, without friction and damping."""
    found = []
    for boundary in boundaries:
        if isinstance(boundary, Damping):
            continue
        if isinstance(boundary, Contact):
            names = {"friction", "frictions"} & set(vars(boundary))
            changes: dict[str, Any] = dict.fromkeys(names)
            boundary = replace(boundary, **changes)
        found.append(boundary)
    return tuple(found)


def rubs(boundaries: tuple[Boundary, ...]) -> bool:
    """Whether some boundary holds nodes with friction."""
    return any(
        isinstance(boundary, Contact)
        and not boundary.at_particles
        and any(friction for _, friction in boundary.kinds)
        for boundary in boundaries
    )


def prepared(
    config: Config,
    boundaries: tuple[Boundary, ...],
    gravity: Array | None,
    lightest: Array,
    rows: Array,
    stiffness: Array,
    origin: Array,
    time: Array,
    dt: Array,
    stage: Array,
) -> Nodes:
    """The nodes of a step.

    Args:
        rows: (M, 4) momentum [kg m/s] and mass [kg].
        stiffness: (M, 1) mass times the norm of the stiffness at rest [kg Pa].
        origin: first node of the window; time: [s] at the start; dt: [s]; stage: [s] from the start
            to the velocities that are solved for.
    """
    mass = rows[:, 3:]
    filled = mass > lightest
    safe = jnp.where(filled, mass, 1)
    empty = jnp.zeros_like(mass)
    before = jnp.where(filled, jnp.concatenate([rows[:, :3] / safe, empty], axis=1), 0)

    def mapped(those, rows, length):
        return stages.on_grid(those, config.grid, config.nodes, origin, rows, time, length)

    damping = tuple(b for b in boundaries if isinstance(b, Damping))
    before = mapped(damping, before, dt)
    target = before
    if gravity is not None:
        with part("gravity"):
            fall = jnp.concatenate([gravity, jnp.zeros_like(gravity[:1])])
            target = target + stage * fall
    target = jnp.where(filled, target, 0)
    pushed = free = held = None
    holding = frictionless(boundaries)
    if stages.acting(holding, "on_grid"):
        free, held, pushed = _holds(lambda rows: mapped(holding, rows, stage), target)
        target = target - pushed
        held = jnp.where(filled, held, 0)
    modulus = jnp.where(filled, stiffness / safe, 0)
    scale = jax.lax.stop_gradient(SURFACE * config.grid.spacing**2 * stage * modulus)
    scale = jnp.where(scale > 0, scale, jnp.finfo(mass.dtype).tiny ** 0.5)
    return Nodes(mass, filled, before, target, pushed, free, held, scale, jnp.sum(filled))


def _holds(mapped, target: Array) -> tuple[Array, Array, Array]:
    """(free, held, pushed) of `Nodes` for a map of rows that acts on each node by itself."""
    after = mapped(target)
    units = jnp.eye(4, dtype=target.dtype)[:3]
    columns = [
        jax.jvp(mapped, (target,), (jnp.broadcast_to(unit, target.shape),))[1][:, :3]
        for unit in units
    ]
    free = jnp.stack(columns, axis=-1)
    square = apply(free, jnp.swapaxes(free, 1, 2))
    fits = jnp.max(jnp.abs(square - free), axis=(1, 2), keepdims=True) < PROJECTION
    free = jnp.where(fits, free, 0)
    held = after - _turned(free, after)
    return free, held, target - after


def apply(A: Array, B: Array) -> Array:
    """A @ B of rows of matrices (M, 3, 3), as sums."""
    return algebra.total(A[:, :, k, None] * B[:, None, k, :] for k in range(3))


def _turned(free: Array, rows: Array) -> Array:
    """A projection (M, 3, 3) of rows (M, 4)."""
    three = sum(free[:, :, k] * rows[:, k, None] for k in range(3))
    return jnp.concatenate([three, jnp.zeros_like(rows[:, 3:])], axis=1)


def project(nodes: Nodes, rows: Array) -> Array:
    """What is free of rows (M, 4)."""
    rows = jnp.where(nodes.filled, rows, 0)
    return rows if nodes.free is None else _turned(nodes.free, rows)


def allowed(nodes: Nodes, rows: Array) -> Array:
    """Velocities (M, 4) with the held part as it must be."""
    rows = project(nodes, rows)
    return rows if nodes.held is None else rows + nodes.held


def characteristic(nodes: Nodes, residual: Array) -> Array:
    """Root mean square over nodes of a residual (M, 4) in units of a residual of strain 1 (Wang et
    al. 2020, "Hierarchical optimization time integration", section 5).
    """
    share = residual / nodes.scale
    return jnp.sqrt(jnp.sum(share * share) / jnp.maximum(nodes.active, 1))


def inverse_blocks(nodes: Nodes, blocks: Array) -> Array:
    """Inverses (6, M), packed, of stiffness blocks (M, 6) with the mass added."""
    diagonal = jnp.asarray([1, 0, 0, 1, 0, 1], blocks.dtype)
    return packed.inverse((blocks + nodes.mass * diagonal).T)


def precondition(nodes: Nodes, inverse: Array, rows: Array) -> Array:
    """The inverse blocks applied to free rows (M, 4)."""
    three = packed.multiply(inverse, [rows[:, k] for k in range(3)])
    return project(nodes, jnp.stack([*three, jnp.zeros_like(three[0])], axis=1))


def released(
    config: Config,
    boundaries: tuple[Boundary, ...],
    nodes: Nodes,
    solved: Array,
    residual: Array,
    origin: Array,
    time: Array,
    dt: Array,
) -> Array:
    """Velocities (M, 4) after friction of held nodes.

    What presses a held node is what its velocity would have become without the boundary: then the
    boundary's own rule gives what friction leaves. A node that would be pulled stays held, and is
    let go in the next step.

    Args:
        solved: (M, 4) [m/s]; residual: (M, 4) [kg m/s] of all rows, held ones too.
        dt: [s] the time in which the residual's impulse acts.
    """
    if nodes.free is None or nodes.pushed is None or not rubs(boundaries):
        return solved
    reaction = jnp.where(nodes.filled, residual / jnp.where(nodes.filled, nodes.mass, 1), 0)
    impact = nodes.pushed - reaction
    loose = solved + impact - _turned(nodes.free, impact)
    surfaces = tuple(boundary for boundary in boundaries if isinstance(boundary, Contact))

    def mapped(those):
        return stages.on_grid(those, config.grid, config.nodes, origin, loose, time, dt)

    without = mapped(frictionless(surfaces))
    error = jnp.abs(without - _turned(nodes.free, without) - nodes.held)
    small = jnp.finfo(error.dtype).eps ** 0.5 * jnp.max(jnp.abs(loose))
    pulled = jnp.max(error, axis=1, keepdims=True) > small
    return jnp.where(pulled, solved, mapped(surfaces))
