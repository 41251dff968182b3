"""Rubber and foam with memory: stiff at once, softer later, back after a while. A spring beside a
Maxwell element (the standard solid), at finite strain.
"""

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.spectral import left_isotropic
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    lame,
    neo_hookean_energy,
    neo_hookean_principal_energy,
    neo_hookean_stress,
    with_moduli,
)
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.materials.parameters import Parameter
from jaxphys.mpm.materials.plasticity import split_deviator

RELAXING = Parameter(
    "relaxing_modulus",
    "stiffness against a fast change of shape that is gone after a while: shear modulus, on top of "
    "the lasting one",
    "Pa",
)
TIME = Parameter("relaxation_time", "after which 0.37 of that is left", "s")
ROWS = tuple(f"viscous_{i}{j}" for i in "xyz" for j in "xyz")


def _relaxed(e: Array, arguments) -> tuple[tuple[Array, Array], tuple]:
    """The deviator of the element's log strains (3, ...) falls by exp(-dt / T), which is exact for
    any step; its volume is the spring's affair.
    """
    modulus, kept = arguments
    _, deviator, _ = split_deviator(e)
    return (jnp.expm1((kept - 1) * deviator), 2 * modulus * kept * deviator), ()


def _update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    """F = F_e F_v in the element; the history is F_v^-1, less the identity so that small changes
    keep their digits.
    """
    inverse = history.reshape(3, 3, *history.shape[1:])
    inverse = inverse + algebra.identity_like(inverse)
    elastic = algebra.matmul(F_trial, inverse)
    kept = jnp.exp(-dt / parameters["relaxation_time"])
    arguments = (parameters["relaxing_modulus"], kept)
    (change, stress), _ = left_isotropic(_relaxed, elastic, arguments)
    flow = algebra.matmul(algebra.inverse(F_trial), algebra.matmul(change, elastic))
    return (
        F_trial,
        neo_hookean_stress(parameters, F_trial) + stress,
        history + flow.reshape(history.shape),
    )


def _element_value(e: Array, modulus: Array) -> tuple[tuple, tuple[Array]]:
    _, deviator, _ = split_deviator(e)
    return (), (modulus * jnp.sum(deviator**2, axis=0),)


def _energy(parameters: Parameters, F: Array, history: Array) -> Array:
    inverse = history.reshape(3, 3, *history.shape[1:])
    elastic = algebra.matmul(F, inverse + algebra.identity_like(inverse))
    _, (element,) = left_isotropic(_element_value, elastic, parameters["relaxing_modulus"])
    return neo_hookean_energy(parameters, F) + element


def _principal_energy(parameters: Parameters, stretches: Array) -> Array:
    """Of the same strain all at once, before anything relaxes."""
    _, (element,) = _element_value(jnp.log(jnp.abs(stretches)), parameters["relaxing_modulus"])
    return neo_hookean_principal_energy(parameters, stretches) + element


def _rest(parameters: Parameters) -> tuple[Array, Array]:
    mu, lam = lame(parameters)
    relaxing = parameters["relaxing_modulus"]
    return lam + 2 * mu + 4 / 3 * relaxing, 2 * mu + jnp.maximum(3 * lam, 2 * relaxing)


STANDARD_SOLID = Law(
    name="standard viscoelastic solid",
    declared=(*ELASTIC_PARAMETERS, RELAXING, TIME),
    history=(0.0,) * 9,
    history_names=ROWS,
    update=_update,
    energy=_energy,
    principal_energy=_principal_energy,
    plastic=False,
    spectral=True,
    prepare=with_moduli,
    rest=_rest,
)
