"""How an obstacle moves: at a steady speed and spin, or from one key frame to the next.

Each value says where it has brought a solid by a given time, and how fast it then moves.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import between, one_of, unit, vector
from jaxphys.core.rotations import (
    normalise_quaternion,
    quaternion_product,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)
from jaxphys.mpm.boundaries.base import (
    FOREVER,
    STATIC,
    TIME,
    VELOCITY,
    Numbers,
    Vector,
    active,
    array_of,
)

Quaternion = tuple[float, float, float, float]
ORIENTATION = between(-1e6, 1e6) | {"count": 4, "nonzero": True}
SPIN = vector(between(-1e8, 1e8), unit("rad/s"))
Interpolation = Literal["linear", "smooth"]
STEEPEST = {"linear": 1.0, "smooth": 1.5}  # largest slope of the way between two frames


class Moved(NamedTuple):
    """Where a motion has brought a solid, and how fast it moves.

    displacement: of its centre [m], (3,); orientation: unit quaternion by which it has turned about
    its centre, (4,), or None for none; velocity: of its centre [m/s], (3,); spin: [rad/s], (3,), or
    None for none.
    """

    displacement: Array
    orientation: Array | None
    velocity: Array
    spin: Array | None


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Steady(Numbers):
    """A velocity and a spin that do not change.

    Attributes:
        velocity: of the centre [m/s].
        spin: about the centre, by the right-hand rule [rad/s].
        start, end: moves while start <= time < end [s], and stands still before and after.
    """

    type: ClassVar[str] = "steady"
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=VELOCITY)
    spin: Vector = field(default=(0.0, 0.0, 0.0), metadata=SPIN)
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)

    def moved(self, time: Array) -> Moved:
        """Where it has brought a solid by `time` [s]."""
        velocity, spin = array_of(self.velocity), array_of(self.spin)
        passed = jnp.clip(time - self.start, 0, self.end - self.start)
        moves = active(time, self.start, self.end)
        return Moved(
            velocity * passed,
            rotation_vector_to_quaternion(spin * passed),
            jnp.where(moves, velocity, 0),
            jnp.where(moves, spin, 0),
        )

    def fastest(self, reach: Array) -> Array:
        """Largest speed [m/s], (), of a solid that reaches so far [m] from its centre."""
        return length(array_of(self.velocity)) + length(array_of(self.spin)) * reach


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Keyframes(Numbers):
    """Places and turns at given times.

    Between two of them the centre goes straight and the turn takes the shorter way about one axis
    (Shoemake 1985); before the first and after the last it stands still.

    Attributes:
        times: at least two, growing [s].
        displacements: from where it stands at rest, one at each time [m]; null: none.
        orientations: quaternions w, x, y, z, of any length, by which it has turned about its centre
            from how it stands at rest, one at each time; null: it does not turn.
        interpolation: `linear` moves at a steady speed, which jumps at each time; `smooth` starts
            and ends at rest each time, at up to 1.5 times that speed.
    """

    type: ClassVar[str] = "keyframes"
    times: tuple[float, ...] = field(metadata=TIME)
    displacements: tuple[Vector, ...] | None = field(
        default=None, metadata=between(-1e6, 1e6) | unit("m")
    )
    orientations: tuple[Quaternion, ...] | None = field(default=None, metadata=between(-1e6, 1e6))
    interpolation: Interpolation = field(default="linear", metadata=STATIC | one_of(Interpolation))

    def __post_init__(self):
        super().__post_init__()
        if not isinstance(self.times, tuple):
            return  # arrays, checked when they were numbers
        if len(self.times) < 2 or any(b <= a for a, b in pairwise(self.times)):
            raise InputError(f"times: {self.times}: give at least two, each later than the last")
        for name in ("displacements", "orientations"):
            entries = getattr(self, name)
            if entries is not None and len(entries) != len(self.times):
                raise InputError(
                    f"{name}: {len(entries)} for {len(self.times)} times; give one for each"
                )
        for turn in self.orientations or ():
            if not any(turn):
                raise InputError("orientations: one is zero; give quaternions of any other length")

    @staticmethod
    def _check_shape(entry, value: Array) -> None:
        shape = {"times": (), "displacements": (3,), "orientations": (4,)}[entry.name]
        if value.shape[1:] != shape:
            raise InputError(f"{entry.name}: expected {shape[0]} numbers each")

    def moved(self, time: Array) -> Moved:
        """Where it has brought a solid by `time` [s]."""
        times = array_of(self.times)
        k = jnp.clip(jnp.searchsorted(times, time, side="right") - 1, 0, len(times) - 2)
        start, duration = times[k], times[k + 1] - times[k]
        share = jnp.clip((time - start) / duration, 0, 1)
        rate = jnp.where(active(time, times[0], times[-1]), 1 / duration, 0)
        if self.interpolation == "smooth":
            rate = rate * 6 * share * (1 - share)
            share = share**2 * (3 - 2 * share)
        displacement = velocity = jnp.zeros(3, times.dtype)
        if self.displacements is not None:
            places = array_of(self.displacements)
            way = places[k + 1] - places[k]
            displacement, velocity = places[k] + share * way, rate * way
        if self.orientations is None:
            return Moved(displacement, None, velocity, None)
        first, turn = self._turn(k)
        orientation = quaternion_product(rotation_vector_to_quaternion(share * turn), first)
        return Moved(displacement, orientation, velocity, rate * turn)

    def _turn(self, k: Array | int) -> tuple[Array, Array]:
        """The orientation of frame k (4,), and the turn from there to the next [rad], (3,)."""
        turns = normalise_quaternion(array_of(self.orientations))
        back = turns[k] * jnp.array([1, -1, -1, -1], turns.dtype)
        return turns[k], quaternion_to_rotation_vector(quaternion_product(turns[k + 1], back))

    def fastest(self, reach: Array) -> Array:
        """Largest speed [m/s], (), of a solid that reaches so far [m] from its centre."""
        times = array_of(self.times)
        ways = jnp.zeros(len(times) - 1, times.dtype)
        if self.displacements is not None:
            ways = jax.vmap(length)(jnp.diff(array_of(self.displacements), axis=0))
        if self.orientations is not None:
            turns = [length(self._turn(k)[1]) for k in range(len(times) - 1)]
            ways = ways + jnp.stack(turns) * reach
        return STEEPEST[self.interpolation] * jnp.max(ways / jnp.diff(times))


def length(vector: Array) -> Array:
    """|vector|, ()."""
    return jnp.sqrt(jnp.sum(vector**2))
