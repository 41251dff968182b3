"""What a fit may change: numbers, each between the user's units and a line without ends.

A search walks on the line; a user reads values. How far a value is from another is told on a scale
of its own, on which a step of one is much: a decade of what is positive, a tenth of the way between
two bounds, the size of what has none.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.fields import numbers_of

Per = Literal["scene", "object", "particle"]
LN10 = float(np.log(10))


@dataclass(frozen=True)
class Free:
    """A number, or several of one meaning, that may be anything.

    Attributes:
        start: where the search begins: a number, or as many as the thing has, such as three of a
            velocity, or an array.
        per: one value for the whole "scene", or one for each "object" or "particle".
        groups: (N,) whole numbers from 0, in the object's order: particles that share a value, in
            place of `per`; a region with a value of its own, say.
        size: by how much a change is much, in the value's units; None: the size of `start`, or 1.

    Raises:
        InputError: `start` is not finite or out of range, or `groups` are no whole numbers.
    """

    type: ClassVar[str] = "free"
    farthest: ClassVar[float] = float("inf")  # place on the line, either way, that a search takes
    start: float | tuple[float, ...]
    per: Per = field(default="scene", kw_only=True)
    groups: np.ndarray | None = field(default=None, kw_only=True, repr=False, metadata={"keys": ()})
    size: float | None = field(default=None, kw_only=True)

    def __post_init__(self):
        start = numbers_of("free: start", self.start)
        if not np.all(np.isfinite(start)):
            raise InputError(f"free: start is {self.start}: give finite numbers")
        if self.per not in get_args(Per):
            raise InputError(f"free: per is {self.per!r}; {nearest(self.per, get_args(Per))}")
        if self.groups is not None:
            groups = np.asarray(self.groups)
            if groups.ndim != 1 or groups.dtype.kind not in "iu" or groups.min(initial=0) < 0:
                raise InputError("free: groups must be (N,) whole numbers from 0")
        if self.size is not None and not self.size > 0:
            raise InputError(f"free: size is {self.size}: give a number above 0")
        self._check_start(start)

    def _check_start(self, start: np.ndarray) -> None:
        """Raises `InputError` where the start is out of range."""

    def to_line(self, value):
        """Values as places on the line."""
        return value

    def from_line(self, place: Array) -> Array:
        """Places on the line as values."""
        return place

    def scale(self, value) -> np.ndarray:
        """Places on the line that make a change that is much, at `value`."""
        size = self.size
        if size is None:
            start = np.abs(np.asarray(self.start, np.float64))
            size = float(np.max(start)) or 1.0
        return np.full(np.shape(value), size)


@dataclass(frozen=True)
class Log(Free):
    """A positive number that may be off by powers of ten: a stiffness, a viscosity, a density."""

    type: ClassVar[str] = "log"

    def _check_start(self, start):
        if not np.all(start > 0):
            raise InputError(f"log: start is {self.start}: give numbers above 0")

    def to_line(self, value):
        return jnp.log(value)

    def from_line(self, place):
        return jnp.exp(place)

    def scale(self, value):
        return np.full(np.shape(value), LN10)


@dataclass(frozen=True)
class Softplus(Free):
    """A number above 0 that may come near it: log(1 + exp(x / size)) size, size that of `start`."""

    type: ClassVar[str] = "softplus"

    def _check_start(self, start):
        if not np.all(start > 0):
            raise InputError(f"softplus: start is {self.start}: give numbers above 0")

    def _unit(self) -> float:
        return float(self.size or np.max(np.asarray(self.start, np.float64)))

    def to_line(self, value):
        x = jnp.asarray(value) / self._unit()
        return x + jnp.log(-jnp.expm1(-x))

    def from_line(self, place):
        return self._unit() * jnp.logaddexp(place, 0.0)

    def scale(self, value):
        return np.ones(np.shape(value))


@dataclass(frozen=True)
class Bounded(Free):
    """A number between two bounds, neither of which it reaches: low + (high - low) / (1 +
    exp(-x)).

    Attributes:
        low, high: the bounds, in the value's units.
    """

    type: ClassVar[str] = "bounded"
    farthest: ClassVar[float] = 9.0  # a ten-thousandth of the way from a bound
    low: float = 0.0
    high: float = 1.0

    def _check_start(self, start):
        if not self.low < self.high:
            raise InputError(f"bounded: low is {self.low}, high {self.high}: give low < high")
        if not np.all((start > self.low) & (start < self.high)):
            raise InputError(
                f"bounded: start is {self.start}: give numbers between {self.low} and {self.high}"
            )

    def to_line(self, value):
        share = (jnp.asarray(value) - self.low) / (self.high - self.low)
        return jnp.log(share) - jnp.log1p(-share)

    def from_line(self, place):
        return self.low + (self.high - self.low) * jax.nn.sigmoid(place)

    def scale(self, value):
        share = (np.asarray(value, np.float64) - self.low) / (self.high - self.low)
        # Near a bound the slope says little: there 4 goes a tenth of the way, as it is curved.
        return 0.1 / np.maximum(share * (1 - share), 0.025)


@dataclass(frozen=True)
class Angle(Free):
    """An angle [degrees], which the search sees in radians."""

    type: ClassVar[str] = "angle"

    def to_line(self, value):
        return jnp.deg2rad(value)

    def from_line(self, place):
        return jnp.rad2deg(place)

    def scale(self, value):
        return np.full(np.shape(value), np.deg2rad(self.size or 10.0))


@dataclass(frozen=True)
class Field:
    """A number that changes smoothly through the object: values at the nodes of a coarse grid over
    it, at rest, between which it is trilinear on the line of `value`.

    Attributes:
        value: what the number is: `Log(2e4)`, say; its start is that of all nodes.
        nodes: of the grid along x, y and z, at least 2 each.
        roughness: how large a difference of neighbouring nodes is expected, on the scale of
            `value` (for `Log` in decades); the smaller, the smoother.
    """

    type: ClassVar[str] = "field"
    value: Free | Log | Bounded | Softplus | Angle
    nodes: tuple[int, int, int] = (4, 4, 4)
    roughness: float = 0.3

    def __post_init__(self):
        if len(self.nodes) != 3 or min(self.nodes) < 2:
            raise InputError(f"field: nodes are {self.nodes}: give three numbers of at least 2")
        if not self.roughness > 0:
            raise InputError(f"field: roughness is {self.roughness}: give a number above 0")
        if np.ndim(self.value.start):
            raise InputError("field: value must start as one number")

    def weights(self, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which nodes (8, N), and by how much (8, N), each particle's value is made of.

        rest: (N, 3) places at rest; the grid spans their bounding box.
        """
        low, high = rest.min(axis=0), rest.max(axis=0)
        nodes = np.array(self.nodes)
        at = (rest - low) / np.maximum(high - low, 1e-30) * (nodes - 1)
        base = np.clip(np.floor(at).astype(int), 0, nodes - 2)
        share = at - base
        which, much = [], []
        for corner in np.ndindex(2, 2, 2):
            node = base + corner
            which.append((node[:, 0] * nodes[1] + node[:, 1]) * nodes[2] + node[:, 2])
            much.append(np.prod(np.where(corner, share, 1 - share), axis=1))
        return np.stack(which), np.stack(much)

    def neighbours(self) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of nodes that lie beside each other, (P,) and (P,)."""
        index = np.arange(np.prod(self.nodes)).reshape(self.nodes)
        pairs = [
            (np.take(index, range(n - 1), axis).ravel(), np.take(index, range(1, n), axis).ravel())
            for axis, n in enumerate(self.nodes)
        ]
        first, second = zip(*pairs, strict=True)
        return np.concatenate(first), np.concatenate(second)
