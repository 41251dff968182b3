"""What a boundary is, to a scene and to the solver: one class for both.

A boundary is declared with plain numbers, in code or JSON, and is then a part of a scene.
`prepared` gives the same class with arrays, a pytree that the solver traces: its numbers may be
differentiated, its static fields choose the code. It acts by overriding one or more of three
stages of a step; a stage that it does not act in is not traced.
"""

from collections.abc import Mapping
from dataclasses import Field, dataclass, fields, replace
from typing import Any, ClassVar, Self, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError, nearest
from jaxphys.core.fields import (
    NON_NEGATIVE,
    POSITIVE,
    Checked,
    between,
    check_value,
    direction,
    numbers_of,
    unit,
    vector,
)
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.state import Model, RigidBody

Vector = tuple[float, float, float]
Coordinates = tuple[Array, Array, Array]
FOREVER = 1e9
# In cells. What lies this near to an edge lies on it, and so outside: in any precision.
ON_EDGE = 1e-3

# Metadata of fields. Static fields choose the code; derived ones are made by `prepared`, and no
# file has a name for them; of these some hold a value of every particle.
STATIC = {"static": True}
DERIVED = {"keys": ()}
PER_PARTICLE = DERIVED | {"per_particle": True}  # (N,), and no part of what all particles share
PLACE = vector(between(-1e6, 1e6), unit("m"))
HALF_SIZE = vector(POSITIVE, unit("m"))
DIRECTION = direction()
VELOCITY = vector(between(-1e8, 1e8), unit("m/s"))
TIME = between(-1e9, 1e9) | unit("s")
DURATION = NON_NEGATIVE | unit("s")
LENGTH = POSITIVE | unit("m")


@dataclass(frozen=True)
class Setting:
    """What boundaries are prepared for.

    Attributes:
        grid: of the solver.
        rest: positions of all particles at time 0 (N, 3) [m], known or traced.
        volume: of the particles at rest (N,) [m^3].
        dtype: of the simulation.
    """

    grid: Grid
    rest: np.ndarray | Array
    volume: np.ndarray | Array
    dtype: np.dtype

    def in_box(self, centre: Any, half_size: Any) -> Any:
        """Which particles start inside a box, (N,) bool; those on its faces do not. Of arrays of
        numpy alone it is one of numpy.
        """
        reach = half_size - ON_EDGE * self.grid.spacing
        return (abs(self.rest - centre) < reach).all(axis=1)


class Numbers(Checked):
    """Base of what is declared with plain numbers and then holds arrays. Subclasses are frozen
    dataclasses and pytrees, with a `type`.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    type: ClassVar[str]

    def prepared(self, setting: Setting) -> Self:
        """The same with its numbers as arrays, and with what it precomputes.

        Raises:
            InputError: naming the field that cannot be used.
        """
        changes: dict[str, Any] = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if value is None or {"static", "keys"} & set(entry.metadata):
                continue
            if isinstance(value, Numbers):
                changes[entry.name] = value.prepared(setting)
                continue
            changes[entry.name] = jnp.asarray(value, setting.dtype)
            self._check_shape(entry, changes[entry.name])
        return replace(self, **changes).derived(setting)

    def derived(self, setting: Setting) -> Self:
        """The same, prepared, with what it derives from where the particles start."""
        return self

    def changed(self, **values) -> Self:
        """The same, prepared, with other numbers, which may be traced and differentiated; those of
        a part are given by name, such as `motion={"velocity": ...}`.

        Raises:
            InputError: a field that does not exist, chooses code, or is left out of the program; a
                wrong shape; a known number out of range, or known numbers that do not go together.
        """
        numbers = {
            entry.name: entry
            for entry in fields(self)
            if not entry.metadata.get("static") and entry.metadata.get("keys") != ()
        }
        made: dict[str, Any] = {}
        for name, value in values.items():
            if name not in numbers:
                raise InputError(f"{name}: is no number of a {self.type}; {nearest(name, numbers)}")
            now = getattr(self, name)
            if now is None:
                raise InputError(
                    f"{name}: was built as zero or none, which leaves it out of the program; build "
                    "the scene with another one to change it"
                )
            if isinstance(now, Numbers):
                made[name] = _changed_part(name, now, value)
                continue
            made[name] = changed_number(name, now, value, numbers[name].metadata)
        changed = replace(self, **made)
        changed._check_together()
        return changed

    def _check_together(self) -> None:
        """What `__post_init__` checks of numbers, of prepared ones where all of them are known."""
        values = {
            entry.name: getattr(self, entry.name)
            for entry in fields(self)
            if entry.metadata.get("keys") != ()
        }
        if not any(isinstance(part, jax.core.Tracer) for part in jax.tree.leaves(values)):
            arrays = {name: one for name, one in values.items() if isinstance(one, jax.Array)}
            type(self)(**values | {name: plain(np.asarray(one)) for name, one in arrays.items()})

    @staticmethod
    def _check_shape(entry, value: Array) -> None:
        shape = (entry.metadata["count"],) if "count" in entry.metadata else ()
        if value.shape != shape:
            wanted = f"{shape[0]} numbers" if shape else "one number"
            raise InputError(f"{entry.name}: expected {wanted}, got shape {value.shape}")


def _changed_part(name: str, part: Numbers, values: Any) -> Numbers:
    if not isinstance(values, Mapping):
        raise InputError(
            f'{name}: give its numbers by name, such as {{"{fields(part)[0].name}": 0}}'
        )
    try:
        return part.changed(**values)
    except InputError as error:
        raise InputError(f"{name}.{error}") from None


def plain(array: np.ndarray) -> Any:
    """An array as nested tuples of numbers."""
    return tuple(map(plain, array)) if array.ndim else float(array)


class Boundary(Numbers):
    """Base of all boundaries."""

    regions: ClassVar[tuple[str, ...]] = ()  # fields that say which particles it acts on

    def acts_in(self, stage: str) -> bool:
        """Whether a step calls the method called `stage`."""
        return getattr(type(self), stage) is not getattr(Boundary, stage)

    @property
    def rough(self) -> bool:
        """Whether it has friction."""
        return False

    @property
    def free(self) -> bool:
        """Whether it is a rigid body that is pushed back."""
        return False

    def body(self, boundaries: "tuple[Boundary, ...]") -> RigidBody:
        """A free one at time 0, among these prepared boundaries."""
        raise NotImplementedError

    def check_start(self, setting: Setting) -> None:
        """Raises `InputError` where particles start that must not."""

    @property
    def rows(self) -> int:
        """How many rows of `State.slip` it keeps."""
        return 0

    def stiffest(self, model: Model, grid: Grid) -> Array:
        """Largest stiffness over mass of the springs that it puts at particles [1/s^2], ().

        Alone, they are stable for dt < 2 / sqrt(this).
        """
        return jnp.zeros((), model.mass.dtype)

    def fastest(self, begin: Array | float = 0.0, end: Array | float = FOREVER) -> Array:
        """Largest speed [m/s], (), that it gives to matter while begin <= time < end [s]."""
        return jnp.zeros(())

    def loads(self, model: Model, grid: Grid) -> dict[str, Array]:
        """What it must know of every particle, arrays (N,): made once for many steps, of all
        particles, while its stages see some of them at a time.
        """
        own = (entry.name for entry in fields(self) if entry.metadata.get("per_particle"))
        return {name: getattr(self, name) for name in own}

    def shared(self) -> Self:
        """Itself without what it holds of every particle, which its stages get as loads."""
        own = [entry.name for entry in fields(self) if entry.metadata.get("per_particle")]
        return replace(self, **dict.fromkeys(own))

    def impulse(
        self,
        position: Array,
        velocity: Array,
        slip: Array | None,
        loads: dict[str, Array],
        time: Array,
        dt: Array,
        since: Array,
    ) -> tuple[Array, Array | None]:
        """Momentum (3, N) [kg m/s] to be added to what the particles give to the grid, and its rows
        of `State.slip` afterwards. Position [m] and velocity [m/s] are (3, N); loads as `loads`
        makes them, of these particles. A load of zero must mean no momentum.

        dt: of the step from `time` on, in which the momentum acts; since: of the one before, in
        which the particles moved by `since` times their velocity; () [s] each.
        """
        raise NotImplementedError

    def on_grid(
        self, velocity: Array, coordinates: Coordinates, grid: Grid, time: Array, dt: Array
    ) -> Array:
        """Node velocities (3, nx, ny, nz) [m/s] afterwards; coordinates [m] broadcast over them."""
        raise NotImplementedError

    def on_particles(
        self, position: Array, velocity: Array, loads: dict[str, Array], time: Array, dt: Array
    ) -> Array:
        """Particle velocities (3, N) [m/s] afterwards; position (3, N) [m] is the one before."""
        raise NotImplementedError


def changed_number(name: str, now: Array, value: Any, rules: Mapping[str, Any]) -> Array:
    """`value` in place of the number `now`, checked by the rules of its field where it is known."""
    if not any(isinstance(part, jax.core.Tracer) for part in jax.tree.leaves(value)):
        check_value(name, plain(numbers_of(name, value)), rules)
    array = jnp.asarray(value, now.dtype)
    if array.shape != now.shape:
        raise InputError(f"{name}: has shape {array.shape}; give {now.shape}")
    return array


def array_of(value: tuple | float | Array | None) -> Array:
    """A number of a prepared boundary: declared as plain one or derived, it is an array by now."""
    return cast(Array, value)


def active(time: Array, start: Array | float, end: Array | float) -> Array:
    """Whether start <= time < end, shape ()."""
    return (time >= start) & (time < end)


def speed_within(speed: Array, begin: Array, end: Array, start, stop) -> Array:
    """`speed`, () [m/s], if start <= time < stop meets begin <= time < end, else 0."""
    return jnp.where((start < end) & (stop > begin), speed, 0)


def column(vector: Array, like) -> Array:
    """A vector (3,) that broadcasts against (3, ...) for places `like` of any number of axes."""
    return vector.reshape(3, *(1,) * jnp.ndim(like[0]))


def height(x, point: Array | Vector, normal: Array) -> Array:
    """Distance of places x, (3, ...) or three arrays that broadcast, along a unit normal [m]."""
    return algebra.total(normal[i] * (x[i] - point[i]) for i in range(3))


def unit_vector(vector: Array) -> Array:
    """vector / |vector|."""
    return vector / jnp.sqrt(jnp.sum(vector**2))
