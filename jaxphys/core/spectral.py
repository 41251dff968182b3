"""Eigenvalues, rotations and isotropic functions of 3x3 matrices, with derivatives of their own.

Nothing here differentiates singular vectors, which are not unique where singular values meet: at
F = I, for one, where every simulation starts. A function that does not depend on their choice has
a derivative there all the same. In the principal frame its off-diagonal part is a divided
difference, whose limit is an ordinary derivative.

Arrays are (3, 3, ...), the particle axis last; see `core.algebra`.
"""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra

PAIRS = ((0, 1), (0, 2), (1, 2))


def sweeps_needed(dtype) -> int:
    """Cyclic Jacobi sweeps after which a 3x3 matrix of `dtype` is diagonal to round-off."""
    return 4 if jnp.finfo(dtype).bits <= 32 else 5


def _jacobi(A: Array, sweeps: int) -> tuple[Array, Array]:
    a = {(i, j): A[i, j] for i in range(3) for j in range(i, 3)}
    one, zero = jnp.ones_like(A[0, 0]), jnp.zeros_like(A[0, 0])
    Q = [[one if i == j else zero for j in range(3)] for i in range(3)]
    tiny = jnp.finfo(A.dtype).tiny
    for _ in range(sweeps):
        for p, q in PAIRS:
            r = 3 - p - q
            off = a[p, q]
            gap = a[q, q] - a[p, p]
            divisor = jnp.abs(gap) + jnp.sqrt(gap * gap + 4 * off * off) + tiny
            # The smaller of the two rotations has |tan| <= 1; the clip only acts where squares
            # underflow.
            tangent = jnp.clip(jnp.where(gap < 0, -2 * off, 2 * off) / divisor, -1, 1)
            c = jax.lax.rsqrt(1 + tangent * tangent)
            s = tangent * c
            a[p, p] = a[p, p] - tangent * off
            a[q, q] = a[q, q] + tangent * off
            a[p, q] = zero
            pr, qr = (min(p, r), max(p, r)), (min(q, r), max(q, r))
            a[pr], a[qr] = c * a[pr] - s * a[qr], s * a[pr] + c * a[qr]
            for row in Q:
                row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    return jnp.stack([a[i, i] for i in range(3)]), algebra.stack_matrix(Q)


def _to_frame(Q: Array, A: Array) -> Array:
    """Q^T A Q."""
    return algebra.matmul(algebra.transpose(Q), algebra.matmul(A, Q))


def _from_frame(Q: Array, A: Array) -> Array:
    """Q A Q^T."""
    return algebra.matmul_transpose(algebra.matmul(Q, A), Q)


def _from_principal(Q: Array, values: Array) -> Array:
    """Q diag(values) Q^T, each of the six different entries once."""
    scaled = [[Q[i, k] * values[k] for k in range(3)] for i in range(3)]
    entry = {
        (i, j): sum(scaled[i][k] * Q[j, k] for k in range(3)) for i in range(3) for j in range(i, 3)
    }
    return algebra.stack_matrix([[entry[min(i, j), max(i, j)] for j in range(3)] for i in range(3)])


@partial(jax.custom_jvp, nondiff_argnums=(1,))
def eigen_symmetric(A: Array, sweeps: int | None = None) -> tuple[Array, Array]:
    """Eigenvalues (3, ...), in no particular order, and eigenvectors (3, 3, ...) of symmetric (3,
    3, ...).

    `A = Q diag(w) Q^T` with the eigenvectors in the columns of Q. Cyclic Jacobi (Golub and Van Loan
    2013, section 8.5) with a fixed number of unrolled sweeps: no branch, no loop, and Q is
    orthogonal to round-off even for repeated eigenvalues. Only the upper triangle is read.

    Where eigenvalues are equal the derivative of Q is taken as zero: differentiate isotropic
    functions through `left_isotropic` instead, which is right there.

    Args:
        A: symmetric matrices.
        sweeps: how many; by default as many as the dtype needs.
    """
    return _jacobi(A, sweeps_needed(A.dtype) if sweeps is None else sweeps)


@eigen_symmetric.defjvp
def _eigen_symmetric_jvp(sweeps, primals, tangents):
    (A,), (dA,) = primals, tangents
    w, Q = eigen_symmetric(A, sweeps)
    D = _to_frame(Q, (dA + algebra.transpose(dA)) / 2)
    turn = jnp.zeros_like(D)
    for i, j in PAIRS:
        gap = w[j] - w[i]
        distinct = jnp.abs(gap) > jnp.finfo(A.dtype).eps * (jnp.abs(w[i]) + jnp.abs(w[j]))
        rate = jnp.where(distinct, D[i, j] / jnp.where(distinct, gap, 1), 0)
        turn = turn.at[i, j].set(rate).at[j, i].set(-rate)
    return (w, Q), (jnp.stack([D[i, i] for i in range(3)]), algebra.matmul(Q, turn))


def left_strain(F: Array) -> Array:
    """F F^T - I, formed from F - I so that small strains keep their digits. Shape (3, 3, ...)."""
    H = F - algebra.identity_like(F)
    return H + algebra.transpose(H) + algebra.matmul_transpose(H, H)


def volume_change(F: Array) -> Array:
    """det F - 1, formed from F - I so that small changes keep their digits. Shape (...)."""
    H = F - algebra.identity_like(F)
    minors = sum(H[i, i] * H[j, j] - H[i, j] * H[j, i] for i, j in PAIRS)
    return algebra.trace(H) + minors + algebra.determinant(H)


def _log_stretches(squares_minus_one: Array) -> Array:
    floor = 8 * jnp.finfo(squares_minus_one.dtype).eps
    return 0.5 * jnp.log1p(jnp.maximum(squares_minus_one, floor - 1))


def log_stretches(F: Array) -> Array:
    """Logarithms of the singular values of F, shape (3, ...), in no particular order.

    Values below sqrt(8 eps) (1e-3 in float32) are raised to it. Not for differentiation where two
    of them are equal.
    """
    return _log_stretches(eigen_symmetric(left_strain(F))[0])


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def left_isotropic(
    function: Callable, F: Array, arguments
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Isotropic functions of the left stretch of F, all from one eigen-decomposition.

    With F F^T = Q diag(exp(2 e)) Q^T, `function(e, arguments)` gives principal values and scalars,
    and this function gives `Q diag(values) Q^T` and the scalars. `function` must be symmetric in
    the three directions: exchanging two of `e` exchanges the same two of the principal values and
    leaves the scalars as they are.

    The derivative has, in the principal frame, ordinary derivatives on the diagonal and divided
    differences beside it (Bowen and Wang 1970; Ogden 1984, section 6.1), both right where stretches
    coincide. It knows F by F F^T alone, so an inverted F counts as its mirror image. Second
    derivatives are right only where the stretches differ.

    Args:
        function: (log stretches (3, ...), arguments) -> (tuple of (3, ...), tuple of (...));
            hashable.
        F: (3, 3, ...).
        arguments: any pytree of arrays that broadcast against (...); differentiated.

    Returns:
        tuple of symmetric (3, 3, ...) and tuple of (...).
    """
    w, Q = eigen_symmetric(left_strain(F))
    values, scalars = function(_log_stretches(w), arguments)
    return tuple(_from_principal(Q, v) for v in values), tuple(scalars)


@left_isotropic.defjvp
def _left_isotropic_jvp(function, primals, tangents):
    (F, arguments), (dF, darguments) = primals, tangents
    w, Q = eigen_symmetric(left_strain(F))
    e = _log_stretches(w)
    half = algebra.matmul_transpose(dF, F)
    D = _to_frame(Q, half + algebra.transpose(half))

    free = w > 8 * jnp.finfo(F.dtype).eps - 1
    de = jnp.stack([D[i, i] for i in range(3)]) * jnp.where(free, 0.5 * jnp.exp(-2 * e), 0)
    (values, scalars), (dvalues, dscalars) = jax.jvp(
        function, (e, arguments), (de.astype(e.dtype), darguments)
    )
    frames = [[[dv[i] if i == j else None for j in range(3)] for i in range(3)] for dv in dvalues]
    # Below this gap the derivative is nearer to the divided difference than what cancellation
    # leaves of it.
    near = jnp.finfo(F.dtype).eps ** (1 / 3)
    for i, j in PAIRS:
        gap = e[i] - e[j]
        close = jnp.abs(gap) < near
        safe = jnp.where(close, 1, gap)
        direction = jnp.zeros_like(e).at[i].set(1).at[j].set(-1)
        _, (slopes, _) = jax.jvp(lambda x: function(x, arguments), (e,), (direction,))
        # (e_i - e_j) / (exp(2 e_i) - exp(2 e_j)); gap / sinh(gap) by its series where it is close.
        ratio = jnp.where(close, 1 - gap * gap / 6, safe / jnp.sinh(safe))
        chain = 0.5 * jnp.exp(-e[i] - e[j]) * ratio
        for frame, value, slope in zip(frames, values, slopes, strict=True):
            difference = jnp.where(close, (slope[i] - slope[j]) / 2, (value[i] - value[j]) / safe)
            frame[i][j] = frame[j][i] = difference * chain * D[i, j]
    primal = tuple(_from_principal(Q, v) for v in values), tuple(scalars)
    tangent = tuple(_from_frame(Q, algebra.stack_matrix(f)) for f in frames), tuple(dscalars)
    return primal, tangent


@jax.custom_jvp
def polar_rotation(F: Array) -> Array:
    """The rotation nearest to F: R of F = R S, always with det R = +1. Shape (3, 3, ...).

    For inverted F the smallest singular value counts as negative, so R changes smoothly through
    inversion. It is not unique where the two smallest signed singular values add up to zero.

    Closed form of Markley (1993, "Attitude determination using vector observations: a fast optimal
    matrix algorithm", eq. 14-16) from the sum of the signed singular values, the largest root of a
    quartic: Newton's method from above (eq. 20), which descends monotonically. One step of Newton
        and Schulz removes what is left of the root's error. No
    decomposition. The derivative solves Z S + S Z = R^T dF - dF^T R for a skew Z, that is it
    divides by sums of singular values, and holds to every order.
    """
    size = jnp.sqrt(jnp.sum(F * F, axis=(0, 1)))
    usable = size > 0
    identity = algebra.identity_like(F)
    G = jnp.where(usable, F / jnp.where(usable, size, 1), identity / jnp.sqrt(3.0).astype(F.dtype))
    C, det = algebra.cofactor(G), algebra.determinant(G)
    squared = jnp.sum(G * G, axis=(0, 1))
    minors = jnp.sum(C * C, axis=(0, 1))
    tiny = jnp.finfo(F.dtype).tiny
    root = jnp.sqrt(3 * squared)
    for _ in range(8 if jnp.finfo(F.dtype).bits <= 32 else 12):
        excess = root * root - squared
        value = excess * excess - 8 * root * det - 4 * minors
        root = root - value / jnp.maximum(4 * root * excess - 8 * det, tiny)
    kappa = 0.5 * (root * root - squared)
    zeta = kappa * root - det
    GGtG = algebra.matmul(algebra.matmul_transpose(G, G), G)
    R = ((kappa + squared) * G + root * C - GGtG) / jnp.maximum(zeta, tiny)
    gram = algebra.matmul(algebra.transpose(R), R)
    return algebra.matmul(R, 1.5 * identity - 0.5 * gram)


@polar_rotation.defjvp
def _polar_rotation_jvp(primals, tangents):
    (F,), (dF,) = primals, tangents
    R = polar_rotation(F)
    S = algebra.matmul(algebra.transpose(R), F)
    W = algebra.matmul(algebra.transpose(R), dF)
    axial = jnp.stack([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]])
    sums = algebra.trace(S) * algebra.identity_like(S) - S
    sums = (sums + algebra.transpose(sums)) / 2
    product = algebra.determinant(sums)
    regular = jnp.abs(product) > jnp.finfo(F.dtype).tiny
    adjugate = algebra.cofactor(sums)
    z = jnp.where(regular, algebra.matvec(adjugate, axial) / jnp.where(regular, product, 1), 0)
    zero = jnp.zeros_like(z[0])
    Z = algebra.stack_matrix([[zero, -z[2], z[1]], [z[2], zero, -z[0]], [-z[1], z[0], zero]])
    return R, algebra.matmul(R, Z)
