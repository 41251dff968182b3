"""The two sums as functions of the particles' places, with the transposes of `sums` as their rules
of reverse mode. For programs that are differentiated as they stand, where a pass with a rule of its
own would be a second loop.
"""

from functools import partial

import jax
from jax import Array

from jaxphys.mpm.transfer.stencil import Window, stencil
from jaxphys.mpm.transfer.sums import gather, gather_slopes, scatter, scatter_transpose


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def to_nodes(
    window: Window,
    origin: Array,
    position: Array,
    rows: Array,
    mass: Array | None,
    momentum: Array,
    affine: Array,
) -> Array:
    """`scatter` from particles at `position` (3, N) [m]; origin: (3,) int32 of the window."""
    return scatter(window, stencil(window, origin, position), rows, mass, momentum, affine)


def _to_nodes_forward(window, origin, position, rows, mass, momentum, affine):
    kept = origin, position, mass, momentum, affine
    return to_nodes(window, origin, position, rows, mass, momentum, affine), kept


def _to_nodes_backward(window, kept, rows):
    origin, position, mass, momentum, affine = kept
    at = stencil(window, origin, position)
    place, heavy, *others = scatter_transpose(window, at, rows, mass, momentum, affine)
    return None, place, rows, None if mass is None else heavy, *others


to_nodes.defvjp(_to_nodes_forward, _to_nodes_backward)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def to_particles(
    window: Window, origin: Array, position: Array, rows: Array
) -> tuple[Array, Array]:
    """The first three rows (3, N) of the sums of `gather` at particles (3, N) [m], and their
    moments (3, 3, N).
    """
    sums, moment = gather(window, stencil(window, origin, position), rows)
    return sums[:3], moment


def _to_particles_forward(window, origin, position, rows):
    sums, moment = to_particles(window, origin, position, rows)
    return (sums, moment), (origin, position, rows, sums)


def _to_particles_backward(window, kept, cotangents):
    origin, position, rows, sums = kept
    at = stencil(window, origin, position)
    place = gather_slopes(window, at, rows, sums, *cotangents)
    return None, place, scatter(window, at, 0 * rows, None, *cotangents)


to_particles.defvjp(_to_particles_forward, _to_particles_backward)
