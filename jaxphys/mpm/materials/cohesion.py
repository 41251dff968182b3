"""Wet sand: grains that water holds together, Drucker and Prager's cone with its tip in tension."""

import math

import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.materials.deriving import law_of_stretches
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    elastic_rest,
    lame,
    with_moduli,
)
from jaxphys.mpm.materials.law import Parameters
from jaxphys.mpm.materials.parameters import Parameter
from jaxphys.mpm.materials.plasticity import (
    DRUCKER_PRAGER,
    FRICTION_ANGLE,
    PLANE_STRAIN,
    friction_coefficient,
    split_deviator,
    unit_deviator,
)
from jaxphys.mpm.materials.viscoplasticity import hencky_of_logs, hencky_of_stretches

COHESION = Parameter(
    "cohesion",
    "shear stress that grains bear without being pressed together, as water or clay gives it "
    "(Mohr and Coulomb's c)",
    "Pa",
    low_included=True,
)


def _onto_cone(parameters: Parameters, e: Array, history: Array, dt: Array):
    """Sand's return map (`plasticity.drucker_prager_values`) on a cone that is moved into tension,
    |dev tau| = alpha (3 c cot(phi) - tr tau), with the same memory of the volume gained apart.

    Pulled beyond the tip, a pressure of -c cot(phi), it comes apart, and bears nothing until it has
    been pressed together again.
    """
    mu, lam = lame(parameters)
    angle = parameters["friction_angle"] * (math.pi / 180)
    sine, cosine = jnp.sin(angle), jnp.cos(angle)
    alpha = friction_coefficient(parameters["friction_angle"])
    # alpha 3 c cot(phi), which is right for no friction, too; then there is no tip.
    strength = math.sqrt(2 / 3) * 6 * parameters["cohesion"] * cosine / (3 - sine)
    rough = sine > 0
    bulk = 3 * lam + 2 * mu
    tip = 3 * parameters["cohesion"] * cosine / (jnp.where(rough, sine, 1) * bulk)
    kept_volume = history[0]
    whole = kept_volume <= 0
    strength, tip = jnp.where(whole, strength, 0), jnp.where(whole, tip, 0)
    total, deviator, norm = split_deviator(e)
    total = total + kept_volume
    apart = (rough | ~whole) & (total > tip)
    excess = norm + (bulk * alpha * total - strength) / (2 * mu)
    slide = -jnp.where(excess > 0, excess, 0) * unit_deviator(deviator, norm)
    moved = jnp.where(apart, 0, e + kept_volume / 3 + slide)
    return moved, jnp.where(apart, total, 0)[None]


WET_SAND = law_of_stretches(
    "Drucker-Prager with cohesion",
    (*ELASTIC_PARAMETERS, FRICTION_ANGLE, COHESION),
    hencky_of_stretches,
    stress=hencky_of_logs,
    return_map=_onto_cone,
    history={"kept_log_volume": 0.0},
    without=(("cohesion", DRUCKER_PRAGER),),
    alternatives=(PLANE_STRAIN,),
    prepare=with_moduli,
    rest=elastic_rest,
)
