"""Fracture: a law that loses its tension for good once stretched too far and crumbles where it is
broken, and a count of the pieces it leaves.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.parts import connected_parts
from jaxphys.core.spectral import left_isotropic
from jaxphys.mpm.materials.elasticity import (
    ELASTIC_PARAMETERS,
    elastic_rest,
    hencky_density,
    hencky_principal_energy,
    hencky_principal_stress,
    lame,
    with_moduli,
)
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.materials.parameters import Parameter
from jaxphys.mpm.materials.plasticity import (
    FRICTION_ANGLE,
    PLANE_STRAIN,
    apply_change,
    drucker_prager_values,
    friction_coefficient,
)


def damage_of_strain(strain: Array, fracture_strain: Array, softening_strain: Array) -> Array:
    """Damage in [0, 1] of a particle whose largest principal log strain is `strain`, all (...).

    Zero up to `fracture_strain`. Beyond it the tension (1 - d) * strain falls along a straight line
    and is gone at `fracture_strain + softening_strain`: d = 1 - (e_c / e) (e_f - e) / (e_f - e_c).
    """
    end = fracture_strain + softening_strain
    reached = jnp.clip(strain, fracture_strain, end)
    carried = (fracture_strain / reached) * (end - reached) / softening_strain
    return 1 - jnp.minimum(carried, 1)


def _tension_and_compression(e: Array):
    total = e[0] + e[1] + e[2]
    return jnp.maximum(e, 0), jnp.minimum(e, 0), jnp.maximum(total, 0), jnp.minimum(total, 0)


def _damaged_stress(mu: Array, lam: Array, damage: Array, e: Array) -> Array:
    stretch, squeeze, swelling, shrinking = _tension_and_compression(e)
    return (1 - damage) * (2 * mu * stretch + lam * swelling) + (2 * mu * squeeze + lam * shrinking)


def fracture_values(e: Array, arguments) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Damage and stress in principal log strains (3, ...), for `left_isotropic`.

    Damage never decreases. It takes away the share of the stress that resists stretching (e > 0,
    tr(e) > 0) and leaves the share that resists compression (the spectral split of Miehe et al.
    2010, eq. 28), so faces of a closing crack still push.

    At damage 1 the particle is rubble: sand, with the log volume by which it has opened kept, so
    that a crack must close before it pushes. Stress that came back at the first turn of the strain
    would pump energy, and volume, out of every cycle.

    Args:
        e: trial log strains.
        arguments: mu, lambda [Pa], fracture strain, softening strain, alpha of
            `friction_coefficient`, damage, and the kept log volume, each (...).

    Returns:
        (exp(change) - 1, principal Kirchhoff stress [Pa]), (damage, kept log volume), both new.
    """
    mu, lam, fracture_strain, softening_strain, alpha, damage, kept_volume = arguments
    largest = jnp.maximum(jnp.maximum(e[0], e[1]), e[2])
    damage = jnp.maximum(damage, damage_of_strain(largest, fracture_strain, softening_strain))
    stress = _damaged_stress(mu, lam, damage, e)
    (rubble_change, rubble_stress), (volume,) = drucker_prager_values(
        e, (mu, lam, alpha, kept_volume)
    )
    broken = damage >= 1
    change = jnp.where(broken, rubble_change, 0)
    return (change, jnp.where(broken, rubble_stress, stress)), (
        damage,
        jnp.where(broken, volume, 0),
    )


def _fracture_update(parameters: Parameters, F_trial: Array, history: Array, dt: Array):
    arguments = (
        *lame(parameters),
        parameters["fracture_strain"],
        parameters["softening_strain"],
        friction_coefficient(parameters["friction_angle"]),
        history[0],
        history[1],
    )
    (change, stress), kept = left_isotropic(fracture_values, F_trial, arguments)
    return apply_change(change, F_trial), stress, jnp.stack(kept)


def _trial_values(e, arguments):
    mu, lam, damage = arguments
    rubble = hencky_principal_stress(mu, lam, e)
    return (jnp.where(damage >= 1, rubble, _damaged_stress(mu, lam, damage, e)),), ()


def fracture_trial(parameters: Parameters, F: Array, history: Array) -> Array:
    """Kirchhoff stress (3, 3, ...) [Pa] with the damage as it is: the derivative of
    `fracture_energy` by F.
    """
    ((stress,), _) = left_isotropic(_trial_values, F, (*lame(parameters), history[0]))
    return stress


def _energy_value(e, arguments):
    mu, lam, damage = arguments
    stretch, squeeze, swelling, shrinking = _tension_and_compression(e)
    lost = mu * jnp.sum(stretch**2, axis=0) + 0.5 * lam * swelling**2
    kept = mu * jnp.sum(squeeze**2, axis=0) + 0.5 * lam * shrinking**2
    damaged = (1 - damage) * lost + kept
    return (), (jnp.where(damage >= 1, hencky_density(mu, lam, e), damaged),)


def fracture_energy(parameters: Parameters, F: Array, history: Array) -> Array:
    """Stored energy per rest volume [J/m^3], shape (...): what damage leaves of it (Miehe et al.
    2010, eq. 27), and of rubble, at damage 1, what sand stores.
    """
    (_, (energy,)) = left_isotropic(_energy_value, F, (*lame(parameters), history[0]))
    return energy


FRACTURE = Law(
    name="fracture",
    declared=(
        *ELASTIC_PARAMETERS,
        Parameter(
            "fracture_strain",
            "largest principal strain at which tension starts to fall",
            "log strain",
        ),
        Parameter("softening_strain", "further strain at which all tension is gone", "log strain"),
        FRICTION_ANGLE,
    ),
    alternatives=(PLANE_STRAIN,),
    history=(0.0, 0.0),
    history_names=("damage", "kept_log_volume"),
    update=_fracture_update,
    energy=fracture_energy,
    principal_energy=hencky_principal_energy,
    plastic=True,
    spectral=True,
    breaks=True,
    trial=fracture_trial,
    prepare=with_moduli,
    rest=elastic_rest,
)


def number_of_pieces(positions, radius: float, minimum_size: int = 1) -> int:
    """How many connected pieces the points form, two points being connected if no farther apart
    than `radius`.

    Runs on the host.

    Args:
        positions: (N, 3) [m].
        radius: [m]; a little over the particle spacing finds the pieces that MPM separates at a
            grid cell.
        minimum_size: pieces of fewer points are dust and do not count.

    Raises:
        InputError: positions are not finite, or not (N, 3), or radius is not positive.
    """
    positions = np.asarray(positions, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise InputError(f"number_of_pieces: positions have shape {positions.shape}, need (N, 3)")
    if not np.isfinite(positions).all():
        raise InputError("number_of_pieces: some positions are not finite; check the simulation")
    if not radius > 0:
        raise InputError(f"number_of_pieces: radius is {radius}, must be positive")
    if len(positions) == 0:
        return 0
    return int(np.sum(np.bincount(connected_parts(positions, radius)) >= minimum_size))
