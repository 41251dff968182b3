"""One scene for each material that shows at a glance what it is made of.

Placed in metres for an object about one metre high. The grid is coarse enough and the materials
soft
enough that a second of motion takes some hundred steps.
"""

from dataclasses import replace

from jaxphys.mpm.materials import get_material
from jaxphys.scene.boundaries import Plane, Walls
from jaxphys.scene.scene import Domain, Ground, Object, Rotation, Scene

FLOOR = 0.125
SIDE = 2.5
SPACING = 1 / 24
SIZE = 0.9
MIDDLE = (SIDE / 2, SIDE / 2)


def _scene(thing: Object, surface: str, friction: float, **fields) -> Scene:
    return Scene(
        objects=(thing,),
        boundaries=(Plane((*MIDDLE, FLOOR), (0.0, 0.0, 1.0), surface, friction), Walls()),
        domain=Domain((SIDE, SIDE, 2.0), SPACING),
        ground=Ground(FLOOR),
        **fields,
    )


def _at(gap: float) -> tuple[float, float, float]:
    """Centre of an object whose bounding sphere's underside is `gap` above the floor [m]."""
    return (*MIDDLE, FLOOR + gap + SIZE / 2)


def default_scene(material: str, *, spacing: float = SPACING) -> Scene:
    """The scene in which `animate --material NAME` shows an object.

    Args:
        material: its name.
        spacing: of the grid [m]; half of it lies between the particles that fill the object.

    Raises:
        InputError: an unknown material, with the nearest names, or a spacing out of range.
    """
    get_material(material)
    scene = _SCENES[material]()
    return replace(scene, domain=replace(scene.domain, spacing=spacing))


def _elastic() -> Scene:
    thing = Object(
        material="elastic",
        parameters={"youngs_modulus": 2e5, "density": 400.0},
        size=SIZE,
        centre=_at(0.55),
        velocity=(0.0, 0.0, -1.0),
        spin=(0.0, 1.2, 0.0),
    )
    return _scene(thing, "separate", 0.4)


def _jelly() -> Scene:
    thing = Object(
        material="jelly",
        parameters={"youngs_modulus": 1.5e4, "poisson_ratio": 0.4, "density": 300.0},
        size=SIZE,
        centre=_at(0.35),
        velocity=(0.0, 0.0, -1.0),
    )
    return _scene(thing, "separate", 0.6)


def _metal() -> Scene:
    thing = Object(
        material="metal",
        parameters={"youngs_modulus": 1e6, "yield_stress": 2e4, "density": 1000.0},
        size=SIZE,
        centre=_at(0.4),
        velocity=(0.0, 0.0, -4.0),
        rotation=(Rotation((0.0, 1.0, 0.0), 25.0),),
    )
    return _scene(thing, "separate", 0.4)


def _sand() -> Scene:
    thing = Object(
        material="sand",
        parameters={"youngs_modulus": 5e5},
        size=SIZE,
        centre=_at(0.02),
    )
    return _scene(thing, "separate", 0.6)


def _fracture() -> Scene:
    thing = Object(
        material="fracture",
        parameters={"youngs_modulus": 5e5},
        size=SIZE,
        centre=_at(0.5),
        velocity=(0.0, 0.0, -4.0),
        rotation=(Rotation((1.0, 0.0, 0.0), 20.0),),
    )
    return _scene(thing, "separate", 0.3)


_SCENES = {
    "elastic": _elastic,
    "jelly": _jelly,
    "metal": _metal,
    "sand": _sand,
    "fracture": _fracture,
}
