"""Solids that are given by a signed distance, at rest or moving; from outside or as a container."""

from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import Self

import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import NON_NEGATIVE, one_of
from jaxphys.core.rotations import normalise_quaternion, quaternion_product, quaternion_to_matrix
from jaxphys.mpm.boundaries.base import (
    FOREVER,
    PLACE,
    STATIC,
    TIME,
    Boundary,
    Setting,
    Vector,
    active,
    array_of,
    column,
    speed_within,
)
from jaxphys.mpm.boundaries.contact import FAR, Contact, Face, Surface, stiffness
from jaxphys.mpm.boundaries.free import Free, Pose, Solid, Wrench
from jaxphys.mpm.boundaries.motion import ORIENTATION, Keyframes, Quaternion, Steady
from jaxphys.mpm.state import RigidBody

Motion = Steady | Keyframes | Free


@dataclass(frozen=True)
class Obstacle(Contact):
    """Base of solids that are given by their signed distance in axes of their own.

    Attributes:
        centre: at rest [m].
        orientation: quaternion w, x, y, z, of any length, that turns it about its centre.
        motion: null: at rest.
        inside: whether matter is held in it, as in a container, and not kept out of it.
        surface: `sticky` stops what touches it, `slip` lets it slide but not leave, `separate`
            also lets it leave.
        friction: Coulomb's coefficient; sticky ignores it.
        start, end: acts while start <= time < end [s].
    """

    place = "centre"
    centre: Vector = field(metadata=PLACE)
    orientation: Quaternion = field(
        default=(1.0, 0.0, 0.0, 0.0), kw_only=True, metadata=ORIENTATION
    )
    motion: Motion | None = field(default=None, kw_only=True)
    inside: bool = field(default=False, kw_only=True, metadata=STATIC)
    surface: Surface = field(default="separate", kw_only=True, metadata=STATIC | one_of(Surface))
    friction: float | None = field(default=0.3, kw_only=True, metadata=NON_NEGATIVE)
    start: float = field(default=0.0, kw_only=True, metadata=TIME)
    end: float = field(default=FOREVER, kw_only=True, metadata=TIME)

    @abstractmethod
    def sides(self, x) -> list[tuple[Array, Array]]:
        """Signed distance [m] of the solid, (...), and the direction away from it, (3, ...), at
        places x in its own axes: three arrays of one shape [m]. Several where a container's sides
        each hold what is near them.
        """

    @property
    def count(self) -> int:
        """How many `sides` there are."""
        return 1

    @property
    @abstractmethod
    def reach(self) -> Array:
        """How far it goes from its centre [m], ()."""

    @abstractmethod
    def solid(self) -> Solid:
        """What its shape says of a rigid body."""

    @property
    def free(self) -> bool:
        """Whether it is a rigid body that is pushed back."""
        return isinstance(self.motion, Free)

    def prepared(self, setting: Setting) -> Self:
        if self.free and (self.inside or not self.at_particles):
            raise InputError(
                "motion: only a solid that acts on particles from outside can be free; unset "
                "`inside`, and let it act on particles"
            )
        return super().prepared(setting)

    def placed(self, pose: Pose) -> Self:
        """A free one where it now is."""
        assert isinstance(self.motion, Free)
        return replace(self, motion=replace(self.motion, now=pose))

    def body(self, boundaries: tuple[Boundary, ...]) -> RigidBody:
        """A free one at time 0, among these prepared boundaries."""
        assert isinstance(self.motion, Free)
        kinds = [kind for other in others(boundaries) for kind in other.kinds]
        rows = 3 * sum(surface == "sticky" or rubs for surface, rubs in kinds)
        return self.motion.body(self.pose(jnp.zeros(())), self.solid(), rows)

    def wrench(self, position: Array, given: Array) -> Wrench:
        """Of momenta (3, N) [kg m/s] given to particles at `position` (3, N) [m], by a free one."""
        assert isinstance(self.motion, Free) and self.motion.now is not None
        x, y, z = (position[i] - self.motion.now.centre[i] for i in range(3))
        turning = [y * given[2] - z * given[1], z * given[0] - x * given[2],
                   x * given[1] - y * given[0]]  # fmt: skip
        return Wrench(jnp.sum(given, axis=1), jnp.stack([jnp.sum(part) for part in turning]))

    def stiffest(self, model, grid):
        if not isinstance(self.motion, Free):
            return super().stiffest(model, grid)
        # All its surface is pushed at once, at as many springs as there are particles on it.
        solid = self.solid()
        dense = stiffness(model, grid) / jnp.where(model.volume > 0, model.volume, 1) ** (2 / 3)
        turning = jnp.sum(solid.levers / jnp.diag(self.motion.inertia_of(solid)))
        light = 1 / self.motion.mass_of(solid) + turning
        return super().stiffest(model, grid) + jnp.max(dense) * solid.area * light

    @property
    def kinds(self):
        return ((self.surface, self.friction is not None),) * self.count

    def pose(self, time: Array) -> Pose:
        """Where it is at `time` [s]."""
        centre = array_of(self.centre)
        orientation = normalise_quaternion(array_of(self.orientation))
        if self.motion is None:
            return Pose(centre, orientation, None, None)
        if isinstance(self.motion, Free):
            rates = array_of(self.motion.velocity), array_of(self.motion.spin)
            start = Pose(centre, orientation, *rates)
            return self.motion.now or start
        shift, turn, velocity, spin = self.motion.moved(time)
        if turn is not None:
            orientation = quaternion_product(turn, orientation)
        return Pose(centre + shift, orientation, velocity, spin)

    def faces(self, x, time: Array) -> tuple[Face, ...]:
        pose = self.pose(time)
        arm = jnp.broadcast_arrays(*(x[i] - pose.centre[i] for i in range(3)))
        axes = quaternion_to_matrix(pose.orientation)
        own = [sum(axes[j, i] * arm[j] for j in range(3)) for i in range(3)]
        velocity = surface_velocity(pose, arm)
        acts = active(time, self.start, self.end)
        faces = []
        for distance, normal in self.sides(own):
            turned = jnp.stack([sum(axes[i, j] * normal[j] for j in range(3)) for i in range(3)])
            if self.inside:
                distance, turned = -distance, -turned
            distance = jnp.where(acts, distance, FAR)
            faces.append(Face(distance, turned, velocity, self.friction, self.surface))
        return tuple(faces)

    def fastest(self, begin=0.0, end=FOREVER):
        if self.motion is None:
            return jnp.zeros(())
        return speed_within(self.motion.fastest(self.reach), begin, end, self.start, self.end)


def others(boundaries: tuple[Boundary, ...]) -> list[Contact]:
    """The surfaces that a free one may touch."""
    return [b for b in boundaries if isinstance(b, Contact) and not b.free]


def surface_velocity(pose: Pose, arm) -> Array:
    """v + w x r [m/s], (3, ...), of a solid at places `arm` from its centre, three arrays [m]."""
    velocity = jnp.zeros_like(pose.centre) if pose.velocity is None else pose.velocity
    v = column(velocity, arm)
    if pose.spin is None:
        return v
    (wx, wy, wz), (x, y, z) = pose.spin, arm
    return v + jnp.stack([wy * z - wz * y, wz * x - wx * z, wx * y - wy * x])


def length_and_direction(x) -> tuple[Array, Array]:
    """|x| (...) and x / |x| (K, ...) of K arrays of one shape; the first axis where x is zero."""
    x = jnp.stack(x)
    squared = jnp.sum(x**2, axis=0)
    there = squared > 0
    length = jnp.sqrt(jnp.where(there, squared, 1))
    first = jnp.arange(len(x)).reshape(-1, *(1,) * squared.ndim) == 0
    return jnp.where(there, length, 0), jnp.where(there, x / length, first)
