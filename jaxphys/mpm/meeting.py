"""Contact between objects, each of which has a velocity field of its own on the grid.

Objects that share a field are one continuum wherever they share a node: they stick to each other
and resist being pulled apart. With a field each they know nothing of each other, and what is to
happen between them is said here, node by node (Bardenhagen, Brackbill and Sulsky 2000): two that
approach are brought to a common velocity along the normal, as much of their sliding is taken away
as Coulomb's law allows, and two that part are left alone. It is an impulse between equals: what one
gains the other loses, at the same node, so that momentum and angular momentum stay.

With several at one node, pairs come one after the other.

In order that momentum stays, the normal must be the same for both, though each sees its own: the
direction in which its mass falls off, averaged over where the other one is. At the edge of a block
that lies on a slab these differ. The block's falls off forwards as well, and with a normal that
leans forwards a block that slides would be driven into the slab, and braked. The slab's points up
all around. So the one that varies less around a node counts: each in inverse proportion to the
square of its variation, so that two that are alike are averaged.

A kernel reaches further than matter does, so that two objects share nodes while they are still two
cells apart. They touch where a node is full, which is where these shares add up to `TOUCH`. That
asks for no density, and holds of shells that are thinner than a cell, and of matter that has been
loosened, as well.
"""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.fields import NON_NEGATIVE, Checked
from jaxphys.mpm.boundaries.contact import shortened

TOUCH = 0.9
EVEN = 0.01  # variation of a direction, 1 - |mean of unit vectors|, that is as good as none


@dataclass(frozen=True)
class Meeting(Checked):
    """What happens where objects of a scene meet.

    Attributes:
        friction: Coulomb's coefficient between all of them, without a unit; 0 lets them slide.
    """

    friction: float = field(default=0.0, metadata=NON_NEGATIVE)


def meet(mass: Array, velocity: Array, lightest: Array, friction: Array | None) -> Array:
    """Velocities (3, K, nx, ny, nz) [m/s] of K objects' fields after contact between them.

    Args:
        mass: of the nodes (K, nx, ny, nz) [kg]; velocity: before, as what is returned.
        lightest: [kg] () nodes with no more of an object have none of it.
        friction: Coulomb's coefficient (), or None for none.
    """
    there = mass > lightest
    shares = mass / jnp.maximum(jnp.max(mass, axis=(1, 2, 3), keepdims=True), lightest)
    before, after = jnp.stack([jnp.stack(_beside(shares, axis)) for axis in (1, 2, 3)], axis=1)
    slopes = after - before
    first, second = np.triu_indices(len(mass), 1)

    def pair(velocity, which):
        a, b = which
        normal = _normal(shares[a], shares[b], slopes[:, a], slopes[:, b])
        inwards = normal > 0
        full = _share(shares[a], normal, jnp.where(inwards, before[:, a], after[:, a])) + _share(
            shares[b], normal, jnp.where(inwards, after[:, b], before[:, b])
        )
        touching = there[a] & there[b] & (full >= TOUCH)
        lost = _lost(velocity[:, a] - velocity[:, b], normal, friction)
        share = jnp.where(touching, 1 / jnp.where(touching, mass[a] + mass[b], 1), 0)
        gained = -mass[b] * share * lost, mass[a] * share * lost
        return velocity.at[:, a].add(gained[0]).at[:, b].add(gained[1]), None

    pairs = jnp.asarray(first, jnp.int32), jnp.asarray(second, jnp.int32)
    return jax.lax.scan(pair, velocity, pairs)[0]


def _lost(relative: Array, normal: Array, friction: Array | None) -> Array:
    """What two touching objects lose of the velocity of the first one relative to the second one,
    (3, ...) each; normal: from the first to the second.
    """
    along = jnp.sum(relative * normal, axis=0)
    closing = jnp.maximum(along, 0)
    lost = closing * normal
    if friction is None:
        return lost
    return lost + shortened(relative - along * normal, friction * closing)


def _normal(first: Array, second: Array, of_first: Array, of_second: Array) -> Array:
    """Unit normals (3, nx, ny, nz) from one object to another; 0 where there is no direction.

    first, second: what the nodes hold of each; of_first, of_second: how that grows on each axis.
    """
    out_of_first, weight = _facing(second, -of_first)
    into_second, other_weight = _facing(first, of_second)
    return _unit(weight * out_of_first + other_weight * into_second)[0]


def _facing(there: Array, slope: Array) -> tuple[Array, Array]:
    """The mean direction (3, ...) around each node of an object's slope, as far as another object
    is there, and what it counts, (...): the more, the less it varies.
    """
    direction, of_mean = _unit(_around(there * slope))
    mean = _around(there * _unit(slope)[1])
    varies = 1 - of_mean / jnp.where(mean > 0, mean, 1)
    return direction, 1 / (varies**2 + EVEN**2)


def _unit(vectors: Array) -> tuple[Array, Array]:
    """Vectors (3, ...) over their lengths, and the lengths (...); 0 where there is no direction."""
    square = jnp.sum(vectors**2, axis=0)
    some = square > 0
    inverse = jnp.where(some, jax.lax.rsqrt(jnp.where(some, square, 1)), 0)
    return vectors * inverse, square * inverse


def _around(nodes: Array) -> Array:
    """Means (..., nx, ny, nz) over each node and its neighbours, a half and a quarter an axis."""
    for axis in (-3, -2, -1):
        before, after = _beside(nodes, axis)
        nodes = nodes / 2 + (before + after) / 4
    return nodes


def _share(mass: Array, normal: Array, inner: Array) -> Array:
    """Mass over that a cell further inside along the normal, or 1 where that is less.

    inner: (3, ...) the mass at the next node inwards on each axis.
    """
    deeper = jnp.maximum(mass, jnp.sum(normal**2 * inner, axis=0))
    return mass / jnp.where(deeper > 0, deeper, 1)


def _beside(nodes: Array, axis: int) -> tuple[Array, Array]:
    """Values at the nodes before and after each along an axis; 0 beyond the ends."""
    axis %= nodes.ndim
    count = nodes.shape[axis]
    padded = jnp.pad(nodes, [(1, 1) if a == axis else (0, 0) for a in range(nodes.ndim)])
    before, after = (
        jax.lax.slice_in_dim(padded, first, first + count, axis=axis) for first in (0, 2)
    )
    return before, after
