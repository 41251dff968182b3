"""How particles lie in chunks while they are stepped.

Outside of the loop a quantity is one array, particle axis last. Inside it is cut into chunks, chunk
axis first: (K, ..., C), one array for each segment, since a segment has a law of its own. What is
left over in a segment's last chunks repeats its last particle, without mass and without a number.
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.transfer.kernels import QUADRATIC, Kernel

LANES = 16  # chunks are multiples of it, as vector units want
MIXED = 1 / 8  # share of steps back in the order, from which on sorting pays


class Cut(NamedTuple):
    """How one segment is cut. Static.

    start, stop: its particles; chunks: how many; size: particles in each, the last ones not full.
    """

    start: int
    stop: int
    chunks: int
    size: int

    @property
    def particles(self) -> int:
        """How many it has."""
        return self.stop - self.start


def cuts(segments: tuple, placement: Placement) -> tuple[Cut, ...]:
    """One `Cut` for each (law, start, stop): the same number of chunks on each device, and chunks
    of one size that leaves as few places empty as whole vectors allow.
    """
    found = []
    for _, start, stop in segments:
        count = stop - start
        share = math.ceil(count / placement.devices)
        rounds = math.ceil(share / min(placement.chunk or share, share))
        size = math.ceil(count / (placement.devices * rounds))
        if rounds > 1:
            size = LANES * math.ceil(size / LANES)
        found.append(Cut(start, stop, placement.devices * rounds, size))
    return tuple(found)


def cut(tree: Any, into: Cut, order: Array, *, empty: bool = False) -> Any:
    """Arrays (..., N) of a pytree as (K, ..., C), the particles of one segment.

    order: (N,) which particle comes at each place; empty: zeros, not the last particle, in what is
    left over.
    """
    place = jnp.arange(into.chunks * into.size)
    index = order[into.start + jnp.minimum(place, into.particles - 1)]

    def one(x: Array) -> Array:
        x = x.at[..., index].get(mode="promise_in_bounds", wrap_negative_indices=False)
        if empty and into.chunks * into.size > into.particles:
            x = jnp.where(place < into.particles, x, jnp.zeros((), x.dtype))
        return jnp.moveaxis(x.reshape(*x.shape[:-1], into.chunks, into.size), -2, 0)

    return jax.tree.map(one, tree)


def numbers(into: Cut, order: Array) -> Array:
    """The particles (K, C) int32 in the chunks of a segment; -1 where there is none."""
    place = jnp.arange(into.chunks * into.size)
    index = order[into.start + jnp.minimum(place, into.particles - 1)]
    found = jnp.where(place < into.particles, index, -1).astype(jnp.int32)
    return found.reshape(into.chunks, into.size)


def joined(parts: list[Any], cuts: tuple[Cut, ...], inverse: Array) -> Any:
    """Arrays (..., N) of pytrees of (K, ..., C), one for each segment. inverse: (N,), the place at
    which each particle is.
    """

    def one(*chunks: Array) -> Array:
        flat = []
        for x, into in zip(chunks, cuts, strict=True):
            x = jnp.moveaxis(x, 0, -2)
            x = x.reshape(*x.shape[:-2], into.chunks * into.size)
            flat.append(x[..., : into.particles])
        whole = flat[0] if len(flat) == 1 else jnp.concatenate(flat, axis=-1)
        return whole.at[..., inverse].get(
            mode="promise_in_bounds", wrap_negative_indices=False, unique_indices=True
        )

    return jax.tree.map(one, *parts)


def orders(
    position: Array,
    grid: Grid,
    segments: tuple,
    kernel: Kernel = QUADRATIC,
    settled: Array | None = None,
) -> tuple[Array, Array]:
    """(order, inverse), (N,) int32 each: which particle comes at each place, and at which place
    each particle is. By grid cell within a segment, where they have mixed so far that sorting pays
    or are not `settled`; as they are otherwise.

    position: (3, N) [m]; settled: () bool.
    """
    count = position.shape[1]
    base = jax.lax.stop_gradient(kernel.base_node(position, grid.spacing, grid.shape))
    _, ny, nz = grid.shape
    key = (base[0] * ny + base[1]) * nz + base[2]
    # A step back in a sorted order that is no small one. Bodies that deform have few of them.
    back = jnp.any(jnp.abs(jnp.diff(base, axis=1)) > 2, axis=0) & (jnp.diff(key) < 0)
    as_they_are = jnp.arange(count, dtype=jnp.int32)

    def by_cell():
        runs = [
            start + jnp.argsort(key[start:stop], stable=True).astype(jnp.int32)
            for _, start, stop in segments
        ]
        order = jnp.concatenate(runs)
        return order, jnp.zeros_like(order).at[order].set(as_they_are, unique_indices=True)

    mixed = jnp.sum(back) > MIXED * count
    if settled is not None:
        mixed = mixed | ~settled
    return jax.lax.cond(mixed, by_cell, lambda: (as_they_are, as_they_are))
