"""Where boundaries act in a step. What no listed boundary does is not traced."""

from collections.abc import Iterable

import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.program import part
from jaxphys.mpm.boundaries.base import Boundary, Setting
from jaxphys.mpm.boundaries.damping import Damping
from jaxphys.mpm.boundaries.free import Wrench
from jaxphys.mpm.boundaries.obstacle import Obstacle
from jaxphys.mpm.grid import Grid, node_coordinates
from jaxphys.mpm.state import Model


def prepare(boundaries: Iterable[Boundary], setting: Setting) -> tuple[Boundary, ...]:
    """The boundaries as the solver wants them.

    Raises:
        InputError: naming the entry and field that cannot be used.
    """
    made = []
    for i, boundary in enumerate(boundaries):
        try:
            made.append(boundary.prepared(setting))
        except InputError as error:
            raise InputError(f"boundaries[{i}].{error}") from None
    free = [i for i, boundary in enumerate(made) if boundary.free]
    if len(free) > 1:
        raise InputError(
            f"boundaries[{free[1]}].motion: is free, as that of boundaries[{free[0]}]; bodies do "
            "not feel each other, so that a scene may have one"
        )
    return tuple(made)


def acting(boundaries: tuple[Boundary, ...], stage: str) -> list[tuple[str, int]]:
    """Those that act in a stage: the name of each one's part of the program, and its place in the
    list. Damping comes first: what others prescribe is not damped.
    """
    listed = [
        (f"boundary {i} {boundary.type}", i)
        for i, boundary in enumerate(boundaries)
        if boundary.acts_in(stage)
    ]
    return sorted(listed, key=lambda entry: not isinstance(boundaries[entry[1]], Damping))


def loads(model: Model, grid: Grid) -> tuple[dict[str, Array], ...]:
    """What each boundary must know of every particle, arrays (N,)."""
    return tuple(boundary.loads(model, grid) for boundary in model.boundaries)


def impulses(
    boundaries: tuple[Boundary, ...],
    loads: tuple[dict[str, Array], ...],
    position: Array,
    velocity: Array,
    slip: Array | None,
    time: Array,
    dt: Array,
    since: Array,
) -> tuple[Array | None, Array | None, Wrench | None]:
    """Momentum (3, N) [kg m/s] that the boundaries add to what particles give to the grid, None if
    none does, the new `State.slip`, and the share of the free one, None if there is none.
    """
    total: Array | None = None
    wrench: Wrench | None = None
    kept: list[Array] = []
    first = 0
    for name, index in acting(boundaries, "impulse"):
        boundary = boundaries[index]
        rows = boundary.rows
        own = slip[first : first + rows] if rows and slip is not None else None
        with part(name):
            given, own = boundary.impulse(position, velocity, own, loads[index], time, dt, since)
            total = given if total is None else total + given
            if isinstance(boundary, Obstacle) and boundary.free:
                wrench = boundary.wrench(position, given)
        if rows and own is not None:
            kept.append(own)
            first += rows
    return total, jnp.concatenate(kept) if kept else slip, wrench


def no_wrench(boundaries: tuple[Boundary, ...], dtype) -> Wrench | None:
    """Of no particles: zero, or None if no boundary is free."""
    if not any(boundary.free for boundary in boundaries):
        return None
    return Wrench(jnp.zeros(3, dtype), jnp.zeros(3, dtype))


def on_grid(
    boundaries: tuple[Boundary, ...],
    grid: Grid,
    nodes: tuple[int, int, int],
    origin: Array,
    rows: Array,
    time: Array,
    dt: Array,
) -> Array:
    """Node rows (M, 4), velocity [m/s] and a void column, after the boundaries that act there.

    nodes: shape of the window; origin: (3,) its first node.
    """
    found = acting(boundaries, "on_grid")
    if not found:
        return rows
    coordinates = node_coordinates(nodes, grid.spacing, origin, rows.dtype)
    velocity = rows.T[:3].reshape(3, *nodes)
    for name, index in found:
        with part(name):
            velocity = boundaries[index].on_grid(velocity, coordinates, grid, time, dt)
    return jnp.concatenate([velocity.reshape(3, -1), rows.T[3:]]).T


def on_particles(
    boundaries: tuple[Boundary, ...],
    loads: tuple[dict[str, Array], ...],
    position: Array,
    velocity: Array,
    time: Array,
    dt: Array,
) -> Array:
    """Particle velocities (3, N) [m/s] after the boundaries that act there."""
    for name, index in acting(boundaries, "on_particles"):
        with part(name):
            velocity = boundaries[index].on_particles(position, velocity, loads[index], time, dt)
    return velocity
