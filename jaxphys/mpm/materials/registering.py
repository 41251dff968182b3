"""A material of one's own: held against what the solver expects, and put into the catalogue."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NoReturn

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core import algebra
from jaxphys.core.errors import InputError, nearest
from jaxphys.core.spectral import log_stretches
from jaxphys.mpm.materials.catalogue import MATERIALS, Material, add, declared_parameters
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.materials.parameters import DENSITY, check_parameter

TOLERANCE = 1e-6  # of the largest number, in float64
# So long that what flows has flowed, and what is viscous bears nothing; and a step as it may be.
LONG, SHORT = 1e9, 1e-4


def register_material(
    name: str,
    law: Law,
    description: str,
    *,
    others: tuple[Law, ...] = (),
    **defaults: float,
) -> Material:
    """Puts a material beside those of the package: scenes, `default_scene`, `materials` and `plan`
    then know it, in this process.

    Args:
        name: what scenes call it.
        law: as `law_of_stretches`, `law_of_volume` or `law_of_gradient` makes it of an energy, or a
            `Law` of one's own.
        description: one line.
        others: laws with the same parameters that a scene may choose instead.
        defaults: of `density` [kg/m^3] and of every parameter of the law.

    Returns:
        the material, as `jaxphys.mpm.MATERIALS` holds it from now on.

    Raises:
        InputError: the name is taken, a default is missing, unknown or out of range, a parameter's
            name means something else already, or a law fails on the spot, at F = I, at equal
            stretches or at a general F: an array of another shape, a stress that is not finite or
            not symmetric, an energy that disagrees with the stress or with its own form in
            principal stretches, a gradient that is not finite. The message gives the number.
    """
    where = f"register_material: {name}"
    if name in MATERIALS:
        raise InputError(f"{where}: there is such a material already; give another name")
    taken = {one.name: one for known in MATERIALS.values() for one in (known.law, *known.others)}
    for one in (law, *others):
        if taken.get(one.name, one) is not one:
            raise InputError(f"{where}: there is another law {one.name!r}; give it another name")
        _check_parameters(where, one, defaults)
        with jax.enable_x64(True):
            _check_law(f"{where}: {one.name}", one, defaults)
    material = Material(name, law, others, description, MappingProxyType(dict(defaults)))
    add(material)
    return material


def _check_parameters(where: str, law: Law, defaults: Mapping[str, float]) -> None:
    declared = {one.name: one for one in (DENSITY, *law.declared)}
    known = declared_parameters()
    for name, one in declared.items():
        if known.get(name, one) != one:
            raise InputError(
                f"{where}: {name} already means {known[name].meaning!r}; take that parameter, or "
                "another name"
            )
        if name not in defaults:
            raise InputError(f"{where}: no default for {name}, {one.text} {one.unit}".rstrip())
        check_parameter(one, defaults[name], where)
    for name in defaults:
        if name not in declared:
            raise InputError(f"{where}: {law.name} reads no {name}; {nearest(name, declared)}")


def _states() -> np.ndarray:
    """Deformation gradients (3, 3, K): none, two equal stretches, and some in no order, turned."""
    random = np.random.default_rng(0)
    general = np.eye(3) + 0.03 * random.normal(size=(4, 3, 3))
    turns = np.linalg.qr(random.normal(size=(4, 3, 3)))[0]
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    equal = np.diag([1.02, 1.02, 0.97])
    return np.stack([np.eye(3), equal, *general, *(turns @ general)], axis=-1)


def _check_law(where: str, law: Law, defaults: Mapping[str, float]) -> None:
    def refuse(what: str) -> NoReturn:
        raise InputError(f"{where}: {what}")

    if len(law.history) != len(law.history_names):
        refuse(f"{len(law.history)} history variables have {len(law.history_names)} names")
    if law.principal_energy is None and law.moduli is None:
        refuse("has neither a principal energy nor moduli: nothing bounds the time step")
    F = jnp.asarray(_states())
    count = F.shape[-1]
    raw = {name: jnp.full(count, float(defaults[name])) for name in law.parameters}
    start = law.at_start(jnp.zeros(count))

    def update(F, raw, dt):
        return law.update(law.prepare(raw), F, start, jnp.asarray(dt))

    like = {"F": F, "the stress": F, "the history": start}
    for label, found in zip(like, jax.eval_shape(update, F, raw, SHORT), strict=True):
        if found.shape != like[label].shape:
            refuse(f"{label} has shape {found.shape}, need {like[label].shape}")

    @jax.jit
    def examined(F, raw):
        short, transpose = jax.vjp(lambda F, raw: update(F, raw, SHORT), F, raw)
        long = update(F, raw, LONG)
        gradients = transpose(jax.tree.map(jnp.ones_like, short))
        return short, long, gradients, _energies(law, law.prepare(raw), long[0], long[2])

    short, long, gradients, energies = jax.tree.map(np.asarray, examined(F, raw))
    for moved in (short, long):
        for label, found in zip(like, moved, strict=True):
            _finite(refuse, label, found)
        tau = moved[1]
        skew = np.max(np.abs(tau - np.swapaxes(tau, 0, 1)))
        if skew > TOLERANCE * np.max(np.abs(tau)):
            refuse(f"the stress is not symmetric: two entries differ by {skew:.3g} Pa")
    _check_energies(refuse, long[1], energies)
    for found in jax.tree.leaves(gradients):
        _finite(refuse, "the gradient of the stress", found)


def _energies(law: Law, values: Any, F: Any, history: Any) -> tuple[Any, Any, Any]:
    """The energy at F, the stress that it says, and the energy of its stretches; None of what the
    law has none of.
    """
    stored = law.energy
    if stored is None:
        return None, None, None
    energy = stored(values, F, history)
    slope = jax.grad(lambda F: jnp.sum(stored(values, F, history)))(F)
    plain = None
    # With a history, that of the stretches is of another state.
    if law.principal_energy is not None and not law.history:
        plain = law.principal_energy(values, jnp.exp(log_stretches(F)))
    return energy, algebra.matmul_transpose(slope, F), plain


def _check_energies(refuse: Any, tau: np.ndarray, energies: tuple[Any, Any, Any]) -> None:
    """The stress of states in which nothing flows any more against the energy's derivative."""
    energy, derived, plain = energies
    if energy is None:
        return
    if energy.shape != tau.shape[2:]:
        refuse(f"the energy has shape {energy.shape}, need {tau.shape[2:]}")
    _finite(refuse, "the energy", energy)
    gap, size = np.max(np.abs(derived - tau)), np.max(np.abs(tau))
    if not gap <= TOLERANCE * size:
        refuse(
            f"energy and stress disagree by {gap:.3g} Pa of {size:.3g}: tau must be "
            "(d energy / d F) F^T"
        )
    if plain is None:
        return
    gap, size = np.max(np.abs(plain - energy)), np.max(np.abs(energy))
    if not gap <= TOLERANCE * size:
        refuse(
            f"the energy of F and that of its stretches differ by {gap:.3g} J/m^3 of {size:.3g}; "
            "if it depends on directions in the matter, say isotropic=False"
        )


_PLACES = ("F = I", "two equal stretches")


def _finite(refuse: Any, label: str, values: np.ndarray) -> None:
    wrong = np.argwhere(~np.isfinite(values))
    if len(wrong):
        place = wrong[0][-1]
        at = _PLACES[place] if place < len(_PLACES) else "a general F"
        refuse(f"{label} is {values[tuple(wrong[0])]} at {at}")
