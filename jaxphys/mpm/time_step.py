"""How long a time step may be: bounds from the state, and a check of a step that was given."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.spectral import log_stretches, volume_change
from jaxphys.mpm.elasticity import lame
from jaxphys.mpm.law import Law, Parameters

ADVECTION = 0.5
GRADIENT = 0.2
SAFETY = 0.8


class StepBounds(NamedTuple):
    """Upper bounds of the time step [s], and the step to take.

    Attributes:
        sound: a wave may not cross more than a cell.
        isolated: a particle alone may not overshoot.
        advection: a particle may not cross more than half a cell.
        gradient: the deformation may not change by more than a fifth.
        dt: the smallest of them times the safety factor.
        reason: which of them it is: the name of its field.
    """

    sound: float
    isolated: float
    advection: float
    gradient: float
    dt: float
    reason: str


def stiffness(law: Law, parameters: Parameters, F: Array) -> Array:
    """Largest J rho0 c^2 [Pa] of all waves through each particle, shape (...).

    Sun, Shinar and Schroeder (2020, section 4.1): with psi the energy of principal stretches s, the
    largest of s_i^2 psi_ii and s_i s_j (s_i psi_i - s_j psi_j) / (s_i^2 - s_j^2), the latter being
    s_i s_j (psi_i + s_i psi_ii - s_j psi_ij) / (2 s_i) where s_i = s_j. At F = I it is lambda + 2
    mu.
    """
    s = jnp.exp(log_stretches(F))

    def slope(s):
        return jax.grad(lambda x: jnp.sum(law.principal_energy(parameters, x)))(s)

    first = slope(s)
    second = []
    for i in range(3):
        direction = jnp.zeros_like(s).at[i].set(1)
        second.append(jax.jvp(slope, (s,), (direction,))[1])
    terms = [s[i] ** 2 * second[i][i] for i in range(3)]
    near = jnp.finfo(F.dtype).eps ** (1 / 3)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        gap = s[i] ** 2 - s[j] ** 2
        close = jnp.abs(gap) < near * (s[i] ** 2 + s[j] ** 2)
        limit = (first[i] + s[i] * second[i][i] - s[j] * second[i][j]) / (2 * s[i])
        ratio = (s[i] * first[i] - s[j] * first[j]) / jnp.where(close, 1, gap)
        terms.append(s[i] * s[j] * jnp.where(close, limit, ratio))
    return jnp.max(jnp.stack(terms), axis=0)


def sound_bound(law: Law, parameters: Parameters, F: Array, density: Array, spacing: float):
    """dx / c [s] with c = sqrt(stiffness / (J rho0)), the smallest over the particles, shape ().

    The von Neumann limit of APIC with quadratic splines lies at 1.0 dx / c (Bai and Schroeder 2022,
    figure 4).
    """
    J = jnp.maximum(jnp.abs(1 + volume_change(F)), jnp.finfo(F.dtype).eps)
    # F F^T does not tell the moduli of a state that has lost its stiffness from those at rest.
    mu, lam = lame(parameters)
    modulus = jnp.maximum(stiffness(law, parameters, F) / J, lam + 2 * mu)
    return spacing * jnp.min(jnp.sqrt(density / modulus))


def isolated_bound(parameters: Parameters, density: Array, spacing: float):
    """dx sqrt(rho0 / (2 mu + 3 lambda)) [s], the smallest over the particles, shape ().

    A single particle under MLS-MPM with quadratic splines and APIC, after Bai and Schroeder (2022,
    technical document, 3.12): stricter than the speed of sound in a body, and what particles that
    break away must obey.
    """
    mu, lam = lame(parameters)
    # For nu < 0 shearing is the stiffer motion.
    return spacing * jnp.min(jnp.sqrt(density / (2 * mu + 3 * jnp.maximum(lam, 0))))


def largest_stable_dt(config, model, state, safety: float = SAFETY) -> StepBounds:
    """The bounds that the state sets to the time step. Runs on the host; each bound in one jitted
    call.

    Args:
        config: with `grid.spacing` [m] and `segments` ((law, start, stop), ...).
        model: with `mass` (N,), `volume` (N,) and `parameters`.
        state: with `velocity` (3, N), `affine` (3, 3, N) and `deformation` (3, 3, N).
        safety: what share of the smallest bound to take.

    Raises:
        InputError: no bound is positive and finite, since the state is not finite.
    """
    spacing = config.grid.spacing
    bounds = {"sound": math.inf, "isolated": math.inf}
    density = model.mass / model.volume
    for law, start, stop in config.segments:
        parameters = {name: model.parameters[name][start:stop] for name in law.parameters}
        sound, isolated = _segment_bounds(
            law, spacing, parameters, state.deformation[:, :, start:stop], density[start:stop]
        )
        bounds["sound"] = min(bounds["sound"], float(sound))
        bounds["isolated"] = min(bounds["isolated"], float(isolated))
    speed, rate = (float(x) for x in _motion(state.velocity, state.affine))
    bounds["advection"] = ADVECTION * spacing / speed if speed else math.inf
    bounds["gradient"] = GRADIENT / rate if rate else math.inf
    reason = min(bounds, key=lambda name: bounds[name])
    if not all(bound > 0 for bound in bounds.values()) or math.isinf(bounds[reason]):
        raise InputError(
            f"time step: the state gives no bound ({bounds}); its numbers are not finite"
        )
    return StepBounds(**bounds, dt=safety * bounds[reason], reason=reason)


@jax.jit(static_argnums=(0, 1))
def _segment_bounds(law, spacing, parameters, F, density):
    return (
        sound_bound(law, parameters, F, density, spacing),
        isolated_bound(parameters, density, spacing),
    )


@jax.jit
def _motion(velocity, affine):
    return (
        jnp.sqrt(jnp.max(jnp.sum(velocity**2, axis=0))),
        jnp.sqrt(jnp.max(jnp.sum(affine**2, axis=(0, 1)))),
    )


def validate_dt(dt: float, bounds: StepBounds, *, unsafe: bool = False) -> None:
    """Refuses a time step that breaks a bound.

    Args:
        dt: [s].
        bounds: of `largest_stable_dt`; a step up to the smallest bound itself, without the safety
            factor, passes.
        unsafe: let it pass, if it is positive and finite.

    Raises:
        InputError: with the bound that is broken and the largest safe step.
    """
    if not (dt > 0 and np.isfinite(dt)):
        raise InputError(f"time step is {dt}, must be positive and finite")
    limit = getattr(bounds, bounds.reason)
    if dt > limit and not unsafe:
        raise InputError(
            f"time step {dt:.3g} s breaks the {bounds.reason} bound {limit:.3g} s; "
            f"the largest safe one is {bounds.dt:.3g} s"
        )
