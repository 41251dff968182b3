"""What a boundary is, to a scene and to the solver: one class for both.

A boundary is declared with plain numbers, in code or JSON, and is then a part of a scene.
`prepared` gives the same class with arrays, a pytree that the solver traces: its numbers may be
differentiated, its static fields choose the code. It acts by overriding one or more of three
stages of a step; a stage that it does not act in is not traced.
"""

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
    unit,
    vector,
)
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.state import Model

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
        rest: positions of all particles at time 0 (N, 3) [m].
        volume: of the particles at rest (N,) [m^3].
        dtype: of the simulation.
    """

    grid: Grid
    rest: np.ndarray
    volume: np.ndarray
    dtype: np.dtype

    def in_box(self, centre: Vector, half_size: Vector) -> np.ndarray:
        """Which particles start inside a box, (N,); those on its faces do not."""
        reach = np.asarray(half_size) - ON_EDGE * self.grid.spacing
        offset = np.abs(np.asarray(self.rest, np.float64) - np.asarray(centre))
        return np.all(offset < reach, axis=1)


class Boundary(Checked):
    """Base of all boundaries. Subclasses are frozen dataclasses and pytrees, with a `type`."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    type: ClassVar[str]

    def prepared(self, setting: Setting) -> Self:
        """The same boundary with its numbers as arrays, and with what it precomputes.

        Raises:
            InputError: naming the field that cannot be used.
        """
        changes = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if value is not None and not ({"static", "keys"} & set(entry.metadata)):
                changes[entry.name] = jnp.asarray(value, setting.dtype)
                self._check_shape(entry, changes[entry.name])
        return replace(self, **changes)

    def changed(self, **values) -> Self:
        """A prepared boundary with other numbers, which may be traced and differentiated.

        Raises:
            InputError: a field that does not exist, chooses code, or is left out of the program; a
                wrong shape; a known number out of range.
        """
        numbers = {
            entry.name: entry
            for entry in fields(self)
            if not entry.metadata.get("static") and entry.metadata.get("keys") != ()
        }
        arrays = {}
        for name, value in values.items():
            if name not in numbers:
                raise InputError(f"{name}: is no number of a {self.type}; {nearest(name, numbers)}")
            now = getattr(self, name)
            if now is None:
                raise InputError(
                    f"{name}: was built as zero or none, which leaves it out of the program; build "
                    "the scene with another one to change it"
                )
            if not isinstance(value, jax.core.Tracer):
                known = np.asarray(value, np.float64)
                plain = tuple(known.tolist()) if known.ndim else float(known)
                check_value(name, plain, numbers[name].metadata)
            arrays[name] = jnp.asarray(value, now.dtype)
            if arrays[name].shape != now.shape:
                raise InputError(f"{name}: has shape {arrays[name].shape}; give {now.shape}")
        return replace(self, **arrays)

    @staticmethod
    def _check_shape(entry, value: Array) -> None:
        shape = (entry.metadata["count"],) if "count" in entry.metadata else ()
        if value.shape != shape:
            wanted = f"{shape[0]} numbers" if shape else "one number"
            raise InputError(f"{entry.name}: expected {wanted}, got shape {value.shape}")

    def acts_in(self, stage: str) -> bool:
        """Whether a step calls the method called `stage`."""
        return getattr(type(self), stage) is not getattr(Boundary, stage)

    @property
    def rows(self) -> int:
        """How many rows of `State.slip` it keeps."""
        return 0

    def stiffest(self, model: Model, grid: Grid) -> Array:
        """Largest stiffness over mass of the springs that it puts at particles [1/s^2], ().

        Alone, they are stable for dt < 2 / sqrt(this).
        """
        return jnp.zeros((), model.mass.dtype)

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
    ) -> tuple[Array, Array | None]:
        """Momentum (3, N) [kg m/s] to be added to what the particles give to the grid, and its rows
        of `State.slip` afterwards. Position [m] and velocity [m/s] are (3, N); loads as `loads`
        makes them, of these particles. A load of zero must mean no momentum.
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


def array_of(value: Vector | float | Array | None) -> Array:
    """A number of a prepared boundary: declared as plain one or derived, it is an array by now."""
    return cast(Array, value)


def active(time: Array, start: Array | float, end: Array | float) -> Array:
    """Whether start <= time < end, shape ()."""
    return (time >= start) & (time < end)


def column(vector: Array, like) -> Array:
    """A vector (3,) that broadcasts against (3, ...) for places `like` of any number of axes."""
    return vector.reshape(3, *(1,) * jnp.ndim(like[0]))


def height(x, point: Array | Vector, normal: Array) -> Array:
    """Distance of places x, (3, ...) or three arrays that broadcast, along a unit normal [m]."""
    return algebra.total(normal[i] * (x[i] - point[i]) for i in range(3))


def unit_vector(vector: Array) -> Array:
    """vector / |vector|."""
    return vector / jnp.sqrt(jnp.sum(vector**2))
