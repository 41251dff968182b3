"""Dense 3x3 algebra written out element by element.

Every function takes arrays whose first one or two axes are the matrix or vector and whose other
axes are anything: `(3, 3)` for one
particle, `(3, 3, N)` for all of them. With the particle axis last, XLA vectorises each line over
particles; a batched `dot_general` of
3x3 matrices does not, and is what jaxlib 0.10.2 computes wrongly.
"""

from collections.abc import Iterable
from typing import cast

import jax
import jax.numpy as jnp
from jax import Array


def stack_matrix(rows) -> Array:
    """A (3, 3, ...) array from three rows of three equally shaped arrays."""
    return jnp.stack([jnp.stack(row) for row in rows])


def identity_like(A: Array) -> Array:
    """The identity, in the shape and dtype of `A` (3, 3, ...)."""
    eye = jnp.eye(3, dtype=A.dtype).reshape((3, 3) + (1,) * (A.ndim - 2))
    return jnp.broadcast_to(eye, A.shape)


def transpose(A: Array) -> Array:
    """Transpose of (3, 3, ...)."""
    return jnp.swapaxes(A, 0, 1)


def trace(A: Array) -> Array:
    """Trace of (3, 3, ...), shape (...)."""
    return A[0, 0] + A[1, 1] + A[2, 2]


def entries(A: Array) -> list[list[Array]]:
    """The nine entries of (3, 3, ...) as a list of three rows.

    Under reverse mode this turns back into one concatenation, where indexing `A[i, j]` entry by
    entry would turn into as many padded arrays to add up.
    """
    nine = jax.lax.split(A.reshape((9, *A.shape[2:])), (1,) * 9, axis=0)
    return [[nine[3 * i + j].reshape(A.shape[2:]) for j in range(3)] for i in range(3)]


def components(v: Array) -> list[Array]:
    """The three components of (3, ...), for the same reason as `entries`."""
    return [x.reshape(v.shape[1:]) for x in jax.lax.split(v, (1,) * 3, axis=0)]


def numbers(x: Array) -> list[Array]:
    """All components of (3, ...) or entries of (3, 3, ...), one after the other."""
    return components(x) if x.ndim == 2 else [entry for row in entries(x) for entry in row]


def matmul(A: Array, B: Array) -> Array:
    """A @ B for (3, 3, ...) arrays."""
    a, b = entries(A), entries(B)
    return stack_matrix(
        [[row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j] for j in range(3)] for row in a]
    )


def matmul_transpose(A: Array, B: Array) -> Array:
    """A @ B^T for (3, 3, ...) arrays."""
    a, b = entries(A), entries(B)
    return stack_matrix(
        [[row[0] * other[0] + row[1] * other[1] + row[2] * other[2] for other in b] for row in a]
    )


def total(terms: Iterable[Array]) -> Array:
    """Their sum; there is at least one."""
    return cast(Array, sum(terms))  # without one it would be the number 0


def matvec(A: Array, v: Array) -> Array:
    """A @ v for A (3, 3, ...) and v (3, ...)."""
    x, y, z = components(v)
    return jnp.stack([row[0] * x + row[1] * y + row[2] * z for row in entries(A)])


def outer(u: Array, v: Array) -> Array:
    """u v^T for u, v (3, ...)."""
    return u[:, None] * v[None, :]


def cofactor(A: Array) -> Array:
    """Cofactor matrix: det(A) A^-T, also where A is singular. Shape (3, 3, ...)."""
    a = entries(A)

    def minor(i: int, j: int) -> Array:
        (p, q), (s, t) = ((i + 1) % 3, (i + 2) % 3), ((j + 1) % 3, (j + 2) % 3)
        return a[p][s] * a[q][t] - a[p][t] * a[q][s]

    return stack_matrix([[minor(i, j) for j in range(3)] for i in range(3)])


def determinant(A: Array) -> Array:
    """Determinant of (3, 3, ...), shape (...)."""
    (a, b, c), (d, e, f), (g, h, i) = entries(A)
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def inverse(A: Array) -> Array:
    """Inverse of (3, 3, ...) by cofactors; infinite where A is singular."""
    return transpose(cofactor(A)) / determinant(A)
