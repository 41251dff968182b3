"""What a user may ask to happen at walls, floors and chosen regions: plain numbers, turned into
solver boundaries by `build`.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from jaxphys.core.fields import NON_NEGATIVE, POSITIVE, Checked, between

Vector = tuple[float, float, float]
Surface = Literal["sticky", "slip", "separate"]
FOREVER = 1e9


@dataclass(frozen=True)
class Walls(Checked):
    """The six faces of the domain, three cells inside it.

    Attributes:
        surface: `sticky` stops what touches it, `slip` lets it slide but not leave, `separate`
            also lets it leave.
        friction: Coulomb's coefficient, for `separate`.
    """

    type: ClassVar[str] = "walls"
    surface: Surface = "separate"
    friction: float = field(default=0.0, metadata=NON_NEGATIVE)


@dataclass(frozen=True)
class Plane(Checked):
    """A half-space that holds matter on the side its normal points to.

    Attributes:
        point: a point of the plane [m].
        normal: points out of the solid, of any length.
        surface, friction: as for `Walls`.
        start, end: acts while start <= time < end [s].
    """

    type: ClassVar[str] = "plane"
    point: Vector = (0.0, 0.0, 0.1)
    normal: Vector = (0.0, 0.0, 1.0)
    surface: Surface = "separate"
    friction: float = field(default=0.3, metadata=NON_NEGATIVE)
    start: float = 0.0
    end: float = FOREVER


@dataclass(frozen=True)
class Box(Checked):
    """A box whose inside moves at a given velocity; the box moves along.

    Attributes:
        centre, half_size: at `start` [m].
        velocity: of the box and of all that is inside [m/s].
        start, end: acts while start <= time < end [s].
        rest_after: how long the box's inside is held still after that [s].
    """

    type: ClassVar[str] = "box"
    centre: Vector
    half_size: Vector = field(metadata=POSITIVE)
    velocity: Vector = (0.0, 0.0, 0.0)
    start: float = 0.0
    end: float = FOREVER
    rest_after: float = field(default=0.0, metadata=NON_NEGATIVE)


@dataclass(frozen=True)
class Impulse(Checked):
    """A push on the particles that start inside a box.

    Attributes:
        centre, half_size: of the box, at rest [m].
        force: on all of it together, shared by mass [N].
        start, duration: [s].
        per_particle: the force is meant for each particle, so that the sum grows with their
            number.
    """

    type: ClassVar[str] = "impulse"
    centre: Vector
    half_size: Vector = field(metadata=POSITIVE)
    force: Vector
    start: float = 0.0
    duration: float = field(default=1e-3, metadata=POSITIVE)
    per_particle: bool = False


@dataclass(frozen=True)
class Translate(Checked):
    """The particles that start inside a box move at a given velocity; zero holds them fixed.

    Attributes:
        centre, half_size: of the box, at rest [m].
        velocity: [m/s].
        start, end: acts while start <= time < end [s].
    """

    type: ClassVar[str] = "translate"
    centre: Vector
    half_size: Vector = field(metadata=POSITIVE)
    velocity: Vector = (0.0, 0.0, 0.0)
    start: float = 0.0
    end: float = FOREVER


@dataclass(frozen=True)
class Rotate(Checked):
    """The particles that start inside a cylinder turn about its axis and move along it.

    Attributes:
        point: centre of the cylinder [m].
        axis: its direction, of any length.
        half_height, radius: [m].
        angular_velocity: about the axis [rad/s].
        axial_velocity: along the axis [m/s].
        start, end: acts while start <= time < end [s].
    """

    type: ClassVar[str] = "rotate"
    point: Vector
    axis: Vector
    half_height: float = field(metadata=POSITIVE)
    radius: float = field(metadata=POSITIVE)
    angular_velocity: float = 0.0
    axial_velocity: float = 0.0
    start: float = 0.0
    end: float = FOREVER


@dataclass(frozen=True)
class Release(Checked):
    """Particles are held and let go one after another by a plane that sweeps over them.

    Attributes:
        normal: direction in which places are measured, of any length.
        begin, finish: where the plane is at `start` and at `end`, along the normal [m].
        start, end: [s].
    """

    type: ClassVar[str] = "release"
    normal: Vector
    begin: float
    finish: float
    start: float = 0.0
    end: float = 1.0


@dataclass(frozen=True)
class Cut(Checked):
    """A half-space that holds what is in it, but for a layer that slides along it, slowed.

    Attributes:
        point, normal, start, end: as for `Plane`.
        lower, upper: of the layer along z [m].
        factor: what is left of the velocity along the plane in the layer.
    """

    type: ClassVar[str] = "cut"
    point: Vector
    normal: Vector
    lower: float = 0.40
    upper: float = 0.53
    factor: float = field(default=0.3, metadata=between(0, 1))
    start: float = 0.0
    end: float = FOREVER


Boundary = Walls | Plane | Box | Impulse | Translate | Rotate | Release | Cut
