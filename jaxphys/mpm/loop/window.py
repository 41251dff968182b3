"""Which part of the grid is computed: chosen on the host for a frame, and followed in a rollout.

A window has room for all particles. Several devices either have the whole of it each, or a slab of
it across x each, whichever gives them less to tell each other.
"""

import math
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.loop import halo
from jaxphys.mpm.loop.chunks import cut, cuts, orders
from jaxphys.mpm.loop.placement import Slabs
from jaxphys.mpm.loop.status import least
from jaxphys.mpm.state import Config, State

# A node costs a fiftieth of a particle, on several devices that add it up a twentieth, and a window
# is a program: seconds of compilation, as much as a film of some thousand steps takes to simulate.
# It is worth that where it leaves out so many nodes for each particle, a quarter of a step.
WORTH = 8
GROWTH, MARGIN = 1.1, 2  # room for what a frame adds: a share of the span, and nodes
MULTIPLE = 4  # few different windows, since each is compiled
FEWEST_OF_ONE_MEMORY = 3  # devices that have slabs; of two, windows are 3% faster
MIXING = 2  # planes by which the particles of two devices may mix further in a frame, at least


def extent(config: Config, position: Array) -> Array | None:
    """`Seen.below` of particles (3, N)."""
    return _extent(config, position) if config.follows else None


def _extent(config: Config, position: Array) -> Array:
    base = config.kernel.base_node(position, config.grid.spacing, config.grid.shape)
    return least(jnp.concatenate([base, -base]))


def hulls(config: Config, positions: list[Array]) -> Array:
    """`Seen.below` of each device, (S, 6), from places (K, 3, C) of each run in chunks."""
    found = []
    for position in positions:
        shares = position.reshape(config.parts, -1, *position.shape[1:])
        of_each = jnp.moveaxis(shares, 1, 2).reshape(config.parts, 3, -1)
        found.append(jax.vmap(partial(_extent, config))(of_each))
    return jnp.min(jnp.stack(found), axis=0)


def followed(config: Config, below: Array | None, origin: Array) -> Array:
    """First nodes of the window, or of the slabs, for the places after a step: as much room on
    either side.

    below: `Seen.below` before it; origin: the first nodes before it.
    """
    if below is None:
        return origin
    if config.slabs is not None:
        # Slabs differ in x alone.
        below = jnp.where(np.arange(6) % 3 == 0, below, jnp.min(below, axis=0))
    lowest, highest = below[..., :3], -below[..., 3:]
    shape = np.array(config.nodes, np.int32)
    room = np.array(config.grid.shape, np.int32) - shape
    free = shape - config.kernel.width - (highest - lowest)
    return jnp.clip(lowest - jnp.maximum(free, 0) // 2, 0, room)


def orders_for(config: Config, position: Array) -> tuple[Array, Array]:
    """`orders` of places (3, N) [m] for a rollout. Slabs must hold what lies in them, with room for
    a frame: particles are sorted where as they are they would not.
    """
    if config.slabs is None:
        return orders(position, config.grid, config.runs, config.kernel)
    as_they_are = jnp.arange(config.particles, dtype=jnp.int32)
    below = _hulls_in(config, position, as_they_are)
    settled = halo.holds(config, below, room=MIXING)
    return orders(position, config.grid, config.runs, config.kernel, settled)


def _hulls_in(config: Config, position: Array, order: Array) -> Array:
    position = jax.lax.stop_gradient(position)
    parts = cuts(config.runs, config.placement)
    return hulls(config, [cut(position, into, order) for into in parts])


def windowed(config: Config, state: State, *, slabs: bool | None = None) -> Config:
    """`config` with a window that has room for the particles of `state` and some motion, or with
    none where that would be no gain; and with slabs of it, where devices send less to each other
    with them. What it is depends on the state alone. Runs on the host.

    slabs: whether there may be any; None: where sending less also takes less time. There are none
        where objects have a velocity field each.
    """
    config = replace(config, window=None, slabs=None)
    config = replace(config, window=_window(config, state))
    if slabs is None:
        # Two that share a memory add windows up faster than they exchange bands.
        shared = jax.default_backend() == "cpu" and jax.process_count() == 1
        slabs = not shared or config.placement.devices >= FEWEST_OF_ONE_MEMORY
    slabs = slabs and config.fields == 1
    return replace(config, slabs=_slabs(config, state) if slabs else None)


def _window(config: Config, state: State) -> tuple[int, int, int] | None:
    nodes = config.fields * math.prod(config.grid.shape)
    worth = WORTH * config.particles
    if nodes < worth:
        return None
    wanted = _with_room(config, _span(config, state.position))
    shape = np.minimum([_of_few(int(count)) for count in wanted], config.grid.shape)
    if nodes - config.fields * math.prod(shape.tolist()) < max(worth, nodes // 2):
        return None
    x, y, z = shape.tolist()
    return x, y, z


def _slabs(config: Config, state: State) -> Slabs | None:
    devices = config.placement.devices
    if devices == 1 or config.nodes[0] < MULTIPLE * devices:  # slabs so thin that all share nodes
        return None
    # Neighbours that share as little as sorted particles do need not be sorted to be known.
    band = _rounded_up(2 * halo.MOVES + config.kernel.width + MIXING)
    trial = Slabs(config.nodes[0], (min(band, config.nodes[0]),))
    widest, overlaps = jax.device_get(_shares(replace(config, slabs=trial), state.position))
    planes = int(_with_room(config, widest - config.kernel.width))
    shared = overlaps + MIXING
    bands = tuple(int(_rounded_up(width)) for width in shared[: np.flatnonzero(shared > 0)[-1] + 1])
    if planes > config.nodes[0] or max(bands) > planes:
        return None
    found = Slabs(planes, bands)
    fewer = halo.sent_planes(replace(config, slabs=found)) < halo.sent_planes(config)
    return found if fewer else None


def _with_room(config: Config, span):
    """Nodes for a span of cells, with room for what a frame adds."""
    return _rounded_up(np.ceil(GROWTH * np.asarray(span) + config.kernel.width + MARGIN))


def _of_few(count: int) -> int:
    """The next of 8, 12, 16, 24, 32, 48, ...: a body that swings would otherwise have many windows,
    each of which is seconds of compilation, where a node is a small part of a particle.
    """
    size = 8
    while size < count:
        size = 3 * size // 2 if size & (size - 1) == 0 else 4 * size // 3
    return size


def _rounded_up(count):
    return np.maximum(np.ceil(np.asarray(count) / MULTIPLE), 1).astype(int) * MULTIPLE


@jax.jit(static_argnames="config")
def _span(config: Config, position):
    base = config.kernel.base_node(position, config.grid.spacing, config.grid.shape)
    return base.max(axis=1) - base.min(axis=1)


@jax.jit(static_argnames="config")
def _shares(config: Config, position):
    """Planes of the widest slab, and what slabs share, in the order that a rollout finds."""
    order, _ = orders_for(config, position)
    below = _hulls_in(config, position, order)
    return halo.widest(config, below), halo.overlaps(config, below)
