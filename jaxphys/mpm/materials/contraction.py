"""Fibres that pull by themselves, again and again: muscle that works.

The pull is what Holzapfel's fibres lack: an active stress along them, added to the passive one, as
models of the heart have it. Its share of its height is told by the time alone; how it depends on
length and speed (Hill's curves) is left out.
"""

import math

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.mpm.materials.deriving import moduli_by_gradient
from jaxphys.mpm.materials.fibres import FIBRES, fibre_direction, fibre_energy, fibre_stress
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.materials.parameters import Parameter

TENSION = Parameter(
    "fibre_tension",
    "pull of the fibres themselves at the height of a contraction: force over their cross-section "
    "at rest, at their length at rest, and in proportion to it",
    "Pa",
    low_included=True,
)
PERIOD = Parameter(
    "contraction_period", "from one contraction to the next; they begin slack, as sin^2", "s"
)


def activation(parameters: Parameters, clock: Array) -> Array:
    """Share of the tension at a time `clock` [s] after the start, in [0, 1]: sin^2(pi clock /
    period).
    """
    return jnp.sin(math.pi * clock / parameters["contraction_period"]) ** 2


def _fibres(parameters: Parameters, F: Array) -> Array:
    """F a0 (3, ...): the fibres as they lie, as long as they are stretched."""
    a0 = [jnp.broadcast_to(x, F.shape[2:]) for x in fibre_direction(parameters)]
    return algebra.matvec(F, jnp.stack(a0))


def contraction_energy(parameters: Parameters, F: Array, history: Array) -> Array:
    """That of the fibres at rest and T/2 (I4 - 1), (...) [J/m^3]: a pull P = T F a0 a0^T."""
    a = _fibres(parameters, F)
    tension = parameters["fibre_tension"] * activation(parameters, history[0])
    return fibre_energy(parameters, F) + 0.5 * tension * (jnp.sum(a * a, axis=0) - 1)


def _at_its_height(parameters: Parameters, F: Array) -> Array:
    """The energy at full tension, when it is stiffest."""
    return contraction_energy(parameters, F, parameters["contraction_period"][None] / 2)


def _update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    history = history + dt
    a = _fibres(parameters, F_trial)
    tension = parameters["fibre_tension"] * activation(parameters, history[0])
    return F_trial, fibre_stress(parameters, F_trial) + algebra.outer(tension * a, a), history


def _rest(parameters: Parameters) -> tuple[Array, Array]:
    """At full tension, which adds T to what moves along a fibre's direction meets."""
    assert FIBRES.rest is not None
    wave, lone = FIBRES.rest(parameters)
    return wave + parameters["fibre_tension"], lone + parameters["fibre_tension"]


CONTRACTING_FIBRES = Law(
    name="contracting fibres in neo-Hookean",
    declared=(*FIBRES.declared, TENSION, PERIOD),
    history=(0.0,),
    history_names=("clock",),
    update=_update,
    energy=contraction_energy,
    principal_energy=None,
    plastic=False,
    without=(("fibre_tension", FIBRES),),
    prepare=FIBRES.prepare,
    rest=_rest,
    moduli=moduli_by_gradient(_at_its_height, FIBRES.prepare),
)
