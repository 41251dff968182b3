"""Boundaries that act on particle velocities: impulses, prescribed motion, sequential release.

Which particles they act on is decided by rest positions, so the choice never changes during a
simulation. `apply` takes and returns velocities (3, N) [m/s]; those with `start` and `end` [s] act
while start <= time < end.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.boundaries import FOREVER, _unit_or_error, _vector, active


class ParticleBoundary:
    """Base of what acts on particle velocities."""

    def apply(
        self, position: Array, velocity: Array, rest: Array, mass: Array, time: Array, dt: Array
    ) -> Array:
        """Velocities (3, N) [m/s] after it; position and rest are (3, N) [m], mass (N,) [kg]."""
        raise NotImplementedError


def in_box(points: Array, centre: Array, half_size: Array) -> Array:
    """Which of the points (3, N) lie strictly inside a box, (N,)."""
    return jnp.all(jnp.abs(points - centre[:, None]) < half_size[:, None], axis=0)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Impulse(ParticleBoundary):
    """A force on a region for a while, as an acceleration of the region as one body.

    PhysGaussian gives the force to each particle, which makes the motion depend on how many
    particles there are; here the region's particles share it in proportion to their mass.

    Attributes:
        force: on the whole region [N], (3,).
        centre, half_size: of the region in rest positions [m], (3,).
        start, end: [s].
    """

    force: Array
    centre: Array
    half_size: Array
    start: Array
    end: Array

    def apply(self, position, velocity, rest, mass, time, dt):
        chosen = in_box(rest, self.centre, self.half_size)
        total = jnp.sum(jnp.where(chosen, mass, 0))
        kick = self.force * dt / jnp.where(total > 0, total, 1)
        acts = chosen & active(time, self.start, self.end)
        return velocity + jnp.where(acts, kick[:, None], 0)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Translation(ParticleBoundary):
    """A region's particles move at a given velocity; zero holds them.

    Attributes:
        velocity: [m/s], (3,).
        centre, half_size: of the region in rest positions [m], (3,).
        start, end: [s].
    """

    velocity: Array
    centre: Array
    half_size: Array
    start: Array
    end: Array

    def apply(self, position, velocity, rest, mass, time, dt):
        acts = in_box(rest, self.centre, self.half_size) & active(time, self.start, self.end)
        return jnp.where(acts, self.velocity[:, None], velocity)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rotation(ParticleBoundary):
    """The particles of a cylinder turn about its axis and move along it.

    Attributes:
        point: centre of the cylinder [m], (3,).
        axis: of the cylinder, (3,), of any length.
        half_height, radius: of the region in rest positions [m], ().
        angular_velocity: about the axis, by the right-hand rule [rad/s], ().
        speed: along the axis [m/s], ().
        start, end: [s].
    """

    point: Array
    axis: Array
    half_height: Array
    radius: Array
    angular_velocity: Array
    speed: Array
    start: Array
    end: Array

    def apply(self, position, velocity, rest, mass, time, dt):
        axis = self.axis / jnp.linalg.norm(self.axis)
        arm = rest - self.point[:, None]
        along = jnp.sum(axis[:, None] * arm, axis=0)
        across = jnp.sum(arm**2, axis=0) - along**2
        chosen = (jnp.abs(along) < self.half_height) & (across < self.radius**2)
        turning = jnp.cross(axis, (position - self.point[:, None]).T).T
        motion = self.angular_velocity * turning + (self.speed * axis)[:, None]
        return jnp.where(chosen & active(time, self.start, self.end), motion, velocity)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Release(ParticleBoundary):
    """Particles are held until a plane that sweeps through their rest positions has passed them.

    The plane starts at `first` and reaches `last` at time `end`, at constant speed; before `start`
    all that it will pass are held. PhysGaussian does the same in 50 steps whatever number of layers
    is asked for.

    Attributes:
        normal: direction of the sweep, (3,), of any length.
        first, last: places of the plane along the normal at `start` and `end` [m], ().
        start, end: [s].
    """

    normal: Array
    first: Array
    last: Array
    start: Array
    end: Array

    def apply(self, position, velocity, rest, mass, time, dt):
        normal = self.normal / jnp.linalg.norm(self.normal)
        place = jnp.sum(normal[:, None] * rest, axis=0)
        share = jnp.clip((time - self.start) / (self.end - self.start), 0, 1)
        plane = self.first + share * (self.last - self.first)
        held = (place > plane) & (place >= self.first) & (place <= self.last)
        return jnp.where(held & (time < self.end), 0, velocity)


def _scalars(dtype, *values) -> tuple[Array, ...]:
    return tuple(jnp.asarray(value, dtype) for value in values)


def impulse(
    force, centre, half_size, start: float = 0.0, end: float = FOREVER, dtype=jnp.float32
) -> Impulse:
    """`Impulse` from plain numbers."""
    vectors = (_vector(x, dtype) for x in (force, centre, half_size))
    return Impulse(*vectors, *_scalars(dtype, start, end))


def translation(
    velocity, centre, half_size, start: float = 0.0, end: float = FOREVER, dtype=jnp.float32
) -> Translation:
    """`Translation` from plain numbers."""
    vectors = (_vector(x, dtype) for x in (velocity, centre, half_size))
    return Translation(*vectors, *_scalars(dtype, start, end))


def rotation(
    point,
    axis,
    half_height: float,
    radius: float,
    angular_velocity: float,
    speed: float = 0.0,
    start: float = 0.0,
    end: float = FOREVER,
    dtype=jnp.float32,
) -> Rotation:
    """`Rotation` from plain numbers. Raises InputError on a zero axis."""
    scalars = _scalars(dtype, half_height, radius, angular_velocity, speed, start, end)
    return Rotation(_vector(point, dtype), _unit_or_error(axis, dtype), *scalars)


def release(
    normal, first: float, last: float, start: float, end: float, dtype=jnp.float32
) -> Release:
    """`Release` from plain numbers. Raises InputError on a zero normal."""
    return Release(_unit_or_error(normal, dtype), *_scalars(dtype, first, last, start, end))
