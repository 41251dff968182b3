"""An obstacle that is pushed back: its mass, and how it starts."""

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.core.fields import POSITIVE, between, unit, vector
from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.mpm.boundaries.base import DERIVED, VELOCITY, Numbers, Vector, array_of
from jaxphys.mpm.boundaries.motion import SPIN, length
from jaxphys.mpm.state import RigidBody


class Pose(NamedTuple):
    """Where a solid is and how it moves.

    centre: [m], (3,); orientation: unit quaternion from its own axes to the world's, (4,);
    velocity: of the centre [m/s], (3,), or None where it never moves; spin: [rad/s], (3,), or None
    where it never turns.
    """

    centre: Array
    orientation: Array
    velocity: Array | None
    spin: Array | None


class Wrench(NamedTuple):
    """What a free solid gave to particles in a step.

    momentum: [kg m/s], (3,); turning: angular momentum about the centre of its pose [kg m^2/s],
    (3,).
    """

    momentum: Array
    turning: Array


class Solid(NamedTuple):
    """What the shape of a solid says of its motion and of where it touches, in axes of its own.

    volume: [m^3], (); middle: its centre of mass, from its centre [m], (3,); inertia: about that,
    of unit density [m^5], (3, 3); area: of its surface [m^2], (); levers: the largest squared lever
    of a push at the surface about each axis through the centre of mass [m^2], (3,); points, radius:
    it touches what is flat where balls around these do, from its centre [m], (3, P) and ().
    """

    volume: Any
    middle: Any
    inertia: Any
    area: Any
    levers: Any
    points: Any
    radius: Any


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Free(Numbers):
    """Moved by what pushes it and by gravity: a rigid body.

    Attributes:
        density: [kg/m^3]; null: given by the mass.
        mass: [kg]; null: given by the density. One of the two is needed.
        inertia: moments about its own axes [kg m^2]; null: those of its shape, evenly filled.
        velocity: of the centre at the start [m/s].
        spin: at the start [rad/s].
        restitution: the share of its speed with which it leaves a plane, a wall or another obstacle
            that it strikes in its middle.
        now: where it is in a step.
    """

    type: ClassVar[str] = "free"
    density: float | None = field(default=None, metadata=POSITIVE | unit("kg/m^3"))
    mass: float | None = field(default=None, metadata=POSITIVE | unit("kg"))
    inertia: Vector | None = field(default=None, metadata=vector(POSITIVE, unit("kg m^2")))
    velocity: Vector = field(default=(0.0, 0.0, 0.0), metadata=VELOCITY)
    spin: Vector = field(default=(0.0, 0.0, 0.0), metadata=SPIN)
    restitution: float = field(default=0.5, metadata=between(0, 1))
    now: Pose | None = field(default=None, kw_only=True, repr=False, metadata=DERIVED)

    def __post_init__(self):
        super().__post_init__()
        declared = isinstance(self.velocity, tuple)
        if declared and (self.density is None) == (self.mass is None):
            raise InputError("density: give a free body either a density or a mass")

    def mass_of(self, solid: Solid) -> Array:
        """[kg], ()."""
        if self.mass is not None:
            return array_of(self.mass)
        return array_of(self.density) * solid.volume

    def inertia_of(self, solid: Solid) -> Array:
        """About the centre of mass, in its own axes [kg m^2], (3, 3)."""
        if self.inertia is not None:
            return jnp.diag(array_of(self.inertia))
        return self.mass_of(solid) / solid.volume * solid.inertia

    def body(self, pose: Pose, solid: Solid, rows: int) -> RigidBody:
        """The body at the start; rows: of its `slip`."""
        mass, own = self.mass_of(solid), self.inertia_of(solid)
        velocity, spin = array_of(self.velocity), array_of(self.spin)
        axes = quaternion_to_matrix(pose.orientation)
        arm = algebra.matvec(axes, solid.middle)
        turned = algebra.matmul(algebra.matmul(axes, own), axes.T)
        small = jnp.finfo(mass.dtype).bits < 64
        return RigidBody(
            position=pose.centre + arm,
            orientation=pose.orientation,
            momentum=mass * (velocity + jnp.cross(spin, arm)),
            angular_momentum=algebra.matvec(turned, spin),
            rest=(jnp.zeros_like(arm), jnp.zeros_like(pose.orientation)) if small else None,
            slip=jnp.zeros((rows, solid.points.shape[1]), mass.dtype) if rows else None,
        )

    def damping_ratio(self) -> Array:
        """Share of critical damping at which a spring and a dashpot leave `restitution` of a speed:
        e = exp(-pi z / sqrt(1 - z^2)).
        """
        e = array_of(self.restitution)
        lossy = jnp.log(jnp.where(e > 0, e, 1))
        ratio = -lossy / jnp.sqrt(math.pi**2 + lossy**2)
        return jnp.where(e > 0, ratio, 1)

    def fastest(self, reach: Array) -> Array:
        """Speed at the start [m/s], (), of a solid that reaches so far [m] from its centre."""
        return length(array_of(self.velocity)) + length(array_of(self.spin)) * reach
