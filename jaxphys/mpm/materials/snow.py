"""Snow: fixed corotated up to small strains, beyond which it gives way for good, and hardens as it
is packed or falls to powder as it is pulled (Stomakhin et al. 2013).
"""

import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.materials.deriving import law_of_stretches
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    MODULI,
    elastic_rest,
    fixed_corotated_principal_energy,
    lame,
    with_moduli,
)
from jaxphys.mpm.materials.law import Parameters
from jaxphys.mpm.materials.parameters import Parameter

# Packed snow gets no stiffer than exp(this) times what it was: some fifty times.
HARDEST = 4.0
COMPRESSION = Parameter(
    "critical_compression",
    "share of its length by which it may be pressed before it gives way",
    "",
    high=1,
)
STRETCH = Parameter(
    "critical_stretch",
    "share of its length by which it may be pulled before it gives way",
    "",
)
HARDENING = Parameter(
    "packing_hardening",
    "how fast it gets stiffer as it is packed: moduli grow by exp of this times the share of "
    "volume that is gone for good",
    "",
    low_included=True,
)


def snow_hardening(parameters: Parameters, history: Array) -> Parameters:
    """Moduli times exp(xi (1 - Jp)), Jp = exp(history[0]) being what is left of the volume for
    good; not more than exp(HARDEST) of them.
    """
    exponent = parameters["packing_hardening"] * -jnp.expm1(history[0])
    factor = jnp.exp(jnp.minimum(exponent, HARDEST))
    mu, lam = lame(parameters)
    return parameters | {MODULI[0]: factor * mu, MODULI[1]: factor * lam}


def _gives_way(parameters: Parameters, e: Array, history: Array, dt: Array):
    """Stretches are cut to [1 - critical compression, 1 + critical stretch]; what is cut off goes
    into the plastic volume.
    """
    low = jnp.log1p(-parameters["critical_compression"])
    high = jnp.log1p(parameters["critical_stretch"])
    kept = jnp.clip(e, low, high)
    return kept, history + jnp.sum(e - kept, axis=0)


def _stress(parameters: Parameters, e: Array) -> Array:
    """2 mu (s - 1) s + lambda (J - 1) J of s = exp(e), (3, ...) [Pa]."""
    mu, lam = lame(parameters)
    volume = e[0] + e[1] + e[2]
    return 2 * mu * jnp.exp(e) * jnp.expm1(e) + lam * jnp.exp(volume) * jnp.expm1(volume)


SNOW = law_of_stretches(
    "snow",
    (*ELASTIC_PARAMETERS, COMPRESSION, STRETCH, HARDENING),
    fixed_corotated_principal_energy,
    stress=_stress,
    return_map=_gives_way,
    history={"log_plastic_volume": 0.0},
    hardened=snow_hardening,
    prepare=with_moduli,
    rest=elastic_rest,
)
