"""Laws from an energy: of the principal stretches, of the volume, or of the whole deformation
gradient. Stress, bounds and gradients follow from it by differentiation.

A return map moves what it is given (log stretches, volume or gradient) and the history; the stress
is that of what it returns.
"""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.program import part
from jaxphys.core.spectral import left_isotropic, volume_change
from jaxphys.mpm.materials.elasticity import add_to_diagonal, without_memory
from jaxphys.mpm.materials.law import Law, Parameters, as_they_are
from jaxphys.mpm.materials.parameters import Parameter
from jaxphys.mpm.materials.plasticity import apply_change

Energy = Callable[[Parameters, Array], Array]
ReturnMap = Callable[[Parameters, Array, Array, Array], tuple[Array, Array]]
NO_HISTORY: Mapping[str, float] = {}


def _stays(parameters: Parameters, e: Array, history: Array, dt: Array) -> tuple[Array, Array]:
    """The return map of what is elastic."""
    return e, history


def law_of_stretches(
    name: str,
    parameters: tuple[Parameter, ...],
    energy: Energy,
    *,
    return_map: ReturnMap | None = None,
    history: Mapping[str, float] = NO_HISTORY,
    stress: Callable[[Parameters, Array], Array] | None = None,
    prepare: Callable[[Parameters], Parameters] = as_they_are,
    hardened: Callable[[Parameters, Array], Parameters] | None = None,
    **told: Any,
) -> Law:
    """An isotropic law from an energy of the principal stretches (Ogden 1984, section 4.3).

    The Kirchhoff stress has the principal values s_i psi_i = d psi / d log s_i. Everything is
    symmetric in the three directions: exchanging two stretches changes no energy.

    Args:
        name, parameters: see `Law`.
        energy: (parameters, s (3, ...)) -> [J/m^3], (...).
        return_map: (parameters, e (3, ...), history (H, ...), dt) -> (e, history), of the log
            stretches e; None: elastic.
        history: names and initial values.
        stress: (parameters, e (3, ...)) -> the principal stresses (3, ...) [Pa] in closed form,
            where that is shorter than the energy's derivative.
        prepare, hardened: see `Law`.
        told: any other attribute of `Law`, such as `rest`.
    """
    rows = len(history)
    flows = return_map or _stays
    present = hardened or (lambda values, _: values)

    def principal_stress(values, e):
        if stress is not None:
            return stress(values, e)
        return jax.grad(lambda e: jnp.sum(energy(values, jnp.exp(e))))(e)

    def elastic_values(e, values):
        return (principal_stress(values, e),), ()

    def values_of(e, arguments):
        values, kept, dt = arguments
        moved, after = flows(values, e, kept, dt)
        tau = principal_stress(present(values, after), moved)
        return (jnp.expm1(moved - e), tau), tuple(after[i] for i in range(rows))

    def elastic(values, F_trial, kept, dt):
        (tau,), _ = left_isotropic(elastic_values, F_trial, prepare(values))
        return F_trial, tau, kept

    def plastic(values, F_trial, kept, dt):
        arguments = (prepare(values), kept, jnp.asarray(dt, F_trial.dtype))
        (change, tau), after = left_isotropic(values_of, F_trial, arguments)
        return apply_change(change, F_trial), tau, jnp.stack(after) if rows else kept

    def energy_value(e, arguments):
        values, kept = arguments
        return (), (energy(present(values, kept), jnp.exp(e)),)

    def stored(values, F, kept):
        return left_isotropic(energy_value, F, (prepare(values), kept))[1][0]

    return Law(
        name=name,
        declared=parameters,
        history=tuple(history.values()),
        history_names=tuple(history),
        update=elastic if return_map is None else plastic,
        energy=stored,
        principal_energy=lambda values, s: energy(prepare(values), jnp.abs(s)),
        plastic=return_map is not None,
        spectral=True,
        prepare=prepare,
        hardened=hardened,
        **told,
    )


def law_of_volume(
    name: str,
    parameters: tuple[Parameter, ...],
    energy: Energy,
    *,
    viscosity: Callable[[Parameters], Array] | None = None,
    **told: Any,
) -> Law:
    """A fluid from an energy of its volume: tau = J psi'(J) I + 2 eta J dev(D).

    It forgets its shape: F becomes J^(1/3) I in every step. So F_trial = J^(1/3) (I + dt C), and
    D = sym(C) is read off it; the initial F must be such a multiple of the identity.

    Args:
        name, parameters: see `Law`.
        energy: (parameters, J (...)) -> [J/m^3], (...).
        viscosity: parameters -> eta [Pa s]; None: none, and nothing of it is traced.
        told: any other attribute of `Law`, such as `rest`.
    """

    def update(values, F_trial, kept, dt):
        J = 1 + volume_change(F_trial)
        pressure = J * jax.grad(lambda J: jnp.sum(energy(values, J)))(J)
        with part("return map"):
            side = jnp.cbrt(J)
            F = side * algebra.identity_like(F_trial)
        tau = pressure * algebra.identity_like(F_trial)
        if viscosity is not None:
            with part("viscosity"):
                rate = (0.5 / dt) * (F_trial + algebra.transpose(F_trial)) / side
                rate = add_to_diagonal(rate, -algebra.trace(rate) / 3)
                tau = tau + 2 * viscosity(values) * J * rate
        return F, tau, kept

    def of_stretches(values, s):
        return energy(values, s[0] * s[1] * s[2])

    return Law(
        name=name,
        declared=parameters,
        history=(),
        history_names=(),
        update=update,
        energy=without_memory(lambda values, F: energy(values, 1 + volume_change(F))),
        principal_energy=of_stretches,
        plastic=True,
        viscosity=viscosity,
        **told,
    )


def law_of_gradient(
    name: str,
    parameters: tuple[Parameter, ...],
    energy: Energy,
    *,
    isotropic: bool = True,
    return_map: ReturnMap | None = None,
    history: Mapping[str, float] = NO_HISTORY,
    prepare: Callable[[Parameters], Parameters] = as_they_are,
    **told: Any,
) -> Law:
    """A law from an energy of the deformation gradient: tau = (d psi / d F) F^T.

    Args:
        name, parameters: see `Law`.
        energy: (parameters, F (3, 3, ...)) -> [J/m^3], (...), the same for R F with any rotation R.
        isotropic: whether it is the same for F R too. Of one that is not, the step is bound by the
            largest eigenvalue of the derivative of its stress (`moduli_by_gradient`).
        return_map: (parameters, F (3, 3, ...), history (H, ...), dt) -> (F, history); None:
            elastic.
        history: names and initial values.
        prepare: see `Law`.
        told: any other attribute of `Law`, such as `rest`.
    """

    def update(values, F, kept, dt):
        values = prepare(values)
        if return_map is not None:
            with part("return map"):
                F, kept = return_map(values, F, kept, dt)
        return F, stress_of(energy, values, F), kept

    def of_stretches(values, s):
        return energy(prepare(values), s[:, None] * _identity(s[0]))

    return Law(
        name=name,
        declared=parameters,
        history=tuple(history.values()),
        history_names=tuple(history),
        update=update,
        energy=without_memory(lambda values, F: energy(prepare(values), F)),
        principal_energy=of_stretches if isotropic else None,
        plastic=return_map is not None,
        prepare=prepare,
        moduli=None if isotropic else moduli_by_gradient(energy, prepare),
        **told,
    )


def _identity(like: Array) -> Array:
    return jnp.eye(3, dtype=like.dtype).reshape(3, 3, *[1] * like.ndim)


def stress_of(energy: Energy, values: Parameters, F: Array) -> Array:
    """The Kirchhoff stress (d psi / d F) F^T, (3, 3, ...) [Pa], its round-off made symmetric."""
    P = jax.grad(lambda F: jnp.sum(energy(values, F)))(F)
    tau = algebra.matmul_transpose(P, F)
    return 0.5 * (tau + algebra.transpose(tau))


ROUNDS = 24


def moduli_by_gradient(energy: Energy, prepare: Callable[[Parameters], Parameters] = as_they_are):
    """`Law.moduli` of an energy of F whatever its symmetry: twice the largest eigenvalue of the
    symmetric part of d tau / d H at (I + H) F, by ROUNDS rounds of power iteration.

    An eigenvalue over all H is at least that over H = a n^T, so that no wave is faster; a particle
    alone is bound by just that. Power iteration comes from below: the moduli are two per cent more.
    """

    def moduli(values: Parameters, F: Array) -> tuple[Array, Array]:
        values = prepare(values)

        def tau(H):
            return stress_of(energy, values, F + algebra.matmul(H, F))

        zero = jnp.zeros_like(F)
        _, pushed = jax.linearize(tau, zero)
        back = jax.linear_transpose(pushed, zero)
        # No symmetry of the matter is likely to be across this one.
        first = np.array([[0.9, 0.31, -0.17], [0.22, -1.1, 0.41], [0.13, 0.27, 1.3]])
        H = jnp.broadcast_to(
            jnp.asarray(first, F.dtype).reshape(3, 3, *[1] * (F.ndim - 2)), F.shape
        )

        def round_of(_, carry):
            H, _ = carry
            moved = 0.5 * (pushed(H) + back(H)[0])
            size = jnp.sqrt(jnp.sum(moved**2, axis=(0, 1)))
            return moved / jnp.where(size > 0, size, 1), size

        _, largest = jax.lax.fori_loop(0, ROUNDS, round_of, (H, jnp.zeros_like(F[0, 0])))
        return 1.02 * largest, 1.02 * largest

    return moduli
