"""Contact at particles as a potential of where a step ends: for implicit steps.

Pressure has one, k Phi(r - d) with Phi' the deflection of `contact`. Friction has none, since what
it may bear grows with pressure; with pressure and normal as the step found them it has one, that of
a spring up to Coulomb's limit and of a constant force beyond (lagged friction, Li et al. 2020,
"Incremental potential contact", section 5).
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.core.program import part
from jaxphys.mpm.boundaries.base import Boundary, array_of
from jaxphys.mpm.boundaries.contact import FAR, Contact, Face, deflection, shortened
from jaxphys.mpm.materials.law import Parameters


class Lag(NamedTuple):
    """Of one face with friction, as the step finds it: normal (3, N), and the longest that springs
    along the surface may be (N,) [m].
    """

    normal: Array
    longest: Array


def has_potential(boundary: Boundary) -> bool:
    """Whether what it does to particles can be a part of an implicit solve."""
    return isinstance(boundary, Contact) and boundary.at_particles


def faces(contact: Contact, position: Array, lost: Array | None, time: Array):
    """The contact's faces as seen from `position` (3, N) [m] and what rounding left out of it,
    `lost` (3, N) [m]: stiff matter at rest presses by less than a digit of its place.
    """
    for face in contact.faces(position, time):
        if lost is not None:
            face = face._replace(distance=face.distance + jnp.sum(face.normal * lost, axis=0))
        yield face


def lags(
    contact: Contact, loads: Parameters, position: Array, lost: Array | None, time: Array
) -> tuple[Lag, ...]:
    """One for each face that keeps slip; position, lost: (3, N) [m] at the start of the step."""
    found = []
    for face in faces(contact, position, lost, time):
        if not face.keeps_slip:
            continue
        radius = loads["particle_radius"]
        if face.surface == "sticky":
            longest = jnp.where(radius - face.distance > -2 * radius, FAR, 0)
        else:
            pressed, _ = deflection(face, radius, None)
            longest = array_of(face.friction) * jnp.abs(pressed)
        found.append(Lag(face.normal, longest.astype(position.dtype)))
    return tuple(found)


def pushed(
    contact: Contact,
    loads: Parameters,
    lags: tuple[Lag, ...],
    slip: Array | None,
    position: Array,
    lost: Array | None,
    velocity: Array,
    time: Array,
    dt: Array,
) -> tuple[Array, Array]:
    """Energy (N,) [J] and force (3, N) [N], the energy's slope by position with its sign turned.

    Args:
        lags: of the step's start.
        slip: rows of `State.slip` at the step's start.
        position: (3, N) [m], that at the start and dt velocity; lost: what rounding left out.
        velocity: (3, N) [m/s]; time: [s] at the end; dt: [s].
    """
    radius, kept = loads["particle_radius"], 0
    energy, force = jnp.zeros_like(radius), jnp.zeros_like(position)
    with part("contact"):
        for face in faces(contact, position, lost, time):
            pressed, _ = deflection(face, radius, None)
            energy, force = energy + pressing(face, radius), force + pressed * face.normal
            if face.keeps_slip and slip is not None:
                with part("friction"):
                    lag, moved = lags[kept], slip[3 * kept : 3 * kept + 3]
                    moved = moved + dt * (velocity - face.velocity)
                    moved = moved - lag.normal * jnp.sum(lag.normal * moved, axis=0)
                    energy = energy + sliding(moved, lag.longest)
                    force = force - shortened(moved, lag.longest)
                kept += 1
        k = loads["stiffness"]
        return k * energy, k * force


def pressing(face: Face, radius: Array) -> Array:
    """The integral (N,) [m^2] of the deflection along the normal."""
    x = radius - face.distance
    pressed = 0.5 * jnp.maximum(x, 0) ** 2
    if face.surface == "separate":
        return pressed
    y = jnp.maximum(-x, 0)
    far = radius**2 - 0.5 * jnp.maximum(2 * radius - y, 0) ** 2
    return pressed + jnp.where(y < radius, 0.5 * y**2, far)


def sliding(moved: Array, longest: Array) -> Array:
    """The potential (N,) [m^2] of springs (3, N) along a surface that are not longer than that."""
    squared = jnp.sum(moved**2, axis=0)
    longer = squared > longest**2
    length = jnp.sqrt(jnp.where(longer, squared, 1))
    return jnp.where(longer, longest * length - 0.5 * longest**2, 0.5 * squared)


def slipped(
    contact: Contact,
    loads: Parameters,
    slip: Array,
    position: Array,
    lost: Array | None,
    velocity: Array,
    time: Array,
    dt: Array,
) -> Array:
    """Its rows of `State.slip` after a step: position and lost (3, N) [m] and time [s] are those at
    the end, velocity (3, N) [m/s] what moved it there.
    """
    rows: list[Array] = []
    for face in faces(contact, position, lost, time):
        if face.keeps_slip:
            first = 3 * len(rows)
            moved = slip[first : first + 3] + dt * (velocity - face.velocity)
            _, after = deflection(face, loads["particle_radius"], moved)
            assert after is not None
            rows.append(after)
    return jnp.concatenate(rows)
