"""Small symmetric matrices as their upper triangles: (n (n + 1) / 2, ...) arrays, row by row."""

import math
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra


@cache
def triangle(n: int) -> tuple[tuple[int, int], ...]:
    """(row, column) of each packed entry."""
    return tuple((i, j) for i in range(n) for j in range(i, n))


@cache
def places(n: int) -> np.ndarray:
    """Where entry (i, j) is in the packed ones, (n, n) int."""
    found = np.zeros((n, n), int)
    for k, (i, j) in enumerate(triangle(n)):
        found[i, j] = found[j, i] = k
    return found


def size(packed: Array) -> int:
    """n of packed matrices."""
    return math.isqrt(2 * len(packed))


def pack(full: Array) -> Array:
    """The upper triangles of (n, n, ...)."""
    return jnp.stack([full[i, j] for i, j in triangle(len(full))])


def split(packed: Array) -> list[Array]:
    """The packed entries one by one, each (...)."""
    parts = jax.lax.split(packed, (1,) * len(packed), axis=0)
    return [x.reshape(packed.shape[1:]) for x in parts]


def multiply(packed: Array, vector: list[Array]) -> list[Array]:
    """The matrices times vectors, n arrays (...) each."""
    m, place = split(packed), places(len(vector))
    return [algebra.total(m[k] * x for k, x in zip(row, vector, strict=True)) for row in place]


def positive(packed: Array) -> Array:
    """The nearest positive semi-definite matrices: negative eigenvalues become zero."""
    n = size(packed)
    full = jnp.moveaxis(packed[places(n).reshape(-1)], 0, -1)
    w, Q = jnp.linalg.eigh(full.reshape(*full.shape[:-1], n, n))
    whole = (Q * jnp.maximum(w, 0)[..., None, :]) @ jnp.swapaxes(Q, -1, -2)
    return pack(jnp.moveaxis(whole, (-2, -1), (0, 1)))


def inverse(packed: Array) -> Array:
    """Inverses of positive definite 3 x 3 matrices (6, ...), of any scale; of zero, zero."""
    a, b, c, d, e, f = split(packed)
    scale = a + d + f
    there = scale > 0
    share = jnp.where(there, 1 / jnp.where(there, scale, 1), 0)
    a, b, c, d, e, f = (x * share for x in (a, b, c, d, e, f))
    minors = jnp.stack(
        [d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b]
    )
    determinant = a * minors[0] + b * minors[1] + c * minors[2]
    sound = determinant > 0
    # A matrix that rounding has made singular is inverted as a multiple of the identity.
    eye = jnp.asarray([1, 0, 0, 1, 0, 1], packed.dtype).reshape(6, *[1] * (packed.ndim - 1))
    return share * jnp.where(sound, minors / jnp.where(sound, determinant, 1), eye)
