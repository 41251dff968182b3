"""Boundaries that act on grid velocities: walls, half-spaces, moving boxes, fixed regions, damping.

Each is a frozen pytree: arrays a gradient may reach, and static fields that choose the code.
`apply` takes and returns velocities (3, nx, ny, nz) [m/s], given node coordinates that broadcast
over the grid, the time [s] at the start of the step and its length. Those with `start` and `end`
[s] act while start <= time < end.
"""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError, nearest

Coordinates = tuple[Array, Array, Array]
SURFACES = ("sticky", "slip", "separate")
FOREVER = 1e30


class GridBoundary:
    """Base of what acts on grid velocities."""

    def apply(self, velocity: Array, coordinates: Coordinates, time: Array, dt: Array) -> Array:
        """Velocities (3, nx, ny, nz) [m/s] after the boundary."""
        raise NotImplementedError


def static(**kwargs):
    """A dataclass field that is part of the program, not of the numbers."""
    return field(metadata={"static": True}, **kwargs)


def check_surface(surface: str) -> None:
    """Raises InputError unless `surface` is one of SURFACES."""
    if surface not in SURFACES:
        raise InputError(f"unknown surface {surface!r}; {nearest(surface, SURFACES)}")


def active(time: Array, start: Array, end: Array) -> Array:
    """Whether start <= time < end, shape ()."""
    return (time >= start) & (time < end)


def _column(vector: Array, like: Array) -> Array:
    return jnp.asarray(vector, like.dtype).reshape(3, 1, 1, 1)


def resolve_contact(velocity: Array, normal: Array, friction: Array, surface: str) -> Array:
    """Velocity relative to a wall, after contact with it.

    sticky: none is left. slip: the normal part goes, whichever way it points. separate: only a part
    that points into the wall goes. Coulomb's law takes up to `friction` times the normal part that
    was removed off the tangential speed (Stomakhin et al. 2013, section 8); for slip that is both
    when pressed and when pulled.

    Args:
        velocity: (3, ...) [m/s], relative to the wall.
        normal: unit, out of the wall, broadcastable to (3, ...).
        friction: coefficient >= 0.
        surface: one of SURFACES.
    """
    if surface == "sticky":
        return jnp.zeros_like(velocity)
    along = jnp.sum(velocity * normal, axis=0)
    removed = along if surface == "slip" else jnp.minimum(along, 0)
    tangential = velocity - along * normal
    squared = jnp.sum(tangential**2, axis=0)
    moving = squared > 0
    speed = jnp.sqrt(jnp.where(moving, squared, 1))
    left = jnp.maximum(1 - friction * jnp.abs(removed) / speed, 0)
    return jnp.where(moving, left, 1) * tangential + (along - removed) * normal


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Walls(GridBoundary):
    """The six walls of the domain, as layers `thickness` nodes deep.

    Attributes:
        friction: Coulomb's coefficient, ().
        shape: nodes of the grid per axis.
        spacing: of the grid [m].
        thickness: depth of each wall in cells; 3 by default, as PhysGaussian's `bounding_box`.
        surfaces: for -x, +x, -y, +y, -z, +z each one of SURFACES, or "open" for no wall.
    """

    friction: Array
    shape: tuple[int, int, int] = static()
    spacing: float = static()
    thickness: int = static(default=3)
    surfaces: tuple[str, ...] = static(default=("separate",) * 6)

    def __post_init__(self):
        if len(self.surfaces) != 6:
            raise InputError(f"walls: {len(self.surfaces)} surfaces, need six: -x +x -y +y -z +z")
        for surface in self.surfaces:
            if surface != "open":
                check_surface(surface)

    def apply(self, velocity: Array, coordinates: Coordinates, time: Array, dt: Array) -> Array:
        # Half a cell of play, so that round-off of a coordinate cannot move a node out of the wall.
        near = (self.thickness + 0.5) * self.spacing
        for wall, surface in enumerate(self.surfaces):
            if surface == "open":
                continue
            axis, upper = divmod(wall, 2)
            far = (self.shape[axis] - 1) * self.spacing - near
            inside = coordinates[axis] > far if upper else coordinates[axis] < near
            normal = jnp.zeros(3, velocity.dtype).at[axis].set(-1 if upper else 1)
            contact = resolve_contact(velocity, _column(normal, velocity), self.friction, surface)
            velocity = jnp.where(inside, contact, velocity)
        return velocity


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HalfSpace(GridBoundary):
    """A plane wall: everything on the side away from its normal is solid.

    Attributes:
        point: on the surface [m], (3,).
        normal: out of the solid, (3,), of any length.
        friction: Coulomb's coefficient, (); sticky ignores it.
        velocity: of the wall [m/s], (3,); the surface moves with it from `start` on.
        start, end: [s].
        surface: one of SURFACES.
    """

    point: Array
    normal: Array
    friction: Array
    velocity: Array
    start: Array
    end: Array
    surface: str = static(default="separate")

    def __post_init__(self):
        check_surface(self.surface)

    def apply(self, velocity: Array, coordinates: Coordinates, time: Array, dt: Array) -> Array:
        normal = self.normal / jnp.linalg.norm(self.normal)
        point = self.point + self.velocity * jnp.maximum(time - self.start, 0)
        height = sum(normal[i] * (coordinates[i] - point[i]) for i in range(3))
        wall = _column(self.velocity, velocity)
        contact = wall + resolve_contact(
            velocity - wall, _column(normal, velocity), self.friction, self.surface
        )
        return jnp.where((height < 0) & active(time, self.start, self.end), contact, velocity)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cut(GridBoundary):
    """A half-space open in a slot: below the surface all is held but for a layer that slides,
    slowed, along it.

    PhysGaussian's `cut`, whose layer is fixed in the code at heights 0.40 to 0.53 and at a factor
    of 0.3 along x and z, with the layer's bounds and the factor made parameters and the plane's own
    normal in place of y.

    Attributes:
        point: on the surface [m], (3,).
        normal: out of the solid, (3,), of any length.
        lower, upper: bounds of the layer along z [m], ().
        factor: what is left of the tangential velocity in the layer, ().
        start, end: [s].
    """

    point: Array
    normal: Array
    lower: Array
    upper: Array
    factor: Array
    start: Array
    end: Array

    def apply(self, velocity: Array, coordinates: Coordinates, time: Array, dt: Array) -> Array:
        normal = self.normal / jnp.linalg.norm(self.normal)
        height = sum(normal[i] * (coordinates[i] - self.point[i]) for i in range(3))
        layer = (coordinates[2] > self.lower) & (coordinates[2] < self.upper)
        slid = self.factor * resolve_contact(
            velocity, _column(normal, velocity), jnp.zeros((), velocity.dtype), "slip"
        )
        held = jnp.where(layer, slid, 0)
        return jnp.where((height < 0) & active(time, self.start, self.end), held, velocity)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Box(GridBoundary):
    """A box whose nodes move at a given velocity: a fixed region if that is zero.

    Attributes:
        centre: at time `start` [m], (3,); the box moves with its velocity from then on.
        half_size: [m], (3,).
        velocity: [m/s], (3,).
        start, end: [s].
        rest_after: how long after `end` the box's nodes are held still [s], (); PhysGaussian's
            `reset` is 15 steps, and there holds the whole grid by mistake.
    """

    centre: Array
    half_size: Array
    velocity: Array
    start: Array
    end: Array
    rest_after: Array

    def apply(self, velocity: Array, coordinates: Coordinates, time: Array, dt: Array) -> Array:
        moved = self.velocity * jnp.clip(time - self.start, 0, self.end - self.start)
        offsets = [jnp.abs(coordinates[i] - self.centre[i] - moved[i]) for i in range(3)]
        inside = (
            (offsets[0] < self.half_size[0])
            & (offsets[1] < self.half_size[1])
            & (offsets[2] < self.half_size[2])
        )
        velocity = jnp.where(
            inside & active(time, self.start, self.end), _column(self.velocity, velocity), velocity
        )
        resting = inside & active(time, self.end, self.end + self.rest_after)
        return jnp.where(resting, 0, velocity)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Damping(GridBoundary):
    """Grid velocities decay at a rate: v exp(-rate dt), whatever the length of the steps.

    Attributes:
        rate: [1/s], (). PhysGaussian's `grid_v_damping_scale` s a step is rate = -log(s) / dt.
        start, end: [s].
    """

    rate: Array
    start: Array
    end: Array

    def apply(self, velocity: Array, coordinates: Coordinates, time: Array, dt: Array) -> Array:
        rate = jnp.where(active(time, self.start, self.end), self.rate, 0)
        return velocity * jnp.exp(-rate * dt).astype(velocity.dtype)


def _vector(value, dtype) -> Array:
    vector = jnp.asarray(value, dtype)
    if vector.shape != (3,):
        raise InputError(f"boundary: expected three numbers, got shape {vector.shape}")
    return vector


def _unit_or_error(normal, dtype) -> Array:
    normal = _vector(normal, dtype)
    if not jnp.linalg.norm(normal) > 0:
        raise InputError("boundary: the normal is zero; give the direction out of the solid")
    return normal


def _friction(value, dtype) -> Array:
    if not value >= 0:
        raise InputError(f"boundary: friction is {value}, must be >= 0")
    return jnp.asarray(value, dtype)


def walls(
    shape: tuple[int, int, int],
    spacing: float,
    surfaces="separate",
    friction: float = 0.0,
    thickness: int = 3,
    dtype=jnp.float32,
) -> Walls:
    """`Walls` of a grid; `surfaces` is one of SURFACES for all six, or six of them (-x, +x, -y, +y,
    -z, +z).
    """
    six = (surfaces,) * 6 if isinstance(surfaces, str) else tuple(surfaces)
    return Walls(_friction(friction, dtype), tuple(shape), float(spacing), thickness, six)


def half_space(
    point,
    normal,
    surface: str = "separate",
    friction: float = 0.0,
    velocity=(0.0, 0.0, 0.0),
    start: float = 0.0,
    end: float = FOREVER,
    dtype=jnp.float32,
) -> HalfSpace:
    """`HalfSpace` from plain numbers. Raises InputError on a zero normal, a negative friction, an
    unknown surface.
    """
    return HalfSpace(
        _vector(point, dtype),
        _unit_or_error(normal, dtype),
        _friction(friction, dtype),
        _vector(velocity, dtype),
        jnp.asarray(start, dtype),
        jnp.asarray(end, dtype),
        surface,
    )


def cut(
    point,
    normal,
    lower: float = 0.40,
    upper: float = 0.53,
    factor: float = 0.3,
    start: float = 0.0,
    end: float = FOREVER,
    dtype=jnp.float32,
) -> Cut:
    """`Cut` from plain numbers. Raises InputError on a zero normal."""
    scalars = (jnp.asarray(x, dtype) for x in (lower, upper, factor, start, end))
    return Cut(_vector(point, dtype), _unit_or_error(normal, dtype), *scalars)


def box(
    centre,
    half_size,
    velocity=(0.0, 0.0, 0.0),
    start: float = 0.0,
    end: float = FOREVER,
    rest_after: float = 0.0,
    dtype=jnp.float32,
) -> Box:
    """`Box` from plain numbers; with the default velocity a region that is held fixed."""
    return Box(
        _vector(centre, dtype),
        _vector(half_size, dtype),
        _vector(velocity, dtype),
        jnp.asarray(start, dtype),
        jnp.asarray(end, dtype),
        jnp.asarray(rest_after, dtype),
    )


def damping(rate: float, start: float = 0.0, end: float = FOREVER, dtype=jnp.float32) -> Damping:
    """`Damping` from plain numbers. Raises InputError on a negative rate."""
    if not rate >= 0:
        raise InputError(f"damping: rate is {rate} 1/s, must be >= 0")
    return Damping(*(jnp.asarray(x, dtype) for x in (rate, start, end)))
