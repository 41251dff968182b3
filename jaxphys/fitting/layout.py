"""The free numbers of a fit as one vector, and what they are in the simulation."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError, nearest
from jaxphys.fitting.free import Field, Free
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.mpm.simulation import Simulation
from jaxphys.scene.look import Look

GAUSSIANS = "gaussians."
BOUNDARIES = "boundaries."
# What the motion starts from: it is found first, from the first frames.
STATE = ("velocity", "spin", "position", "affine", "deformation")
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Entry:
    """One name of `free`: where its numbers are in the vector.

    Attributes:
        name: as the user gave it.
        free: what the numbers may be.
        start, stop: of the vector.
        shape: of the numbers: that of the value, with groups or nodes before it.
        groups: (N,) which of them each particle has, or None: all the same.
        nodes: (8, N) and (8, N), nodes and weights of a `Field`, or None.
    """

    name: str
    free: Free | Field
    start: int
    stop: int
    shape: tuple[int, ...]
    groups: np.ndarray | None
    nodes: tuple[np.ndarray, np.ndarray] | None

    @property
    def kind(self) -> Free:
        """The kind of number."""
        return self.free.value if isinstance(self.free, Field) else self.free

    @property
    def labels(self) -> list[str]:
        """A name for each of its numbers."""
        made = []
        for index in np.ndindex(self.shape):
            parts = list(index)
            grouped = self.groups is not None or self.nodes is not None
            label = self.name + (f"[{parts.pop(0)}]" if grouped else "")
            if parts:
                at = parts[-1]
                label += f".{AXES[at]}" if self.shape[-1] == 3 else f"[{at}]"
            made.append(label)
        return made


@dataclass(frozen=True)
class Layout:
    """All free numbers of a fit.

    Attributes:
        entries: in the order in which they were given.
    """

    entries: tuple[Entry, ...]

    @property
    def size(self) -> int:
        """How many numbers."""
        return self.entries[-1].stop

    @property
    def labels(self) -> list[str]:
        """A name for each of them."""
        return [label for entry in self.entries for label in entry.labels]

    def start(self) -> np.ndarray:
        """Where the search begins, on the line, float64 (size,)."""
        return self.vector({entry.name: entry.kind.start for entry in self.entries})

    def vector(self, values: Mapping[str, Any]) -> np.ndarray:
        """Values by name, in the user's units, as places on the line, float64 (size,)."""
        return np.concatenate(
            [
                np.broadcast_to(
                    np.asarray(entry.kind.to_line(np.asarray(values[entry.name], np.float64))),
                    entry.shape,
                ).ravel()
                for entry in self.entries
            ]
        )

    def scale(self, vector: np.ndarray) -> np.ndarray:
        """Steps on the line that are much, at `vector`, (size,)."""
        found = []
        for entry in self.entries:
            value = np.asarray(entry.kind.from_line(jnp.asarray(vector[entry.start : entry.stop])))
            found.append(entry.kind.scale(value))
        return np.concatenate(found)

    def farthest(self) -> np.ndarray:
        """How far from 0 on the line a search goes, either way, (size,)."""
        return np.concatenate(
            [np.full(entry.stop - entry.start, entry.kind.farthest) for entry in self.entries]
        )

    def values(self, vector) -> dict[str, Array]:
        """The numbers by name, in the user's units: those of groups and nodes as they are."""
        return {
            entry.name: entry.kind.from_line(vector[entry.start : entry.stop].reshape(entry.shape))
            for entry in self.entries
        }

    def member(self, names) -> np.ndarray:
        """Which numbers belong to entries of these names, bool (size,)."""
        found = np.zeros(self.size, bool)
        for entry in self.entries:
            found[entry.start : entry.stop] = entry.name in names
        return found

    def spread(self, entry: Entry, vector: Array) -> Array:
        """What the simulation is given for an entry: one value, or one for each particle."""
        line = vector[entry.start : entry.stop].reshape(entry.shape)
        if entry.nodes is not None:
            which, much = entry.nodes
            line = jnp.sum(line[which] * much, axis=0)
        elif entry.groups is not None:
            line = line[entry.groups]
        return entry.kind.from_line(line)

    def applied(
        self, simulation: Simulation, look: Look | None, vector: Array
    ) -> tuple[Simulation, Look | None]:
        """The simulation and what is drawn of it, with these numbers."""
        numbers: dict[str, Any] = {}
        boundaries: dict[int, dict[str, Any]] = {}
        drawn: dict[str, Any] = {}
        for entry in self.entries:
            value = self.spread(entry, vector)
            if entry.name.startswith(GAUSSIANS):
                drawn[entry.name.removeprefix(GAUSSIANS)] = value
            elif entry.name.startswith(BOUNDARIES):
                index, *parts, last = boundary_path(entry.name)
                place = boundaries.setdefault(int(index), {})
                for part in parts:
                    place = place.setdefault(part, {})
                place[last] = value
            else:
                numbers[entry.name] = value
        if boundaries:
            numbers["boundaries"] = boundaries
        if numbers:
            simulation = simulation.with_(**numbers)
        if boundaries and look is not None:
            look = look.following(simulation.model.boundaries)
        if drawn and look is not None:
            gaussians = look.gaussians
            changed = {
                name: jnp.asarray(value, getattr(gaussians, name).dtype)
                for name, value in drawn.items()
            }
            look = dataclasses.replace(look, gaussians=dataclasses.replace(gaussians, **changed))
        return simulation, look

    def roughness(self, vector: Array) -> list[Array]:
        """What the fields' differences of neighbouring nodes weigh, as residuals."""
        found = []
        for entry in self.entries:
            if isinstance(entry.free, Field):
                first, second = entry.free.neighbours()
                line = vector[entry.start : entry.stop]
                much = (
                    entry.kind.scale(np.asarray(entry.kind.start, np.float64))
                    * entry.free.roughness
                )
                found.append((line[first] - line[second]) / much)
        return found


def boundary_path(name: str) -> list[str]:
    """The place in the list and the names of `boundaries.0.motion.velocity`.

    Raises:
        InputError: it is no such name.
    """
    path = name.split(".")[1:]
    if len(path) < 2 or not all(path) or not (path[0].isascii() and path[0].isdigit()):
        raise InputError(
            f"{name!r} names no number of a boundary: write boundaries, its place in the list from "
            "0, and the number, such as boundaries.0.friction"
        )
    return path


def layout(free: Mapping[str, Free | Field], simulation: Simulation, look: Look | None) -> Layout:
    """Where each free number is in the vector of a fit.

    Raises:
        InputError: nothing is free, a name that nothing here has, a value that is no `Free` or
            `Field`, groups of another length, or appearance without anything drawn.
    """
    if not free:
        raise InputError("free: nothing is free; name at least one number, such as youngs_modulus")
    count = simulation.config.particles
    rest = np.asarray(simulation.frame(simulation.state).position, np.float64)
    entries, at = [], 0
    for name, one in free.items():
        if not isinstance(one, Free | Field):
            raise InputError(
                f"free[{name!r}] is {one!r}: give Free, Log, Bounded, Softplus, Angle or Field"
            )
        groups, nodes = None, None
        if isinstance(one, Field):
            nodes = one.weights(rest)
            shape: tuple[int, ...] = (int(np.prod(one.nodes)),)
        else:
            groups = _groups(name, one, simulation, count)
            own = np.shape(one.start)
            if name.startswith(GAUSSIANS):
                groups, own = None, _drawn_shape(name, look)
            shape = own if groups is None else (int(groups.max()) + 1, *own)
        size = int(np.prod(shape))
        entries.append(Entry(name, one, at, at + size, shape, groups, nodes))
        at += size
    made = Layout(tuple(entries))
    try:
        made.applied(simulation, look, jnp.asarray(made.start(), simulation.model.mass.dtype))
    except InputError as error:
        raise InputError(f"free: {str(error).removeprefix('with_: ')}") from None
    return made


def _groups(name: str, one: Free, simulation: Simulation, count: int) -> np.ndarray | None:
    if one.groups is not None:
        if len(one.groups) != count:
            raise InputError(
                f"free[{name!r}]: groups has {len(one.groups)} entries, but there are {count} "
                "particles"
            )
        return np.asarray(one.groups)
    if one.per == "object":
        return np.repeat(np.arange(len(simulation.counts)), simulation.counts)
    if one.per == "particle":
        return np.arange(count)
    return None


def _drawn_shape(name: str, look: Look | None) -> tuple[int, ...]:
    field = name.removeprefix(GAUSSIANS)
    known = [entry.name for entry in dataclasses.fields(Gaussians)]
    if field not in known:
        raise InputError(f"free: no Gaussians have {field!r}; {nearest(field, known)}")
    if look is None:
        raise InputError(f"free: {name} needs look=, what is drawn; `build` gives it")
    return tuple(getattr(look.gaussians, field).shape)
