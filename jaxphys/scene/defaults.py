"""One scene for each material that shows at a glance what it is made of.

Placed in metres for an object about one metre high. The grid is coarse enough and the materials
soft enough that a second of motion takes some hundred steps.
"""

from collections.abc import Callable

from jaxphys.mpm.materials import get_material
from jaxphys.scene.boundaries import Plane, Vector, Walls
from jaxphys.scene.scene import Domain, Filling, Ground, Object, Region, Rotation, Scene

SIDE = 2.5
HEIGHT = 2.0  # above the floor
SPACING = 1 / 24
SIZE = 0.9
MIDDLE = SIDE / 2
# The floor lies above the lowest wall, which is three cells deep and has no friction.
FLOOR_CELLS = 5


def default_scene(material: str, *, spacing: float = SPACING) -> Scene:
    """The scene in which `animate --material NAME` shows an object.

    Args:
        material: its name.
        spacing: of the grid [m]; half of it lies between the particles that fill the object.

    Raises:
        InputError: an unknown material, with the nearest names, or a spacing out of range.
    """
    get_material(material)
    return _SCENES[material](spacing)


def _scene(thing: Object, spacing: float, friction: float, **fields) -> Scene:
    floor = FLOOR_CELLS * spacing
    return Scene(
        objects=(thing,),
        boundaries=(
            Plane((MIDDLE, MIDDLE, floor), (0.0, 0.0, 1.0), "separate", friction),
            Walls(),
        ),
        domain=Domain((SIDE, SIDE, HEIGHT + floor), spacing),
        ground=Ground(floor),
        **fields,
    )


def _at(gap: float, size: float, spacing: float) -> Vector:
    """Centre of an object whose bounding cube's underside is `gap` above the floor [m]."""
    return (MIDDLE, MIDDLE, FLOOR_CELLS * spacing + gap + size / 2)


def _elastic(spacing: float) -> Scene:
    thing = Object(
        material="elastic",
        parameters={"youngs_modulus": 2e5, "density": 400.0},
        size=SIZE,
        centre=_at(0.5, SIZE, spacing),
        velocity=(0.0, 0.0, -1.0),
        spin=(0.0, 0.2, 0.0),
    )
    return _scene(thing, spacing, 0.4)


def _jelly(spacing: float) -> Scene:
    thing = Object(
        material="jelly",
        parameters={"youngs_modulus": 1.5e4, "poisson_ratio": 0.4, "density": 300.0},
        size=SIZE,
        centre=_at(0.35, SIZE, spacing),
        velocity=(0.0, 0.0, -1.0),
    )
    return _scene(thing, spacing, 0.6)


def _metal(spacing: float) -> Scene:
    thing = Object(
        material="metal",
        parameters={"youngs_modulus": 1e6, "yield_stress": 3.5e4, "density": 1000.0},
        size=SIZE,
        centre=_at(0.35, SIZE, spacing),
        velocity=(0.0, 0.0, -4.0),
        rotation=(Rotation((0.0, 1.0, 0.0), 25.0),),
    )
    return _scene(thing, spacing, 0.4)


def _sand(spacing: float) -> Scene:
    thing = Object(
        material="sand",
        parameters={"youngs_modulus": 5e5},
        size=0.75,
        centre=_at(0.05, 0.75, spacing),
        filling=Filling(show=True),
    )
    return _scene(thing, spacing, 0.7, splats_follow="elastic")


def _fracture(spacing: float) -> Scene:
    size = 0.75
    centre = _at(0.4, size, spacing)
    # Flaws decide where a real thing breaks: here three planes that meet off the middle, one layer
    # of particles thick. Thicker ones leave more rubble than pieces.
    flaws = []
    for axis, offset in enumerate((0.06, -0.05, 0.04)):
        place, half_size = list(centre), [size] * 3
        place[axis] += offset * size
        half_size[axis] = 0.25 * spacing
        flaws.append(
            Region(
                tuple(place), tuple(half_size), {"fracture_strain": 5e-3, "softening_strain": 0.02}
            )
        )
    thing = Object(
        material="fracture",
        parameters={
            "youngs_modulus": 8e5,
            "density": 500.0,
            "fracture_strain": 0.08,
            "softening_strain": 0.1,
        },
        regions=tuple(flaws),
        size=size,
        centre=centre,
        velocity=(0.0, 0.0, -3.0),
        rotation=(Rotation((1.0, 0.0, 0.0), 20.0),),
        filling=Filling(show=True),
    )
    return _scene(thing, spacing, 0.3, splats_follow="elastic")


_SCENES: dict[str, Callable[[float], Scene]] = {
    "elastic": _elastic,
    "jelly": _jelly,
    "metal": _metal,
    "sand": _sand,
    "fracture": _fracture,
}
