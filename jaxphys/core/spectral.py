"""Eigenvalues, rotations and isotropic functions of 3x3 matrices, with derivatives of their own.

Nothing here differentiates singular vectors, which are not unique where singular values meet: at
F = I, for one, where every simulation starts. A function that does not depend on their choice has
a derivative there all the same. In the principal frame its off-diagonal part is a divided
difference, whose limit is an ordinary derivative.

Arrays are (3, 3, ...), the particle axis last; see `core.algebra`.
"""

import math
from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
from jax import Array
from jax.lax import optimization_barrier

from jaxphys.core import algebra
from jaxphys.core.program import part

PAIRS = ((0, 1), (0, 2), (1, 2))
# Where a choice may fall either way it is made this far from the tie. Symmetric strains lie on
# ties, up to rounding, and a compiler that forms a number anew for each of its uses may round it to
# one side in one and to the other in the next: half of one choice with half of the other is an
# answer to neither.
ASIDE = 0.0317


def _to_frame(Q: Array, A: Array) -> Array:
    """Q^T A Q."""
    half = optimization_barrier(algebra.matmul(A, Q))
    return optimization_barrier(algebra.matmul(algebra.transpose(Q), half))


def _from_frame(Q: Array, A: Array) -> Array:
    """Q A Q^T."""
    half = optimization_barrier(algebra.matmul(Q, A))
    return algebra.matmul_transpose(half, Q)


def _from_principal(Q: Array, values: Array) -> Array:
    """Q diag(values) Q^T, each of the six different entries once."""
    q, w = algebra.entries(Q), algebra.components(values)
    scaled = [[q[i][k] * w[k] for k in range(3)] for i in range(3)]
    entry = {(i, j): _dot(scaled[i], q[j]) for i in range(3) for j in range(i, 3)}
    return algebra.stack_matrix([[entry[min(i, j), max(i, j)] for j in range(3)] for i in range(3)])


def _dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _isolated_root(half_determinant: Array) -> Array:
    """The root of x^3 = 3 x + 2 h that is farthest from the other two, for h in [-1, 1], or nearly.

    Its size lies in [sqrt(3), 2], where Newton's method, started from a parabola through the ends,
    is right to round-off after three (float32) or four steps, and where x hardly depends on errors
    of h.
    """
    # At h = 0, the pure shear, both ends are as far.
    sign = jnp.where(half_determinant < -ASIDE, -1, 1).astype(half_determinant.dtype)
    h = jnp.minimum(sign * half_determinant, 1)
    x = math.sqrt(3) + h * (1 / 3 - h * (math.sqrt(3) - 5 / 3))
    for _ in range(3 if jnp.finfo(h.dtype).bits <= 32 else 4):
        x = x - (x * (x * x - 3) - 2 * h) / (3 * (x * x - 1))
    return sign * x


@jax.custom_jvp
@part("eigen-decomposition")
def eigen_symmetric(A: Array) -> tuple[Array, Array]:
    """Eigenvalues (3, ...), in no particular order, and eigenvectors (3, 3, ...) of symmetric (3,
    3, ...).

    `A = Q diag(w) Q^T` with the eigenvectors in the columns of Q. Direct, without iteration to
    convergence and without branches, and as accurate as Jacobi's method, also where eigenvalues are
    close (Eberly 2014, "A robust eigensolver for 3x3 symmetric matrices"): the eigenvalue farthest
    from the other two is a well-conditioned root of the characteristic polynomial and its
    eigenvector the largest row of a cofactor matrix; what is left is one 2x2 rotation in the plane
    across it (basis of that plane: Duff et al. 2017). Errors are a few eps of the largest deviation
    from A's mean eigenvalue. Only the upper triangle is read.

    Where eigenvalues are equal the derivative of Q is taken as zero: differentiate isotropic
    functions through `left_isotropic` instead, which is right there.
    """
    # The barriers keep XLA from fusing, and so repeating, all that comes before into each array
    # that comes after; its CPU backend drops them first, so that nothing may hang on them.
    limits = jnp.finfo(A.dtype)
    (a, f, e), (_, b, d), (_, _, c) = algebra.entries(A)
    mean = (a + b + c) / 3
    diagonal = [a - mean, b - mean, c - mean]
    # Once more, for what round-off left of the trace where A is nearly a multiple of the identity.
    rest = (diagonal[0] + diagonal[1] + diagonal[2]) / 3
    mean, diagonal = mean + rest, [entry - rest for entry in diagonal]
    beside = [d, e, f]
    square = (_dot(diagonal, diagonal) + 2 * _dot(beside, beside)) / 6
    isotropic = square < limits.tiny / limits.eps**2
    size = jnp.where(isotropic, 0, jnp.sqrt(jnp.where(isotropic, 1, square)))
    scale = jnp.where(isotropic, 0, jax.lax.rsqrt(jnp.where(isotropic, 1, square)))
    scale, size, mean = optimization_barrier((scale, size, mean))

    # G = (A - mean I) / size has the characteristic polynomial x^3 - 3 x - det G.
    a, b, c, d, e, f = (x * scale for x in (*diagonal, *beside))
    G = ((a, f, e), (f, b, d), (e, d, c))
    half = 0.5 * (a * (b * c - d * d) - f * (f * c - d * e) + e * (f * d - b * e))
    x = optimization_barrier(_isolated_root(optimization_barrier(half)))
    p, q, r = a - x, b - x, c - x
    C00, C11, C22 = q * r - d * d, p * r - e * e, p * q - f * f
    C12, C02, C01 = e * f - p * d, d * f - q * e, d * e - r * f
    C00, C11, C22, C12, C02, C01 = optimization_barrier((C00, C11, C22, C12, C02, C01))
    nearly = 1 - ASIDE
    first = (nearly * C11 <= C00) & (nearly * C22 <= C00)
    second = ~first & (nearly * C22 <= C11)
    v = [
        jnp.where(first, C00, jnp.where(second, C01, C02)),
        jnp.where(first, C01, jnp.where(second, C11, C12)),
        jnp.where(first, C02, jnp.where(second, C12, C22)),
    ]
    shorten = optimization_barrier(jax.lax.rsqrt(_dot(v, v)))
    v = [component * shorten for component in v]

    sign = jnp.where(v[2] < -ASIDE, -1, 1).astype(A.dtype)
    v, sign, slope = optimization_barrier((v, sign, -1 / (sign + v[2])))
    product = v[0] * v[1] * slope
    s = [1 + sign * v[0] * v[0] * slope, sign * product, -sign * v[0]]
    t = [product, sign + v[1] * v[1] * slope, -v[1]]
    s, t, G = optimization_barrier((s, t, G))
    Gt = [_dot(row, t) for row in G]
    vv, ss = (_dot(u, [_dot(row, u) for row in G]) for u in (v, s))
    vv, ss, tt, st = optimization_barrier((vv, ss, _dot(t, Gt), _dot(s, Gt)))
    gap = tt - ss
    side = jnp.where(gap < -ASIDE * jnp.abs(st), -1, 1).astype(A.dtype)
    tangent = 2 * st / (gap + side * (jnp.sqrt(gap * gap + 4 * st * st) + limits.tiny))
    # Not above it in size but where squares underflow.
    tangent = jnp.clip(tangent, -1 - ASIDE, 1 + ASIDE)
    tangent, cosine = optimization_barrier((tangent, jax.lax.rsqrt(1 + tangent * tangent)))
    sine = tangent * cosine
    w = [mean + size * vv, mean + size * (ss - tangent * st), mean + size * (tt + tangent * st)]
    Q = [[v[i], cosine * s[i] - sine * t[i], sine * s[i] + cosine * t[i]] for i in range(3)]
    w, Q = optimization_barrier((w, Q))
    return jnp.stack(w), algebra.stack_matrix(Q)


@eigen_symmetric.defjvp
def _eigen_symmetric_jvp(primals, tangents):
    (A,), (dA,) = primals, tangents
    w, Q = eigen_symmetric(A)
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
    (a, b, c), (d, e, f), (g, h, i) = algebra.entries(H)
    minors = (a * e - b * d) + (a * i - c * g) + (e * i - f * h)
    return a + e + i + minors + algebra.determinant(H)


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
    w, Q = eigen_symmetric(optimization_barrier(left_strain(F)))
    logs = optimization_barrier(_log_stretches(w))
    values, scalars = optimization_barrier(function(logs, arguments))
    return tuple(_from_principal(Q, v) for v in values), tuple(scalars)


@left_isotropic.defjvp
def _left_isotropic_jvp(function, primals, tangents):
    (F, arguments), (dF, darguments) = primals, tangents
    w, Q = eigen_symmetric(optimization_barrier(left_strain(F)))
    e = optimization_barrier(_log_stretches(w))
    half = optimization_barrier(algebra.matmul_transpose(dF, F))
    strain = _to_frame(Q, half + algebra.transpose(half))

    free = w > 8 * jnp.finfo(F.dtype).eps - 1
    slope = optimization_barrier(jnp.where(free, 0.5 * jnp.exp(-2 * e), 0))
    D = algebra.entries(strain)
    de = jnp.stack([D[i][i] for i in range(3)]) * slope
    (values, scalars), (dvalues, dscalars) = jax.jvp(function, (e, arguments), (de, darguments))
    values, scalars = optimization_barrier((values, scalars))
    dvalues, dscalars = optimization_barrier((dvalues, dscalars))
    diagonals = [algebra.components(dv) for dv in dvalues]
    frames = [[[dv[i] if i == j else None for j in range(3)] for i in range(3)] for dv in diagonals]
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
            frame[i][j] = frame[j][i] = optimization_barrier(difference * chain) * D[i][j]
    primal = tuple(_from_principal(Q, v) for v in values), scalars
    tangent = tuple(
        _from_frame(Q, optimization_barrier(algebra.stack_matrix(frame))) for frame in frames
    )
    return primal, (tangent, dscalars)


@jax.custom_jvp
@part("polar rotation")
def polar_rotation(F: Array) -> Array:
    """The rotation nearest to F: R of F = R S, always with det R = +1. Shape (3, 3, ...).

    For inverted F the smallest singular value counts as negative, so R changes smoothly through
    inversion. It is not unique where the two smallest signed singular values add up to zero.

    Closed form of Markley (1993, "Attitude determination using vector observations: a fast optimal
    matrix algorithm", eq. 14-16) from the sum of the signed singular values, the largest root of a
    quartic: Newton's method from above (eq. 20), which descends monotonically. One step of Newton
    and Schulz removes what is left of the root's error; in float32, digits are still lost where the
    two smallest signed singular values nearly cancel. No decomposition. The derivative solves
    Z S + S Z = R^T dF - dF^T R for a skew Z, that is it divides by sums of singular values, and
    holds to every order.
    """
    C, det = algebra.cofactor(F), algebra.determinant(F)
    squared = jnp.sum(F * F, axis=(0, 1))
    minors = jnp.sum(C * C, axis=(0, 1))
    FFt = algebra.matmul_transpose(F, F)
    C, det, squared, minors, FFt = optimization_barrier((C, det, squared, minors, FFt))
    tiny = jnp.finfo(F.dtype).tiny
    root = jnp.sqrt(3 * squared)
    for _ in range(8 if jnp.finfo(F.dtype).bits <= 32 else 12):
        excess = root * root - squared
        value = excess * excess - 8 * root * det - 4 * minors
        root = root - value / jnp.maximum(4 * root * excess - 8 * det, tiny)
    kappa = 0.5 * (root * root - squared)
    shorten = 1 / jnp.maximum(kappa * root - det, tiny)
    root, kappa, shorten = optimization_barrier((root, kappa, shorten))
    R = ((kappa + squared) * F + root * C - algebra.matmul(FFt, F)) * shorten
    R = optimization_barrier(R)
    gram = optimization_barrier(algebra.matmul(algebra.transpose(R), R))
    return 1.5 * R - 0.5 * algebra.matmul(R, gram)


@polar_rotation.defjvp
def _polar_rotation_jvp(primals, tangents):
    (F,), (dF,) = primals, tangents
    R = optimization_barrier(polar_rotation(F))
    S = optimization_barrier(algebra.matmul(algebra.transpose(R), F))
    W = optimization_barrier(algebra.matmul(algebra.transpose(R), dF))
    (_, b, c), (d, _, f), (g, h, _) = algebra.entries(W)
    axial = jnp.stack([h - f, c - g, d - b])
    sums = algebra.trace(S) * algebra.identity_like(S) - (S + algebra.transpose(S)) / 2
    sums = optimization_barrier(sums)
    product = algebra.determinant(sums)
    regular = jnp.abs(product) > jnp.finfo(F.dtype).tiny
    share = jnp.where(regular, 1 / jnp.where(regular, product, 1), 0)
    solver = optimization_barrier(algebra.cofactor(sums) * share)
    z = optimization_barrier(algebra.matvec(solver, optimization_barrier(axial)))
    z = algebra.components(z)
    zero = jnp.zeros_like(z[0])
    Z = algebra.stack_matrix([[zero, -z[2], z[1]], [z[2], zero, -z[0]], [-z[1], z[0], zero]])
    return R, algebra.matmul(R, Z)
