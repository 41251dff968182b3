"""The boundary conditions of PhysGaussian's configuration format as ours."""

from typing import Any

from jaxphys.core.errors import InputError, nearest
from jaxphys.mpm.boundaries import (
    FOREVER,
    AnyBoundary,
    Box,
    Cut,
    Impulse,
    Plane,
    Release,
    Rotate,
    Translate,
    Walls,
)
from jaxphys.scene.reader import Reader

SPAN = {"start_time", "end_time"}
KEYS = {
    "bounding_box": set(),
    "cuboid": {"point", "size", "velocity", "reset"} | SPAN,
    "particle_impulse": {"force", "start_time", "num_dt", "point", "size"},
    "enforce_particle_translation": {"point", "size", "velocity"} | SPAN,
    "surface_collider": {"point", "normal", "surface", "friction"} | SPAN,
    "release_particles_sequentially": {"normal", "start_position", "end_position", "num_layers"}
    | SPAN,
    "enforce_particle_velocity_rotation": (
        {"normal", "point", "half_height_and_radius", "rotation_scale", "translation_scale"} | SPAN
    ),
}


def _cuboid(read: Reader, substep: float, notes: list[str]) -> Box:
    resets = read.flag("reset")
    if resets:
        notes.append("cuboid reset: theirs then stops the whole grid; here only the box is held")
    return Box(
        read.numbers("point", 3),
        read.numbers("size", 3),
        read.numbers("velocity", 3),
        read.number("start_time", 0.0),
        read.number("end_time", 1e3),
        15 * substep if resets else 0.0,
    )


def _impulse(read: Reader, substep: float, notes: list[str]) -> Impulse:
    notes.append(
        "particle_impulse: the force is for each particle, so its effect depends on filling"
    )
    return Impulse(
        read.numbers("point", 3, [1, 1, 1]),
        read.numbers("size", 3, [1, 1, 1]),
        read.numbers("force", 3),
        read.number("start_time", 0.0),
        read.whole("num_dt", 1) * substep,
        per_particle=True,
    )


def _translate(read: Reader, substep: float, notes: list[str]) -> Translate:
    return Translate(
        read.numbers("point", 3),
        read.numbers("size", 3),
        read.numbers("velocity", 3),
        read.number("start_time"),
        read.number("end_time"),
    )


def _plane(read: Reader, substep: float, notes: list[str]) -> Plane | Cut:
    surface, friction = read.text("surface", "sticky"), read.number("friction", 0.0)
    if surface == "sticky" and friction != 0:
        raise InputError(
            f"{read.where}.friction: sticky surfaces take friction 0, found {friction}"
        )
    point, normal = read.numbers("point", 3), read.numbers("normal", 3)
    start, end = read.number("start_time", 0.0), read.number("end_time", FOREVER)
    if surface == "cut":
        notes.append("surface_collider cut: slides along the plane here, along x and z there")
        return Cut(point, normal, start=start, end=end)
    if surface != "sticky":
        notes.append(f"surface_collider {surface}: theirs sticks whatever it says; not so here")
    kind = surface if surface in ("sticky", "slip") else "separate"
    return Plane(point, normal, kind, friction, start, end, acts_on="nodes")


def _release(read: Reader, substep: float, notes: list[str]) -> Release:
    read.whole("num_layers", 50)
    notes.append("release_particles_sequentially: 50 layers there, one continuous sweep here")
    return Release(
        read.numbers("normal", 3),
        read.number("start_position"),
        read.number("end_position"),
        read.number("start_time"),
        read.number("end_time"),
    )


def _rotate(read: Reader, substep: float, notes: list[str]) -> Rotate:
    half_height, radius = read.numbers("half_height_and_radius", 2)
    return Rotate(
        read.numbers("point", 3),
        read.numbers("normal", 3),
        half_height,
        radius,
        # By the left hand: theirs is v = -scale n x r.
        -read.number("rotation_scale"),
        read.number("translation_scale"),
        read.number("start_time"),
        read.number("end_time"),
    )


def _walls(read: Reader, substep: float, notes: list[str]) -> Walls:
    return Walls(acts_on="nodes")


READERS = {
    "bounding_box": _walls,
    "cuboid": _cuboid,
    "particle_impulse": _impulse,
    "enforce_particle_translation": _translate,
    "surface_collider": _plane,
    "release_particles_sequentially": _release,
    "enforce_particle_velocity_rotation": _rotate,
}


def read_boundary(value: Any, where: str, substep: float, notes: list[str]) -> AnyBoundary:
    """One entry of `boundary_conditions`; adds to `notes` what differs from PhysGaussian."""
    if not isinstance(value, dict) or not isinstance(value.get("type"), str):
        raise InputError(f"{where}: expected an object with a key 'type'; valid: {', '.join(KEYS)}")
    name = value["type"]
    if name not in KEYS:
        raise InputError(f"{where}.type: unknown boundary {name!r}; {nearest(name, KEYS)}")
    read = Reader(value, KEYS[name] | {"type"}, where)
    try:
        return READERS[name](read, substep, notes)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(where) else f"{where}.{message}") from None
