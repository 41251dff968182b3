"""Dense 3x3 algebra written out element by element.

Every function takes arrays whose first one or two axes are the matrix or vector and whose other
axes are anything: `(3, 3)` for one
particle, `(3, 3, N)` for all of them. With the particle axis last, XLA vectorises each line over
particles; a batched `dot_general` of
3x3 matrices does not, and is what jaxlib 0.10.2 computes wrongly.
"""

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


def matmul(A: Array, B: Array) -> Array:
    """A @ B for (3, 3, ...) arrays."""
    return stack_matrix(
        [
            [A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j] for j in range(3)]
            for i in range(3)
        ]
    )


def matmul_transpose(A: Array, B: Array) -> Array:
    """A @ B^T for (3, 3, ...) arrays."""
    return stack_matrix(
        [
            [A[i, 0] * B[j, 0] + A[i, 1] * B[j, 1] + A[i, 2] * B[j, 2] for j in range(3)]
            for i in range(3)
        ]
    )


def matvec(A: Array, v: Array) -> Array:
    """A @ v for A (3, 3, ...) and v (3, ...)."""
    return jnp.stack([A[i, 0] * v[0] + A[i, 1] * v[1] + A[i, 2] * v[2] for i in range(3)])


def outer(u: Array, v: Array) -> Array:
    """u v^T for u, v (3, ...)."""
    return u[:, None] * v[None, :]


def cofactor(A: Array) -> Array:
    """Cofactor matrix: det(A) A^-T, also where A is singular. Shape (3, 3, ...)."""

    def minor(i: int, j: int) -> Array:
        (a, b), (c, d) = ((i + 1) % 3, (i + 2) % 3), ((j + 1) % 3, (j + 2) % 3)
        return A[a, c] * A[b, d] - A[a, d] * A[b, c]

    return stack_matrix([[minor(i, j) for j in range(3)] for i in range(3)])


def determinant(A: Array) -> Array:
    """Determinant of (3, 3, ...), shape (...)."""
    return (
        A[0, 0] * (A[1, 1] * A[2, 2] - A[1, 2] * A[2, 1])
        - A[0, 1] * (A[1, 0] * A[2, 2] - A[1, 2] * A[2, 0])
        + A[0, 2] * (A[1, 0] * A[2, 1] - A[1, 1] * A[2, 0])
    )


def inverse(A: Array) -> Array:
    """Inverse of (3, 3, ...) by cofactors; infinite where A is singular."""
    return transpose(cofactor(A)) / determinant(A)
