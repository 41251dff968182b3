"""Elastic response of a law while its history stands still: what an implicit solve sees of it."""

from collections.abc import Callable
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.lax import optimization_barrier

from jaxphys.core import algebra, packed
from jaxphys.core.spectral import left_isotropic
from jaxphys.mpm.materials.law import Law, Parameters

ENTRIES = 9


def trial_stress(law: Law, parameters: Parameters, F: Array, history: Array) -> Array:
    """Kirchhoff stress (3, 3, ...) [Pa] of an elastic gradient F with nothing flowing: the
    derivative of `law.energy` at this history.

    It goes through `core.spectral` once, so that its own derivative is right at equal stretches.
    """
    if law.trial is not None:
        return law.trial(parameters, F, history)
    if not law.plastic:
        return law.update(parameters, F, history, jnp.zeros((), F.dtype))[1]
    ((stress,), _) = left_isotropic(_principal_stress(law.principal_energy), F, parameters)
    return stress


@cache
def _principal_stress(energy: Callable) -> Callable:
    """d psi / d e of an energy of principal stretches exp(e): for `left_isotropic`, which wants the
    same function each time.
    """

    def values(e, parameters):
        return (jax.grad(lambda e: jnp.sum(energy(parameters, jnp.exp(e))))(e),), ()

    return values


def pulled_back(law: Law, parameters: Parameters, F: Array, history: Array, turn: Array) -> Array:
    """P(G F) F^T [Pa] (3, 3, ...) with G = I + `turn`, both (3, 3, ...): the derivative of
    psi(G F) by G, which is tau(G F) G^-T.
    """
    G = turn + algebra.identity_like(turn)
    G, after = optimization_barrier((G, algebra.matmul(G, F)))
    stress = trial_stress(law, parameters, after, history)
    stress, back = optimization_barrier((stress, algebra.inverse(G)))
    return algebra.matmul_transpose(stress, back)


def tangent(
    law: Law, parameters: Parameters, F: Array, history: Array, turn: Array
) -> tuple[Array, Array]:
    """`pulled_back` (3, 3, ...) and its derivative by `turn`, a symmetric 9 x 9 matrix over entries
    (i, j) in the order 3 i + j, packed (45, ...).
    """

    def response(turn):
        return pulled_back(law, parameters, F, history, turn)

    single = np.eye(ENTRIES).reshape(ENTRIES, 3, 3, *[1] * (F.ndim - 2))
    units = jnp.broadcast_to(jnp.asarray(single, F.dtype), (ENTRIES, *F.shape))
    value, columns = jax.vmap(lambda d: jax.jvp(response, (turn,), (d,)), out_axes=(None, 0))(units)
    # Once, and not in each of the entries that are picked.
    columns = optimization_barrier(columns)
    return value, packed.pack(columns.reshape(ENTRIES, ENTRIES, *F.shape[2:]))


def rest_stiffness(law: Law, parameters: Parameters, like: Array) -> Array:
    """Frobenius norm of dP / dF at rest [Pa], (...), for F shaped as `like` (3, 3, ...).

    For Lame's moduli sqrt(9 lambda^2 + 12 lambda mu + 24 mu^2).
    """
    start = np.asarray(law.history).reshape(-1, *[1] * (like.ndim - 2))
    history = jnp.broadcast_to(jnp.asarray(start, like.dtype), (len(law.history), *like.shape[2:]))
    rest = algebra.identity_like(like)
    _, found = tangent(law, parameters, rest, history, jnp.zeros_like(like))
    entries = zip(packed.triangle(ENTRIES), packed.split(found), strict=True)
    return jnp.sqrt(algebra.total((1 if i == j else 2) * x**2 for (i, j), x in entries))
