"""Fibres in a soft matrix, along one direction of each particle: muscle, tendon, meat, wood."""

import math

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.mpm.materials.deriving import moduli_by_gradient
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    lame,
    neo_hookean_energy,
    neo_hookean_stress,
    with_moduli,
    without_memory,
)
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.materials.parameters import Parameter

STIFFNESS = Parameter(
    "fibre_stiffness",
    "what fibres add, while they are stretched, to the stiffness along them: a quarter of that "
    "modulus (k1 of Holzapfel et al. 2000)",
    "Pa",
    low_included=True,
)
STIFFENING = Parameter(
    "fibre_stiffening",
    "how fast they get stiffer as they are stretched (k2 of the same)",
    "",
    low_included=True,
    high=100,
)
AZIMUTH = Parameter(
    "fibre_azimuth",
    "direction of the fibres before anything moves, about z; 0 is x, 90 is y",
    "degrees",
    low=-math.inf,
)
ELEVATION = Parameter(
    "fibre_elevation",
    "their angle above the horizontal plane; 90 is z",
    "degrees",
    low=-math.inf,
)
DIRECTION = ("fibre_x", "fibre_y", "fibre_z")


def fibre_direction(parameters: Parameters) -> Array:
    """Unit vector (3, ...) of the fibres at rest."""
    if DIRECTION[0] in parameters:
        return jnp.stack([parameters[name] for name in DIRECTION])
    azimuth, elevation = (parameters[p.name] * (math.pi / 180) for p in (AZIMUTH, ELEVATION))
    level = jnp.cos(elevation)
    return jnp.stack(
        jnp.broadcast_arrays(level * jnp.cos(azimuth), level * jnp.sin(azimuth), jnp.sin(elevation))
    )


def _prepare(parameters: Parameters) -> Parameters:
    direction = algebra.components(fibre_direction(parameters))
    return with_moduli(parameters) | dict(zip(DIRECTION, direction, strict=True))


def _stretched(parameters: Parameters, F: Array) -> tuple[Array, Array, Array]:
    """The fibres as they lie (3, ...), <I4 - 1> and exp(k2 <I4 - 1>^2); I4 is the square of their
    stretch, and <> is zero where they are not stretched: they buckle.
    """
    a0 = [jnp.broadcast_to(x, F.shape[2:]) for x in fibre_direction(parameters)]
    a = algebra.matvec(F, jnp.stack(a0))
    x, y, z = algebra.components(a)
    excess = jnp.maximum(x * x + y * y + z * z - 1, 0)
    return a, excess, jnp.exp(parameters["fibre_stiffening"] * excess**2)


def fibre_stress(parameters: Parameters, F: Array) -> Array:
    """Neo-Hookean and 2 k1 <I4 - 1> exp(k2 <I4 - 1>^2) a a^T with a = F a0, (3, 3, ...) [Pa]."""
    a, excess, growth = _stretched(parameters, F)
    pull = 2 * parameters["fibre_stiffness"] * excess * growth
    return neo_hookean_stress(parameters, F) + algebra.outer(pull * a, a)


def fibre_energy(parameters: Parameters, F: Array) -> Array:
    """Neo-Hookean and k1 / (2 k2) (exp(k2 <I4 - 1>^2) - 1), (...) [J/m^3] (Holzapfel, Gasser and
    Ogden 2000, eq. 55).
    """
    _, excess, _ = _stretched(parameters, F)
    k1, k2 = parameters["fibre_stiffness"], parameters["fibre_stiffening"]
    stiffens = k2 > 0
    square = excess**2
    grown = jnp.expm1(k2 * square) / jnp.where(stiffens, k2, 1)
    return neo_hookean_energy(parameters, F) + 0.5 * k1 * jnp.where(stiffens, grown, square)


def _rest(parameters: Parameters) -> tuple[Array, Array]:
    """As if they were stretched already: I4 = 1 from above."""
    mu, lam = lame(parameters)
    fibres = 4 * parameters["fibre_stiffness"]
    return lam + 2 * mu + fibres, 2 * mu + 3 * jnp.maximum(lam, 0) + fibres


def _update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    return F_trial, fibre_stress(parameters, F_trial), history


FIBRES = Law(
    name="fibres in neo-Hookean",
    declared=(*ELASTIC_PARAMETERS, STIFFNESS, STIFFENING, AZIMUTH, ELEVATION),
    history=(),
    history_names=(),
    update=_update,
    energy=without_memory(fibre_energy),
    principal_energy=None,
    plastic=False,
    prepare=_prepare,
    rest=_rest,
    moduli=moduli_by_gradient(fibre_energy, _prepare),
)
