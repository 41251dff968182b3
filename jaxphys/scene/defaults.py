"""One scene for each material that shows at a glance what it is made of.

Placed in metres for an object about one metre high, whatever the grid's spacing: a finer grid shows
the same scene. The material's parameters are its defaults (`materials.catalogue`), soft enough
that a second of motion takes some hundred steps on the coarse grid.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np

from jaxphys.mpm.boundaries import Capsule, Keyframes, Plane, Vector, Walls
from jaxphys.mpm.materials.catalogue import get_material
from jaxphys.scene.scene import Domain, Filling, Ground, Object, Region, Rotation, Scene

SIDE = 2.5
HEIGHT = 2.0  # above the floor
SPACING = 1 / 24
SIZE = 0.9
MIDDLE = SIDE / 2
# The walls are slippery, so the lowest one stays below the floor; a grid of 0.12 m still has two
# cells outside it.
FLOOR = 0.25
INSET = 0.2
# Turns a capsule so that it lies along the view of the usual camera (`View.azimuth`), -60 degrees.
INTO_PICTURE = (0.70711, 0.61237, 0.35355, 0.0)
# Packed snow that bears thirty times more than what is around it.
LUMP = {"youngs_modulus": 1e6, "critical_stretch": 0.03, "critical_compression": 0.1}
TANK = 0.6  # from the domain's sides to those of the glass tank that water is poured into


def default_scene(material: str, *, spacing: float = SPACING) -> Scene:
    """The scene in which `animate --material NAME` shows an object.

    Args:
        material: its name.
        spacing: of the grid [m]; half of it lies between the particles that fill the object.

    Raises:
        InputError: an unknown material, with the nearest names, or a spacing out of range.
    """
    get_material(material)
    made = _SCENES.get(material, partial(_dropped, material))
    return made(Domain((SIDE, SIDE, FLOOR + HEIGHT), spacing))


def _scene(thing: Object, domain: Domain, friction: float, **fields) -> Scene:
    floor = Plane((MIDDLE, MIDDLE, FLOOR), (0.0, 0.0, 1.0), "separate", friction)
    return Scene(
        objects=(thing,),
        boundaries=(floor, Walls(inset=INSET)),
        domain=domain,
        ground=Ground(FLOOR),
        **fields,
    )


def _above(gap: float, size: float) -> Vector:
    """Centre of an object whose bounding cube's underside is `gap` above the floor [m]."""
    return (MIDDLE, MIDDLE, FLOOR + gap + size / 2)


def _elastic(domain: Domain) -> Scene:
    thing = Object(
        material="elastic",
        size=SIZE,
        centre=_above(0.5, SIZE),
        velocity=(0.0, 0.0, -1.0),
        spin=(0.0, 0.2, 0.0),
    )
    return _scene(thing, domain, friction=0.4)


def _jelly(domain: Domain) -> Scene:
    thing = Object(
        material="jelly",
        size=SIZE,
        centre=_above(0.15, SIZE),
        velocity=(0.0, 0.0, -1.0),
        # Upright, something that is narrow below would begin to fall over where the film ends.
        rotation=(Rotation((0.0, 1.0, 0.0), 35.0),),
        # A skin that is stretched shows its inside between its splats.
        filling=Filling(show=True),
    )
    # Elastic laws do not tire: without damping it would bounce on for longer than the film.
    return _scene(thing, domain, friction=0.6, damping=2.5)


def _metal(domain: Domain) -> Scene:
    thing = Object(
        material="metal",
        size=SIZE,
        centre=_above(0.35, SIZE),
        velocity=(0.0, 0.0, -4.0),
        rotation=(Rotation((0.0, 1.0, 0.0), 25.0),),
    )
    return _scene(thing, domain, friction=0.4)


def _sand(domain: Domain) -> Scene:
    size = 0.75
    thing = Object(
        material="sand",
        size=size,
        centre=_above(0.05, size),
        # As fine inside as the skin's grains, which it is seen between.
        filling=Filling(show=True, per_cell=4),
        # Of one colour a heap has no surface to be seen.
        grain=0.3,
    )
    # It lies still after a second.
    return _scene(thing, domain, friction=0.7, splats_follow="elastic", frames=30)


def _fracture(domain: Domain) -> Scene:
    size = 0.75
    centre = _above(0.4, size)
    # Flaws decide where a real thing breaks: here planes that meet off the middle. What is thinner
    # than a cell and a half cannot part: both sides would still share the nodes between them.
    weak = {"fracture_strain": 5e-3, "softening_strain": 0.02}
    flaws = []
    for axis, offset in enumerate((0.06, -0.05, 0.04)):
        place, half_size = list(centre), [size] * 3
        place[axis] += offset * size
        half_size[axis] = 0.035
        (x, y, z), (a, b, c) = place, half_size
        flaws.append(Region((x, y, z), (a, b, c), weak))
    thing = Object(
        material="fracture",
        regions=tuple(flaws),
        size=size,
        centre=centre,
        velocity=(0.0, 0.0, -4.0),
        rotation=(Rotation((1.0, 0.0, 0.0), 20.0),),
        filling=Filling(show=True),
    )
    return _scene(thing, domain, friction=0.7, splats_follow="elastic")


def _dropped(
    material: str,
    domain: Domain,
    *,
    size: float = 0.75,
    gap: float = 0.1,
    speed: float = 1.0,
    friction: float = 0.5,
    follow: Literal["total", "elastic"] = "elastic",
    rotation: tuple[Rotation, ...] = (),
    damping: float = 0.0,
) -> Scene:
    """Let fall: what most materials are told by."""
    thing = Object(
        material=material,
        size=size,
        centre=_above(gap, size),
        velocity=(0.0, 0.0, -speed),
        rotation=rotation,
        filling=Filling(show=True),
    )
    return _scene(thing, domain, friction=friction, splats_follow=follow, damping=damping)


def _water(domain: Domain) -> Scene:
    scene = _dropped("water", domain, size=0.6, gap=0.02, speed=0.0, friction=0.0)
    # Within the domain's walls it would lie a cell deep.
    tank = Walls(inset=TANK, surfaces=(*("separate",) * 4, "open", "open"))
    return replace(scene, boundaries=(*scene.boundaries, tank))


def _cream(domain: Domain) -> Scene:
    return _dropped("cream", domain, friction=0.8)


def _toothpaste(domain: Domain) -> Scene:
    return _dropped("toothpaste", domain, gap=0.03, speed=0.3, friction=0.8)


def _plasticine(domain: Domain) -> Scene:
    turn = (Rotation((0.0, 1.0, 0.0), 25.0),)
    return _dropped("plasticine", domain, gap=0.3, speed=5.0, follow="total", rotation=turn)


def _snow(domain: Domain) -> Scene:
    size, rise, radius = 0.75, 0.25, 0.1
    scene = _dropped("snow", domain, size=size, gap=rise + radius + 0.1, speed=3.0, friction=0.8)
    # On a floor it is only packed. A log in its way pulls it apart, and what is harder than the
    # snow around it comes off in lumps (Stomakhin et al. 2013 begin with uneven snow too); of even
    # snow this large nothing holds its own weight, and all of it falls to powder.
    (thing,) = scene.objects
    lumps = tuple(
        Region(_offset(thing.centre, place), (half, half, half), LUMP)
        for place, half in _uneven(size)
    )
    log = Capsule(
        centre=(MIDDLE, MIDDLE, FLOOR + rise),
        orientation=INTO_PICTURE,
        radius=radius,
        half_height=0.6,
        friction=0.3,
    )
    return replace(
        scene,
        objects=(replace(thing, regions=lumps, grain=0.25),),
        boundaries=(*scene.boundaries, log),
        frames=30,
        obstacle_colour=(0.35, 0.23, 0.15),
        # White snow shows on what is not white.
        background=(0.5, 0.62, 0.78),
        ground=Ground(FLOOR, colour=(0.4, 0.5, 0.62)),
    )


def _offset(centre: Vector, by: Vector) -> Vector:
    return (centre[0] + by[0], centre[1] + by[1], centre[2] + by[2])


def _uneven(size: float) -> list[tuple[Vector, float]]:
    """Middles, from that of an object, and half sides of 27 cubes that lie a little out of order
    through it, some two cells apart [m].
    """
    pitch, random = size / 3, np.random.default_rng(0)
    found = []
    for i, j, k in product((-1, 0, 1), repeat=3):
        x, y, z = pitch * (np.array([i, j, k]) + random.uniform(-0.08, 0.08, 3))
        found.append(((float(x), float(y), float(z)), float(pitch * random.uniform(0.3, 0.38))))
    return found


def _wet_sand(domain: Domain) -> Scene:
    return _dropped("wet-sand", domain, gap=0.3, speed=3.0, friction=0.7)


def _memory_foam(domain: Domain) -> Scene:
    size, radius, deep = 0.75, 0.16, 0.4
    scene = _dropped("memory-foam", domain, size=size, gap=0.01, speed=0.0, follow="total")
    above = FLOOR + size + radius + 0.05
    bar = Capsule(
        centre=(MIDDLE, MIDDLE, above),
        orientation=INTO_PICTURE,
        radius=radius,
        half_height=0.5,
        friction=0.3,
        motion=Keyframes(
            times=(0.1, 0.6, 1.0, 1.3),
            displacements=tuple((0.0, 0.0, z) for z in (0.0, -deep, -deep, 0.5)),
            interpolation="smooth",
        ),
    )
    # It is the return that tells it from other foam, and that takes its time.
    return replace(scene, boundaries=(*scene.boundaries, bar), frames=96)


def _muscle(domain: Domain) -> Scene:
    # It stands there and works; at rest nothing would tell it from a jelly.
    return _dropped("muscle", domain, gap=0.01, speed=0.0, follow="total", damping=2.5)


_SCENES: dict[str, Callable[[Domain], Scene]] = {
    "elastic": _elastic,
    "jelly": _jelly,
    "metal": _metal,
    "sand": _sand,
    "fracture": _fracture,
    "water": _water,
    "cream": _cream,
    "toothpaste": _toothpaste,
    "plasticine": _plasticine,
    "snow": _snow,
    "wet-sand": _wet_sand,
    "memory-foam": _memory_foam,
    "muscle": _muscle,
}
