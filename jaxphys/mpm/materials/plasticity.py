"""Plastic laws on Hencky strain: von Mises for metal, Drucker-Prager for sand.

Parameters mean what a handbook means: the yield stress and the hardening modulus of a uniaxial
test, the friction angle of triaxial compression. The return maps know the radius of von Mises'
cylinder and the slope of Drucker and Prager's cone.

All return maps move the principal log strains only, so one eigen-decomposition gives the return
map and the stress. The elastic gradient is updated as F + (Q diag(exp(change) - 1) Q^T) F: where
nothing yields the change is zero and F stays bit for bit what it was.
"""

import math

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError, nearest
from jaxphys.core.program import part
from jaxphys.core.spectral import left_isotropic
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    elastic_rest,
    hencky_energy,
    hencky_principal_energy,
    hencky_principal_stress,
    lame,
    with_moduli,
    without_memory,
)
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.materials.parameters import YIELD_STRESS, Alternative, Parameter

# sqrt(3/2) |dev tau| is the stress of a uniaxial test, sqrt(2/3) |plastic strain| its plastic
# strain.
UNIAXIAL = math.sqrt(2 / 3)


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


def unit_deviator(deviator: Array, norm: Array) -> Array:
    """The direction (3, ...) of a deviator of that norm; zero where it has none."""
    return deviator / jnp.where(norm > 0, norm, 1)


def apply_change(change: Array, F: Array) -> Array:
    """F after a change of its log stretches, `change` being Q diag(exp(change) - 1) Q^T, (3, 3,
    ...).
    """
    with part("return map"):
        return F + algebra.matmul(change, F)


def von_mises_values(e: Array, arguments) -> tuple[tuple[Array, Array], tuple[Array]]:
    """The von Mises return map in principal log strains (3, ...), for `left_isotropic`.

    Yield where |dev tau| = 2 mu |dev e| exceeds the radius of the cylinder, which grows by `growth`
    for each unit of plastic strain. The closest point lies along the deviator, at a distance g with
    2 mu (|dev e| - g) = radius + growth g (Simo and Hughes 1998, box 3.1).

    Args:
        e: trial log strains.
        arguments: mu, lambda, radius, growth [Pa], each (...).

    Returns:
        (exp(change) - 1, principal Kirchhoff stress [Pa]), (g,).
    """
    mu, lam, radius, growth = arguments
    values, flow = _onto_cylinder(e, mu, lam, radius, 2 * mu + growth)
    return values, (flow,)


def perfect_values(e: Array, arguments) -> tuple[tuple[Array, Array], tuple]:
    """`von_mises_values` of a cylinder that does not grow: mu, lambda, radius."""
    mu, lam, radius = arguments
    values, _ = _onto_cylinder(e, mu, lam, radius, 2 * mu)
    return values, ()


def _onto_cylinder(e: Array, mu: Array, lam: Array, radius: Array, resistance: Array):
    _, deviator, norm = split_deviator(e)
    excess = 2 * mu * norm - radius
    flow = jnp.where(excess > 0, excess / resistance, 0)
    change = -flow * unit_deviator(deviator, norm)
    return (jnp.expm1(change), hencky_principal_stress(mu, lam, e + change)), flow


def _von_mises_update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    plastic_strain, hardening = history[0], parameters["hardening"]
    strength = parameters["yield_stress"] + hardening * plastic_strain
    arguments = (*lame(parameters), UNIAXIAL * strength, UNIAXIAL**2 * hardening)
    (change, stress), (flow,) = left_isotropic(von_mises_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, (plastic_strain + UNIAXIAL * flow)[None]


def _perfect_update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    arguments = (*lame(parameters), UNIAXIAL * parameters["yield_stress"])
    (change, stress), _ = left_isotropic(perfect_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, history


def _triaxial_coefficient(sine: Array) -> Array:
    return math.sqrt(2 / 3) * 2 * sine / (3 - sine)


def _plane_strain_coefficient(sine: Array) -> Array:
    return math.sqrt(2) / 3 * sine


COEFFICIENTS = {
    "triaxial compression": _triaxial_coefficient,
    "plane strain": _plane_strain_coefficient,
}


def friction_coefficient(
    friction_angle: Array | np.ndarray, test: str = "triaxial compression"
) -> Array:
    """The slope alpha of the cone |dev tau| = -alpha tr(tau) that slides where Mohr and Coulomb's
    law with the friction angle phi does in one test.

    Mohr and Coulomb's surface has corners, so no cone fits it in every test. In triaxial
    compression alpha = sqrt(2/3) 2 sin(phi) / (3 - sin(phi)) (Klar et al. 2016). In plane strain,
    where flow at constant volume, as here, makes the middle stress the mean of the other two,
    alpha = sqrt(2) sin(phi) / 3: the cone of a triaxial angle of 30 degrees slides at 43.9 there.

    Args:
        friction_angle: phi [degrees], any shape.
        test: "triaxial compression" or "plane strain".

    Raises:
        InputError: another test.
    """
    if test not in COEFFICIENTS:
        raise InputError(f"friction_coefficient: no test {test!r}; {nearest(test, COEFFICIENTS)}")
    return COEFFICIENTS[test](jnp.sin(friction_angle * (math.pi / 180)))


def triaxial_friction_angle(plane_strain_angle: Array | np.ndarray) -> Array:
    """The `friction_angle` [degrees] of the cone that slides at `plane_strain_angle` [degrees] in
    plane strain: what a parameter `plane_strain_friction_angle` stands for.
    """
    ratio = friction_coefficient(plane_strain_angle, "plane strain") / math.sqrt(2 / 3)
    return jnp.arcsin(3 * ratio / (2 + ratio)) * (180 / math.pi)


def _cone(total: Array, deviator: Array, norm: Array, mu: Array, lam: Array, alpha: Array):
    """Whether nothing holds, and the change of log strains that slides back onto the cone."""
    excess = norm + (3 * lam + 2 * mu) / (2 * mu) * total * alpha
    return total > 0, -jnp.where(excess > 0, excess, 0) * unit_deviator(deviator, norm)


def uncorrected_values(e: Array, arguments) -> tuple[tuple[Array, Array], tuple]:
    """The Drucker-Prager return map of Klar et al. (2016): mu, lambda, alpha.

    As `drucker_prager_values` without memory: sand that has come apart resists as soon as its
    strain turns, so it stays looser, and gains volume in every cycle.
    """
    mu, lam, alpha = arguments
    apart, slide = _cone(*split_deviator(e), mu, lam, alpha)
    change = jnp.where(apart, -e, slide)
    stress = jnp.where(apart, 0, hencky_principal_stress(mu, lam, e + change))
    return (jnp.expm1(change), stress), ()


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
    apart, slide = _cone(total, deviator, norm, mu, lam, alpha)
    change = jnp.where(apart, -e, kept_volume / 3 + slide)
    stress = jnp.where(apart, 0, hencky_principal_stress(mu, lam, e + change))
    return (jnp.expm1(change), stress), (jnp.where(apart, total, 0),)


def _drucker_prager_update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    arguments = (
        *lame(parameters),
        friction_coefficient(parameters["friction_angle"]),
        history[0],
    )
    (change, stress), (volume,) = left_isotropic(drucker_prager_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, volume[None]


def _uncorrected_update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    arguments = (*lame(parameters), friction_coefficient(parameters["friction_angle"]))
    (change, stress), _ = left_isotropic(uncorrected_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, history


HARDENING = Parameter(
    "hardening",
    "by how much that stress grows for each unit of plastic strain of the bar (isotropic, linear)",
    "Pa",
    low_included=True,
)
FRICTION_ANGLE = Parameter(
    "friction_angle",
    "angle of internal friction in triaxial compression, as laboratories measure it; in plane "
    "strain the same grains slide later, at 43.9 for 30",
    "degrees",
    high=90,
    low_included=True,
)
PLANE_STRAIN = Alternative(
    Parameter(
        "plane_strain_friction_angle",
        "angle of internal friction in plane strain: of long slopes and of two-dimensional theory",
        "degrees",
        high=90,
        low_included=True,
    ),
    "friction_angle",
    triaxial_friction_angle,
)
PERFECT_VON_MISES = Law(
    name="von Mises without hardening",
    declared=(*ELASTIC_PARAMETERS, YIELD_STRESS),
    history=(),
    history_names=(),
    update=_perfect_update,
    energy=without_memory(hencky_energy),
    principal_energy=hencky_principal_energy,
    plastic=True,
    spectral=True,
    prepare=with_moduli,
    rest=elastic_rest,
    omits=("hardening",),
)
VON_MISES = Law(
    name="von Mises",
    declared=(*ELASTIC_PARAMETERS, YIELD_STRESS, HARDENING),
    history=(0.0,),
    history_names=("equivalent_plastic_strain",),
    update=_von_mises_update,
    energy=without_memory(hencky_energy),
    principal_energy=hencky_principal_energy,
    plastic=True,
    spectral=True,
    prepare=with_moduli,
    rest=elastic_rest,
    without=(("hardening", PERFECT_VON_MISES),),
)
DRUCKER_PRAGER = Law(
    name="Drucker-Prager",
    declared=(*ELASTIC_PARAMETERS, FRICTION_ANGLE),
    alternatives=(PLANE_STRAIN,),
    history=(0.0,),
    history_names=("kept_log_volume",),
    update=_drucker_prager_update,
    energy=without_memory(hencky_energy),
    principal_energy=hencky_principal_energy,
    plastic=True,
    spectral=True,
    prepare=with_moduli,
    rest=elastic_rest,
)
UNCORRECTED_DRUCKER_PRAGER = Law(
    name="Drucker-Prager without volume correction",
    declared=(*ELASTIC_PARAMETERS, FRICTION_ANGLE),
    alternatives=(PLANE_STRAIN,),
    history=(),
    history_names=(),
    update=_uncorrected_update,
    energy=without_memory(hencky_energy),
    principal_energy=hencky_principal_energy,
    plastic=True,
    spectral=True,
    prepare=with_moduli,
    rest=elastic_rest,
)
