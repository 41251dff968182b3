"""The boundary conditions of PhysGaussian's configuration format: as its file has them, and each
as one of ours.
"""

from dataclasses import dataclass, field
from typing import ClassVar

from jaxphys.core.errors import InputError
from jaxphys.core.fields import LENGTH, PLACE, SPEED, TIME, between
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
from jaxphys.mpm.boundaries.contact import Surface

Vector = tuple[float, float, float]
FLAG = {"zero_or_one": True}
MOST_STEPS = between(1, 100_000_000)


@dataclass(frozen=True)
class BoundingBox:
    """The faces of the grid."""

    type: ClassVar[str] = "bounding_box"

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        """What it is here; adds to `notes` what differs. So does `ours` of the others."""
        return Walls(acts_on="nodes")


@dataclass(frozen=True)
class Cuboid:
    """A box of the grid that moves."""

    type: ClassVar[str] = "cuboid"
    point: Vector = field(metadata=PLACE)
    size: Vector = field(metadata=LENGTH)
    velocity: Vector = field(metadata=SPEED)
    start_time: float = field(default=0.0, metadata=TIME)
    end_time: float = field(default=1e3, metadata=TIME)
    reset: bool = field(default=False, metadata=FLAG)

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        if self.reset:
            notes.append(
                "cuboid reset: theirs then stops the whole grid; here only the box is held"
            )
        rest = 15 * substep if self.reset else 0.0
        return Box(self.point, self.size, self.velocity, self.start_time, self.end_time, rest)


@dataclass(frozen=True)
class ParticleImpulse:
    """A push on the particles of a box."""

    type: ClassVar[str] = "particle_impulse"
    force: Vector
    start_time: float = field(default=0.0, metadata=TIME)
    num_dt: int = field(default=1, metadata=MOST_STEPS)
    point: Vector = field(default=(1.0, 1.0, 1.0), metadata=PLACE)
    size: Vector = field(default=(1.0, 1.0, 1.0), metadata=LENGTH)

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        notes.append(
            "particle_impulse: the force is for each particle, so its effect depends on filling"
        )
        duration = self.num_dt * substep
        return Impulse(
            self.point, self.size, self.force, self.start_time, duration, per_particle=True
        )


@dataclass(frozen=True)
class ParticleTranslation:
    """The particles of a box move at one velocity."""

    type: ClassVar[str] = "enforce_particle_translation"
    point: Vector = field(metadata=PLACE)
    size: Vector = field(metadata=LENGTH)
    velocity: Vector = field(metadata=SPEED)
    start_time: float = field(metadata=TIME)
    end_time: float = field(metadata=TIME)

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        return Translate(self.point, self.size, self.velocity, self.start_time, self.end_time)


@dataclass(frozen=True)
class SurfaceCollider:
    """A half-space."""

    type: ClassVar[str] = "surface_collider"
    point: Vector = field(metadata=PLACE)
    normal: Vector = field(metadata=PLACE)
    surface: str = "sticky"
    friction: float = field(default=0.0, metadata=between(0, 1e6))
    start_time: float = field(default=0.0, metadata=TIME)
    end_time: float = field(default=FOREVER, metadata=TIME)

    def __post_init__(self):
        if self.surface == "sticky" and self.friction != 0:
            raise InputError(f"friction: sticky surfaces take friction 0, found {self.friction}")

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        start, end = self.start_time, self.end_time
        if self.surface == "cut":
            notes.append("surface_collider cut: slides along the plane here, along x and z there")
            return Cut(self.point, self.normal, start=start, end=end)
        if self.surface != "sticky":
            notes.append(
                f"surface_collider {self.surface}: theirs sticks whatever it says; not so here"
            )
        kinds: dict[str, Surface] = {"sticky": "sticky", "slip": "slip"}
        kind = kinds.get(self.surface, "separate")
        return Plane(self.point, self.normal, kind, self.friction, start, end, acts_on="nodes")


@dataclass(frozen=True)
class ReleaseSequentially:
    """Particles are let go layer by layer."""

    type: ClassVar[str] = "release_particles_sequentially"
    normal: Vector = field(metadata=PLACE)
    start_position: float = field(metadata=PLACE)
    end_position: float = field(metadata=PLACE)
    start_time: float = field(metadata=TIME)
    end_time: float = field(metadata=TIME)
    num_layers: int = field(default=50, metadata=MOST_STEPS)

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        notes.append("release_particles_sequentially: 50 layers there, one continuous sweep here")
        return Release(
            self.normal, self.start_position, self.end_position, self.start_time, self.end_time
        )


@dataclass(frozen=True)
class VelocityRotation:
    """The particles of a cylinder turn about its axis."""

    type: ClassVar[str] = "enforce_particle_velocity_rotation"
    normal: Vector = field(metadata=PLACE)
    point: Vector = field(metadata=PLACE)
    half_height_and_radius: tuple[float, float] = field(metadata=LENGTH)
    rotation_scale: float = field(metadata=between(-1e6, 1e6))
    translation_scale: float = field(metadata=SPEED)
    start_time: float = field(metadata=TIME)
    end_time: float = field(metadata=TIME)

    def ours(self, substep: float, notes: list[str]) -> AnyBoundary:
        return Rotate(
            self.point,
            self.normal,
            *self.half_height_and_radius,
            # By the left hand: theirs is v = -scale n x r.
            -self.rotation_scale,
            self.translation_scale,
            self.start_time,
            self.end_time,
        )


Condition = (
    BoundingBox
    | Cuboid
    | ParticleImpulse
    | ParticleTranslation
    | SurfaceCollider
    | ReleaseSequentially
    | VelocityRotation
)
