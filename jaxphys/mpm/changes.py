"""Other numbers for a simulation, by name: in the object's order, and checked where they are known.

What is traced cannot be checked. Ranges that it breaks show in the status of the motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.fields import (
    NON_NEGATIVE,
    PLACE,
    RATE,
    SPEED,
    between,
    check_number,
    numbers_of,
)
from jaxphys.mpm.boundaries import Setting
from jaxphys.mpm.materials.parameters import Parameter, check_parameter
from jaxphys.mpm.state import Config, Model, State, refuse_inverted

GRAVITY = between(-1e6, 1e6)
STRETCH = between(-1e6, 1e6)


def is_traced(value: Any) -> bool:
    """Whether any number of a pytree is known only when its program runs."""
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))


@dataclass(frozen=True)
class Layout:
    """How particles are given and how the solver keeps them.

    Attributes:
        order: the solver's place of each particle of the objects, int32 (N,).
        objects: (start, stop) of each object, in the objects' order.
        dtype: of the simulation.
    """

    order: Array
    objects: tuple[tuple[int, int], ...]
    dtype: Any

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.objects[-1][1]

    def kept(self, value: Array) -> Array:
        """(..., N) from the objects' order into the solver's."""
        return jnp.zeros_like(value).at[..., self.order].set(value, unique_indices=True)

    def array(self, name: str, value: Any, rules: Mapping) -> Array:
        """`value` as an array, its range checked."""
        if not is_traced(value):
            known = numbers_of(f"with_: {name}", value)
            for number in (known.min(initial=0), known.max(initial=0)):
                check_number(f"with_: {name}", float(number), rules)
        return jnp.asarray(value, self.dtype)

    def each(self, name: str, value: Any, shape: tuple[int, ...], rules: Mapping) -> Array:
        """One for all particles, of `shape`, or one each, (N, *shape), as (*shape, N)."""
        array = self.array(name, value, rules)
        every = (self.count, *shape)
        if array.shape == shape:
            return jnp.broadcast_to(array[..., None], (*shape, self.count))
        if array.shape != every:
            raise InputError(f"with_: {name} has shape {array.shape}; give {shape} or {every}")
        return self.kept(jnp.moveaxis(array, 0, -1))


def with_parameters(
    config: Config, model: Model, layout: Layout, values: Mapping[str, Any], others: set[str]
) -> Model:
    """The model with other parameters of its materials; others: what else has a name."""
    known = model.parameters
    laws = [law for law, _, _ in config.segments]
    omitted = {name for law in laws for name in law.omits}
    declared = {parameter.name: parameter for law in laws for parameter in law.declared}
    alternatives = {other.parameter.name: other for law in laws for other in law.alternatives}
    made = {}
    for given, value in values.items():
        other = alternatives.get(given)
        name = given if other is None else other.instead_of
        if name in omitted - set(known):
            raise InputError(
                f"with_: {name} was built as 0, which leaves it out of the program; build the "
                "scene with a positive one to change it"
            )
        if name not in known:
            names = {*known, *others}
            raise InputError(f"with_: no material here has {given!r}; {nearest(given, names)}")
        if name in made:
            raise InputError(f"with_: {name} is given twice, under two names")
        column = parameter(layout, declared[name] if other is None else other.parameter, value)
        made[name] = column if other is None else jnp.asarray(other.convert(column), layout.dtype)
    return replace(model, parameters=known | made)


def parameter(layout: Layout, declared: Parameter, value: Any) -> Array:
    """A parameter of materials, a number or (N,) in the objects' order, as (N,) in the solver's."""
    if not is_traced(value):
        check_parameter(declared, value, "with_")
    value = jnp.asarray(value, layout.dtype)
    if value.shape not in ((), (layout.count,)):
        raise InputError(
            f"with_: {declared.name} has shape {value.shape}; give a number or ({layout.count},)"
        )
    return jnp.broadcast_to(value, (layout.count,)) if value.ndim == 0 else layout.kept(value)


def gravity_of(layout: Layout, gravity: Any) -> Array:
    """(3,) [m/s^2]."""
    made = layout.array("gravity", gravity, GRAVITY)
    if made.shape != (3,):
        raise InputError(f"with_: gravity has shape {made.shape}; give (3,)")
    return made


def with_start(
    config: Config,
    model: Model,
    state: State,
    layout: Layout,
    position: Any,
    velocity: Any,
    spin: Any,
    affine: Any,
    deformation: Any,
) -> State:
    """The state with another start; what is None stays."""
    residual = state.residual
    if position is not None:
        array = layout.array("position", position, PLACE)
        if array.shape != (layout.count, 3):
            raise InputError(f"with_: position has shape {array.shape}; give ({layout.count}, 3)")
        if not is_traced(array):
            _refuse_outside(config, array)
        state = state._replace(position=layout.kept(array.T))
        if residual is not None:
            residual = residual._replace(position=jnp.zeros_like(state.position))
    if velocity is not None:
        made = layout.each("velocity", velocity, (3,), SPEED)
        state = state._replace(velocity=made, affine=jnp.zeros_like(state.affine))
    if spin is not None:
        state = _spinning(model, state, layout, spin, drifts=velocity is None)
    if affine is not None:
        state = state._replace(affine=layout.each("affine", affine, (3, 3), RATE))
    if deformation is not None:
        F = layout.each("deformation", deformation, (3, 3), STRETCH)
        refuse_inverted(jnp.moveaxis(F[..., layout.order], -1, 0), "with_")
        total = None if state.total is None else F
        state = state._replace(deformation=F, total=total)
        if residual is not None:
            none = jnp.zeros_like(F)
            residual = residual._replace(deformation=none, total=None if total is None else none)
    return state._replace(residual=residual)


def _refuse_outside(config: Config, position: Array) -> None:
    within = np.asarray(config.kernel.inside(position.T, config.grid.spacing, config.grid.shape))
    if not within.all():
        which = int(np.flatnonzero(~within)[0])
        where = ", ".join(f"{x:.4g}" for x in np.asarray(position[which]))
        raise InputError(f"with_: position[{which}] ({where}) lies outside of the grid")


def _spinning(model: Model, state: State, layout: Layout, spin: Any, *, drifts: bool) -> State:
    """Every object turning about its centre of mass; drifts: as fast as it moves as a whole."""
    objects = len(layout.objects)
    rates = layout.array("spin", spin, RATE)
    if rates.shape not in ((3,), (objects, 3)):
        raise InputError(f"with_: spin has shape {rates.shape}; give (3,) or ({objects}, 3)")
    rates = jnp.broadcast_to(rates, (objects, 3))
    mass, place, speed = (
        array[..., layout.order] for array in (model.mass, state.position, state.velocity)
    )
    velocities, gradients = [], []
    for rate, (start, stop) in zip(rates, layout.objects, strict=True):
        share = mass[start:stop] / jnp.sum(mass[start:stop])
        arm = place[:, start:stop]
        arm = arm - jnp.sum(share * arm, axis=1, keepdims=True)
        own = speed[:, start:stop]
        if drifts:
            own = jnp.sum(share * own, axis=1, keepdims=True)
        velocities.append(own + jnp.cross(rate, arm, axisb=0, axisc=0))
        gradient = jnp.cross(rate, jnp.eye(3, dtype=rate.dtype), axisb=0, axisc=0)
        gradients.append(jnp.broadcast_to(gradient[..., None], (3, 3, stop - start)))
    return state._replace(
        velocity=layout.kept(jnp.concatenate(velocities, axis=1)),
        affine=layout.kept(jnp.concatenate(gradients, axis=2)),
    )


def with_friction(model: Model, layout: Layout, friction: Any) -> Model:
    """The model with another friction between its objects, if there is any between them.

    Raises:
        InputError: nothing here has friction; or it is out of range or no number.
    """
    if model.friction is None:
        if not any(boundary.rough for boundary in model.boundaries):
            raise InputError(
                "with_: no boundary here has friction, nor has contact between objects; build one "
                "with friction above 0"
            )
        return model
    made = layout.array("friction", friction, NON_NEGATIVE)
    if made.shape != ():
        raise InputError(f"with_: friction has shape {made.shape}; give one number")
    return replace(model, friction=made)


def with_boundaries(
    boundaries: tuple,
    setting: Setting,
    changes: Mapping[int, Mapping[str, Any]],
    friction: Any,
    moved: bool,
) -> tuple:
    """Prepared boundaries with other numbers.

    Args:
        setting: with the start as it is by now.
        changes: numbers by place in the list and name; friction: of all that are rough, or None.
        moved: whether particles start elsewhere.
    """
    made = list(boundaries)
    if not isinstance(changes, Mapping) or not all(
        isinstance(v, Mapping) for v in changes.values()
    ):
        raise InputError(
            "with_: boundaries: give numbers by place and name, such as {0: {'friction': 0.2}}"
        )
    if friction is not None:
        for index in [index for index, boundary in enumerate(made) if boundary.rough]:
            made[index] = _with_numbers(made[index], index, {"friction": friction})
    for index, values in changes.items():
        if index not in range(len(made)):
            raise InputError(f"with_: boundaries[{index!r}]: there are {len(made)}, counted from 0")
        made[index] = _with_numbers(made[index], index, values)
    for index, boundary in enumerate(made):
        names = set(changes.get(index, ()))
        if moved or names & set(boundary.regions):
            made[index] = boundary = boundary.derived(setting)
        if (moved or names) and not is_traced((boundary, setting.rest)):
            try:
                boundary.check_start(setting)
            except InputError as error:
                raise InputError(f"with_: boundaries[{index}].{error}") from None
    return tuple(made)


def _with_numbers(boundary: Any, index: int, values: Mapping[str, Any]) -> Any:
    try:
        return boundary.changed(**values)
    except InputError as error:
        raise InputError(f"with_: boundaries[{index}].{error}") from None
