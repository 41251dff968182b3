"""Elastic laws: neo-Hookean, fixed corotated, and St Venant-Kirchhoff in Hencky (logarithmic)
strain.
"""

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.spectral import left_isotropic, left_strain, polar_rotation, volume_change
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.materials.parameters import POISSON_RATIO, YOUNGS_MODULUS

ELASTIC_PARAMETERS = (YOUNGS_MODULUS, POISSON_RATIO)
MODULI = ("shear_modulus", "first_lame_parameter")


def lame(parameters: Parameters) -> tuple[Array, Array]:
    """Shear modulus mu and Lame's first parameter lambda [Pa] as `with_moduli` has worked them out,
    or from `youngs_modulus` [Pa] and `poisson_ratio`, or `bulk_modulus` and `shear_modulus` [Pa].
    """
    if MODULI[1] in parameters:
        return parameters[MODULI[0]], parameters[MODULI[1]]
    if "bulk_modulus" in parameters:
        mu = parameters["shear_modulus"]
        return mu, parameters["bulk_modulus"] - 2 / 3 * mu
    E, nu = parameters["youngs_modulus"], parameters["poisson_ratio"]
    return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))


def with_moduli(parameters: Parameters) -> Parameters:
    """Parameters with the moduli that `lame` gives, so that no step works them out again."""
    return parameters | dict(zip(MODULI, lame(parameters), strict=True))


def elastic_rest(parameters: Parameters) -> tuple[Array, Array]:
    """(wave, lone) moduli at rest [Pa] of every law that is linear elasticity at small strains."""
    mu, lam = lame(parameters)
    # For nu < 0 shearing is the stiffer motion.
    return lam + 2 * mu, 2 * mu + 3 * jnp.maximum(lam, 0)


def add_to_diagonal(A: Array, value: Array) -> Array:
    """A + value I for A (3, 3, ...) and value (...).

    Broadcast, so that XLA computes the value once; entry by entry it does so for each.
    """
    return A + value * algebra.identity_like(A)


def neo_hookean_stress(parameters: Parameters, F: Array) -> Array:
    """tau = mu (F F^T - I) + lambda log(J) I, shape (3, 3, ...) [Pa] (Bonet and Wood 2008, eq.
    6.29).

    Not a number where J < 0: the law has no inverted states.
    """
    mu, lam = lame(parameters)
    return add_to_diagonal(mu * left_strain(F), lam * jnp.log1p(volume_change(F)))


def neo_hookean_energy(parameters: Parameters, F: Array) -> Array:
    """mu/2 (tr(F F^T) - 3) - mu log J + lambda/2 log(J)^2, shape (...) [J/m^3]."""
    mu, lam = lame(parameters)
    log_volume = jnp.log1p(volume_change(F))
    return mu * (0.5 * algebra.trace(left_strain(F)) - log_volume) + 0.5 * lam * log_volume**2


def neo_hookean_principal_energy(parameters: Parameters, stretches: Array) -> Array:
    """`neo_hookean_energy` of the principal stretches (3, ...)."""
    mu, lam = lame(parameters)
    logs = jnp.log(stretches)
    log_volume = logs[0] + logs[1] + logs[2]
    squares = jnp.sum(stretches**2 - 1, axis=0)
    return mu * (0.5 * squares - log_volume) + 0.5 * lam * log_volume**2


def fixed_corotated_stress(parameters: Parameters, F: Array) -> Array:
    """tau = 2 mu (F - R) F^T + lambda (J - 1) J I, shape (3, 3, ...) [Pa] (Stomakhin et al. 2012,
    eq. 8).

    R is the rotation nearest to F with det R = +1, so that inverted particles are pushed back.
    """
    mu, lam = lame(parameters)
    change = volume_change(F)
    shear = algebra.matmul_transpose(F - polar_rotation(F), F)
    # R F^T is symmetric; round-off must not make a torque.
    shear = mu * (shear + algebra.transpose(shear))
    return add_to_diagonal(shear, lam * change * (1 + change))


def fixed_corotated_energy(parameters: Parameters, F: Array) -> Array:
    """mu |F - R|^2 + lambda/2 (J - 1)^2, shape (...) [J/m^3]."""
    mu, lam = lame(parameters)
    difference = F - polar_rotation(F)
    return mu * jnp.sum(difference**2, axis=(0, 1)) + 0.5 * lam * volume_change(F) ** 2


def fixed_corotated_principal_energy(parameters: Parameters, stretches: Array) -> Array:
    """`fixed_corotated_energy` of the signed singular values (3, ...)."""
    mu, lam = lame(parameters)
    J = stretches[0] * stretches[1] * stretches[2]
    return mu * jnp.sum((stretches - 1) ** 2, axis=0) + 0.5 * lam * (J - 1) ** 2


def hencky_principal_stress(mu: Array, lam: Array, e: Array) -> Array:
    """2 mu e + lambda tr(e): principal Kirchhoff stress [Pa] of principal log strains, both (3,
    ...).
    """
    return 2 * mu * e + lam * (e[0] + e[1] + e[2])


def hencky_density(mu: Array, lam: Array, e: Array) -> Array:
    """mu |e|^2 + lambda/2 tr(e)^2: stored energy [J/m^3] of principal log strains (3, ...)."""
    return mu * jnp.sum(e * e, axis=0) + 0.5 * lam * (e[0] + e[1] + e[2]) ** 2


def _hencky_stress_values(e, moduli):
    mu, lam = moduli
    return (hencky_principal_stress(mu, lam, e),), ()


def _hencky_energy_value(e, moduli):
    mu, lam = moduli
    return (), (hencky_density(mu, lam, e),)


def hencky_stress(parameters: Parameters, F: Array) -> Array:
    """tau = Q (2 mu e + lambda tr(e)) Q^T with F F^T = Q diag(exp(2 e)) Q^T, shape (3, 3, ...) [Pa]
    (Klar et al. 2016).
    """
    ((tau,), _) = left_isotropic(_hencky_stress_values, F, lame(parameters))
    return tau


def hencky_energy(parameters: Parameters, F: Array) -> Array:
    """mu |e|^2 + lambda/2 tr(e)^2 with e the logarithms of the singular values of F, shape (...)
    [J/m^3].
    """
    (_, (energy,)) = left_isotropic(_hencky_energy_value, F, lame(parameters))
    return energy


def hencky_principal_energy(parameters: Parameters, stretches: Array) -> Array:
    """`hencky_energy` of the singular values (3, ...); their sign does not count."""
    return hencky_density(*lame(parameters), jnp.log(jnp.abs(stretches)))


def without_memory(energy):
    """The energy of a law whose history stores none."""
    return lambda parameters, F, history: energy(parameters, F)


def _elastic(name, stress, energy, principal_energy, spectral=False) -> Law:
    def update(parameters, F_trial, history, dt):
        return F_trial, stress(parameters, F_trial), history

    return Law(
        name=name,
        declared=ELASTIC_PARAMETERS,
        history=(),
        history_names=(),
        update=update,
        energy=without_memory(energy),
        principal_energy=principal_energy,
        plastic=False,
        spectral=spectral,
        prepare=with_moduli,
        rest=elastic_rest,
    )


NEO_HOOKEAN = _elastic(
    "neo-Hookean", neo_hookean_stress, neo_hookean_energy, neo_hookean_principal_energy
)
FIXED_COROTATED = _elastic(
    "fixed corotated",
    fixed_corotated_stress,
    fixed_corotated_energy,
    fixed_corotated_principal_energy,
)
HENCKY = _elastic("Hencky", hencky_stress, hencky_energy, hencky_principal_energy, spectral=True)
