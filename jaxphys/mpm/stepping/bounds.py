"""How long a time step may be: bounds from the state, and a check of a step that was given."""

import math
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.core.program import COMPILED_FAST
from jaxphys.core.spectral import left_strain
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.transfer.kernels import KernelName
from jaxphys.mpm.transfer.schemes import Transfer

ADVECTION = 0.5
GRADIENT = 0.2
SAFETY = 0.8
# A particle alone may swing out from a strain a to sqrt(a^2 + SWING^2), or sqrt(3 / 2) a if less.
SWING = 0.007
# Cells that a wave may cross in a step, without and with affine velocities: where particles are one
# a cell, the worst case. More of them allow more, and the blend with FLIP takes nothing away.
SOUND: dict[KernelName, tuple[float, float]] = {
    "quadratic": (math.sqrt(0.5), 1.0),
    "cubic": (1.13, 1.39),
}
DEFAULT = Transfer()
# Share of the step that sound allows where stress follows the mean volume of the step before: what
# of a wave the mean does not see, 1 - a, is damped by W (1 - a) a step, W = (w dt)^2, and must not
# be by more than 2: W < 4 / (2 - a), against 4 where a = 1.
LAGGED = math.sqrt(0.5)


class StepBounds(NamedTuple):
    """Upper bounds of the time step [s], arrays () or numbers, and the step to take.

    Attributes:
        sound: a wave may not cross more than a cell, or what else the transfer allows.
        isolated: a particle alone may not overshoot.
        advection: a particle may not cross more than half a cell, after a fall through the domain.
        gradient: the deformation may not change by more than a fifth.
        viscous: what flows may not be slowed beyond rest.
        contact: what touches a boundary may not overshoot.
        dt: the smallest of them times the safety factor.
    """

    sound: Array | float
    isolated: Array | float
    advection: Array | float
    gradient: Array | float
    viscous: Array | float
    contact: Array | float
    dt: Array | float

    @property
    def reason(self) -> str:
        """The name of the smallest bound. Not for use inside jit."""
        return min(self._fields[:-1], key=lambda name: float(getattr(self, name)))

    @property
    def limit(self) -> float:
        """The smallest bound [s], without the safety factor. Not for use inside jit."""
        return float(getattr(self, self.reason))


def moduli(law: Law, parameters: Parameters, s: Array) -> tuple[Array, Array]:
    """What resists a further small strain at principal stretches s (3, ...): (wave, lone), each
    (...) [Pa].

    wave: the largest rho0 c^2 of all waves, c being their speed in space, not at rest (Sun, Shinar
    and Schroeder 2020, section 4.1). With psi the energy of s, the largest of s_i^2 psi_ii and s_i
    s_j r_ij, where r_ij = (s_i psi_i - s_j psi_j) / (s_i^2 - s_j^2), or where s_i = s_j its limit
    (psi_i + s_i psi_ii - s_j psi_ij) / (2 s_i). At s = 1 it is lambda + 2 mu.

    lone: the largest eigenvalue of d tau / d e, of the Kirchhoff stress by a strain e after s. It
    has the block s_i s_j psi_ij + delta_ij s_i psi_i of stretching and the eigenvalues (s_i^2 +
    s_j^2) r_ij of shearing. At s = 1 it is the larger of 2 mu + 3 lambda and 2 mu.
    """

    energy = law.principal_energy
    if energy is None:
        raise InputError(f"law {law.name}: has neither a principal energy nor moduli of its own")

    def slope(s):
        return jax.grad(lambda x: jnp.sum(energy(parameters, x)))(s)

    axes = np.eye(3, dtype=s.dtype).reshape(3, 3, *[1] * (s.ndim - 1))
    directions = jnp.broadcast_to(axes, (3, *s.shape))
    first, second = jax.vmap(lambda d: jax.jvp(slope, (s,), (d,)), out_axes=(None, 0))(directions)
    # The pairs (0, 1), (1, 2), (2, 0) of each array with the one after it.
    after = jnp.roll(s, -1, axis=0)
    own = jnp.stack([second[i, i] for i in range(3)])
    mixed = jnp.stack([second[i, (i + 1) % 3] for i in range(3)])
    squares, gap = s**2 + after**2, s**2 - after**2
    close = jnp.abs(gap) < jnp.finfo(s.dtype).eps ** (1 / 3) * squares
    limit = (first + s * own - after * mixed) / (2 * s)
    tension = s * first
    ratio = (tension - jnp.roll(tension, -1, axis=0)) / jnp.where(close, 1, gap)
    ratio = jnp.where(close, limit, ratio)
    wave = jnp.maximum(jnp.max(s**2 * own, axis=0), jnp.max(s * after * ratio, axis=0))
    stretching = _eigenvalues(s**2 * own + tension, s * after * mixed)[0]
    return wave, jnp.maximum(stretching, jnp.max(squares * ratio, axis=0))


def _eigenvalues(diagonal: Array, beside: Array) -> Array:
    """Eigenvalues (3, ...), the largest first, of symmetric matrices: their diagonals (3, ...) and
    what stands beside them at (0, 1), (1, 2), (2, 0), (3, ...).

    In closed form (Smith 1961): short, and off by the square root of eps of their spread where two
    of them meet, which is enough for a bound. Not for differentiation.
    """
    # Squares of the largest moduli leave float32.
    largest = jnp.maximum(jnp.max(jnp.abs(diagonal), axis=0), jnp.max(jnp.abs(beside), axis=0))
    largest = jnp.where(largest > 0, largest, 1)
    diagonal, beside = diagonal / largest, beside / largest
    mean = jnp.mean(diagonal, axis=0)
    a, b = diagonal - mean, beside
    size = jnp.sqrt((jnp.sum(a**2, axis=0) + 2 * jnp.sum(b**2, axis=0)) / 6)
    scale = 1 / jnp.where(size > 0, size, 1)
    a, b = a * scale, b * scale
    determinant = (
        a[0] * a[1] * a[2]
        + 2 * b[0] * b[1] * b[2]
        - (a[0] * b[1] ** 2 + a[1] * b[2] ** 2 + a[2] * b[0] ** 2)
    )
    angle = jnp.arccos(jnp.clip(determinant / 2, -1, 1)) / 3
    cosines = jnp.stack([jnp.cos(angle + turn * math.pi / 3) for turn in (0, 4, 2)])
    return largest * (mean + 2 * size * cosines)


def principal_stretches(F: Array) -> Array:
    """Singular values of F, (3, ...), for bounds: see `_eigenvalues`.

    Where the largest outweighs the other two, what it is off by would swamp them: these follow from
    the trace and the determinant.
    """
    B = left_strain(F)
    diagonal = jnp.stack([B[i, i] for i in range(3)])
    squares = 1 + _eigenvalues(diagonal, jnp.stack([B[0, 1], B[1, 2], B[2, 0]]))
    first, mean = squares[0], 0.5 * (3 + jnp.sum(diagonal, axis=0) - squares[0])
    product = algebra.determinant(F) ** 2 / first
    second = mean + jnp.sqrt(jnp.maximum(mean**2 - product, 0))
    small = jnp.stack([first, second, product / jnp.where(second > 0, second, 1)])
    squares = jnp.where(first > 2 * mean, small, squares)
    return jnp.sqrt(jnp.maximum(squares, 8 * jnp.finfo(F.dtype).eps))


def moduli_of(law: Law, parameters: Parameters, F: Array) -> tuple[Array, Array]:
    """(wave, lone) [Pa] of a law at deformation gradients F (3, 3, ...): its own, or `moduli`."""
    if law.moduli is not None:
        return law.moduli(parameters, F)
    return moduli(law, parameters, principal_stretches(F))


def rest_moduli(law: Law, parameters: Parameters, like: Array) -> tuple[Array, Array]:
    """`moduli_of` a law at rest, each broadcast against `like` (...)."""
    if law.rest is not None:
        return law.rest(parameters)
    return moduli_of(law, parameters, _same_in_all_directions(jnp.ones_like(like)))


def _same_in_all_directions(stretch: Array) -> Array:
    """F (3, 3, ...) of a body that is stretched by `stretch` (...) in every direction."""
    return jnp.eye(3, dtype=stretch.dtype).reshape(3, 3, *[1] * stretch.ndim) * stretch


def with_wave_modulus(config, model):
    """The model with what contact must know of the laws: the wave modulus of every particle at
    rest, `Model.wave_modulus`. Itself where there is no boundary to ask for it.
    """
    if not model.boundaries:
        return model
    found = [
        jnp.broadcast_to(rest_moduli(law, parameters, density)[0], density.shape)
        for law, parameters, _, density in _segments(config, model)
    ]
    return replace(model, wave_modulus=jnp.concatenate(found))


def _step_of(length: float, density: Array, modulus: Array) -> Array:
    """length sqrt(rho0 / modulus) [s]; unbounded for what has no mass, and so exerts no force."""
    return jnp.where(density > 0, length * jnp.sqrt(density / modulus), jnp.inf)


def sound_length(transfer: Transfer, spacing: float) -> float:
    """How far a wave may run in a step [m]: the von Neumann limit.

    dx for APIC with quadratic splines (Bai and Schroeder 2022, figure 4). The others are found
    numerically, from the amplification of plane waves on a lattice (docs/transfer.md).
    """
    return spacing * SOUND[transfer.kernel][transfer.scheme.affine]


def lone_length(transfer: Transfer, spacing: float) -> float:
    """The length [m] over which a particle alone swings: its bound is this over sqrt(lone / rho0).

    With k = `inverse_inertia`, a particle that shares its nodes with no other obeys C' = a C - dt
    (k / dx^2) tau(F) / rho0 and F' = (I + dt C') F, whatever its velocity. With an affine part (a =
    1) that is a leapfrog of the frequency w = sqrt(k lone / rho0) / dx, stable up to 2 / w: at rest
    and with quadratic splines the bound of Bai and Schroeder (technical document, 3.12). Without
    one a strain e becomes (1 - (w dt)^2) e, stable up to sqrt(2) / w.
    """
    swing = 2 * spacing / math.sqrt(transfer.spline.inverse_inertia)
    return swing if transfer.scheme.affine else math.sqrt(0.5) * swing


def present_bounds(
    law: Law,
    parameters: Parameters,
    F: Array,
    density: Array,
    spacing: float,
    transfer: Transfer = DEFAULT,
) -> tuple[Array, Array]:
    """(sound, isolated) [s] of each particle as it is now deformed, (...): `sound_length` over the
    speed of waves, `lone_length` over sqrt(lone modulus / rho0).
    """
    present = moduli_of(law, parameters, F)
    # F F^T does not tell the moduli of a state that has lost its stiffness from those at rest.
    largest = map(jnp.maximum, present, rest_moduli(law, parameters, density))
    sound = sound_length(transfer, spacing) * (LAGGED if law.shares_volume else 1)
    lengths = sound, lone_length(transfer, spacing)
    first, second = (
        _step_of(length, density, modulus) for length, modulus in zip(lengths, largest, strict=True)
    )
    return first, second


def isolated_bound(
    law: Law,
    parameters: Parameters,
    F: Array,
    C: Array,
    density: Array,
    spacing: float,
    transfer: Transfer = DEFAULT,
) -> Array:
    """How long a step may be for a particle that swings alone, [s], (...).

    Strained by e, the largest log stretch, it comes back at the other side, where a law may be
    several times stiffer: the lone modulus is the largest of those at stretches exp(-e), 1 and
    exp(e).

    At a share q of the limit of stability the leapfrog swings out to a / sqrt(1 - q^2) of an
    amplitude a; a^2 is e^2 and what the strain rate adds, |sym C|^2 / w^2 with the frequency w of
    `lone_length`. The bound lets it swing out to sqrt(a^2 + SWING^2), or to sqrt(3/2) a where that
    is less: q = 1 at rest, which is the sharp limit, and q = 0.58 from an amplitude of a hundredth
    on.

    Nor may the energy psi that it holds, once it is all in its rate, rho0 dx^2 / (2 k) |C|^2,
    deform it by more than GRADIENT a step: large rates let a swing leak from one direction into
    another.

    Without an affine part it keeps no rate and swings out no further; the same shares of the
    shorter limit are on the safe side.
    """
    _, rest = rest_moduli(law, parameters, density)
    rate = 0.5 * (C + algebra.transpose(C))
    s = principal_stretches(F)
    e = jnp.max(jnp.abs(jnp.log(s)), axis=0)
    k = transfer.spline.inverse_inertia
    swing = e**2 + jnp.sum(rate**2, axis=(0, 1)) * spacing**2 / k * density / rest
    squeezed, stretched = (_lone_at(law, parameters, jnp.exp(side * e)) for side in (-1, 1))
    modulus = jnp.maximum(rest, jnp.maximum(squeezed, stretched))
    modulus = modulus * (1 + jnp.minimum(swing / SWING**2, 2))
    swinging = _step_of(lone_length(transfer, spacing), density, modulus)
    return jnp.minimum(
        swinging, release_bound(law, parameters, F, s, density, spacing, GRADIENT, transfer)
    )


def release_bound(
    law: Law,
    parameters: Parameters,
    F: Array,
    s: Array,
    density: Array,
    spacing: float,
    gradient: float,
    transfer: Transfer = DEFAULT,
) -> Array:
    """How long a step may be, [s], (...), lest a particle alone be deformed by more than `gradient`
    in one once the energy that it holds is all in its rate; s: `principal_stretches` of F.
    """
    if law.principal_energy is not None:
        energy = law.principal_energy(parameters, s)
    elif law.energy is not None:
        energy = law.energy(parameters, F, law.at_start(density))
    else:
        return jnp.full_like(density, jnp.inf)
    released = jnp.maximum(8 / gradient**2 * energy, jnp.finfo(density.dtype).tiny)
    return _step_of(lone_length(transfer, spacing), density, released)


def _lone_at(law: Law, parameters: Parameters, stretch: Array) -> Array:
    """The lone modulus (...) [Pa] at the same stretch (...) in every direction."""
    if law.moduli is not None:
        return law.moduli(parameters, _same_in_all_directions(stretch))[1]
    return moduli(law, parameters, jnp.stack([stretch] * 3))[1]


def viscous_bound(
    law: Law,
    parameters: Parameters,
    density: Array,
    spacing: float,
    transfer: Transfer = DEFAULT,
) -> Array:
    """rho0 dx^2 / (k eta) [s], (...), with k = `inverse_inertia`: a particle alone loses 2 k eta /
    (rho0 dx^2) of its strain rate D a second, C' = a C - dt (k / dx^2) 2 eta D / rho0, and may not
    lose it twice over in a step. Without an affine part (a = 0) it may not lose it more than once,
    in half the step.
    """
    if law.viscosity is None:
        return jnp.full_like(density, jnp.inf)
    viscosity = law.viscosity(parameters)
    flows = (density > 0) & (viscosity > 0)
    k = transfer.spline.inverse_inertia * (1 if transfer.scheme.affine else 2)
    return jnp.where(flows, density * spacing**2 / (k * jnp.where(flows, viscosity, 1)), jnp.inf)


def _segments(config, model, history: Array | None = None):
    """(law, parameters, slice, density) of every segment, hardened by a history (H, N)."""
    density = model.mass / jnp.where(model.mass > 0, model.volume, 1)
    for law, start, stop in config.segments:
        parameters = {name: model.parameters[name][start:stop] for name in law.parameters}
        own = None if history is None else history[: len(law.history), start:stop]
        parameters = law.present(law.prepare(parameters), own)
        yield law, parameters, slice(start, stop), density[start:stop]


def contact_bound(model, grid) -> Array:
    """2 / sqrt(k/m) [s], (), with the stiffest contacts k/m [1/s^2] of all boundaries together, for
    several may touch at one place; infinite where none does.
    """
    rates = [boundary.stiffest(model, grid) for boundary in model.boundaries]
    return 2 / jnp.sqrt(sum(rates, jnp.zeros((), model.mass.dtype)))


def hard_limit(
    law: Law,
    parameters: Parameters,
    F: Array,
    density: Array,
    spacing: float,
    transfer: Transfer = DEFAULT,
) -> Array:
    """The step [s] beyond which each particle is unstable as it is now, (...), contact apart.

    parameters: those of the present history, `Law.present`.
    """
    bound = jnp.minimum(*present_bounds(law, parameters, F, density, spacing, transfer))
    if law.viscosity is None:
        return bound
    return jnp.minimum(bound, viscous_bound(law, parameters, density, spacing, transfer))


def fastest(config, model, state) -> Array:
    """Largest speed [m/s], (), of a particle now, after a free fall to the end of the domain, or
    once a boundary has met it: what is elastic leaves a surface at up to twice its speed.
    """
    squared = jnp.sum(state.velocity**2, axis=0)
    if model.gravity is not None:
        ends = jnp.maximum(model.gravity * jnp.array(config.grid.extent, squared.dtype), 0)
        drop = jnp.sum(ends) - jnp.sum(model.gravity[:, None] * state.position, axis=0)
        squared = squared + 2 * jnp.maximum(drop, 0)
    speed = jnp.sqrt(jnp.max(squared))
    for boundary in model.boundaries:
        speed = jnp.maximum(speed, 2 * boundary.fastest().astype(speed.dtype))
    return speed


def step_bounds(config, model, state, safety: float = SAFETY) -> StepBounds:
    """The bounds that the state sets to the time step, as arrays (). Pure.

    Args:
        config: with `grid` and `segments` ((law, start, stop), ...).
        model: with `mass` (N,), `volume` (N,), `parameters`, `gravity` and `boundaries`.
        state: with `position`, `velocity` (3, N), `affine` and `deformation` (3, 3, N).
        safety: what share of the smallest bound to take.
    """
    F, C, spacing = state.deformation, state.affine, config.grid.spacing
    sound, isolated, viscous = [], [], []
    for law, parameters, own, density in _segments(config, model, state.history):
        matter = (density, spacing, config.transfer)
        sound.append(present_bounds(law, parameters, F[..., own], *matter)[0])
        isolated.append(isolated_bound(law, parameters, F[..., own], C[..., own], *matter))
        viscous.append(viscous_bound(law, parameters, *matter))

    def least(bounds):
        return jnp.min(jnp.stack([jnp.min(bound) for bound in bounds]))

    bounds = (
        least(sound),
        least(isolated),
        ADVECTION * spacing / fastest(config, model, state),
        GRADIENT / jnp.sqrt(jnp.max(jnp.sum(C**2, axis=(0, 1)))),
        least(viscous),
        contact_bound(with_wave_modulus(config, model), config.grid),
    )
    return StepBounds(*bounds, dt=safety * jnp.min(jnp.stack(bounds)))


_compiled_bounds = jax.jit(step_bounds, static_argnums=(0, 3), compiler_options=dict(COMPILED_FAST))


def largest_stable_dt(config, model, state, safety: float = SAFETY) -> StepBounds:
    """`step_bounds` as numbers. Runs on the host, in one compiled call.

    Raises:
        InputError: no bound is positive and finite, since the state is not finite.
    """
    bounds = StepBounds(*(float(bound) for bound in _compiled_bounds(config, model, state, safety)))
    if not all(bound > 0 for bound in bounds) or math.isinf(bounds.limit):
        raise InputError(
            f"time step: the state gives no bound ({bounds._asdict()}); its numbers are not finite"
        )
    return bounds


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
    if dt > bounds.limit and not unsafe:
        raise InputError(
            f"time step {dt:.3g} s breaks the {bounds.reason} bound {bounds.limit:.3g} s; "
            f"the largest safe one is {bounds.dt:.3g} s"
        )
