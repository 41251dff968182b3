"""Plastic laws on Hencky strain: von Mises for metal, Drucker-Prager with volume correction for
sand.

Both return maps move the principal log strains only, so one eigen-decomposition gives the return
map and the stress. The elastic gradient is updated as F + (Q diag(exp(change) - 1) Q^T) F: where
nothing yields the change is zero and F stays bit for bit what it was.
"""

import math

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.spectral import left_isotropic
from jaxphys.mpm.elasticity import (
    ELASTIC_PARAMETERS,
    hencky_energy,
    hencky_principal_energy,
    hencky_principal_stress,
    lame,
)
from jaxphys.mpm.law import Law, Parameters


def split_deviator(e: Array) -> tuple[Array, Array, Array]:
    """Trace (...), deviator (3, ...) and the deviator's norm (...) of principal strains (3, ...).

    The norm's derivative at a zero deviator is zero, not the undefined one of the square root.
    """
    total = e[0] + e[1] + e[2]
    deviator = e - total / 3
    squared = deviator[0] ** 2 + deviator[1] ** 2 + deviator[2] ** 2
    positive = squared > 0
    norm = jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1)), 0)
    return total, deviator, norm


def _unit(deviator: Array, norm: Array) -> Array:
    return deviator / jnp.where(norm > 0, norm, 1)


def apply_change(change: Array, F: Array) -> Array:
    """F after a change of its log stretches, `change` being Q diag(exp(change) - 1) Q^T, (3, 3,
    ...).
    """
    return F + algebra.matmul(change, F)


def von_mises_values(e: Array, arguments) -> tuple[tuple[Array, Array], tuple[Array]]:
    """The von Mises return map in principal log strains (3, ...), for `left_isotropic`.

    Yield where |dev tau| = 2 mu |dev e| exceeds tau_Y + H a, with a the accumulated plastic strain.
    The closest point lies along the deviator, at a distance g with 2 mu (|dev e| - g) = tau_Y + H
    (a + g) (Simo and Hughes 1998, box 3.1).

    Args:
        e: trial log strains.
        arguments: mu, lambda, tau_Y, H [Pa], and a, each (...).

    Returns:
        (exp(change) - 1, principal Kirchhoff stress [Pa]), (the new accumulated plastic strain,).
    """
    mu, lam, yield_stress, hardening, accumulated = arguments
    _, deviator, norm = split_deviator(e)
    excess = 2 * mu * norm - (yield_stress + hardening * accumulated)
    flow = jnp.where(excess > 0, excess / (2 * mu + hardening), 0)
    change = -flow * _unit(deviator, norm)
    stress = hencky_principal_stress(mu, lam, e + change)
    return (jnp.expm1(change), stress), (accumulated + flow,)


def _von_mises_update(parameters: Parameters, F_trial: Array, history: Array):
    arguments = (
        *lame(parameters),
        parameters["yield_stress"],
        parameters["hardening"],
        history[0],
    )
    (change, stress), (accumulated,) = left_isotropic(von_mises_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, accumulated[None]


def friction_coefficient(friction_angle: Array) -> Array:
    """alpha = sqrt(2/3) 2 sin(phi) / (3 - sin(phi)) of the friction angle phi [degrees] (Klar et
    al. 2016).
    """
    sine = jnp.sin(friction_angle * (math.pi / 180))
    return math.sqrt(2 / 3) * 2 * sine / (3 - sine)


def drucker_prager_values(e: Array, arguments) -> tuple[tuple[Array, Array], tuple[Array]]:
    """The Drucker-Prager return map in principal log strains (3, ...), for `left_isotropic`.

    Klar et al. (2016) with the volume correction of Tampubolon et al. (2017): the log volume that
    was gained while the sand came apart is kept in the history and given back before the sand
    resists compression again. With the trial strain e + v/3,

    * tr > 0: nothing holds, all log strains become zero, and v = tr is kept;
    * g = |dev| + (3 lambda + 2 mu) / (2 mu) tr alpha <= 0: elastic;
    * otherwise the deviator shrinks by g at constant volume.

    Args:
        e: trial log strains.
        arguments: mu, lambda [Pa], alpha, and the kept log volume v >= 0, each (...).

    Returns:
        (exp(change) - 1, principal Kirchhoff stress [Pa]), (the new v,).
    """
    mu, lam, alpha, kept_volume = arguments
    total, deviator, norm = split_deviator(e)
    total = total + kept_volume
    apart = total > 0
    excess = norm + (3 * lam + 2 * mu) / (2 * mu) * total * alpha
    flow = jnp.where(excess > 0, excess, 0)
    change = jnp.where(apart, -e, kept_volume / 3 - flow * _unit(deviator, norm))
    stress = jnp.where(apart, 0, hencky_principal_stress(mu, lam, e + change))
    return (jnp.expm1(change), stress), (jnp.where(apart, total, 0),)


def _drucker_prager_update(parameters: Parameters, F_trial: Array, history: Array):
    arguments = (
        *lame(parameters),
        friction_coefficient(parameters["friction_angle"]),
        history[0],
    )
    (change, stress), (volume,) = left_isotropic(drucker_prager_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, volume[None]


VON_MISES = Law(
    name="von Mises",
    parameters=(*ELASTIC_PARAMETERS, "yield_stress", "hardening"),
    history=(0.0,),
    history_names=("plastic_strain",),
    update=_von_mises_update,
    energy=hencky_energy,
    principal_energy=hencky_principal_energy,
    plastic=True,
)
DRUCKER_PRAGER = Law(
    name="Drucker-Prager",
    parameters=(*ELASTIC_PARAMETERS, "friction_angle"),
    history=(0.0,),
    history_names=("kept_log_volume",),
    update=_drucker_prager_update,
    energy=hencky_energy,
    principal_energy=hencky_principal_energy,
    plastic=True,
)
