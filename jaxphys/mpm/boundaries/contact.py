"""Contact of particles, or of nodes, with surfaces that are given by a signed distance.

At particles it is a potential. A particle is a ball of radius r = V^(1/3) / 2, half the distance
between particles of a lattice, so that a body touches where its own surface does. At distance d
from the surface it is pushed out by

    f = k (r - d)+,   k = STIFFNESS * M V / h^2

with M its wave modulus at rest, V its volume, h the spacing: the acceleration is the same whatever
the number of particles in a cell, STIFFNESS (c / h)^2 (r - d)+. Friction is a spring of the same k
along the surface, which gives way where Coulomb's law says so: the elastic part u of the slip, kept
in `State.slip`, is cut to |u| <= mu (r - d)+. Nothing creeps, nothing depends on dt, and without
friction energy is conserved. Surfaces that hold also pull, up to a distance of 2 r beyond touch.

On the grid, nodes inside of the solid lose their velocity: firm, but to within a cell.
"""

from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import one_of
from jaxphys.core.program import part
from jaxphys.mpm.boundaries.base import (
    ON_EDGE,
    PER_PARTICLE,
    STATIC,
    Boundary,
    Coordinates,
    Setting,
    array_of,
)
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.state import Model

Surface = Literal["sticky", "slip", "separate"]
ActsOn = Literal["particles", "nodes"]

STIFFNESS = 2.0
DEEPEST = 0.5  # cells that a particle may start inside of a solid
_FRICTIONLESS: dict[str, Any] = {"friction": None}  # a field of every subclass
FAR = 1e6  # how far away [m] is what does not act


class Face(NamedTuple):
    """One surface as seen from places (...).

    distance: [m], positive outside, (...); normal: out of the solid, (3, ...); velocity: of the
    surface [m/s], (3, ...); friction: Coulomb's coefficient, (), or None where there is none;
    surface: a `Surface`.
    """

    distance: Array
    normal: Array
    velocity: Array
    friction: Array | float | None
    surface: Surface

    @property
    def keeps_slip(self) -> bool:
        """Whether it has springs along the surface."""
        return self.surface == "sticky" or self.friction is not None


@dataclass(frozen=True)
class Contact(Boundary):
    """Base of boundaries that are surfaces.

    Attributes:
        acts_on: "particles": by a potential at the particles, exact at any place; "nodes": by
            holding grid nodes inside of the solid. None: particles, but nodes where it is sticky.
        particle_radius: [m], (N,).
    """

    place: ClassVar[str]  # the field that an object inside of it should be told to change
    acts_on: ActsOn | None = field(default=None, kw_only=True, metadata=STATIC | one_of(ActsOn))
    particle_radius: Array | None = field(
        default=None, kw_only=True, repr=False, metadata=PER_PARTICLE
    )

    @property
    @abstractmethod
    def friction(self) -> float | None:
        """Coulomb's coefficient, the same for all faces unless they have their own."""

    @abstractmethod
    def faces(self, x, time: Array) -> tuple[Face, ...]:
        """Its surfaces as seen from places x: (3, N), or three arrays that broadcast [m]."""

    @property
    @abstractmethod
    def kinds(self) -> tuple[tuple[Surface, bool], ...]:
        """For each face its surface, and whether it has friction."""

    @property
    def at_particles(self) -> bool:
        """Whether it acts on particles, not on nodes."""
        if self.acts_on is None:
            return not any(surface == "sticky" for surface, _ in self.kinds)
        return self.acts_on == "particles"

    def acts_in(self, stage: str) -> bool:
        return stage == ("impulse" if self.at_particles else "on_grid")

    @property
    def rough(self) -> bool:
        return self.friction is not None

    @property
    def rows(self) -> int:
        if not self.at_particles:
            return 0
        return 3 * sum(surface == "sticky" or rubs for surface, rubs in self.kinds)

    def prepared(self, setting: Setting) -> Self:
        made = super().prepared(setting)
        # Friction of zero is none: its code is left out, and it cannot be differentiated.
        if not self.friction:
            made = replace(made, **_FRICTIONLESS)
        if not made.at_particles:
            return made
        radius = jnp.asarray(0.5 * np.cbrt(setting.volume), setting.dtype)
        made = replace(made, particle_radius=radius)
        made.check_start(setting)
        return made

    def check_start(self, setting: Setting) -> None:
        """Raises InputError where particles start so deep inside that they would be shot out."""
        for distance in _distances(self, jnp.asarray(setting.rest.T, setting.dtype)):
            depth = -np.asarray(distance) / setting.grid.spacing
            if depth.max(initial=0) > DEEPEST:
                raise InputError(
                    f"{self.place}: {(depth > DEEPEST).sum()} particles start inside of it, up to "
                    f"{depth.max():.2g} cells deep; move one of them, or let it act on nodes"
                )

    def stiffest(self, model: Model, grid: Grid) -> Array:
        if not self.at_particles:
            return super().stiffest(model, grid)
        heavy = model.mass > 0
        ratio = stiffness(model, grid) / jnp.where(heavy, model.mass, 1)
        return jnp.max(jnp.where(heavy, ratio, 0))

    def loads(self, model, grid):
        if not self.at_particles:
            return {}
        return super().loads(model, grid) | {"stiffness": stiffness(model, grid)}

    def impulse(self, position, velocity, slip, loads, time, dt, since):
        with part("contact"):
            return self._pushed(position, velocity, slip, loads, time, dt, since)

    def _pushed(self, position, velocity, slip, loads, time, dt, since):
        total, kept, first = jnp.zeros_like(position), [], 0
        for face in self.faces(position, time):
            moved = None
            if face.keeps_slip:
                # `slip` is as the step before left it; the particle has moved since.
                moved = slip[first : first + 3] + since * (velocity - face.velocity)
                first += 3
            pressed, moved = deflection(face, loads["particle_radius"], moved)
            total = total + pressed * face.normal
            if moved is not None:
                total = total - moved
                kept.append(moved)
        return dt * loads["stiffness"] * total, jnp.concatenate(kept) if kept else None

    def on_grid(self, velocity, coordinates: Coordinates, grid, time, dt):
        for face in self.faces(coordinates, time):
            contact = face.velocity + held(velocity - face.velocity, face)
            inside = face.distance < -ON_EDGE * grid.spacing
            velocity = jnp.where(inside, contact, velocity)
        return velocity


def stiffness(model: Model, grid: Grid) -> Array:
    """Stiffness of contact at each particle [N/m], (N,)."""
    return (STIFFNESS / grid.spacing**2) * array_of(model.wave_modulus) * model.volume


def deflection(face: Face, radius: Array, slip: Array | None) -> tuple[Array, Array | None]:
    """By how much the springs of contact are deflected: (N,) along the normal [m], positive where
    they push, and (3, N) along the surface [m], after friction has given way.
    """
    x = radius - face.distance
    pressed = jnp.maximum(x, 0)
    if face.surface != "separate":
        # Pulls in proportion up to r beyond touch, then less and less up to 2 r.
        pressed = pressed - jnp.maximum(jnp.minimum(-x, x + 2 * radius), 0)
    if slip is None:
        return pressed, None
    with part("friction"):
        return pressed, _strained(face, x, radius, pressed, slip)


def _strained(face: Face, x: Array, radius: Array, pressed: Array, slip: Array) -> Array:
    slip = slip - face.normal * jnp.sum(face.normal * slip, axis=0)
    if face.surface == "sticky":
        return jnp.where(x > -2 * radius, slip, 0)
    return shortened(slip, array_of(face.friction) * jnp.abs(pressed))


def shortened(vector: Array, longest: Array) -> Array:
    """Vectors (3, ...) cut to a length of at most `longest` (...)."""
    squared = jnp.sum(vector**2, axis=0)
    longer = squared > longest**2
    length = jnp.sqrt(jnp.where(longer, squared, 1))
    return jnp.where(longer, longest / length, 1) * vector


def held(velocity: Array, face: Face) -> Array:
    """Velocity (3, ...) [m/s] relative to a surface, after contact with it.

    sticky: none is left. slip: the normal part goes, whichever way it points. separate: only a part
    that points into the solid goes. Coulomb's law takes up to `friction` times the normal part that
    was removed off the tangential speed (Stomakhin et al. 2013, section 8); for slip that is both
    when pressed and when pulled.
    """
    if face.surface == "sticky":
        return jnp.zeros_like(velocity)
    along = jnp.sum(velocity * face.normal, axis=0)
    removed = along if face.surface == "slip" else jnp.minimum(along, 0)
    if face.friction is None:
        return velocity - removed * face.normal
    with part("friction"):
        tangential = velocity - along * face.normal
        # Slowed by what friction takes; what is slower than that stops.
        taken = shortened(tangential, face.friction * jnp.abs(removed))
        return tangential - taken + (along - removed) * face.normal


@jax.jit
def _distances(boundary: Contact, points: Array) -> list[Array]:
    """Of points (3, N) from each face of a boundary as it stands at time 0, (N,) each."""
    return [face.distance for face in boundary.faces(points, jnp.zeros(()))]
