"""What devices with a slab of the grid each tell their neighbours.

    planes of device d      t_d ........ lo_d-1 ====particles==== hi_d+4 ........ t_d + planes
    planes of device d + 1            t_d+1 ..... lo_d+1 - 1 ====particles====

Particles are sorted by x first, so that a device's are a slab already, but they go where they like
from then on: between two sorts slabs overlap by more and more, and their ends move. Each device
therefore knows the lowest and the highest `base_node` of all of them before a step (lo and hi). In
the step they move by a cell at most and give to three nodes an axis (cubic splines to four), so
that two devices share planes from lo - 1 of the later one to hi + 3 of the earlier one. A band of a
static number of planes that begins there is what they exchange, and add. It is as wide on either
side: the way back is the very same exchange of cotangents.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.loop.placement import APART, AXIS, EVERYWHERE, Slabs
from jaxphys.mpm.state import Config

MOVES = 1  # cells that a particle moves in a step, at most; or the step has failed
NUMBER = 4  # bytes of a float32


class Bands(NamedTuple):
    """Where the slabs of S devices overlap. int32, in planes of the grid.

    before: (S,) first plane that a device shares with any of those before it; after: (S, hops),
    with the next ones; highest: (S,) highest `base_node` for which the bands have room.
    """

    before: Array
    after: Array
    highest: Array


def where(config: Config):
    """Where rows of nodes are, and what belongs to them: on every device its own, or the same."""
    return EVERYWHERE if config.slabs is None else APART


def bands(config: Config, below: Array | None) -> Bands | None:
    """The bands of a step, or None where there are no slabs.

    below: (S, 6), `Seen.below` of each device.
    """
    slabs = config.slabs
    if slabs is None or below is None:
        return None
    after, there = _later(below[:, 0])
    ends = after - MOVES + _widths(slabs, config.parts)
    least = jnp.where(there, ends - config.kernel.width - MOVES, config.grid.shape[0])
    return Bands(below[:, 0] - MOVES, after[:, : len(slabs.bands)] - MOVES, jnp.min(least, axis=1))


def highest(config: Config, origin: Array, bands: Bands | None) -> Array:
    """Highest `base_node` (3,) of particles for which this device's part of the grid has room."""
    room = origin + jnp.array(config.nodes, jnp.int32) - config.kernel.width
    return room if bands is None else room.at[0].min(bands.highest[0])


def overlaps(config: Config, below: Array) -> Array:
    """Planes (S - 1,) that devices share at most with the one 1, 2, ... after them, if a step moves
    their particles; not positive where none.
    """
    after, there = _later(below[:, 0])
    shared = -below[:, 3:4] - after + config.kernel.width + 2 * MOVES
    return jnp.max(jnp.where(there, shared, jnp.iinfo(jnp.int32).min), axis=0)


def widest(config: Config, below: Array) -> Array:
    """Planes () of the widest slab that holds the particles of its device."""
    return jnp.max(-below[:, 3] - below[:, 0]) + config.kernel.width


def holds(config: Config, below: Array, room: int) -> Array:
    """Whether slabs hold the particles, and each slab and band has `room` planes more: () bool."""
    slabs = config.slabs
    assert slabs is not None
    fit = jnp.all(overlaps(config, below) + room <= _widths(slabs, len(below)))
    return fit & (widest(config, below) + room <= slabs.planes)


def _widths(slabs: Slabs, devices: int) -> Array:
    """Planes (S - 1,) of the bands with the device 1, 2, ... after each; 0 where there is none."""
    return jnp.array([*slabs.bands, *(0,) * (devices - 1 - len(slabs.bands))], jnp.int32)


def _later(lowest: Array) -> tuple[Array, Array]:
    """`lowest` (S,) of the devices 1, 2, ... after each, (S, S - 1), and whether there are any."""
    devices = len(lowest)
    index = jnp.arange(devices)[:, None] + jnp.arange(1, devices)
    there = index < devices
    return lowest[jnp.minimum(index, devices - 1)], there


def exchanged(config: Config, origin: Array, bands: Bands, rows: Array) -> Array:
    """Rows (M, C) of this device's slab, and on them what the others have of the same nodes.

    Within `placement.spread`: origin (3,), bands and rows are this device's own. A sum of its
    copies for every node: symmetric, so that it is its own transpose. Where three devices share a
    node their copies may differ by a rounding.
    """
    slabs, devices = config.slabs, config.placement.devices
    assert slabs is not None
    planes = rows.reshape(slabs.planes, -1)

    def band(start: Array, count: int) -> Array:
        """Planes of the own slab; those before it, which must not count from its end, are none."""
        index = start - origin[0] + jnp.arange(count)
        return jnp.where(index < 0, slabs.planes, index)

    arrived = []
    for hop, count in enumerate(slabs.bands, start=1):
        before = band(bands.before[0], count)
        after = band(bands.after[0, hop - 1], count)
        there = [(device, device + hop) for device in range(devices - hop)]
        back = [(later, device) for device, later in there]
        for to_send, pairs, to_add in ((after, there, before), (before, back, after)):
            sent = planes.at[to_send].get(mode="fill", fill_value=0)
            arrived.append((to_add, jax.lax.ppermute(sent, AXIS, pairs)))
    for index, band_rows in arrived:
        planes = planes.at[index].add(band_rows, mode="drop")
    return planes.reshape(rows.shape)


def total(config: Config, origin: Array, bands: Bands | None, rows: Array | None, wrench: Any):
    """(rows, wrench) of all particles, where this device has those of its own: rows (M, C) and a
    pytree, or None, of the last pass.
    """
    if rows is None or config.placement.devices == 1:
        return rows, wrench
    if bands is None:
        return jax.lax.psum((rows, wrench), AXIS)
    rows = exchanged(config, origin, bands, rows)
    return rows, wrench if wrench is None else jax.lax.psum(wrench, AXIS)


def sent_planes(config: Config) -> float:
    """Planes of the window across x that a device sends in a step: both its bands, or its share in
    adding windows up (a ring: twice all but its own part of the window).
    """
    devices, slabs = config.placement.devices, config.slabs
    if slabs is None:
        return 2 * (devices - 1) / devices * config.nodes[0]
    return max(
        sum(
            count * ((device >= hop) + (device + hop < devices))
            for hop, count in enumerate(slabs.bands, start=1)
        )
        for device in range(devices)
    )


def sent_bytes(config: Config) -> int:
    """Bytes that a device sends to others in a step in float32, at most."""
    plane = config.fields * config.nodes[1] * config.nodes[2] * config.columns * NUMBER
    return round(sent_planes(config) * plane)
