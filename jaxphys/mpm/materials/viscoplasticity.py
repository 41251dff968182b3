"""What flows once the stress is high enough, and the faster the higher: plasticine, cream,
toothpaste. Elastic below, in Hencky's strain; volume is elastic throughout.

In simple shear both are what a rheometer measures: the shear stress is that at which flow sets in
and a part that grows with the shear rate. The flow of a step is implicit in the stress at its end,
so that no viscosity shortens the step.
"""

import math

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.materials.deriving import law_of_stretches
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    elastic_rest,
    hencky_density,
    hencky_principal_stress,
    lame,
    with_moduli,
)
from jaxphys.mpm.materials.law import Parameters
from jaxphys.mpm.materials.parameters import (
    BULK_MODULUS,
    SHEAR_MODULUS,
    YIELD_STRESS,
    Parameter,
)
from jaxphys.mpm.materials.plasticity import UNIAXIAL, split_deviator, unit_deviator

PLASTIC_VISCOSITY = Parameter(
    "plastic_viscosity",
    "by how much the shear stress grows for each unit of shear rate once it yields (Bingham)",
    "Pa s",
    low_included=True,
)
SHEAR_YIELD_STRESS = Parameter(
    "shear_yield_stress",
    "shear stress below which it does not flow, as rheometers measure it",
    "Pa",
)
CONSISTENCY = Parameter(
    "consistency",
    "by how much the shear stress is higher than that at a shear rate of 1/s (Herschel-Bulkley)",
    "Pa s^n",
)
FLOW_INDEX = Parameter(
    "flow_index",
    "n, the power of the shear rate with which that grows: below 1 it thins as it is sheared "
    "faster, 1 is Bingham's fluid",
    "",
    low=0.1,
    high=4,
)
SQRT2 = math.sqrt(2)


def hencky_of_stretches(parameters: Parameters, stretches: Array) -> Array:
    """Hencky's energy [J/m^3], (...), of principal stretches (3, ...)."""
    return hencky_density(*lame(parameters), jnp.log(stretches))


def hencky_of_logs(parameters: Parameters, e: Array) -> Array:
    """Its principal Kirchhoff stresses [Pa] of log stretches, both (3, ...)."""
    return hencky_principal_stress(*lame(parameters), e)


def _bingham_flow(parameters: Parameters, e: Array, history: Array, dt: Array):
    """|s| = Y + 2 eta |flow| / dt at the end of a step whose trial stress is 2 mu |dev e| (Simo and
    Hughes 1998, section 2.7): in shear |s| = sqrt(2) tau and |flow| = shear / sqrt(2).
    """
    mu, _ = lame(parameters)
    _, deviator, norm = split_deviator(e)
    excess = 2 * mu * norm - UNIAXIAL * parameters["yield_stress"]
    resistance = 2 * mu * dt + 2 * parameters["plastic_viscosity"]
    flow = jnp.where(excess > 0, excess * dt / resistance, 0)
    return e - flow * unit_deviator(deviator, norm), history


@jax.custom_jvp
def shear_rate(excess: Array, stiffness: Array, consistency: Array, index: Array) -> Array:
    """The rate g >= 0 of consistency g^index + stiffness g = excess, all (...); 0 for none.

    The equation of one unknown is made alpha u + beta u^p = 1 with p >= 1 and the larger of alpha
    and beta 1: convex, so that Newton's method descends from u = 1, by six steps to round-off. The
    derivative is the implicit one.
    """
    flows = excess > 0
    thinning = index <= 1
    p = jnp.where(thinning, 1 / index, index)
    linear = jnp.where(thinning, consistency, stiffness)
    power = jnp.where(thinning, stiffness, consistency)
    log = jnp.log(jnp.where(flows, excess, 1))
    one, other = log - jnp.log(linear), (log - jnp.log(power)) / p
    start = jnp.minimum(one, other)
    alpha, beta = jnp.exp(start - one), jnp.exp(p * (start - other))
    u = jnp.ones_like(start)
    for _ in range(5 if jnp.finfo(u.dtype).bits <= 32 else 6):
        grown = beta * jnp.exp(p * jnp.log(u))
        u = u - (alpha * u + grown - 1) / (alpha + p * grown / u)
    g = jnp.exp(jnp.where(thinning, p, 1) * (start + jnp.log(u)))
    return jnp.where(flows, g, 0)


@shear_rate.defjvp
def _shear_rate_jvp(primals, tangents):
    _, stiffness, consistency, index = primals
    dexcess, dstiffness, dconsistency, dindex = tangents
    g = shear_rate(*primals)
    flows = g > 0
    safe = jnp.where(flows, g, 1)
    power = safe**index
    change = (
        dexcess
        - safe * dstiffness
        - power * dconsistency
        - consistency * power * jnp.log(safe) * dindex
    )
    slope = stiffness + index * consistency * power / safe
    return g, jnp.where(flows, change / slope, 0)


def _herschel_bulkley_flow(parameters: Parameters, e: Array, history: Array, dt: Array):
    """tau = tau_y + K g^n at the end of a step whose trial shear stress is sqrt(2) mu |dev e|, and
    which flows by |flow| = g dt / sqrt(2) (Herschel and Bulkley 1926; Yue et al. 2015).
    """
    mu, _ = lame(parameters)
    _, deviator, norm = split_deviator(e)
    excess = SQRT2 * mu * norm - parameters["shear_yield_stress"]
    excess, stiffness, consistency, index = jnp.broadcast_arrays(
        excess, mu * dt, parameters["consistency"], parameters["flow_index"]
    )
    rate = shear_rate(excess, stiffness, consistency, index)
    return e - rate * (dt / SQRT2) * unit_deviator(deviator, norm), history


PLASTICINE = law_of_stretches(
    "viscoplastic von Mises",
    (*ELASTIC_PARAMETERS, YIELD_STRESS, PLASTIC_VISCOSITY),
    hencky_of_stretches,
    stress=hencky_of_logs,
    return_map=_bingham_flow,
    prepare=with_moduli,
    rest=elastic_rest,
)
HERSCHEL_BULKLEY = law_of_stretches(
    "Herschel-Bulkley",
    (BULK_MODULUS, SHEAR_MODULUS, SHEAR_YIELD_STRESS, CONSISTENCY, FLOW_INDEX),
    hencky_of_stretches,
    stress=hencky_of_logs,
    return_map=_herschel_bulkley_flow,
    prepare=with_moduli,
    rest=elastic_rest,
)
