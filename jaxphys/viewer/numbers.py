"""The numbers of a scene that have a slider, and the scene with another one."""

import math
from dataclasses import dataclass, replace
from typing import Any

from jaxphys.mpm.boundaries import AnyBoundary
from jaxphys.mpm.materials.catalogue import get_material, material_values
from jaxphys.scene.build import material_of
from jaxphys.scene.scene import Object, Scene

# Of materials, in this order, where the material has them. Those above 0 without an end have
# sliders of their logarithm.
PARAMETERS = (
    "youngs_modulus",
    "poisson_ratio",
    "density",
    "bulk_modulus",
    "viscosity",
    "friction_angle",
    "yield_stress",
)
DECADES = 1.5  # to either side of where a logarithm's slider starts
LARGEST_GRAVITY = 25.0  # [m/s^2]
LARGEST_FRICTION = 2.0
LEAST_FRICTION = 0.01  # none at all is another program


@dataclass(frozen=True)
class Number:
    """One slider.

    Attributes:
        key: of the number, such as `objects.0.youngs_modulus`, `gravity` or `friction`.
        label, unit: for people.
        value: as it is.
        low, high: ends of the slider.
        logarithmic: the slider is one of the logarithm.
    """

    key: str
    label: str
    unit: str
    value: float
    low: float
    high: float
    logarithmic: bool = False


def numbers_of(scene: Scene) -> list[Number]:
    """The numbers of a scene that have a slider."""
    found = []
    for i, thing in enumerate(scene.objects):
        found += [_parameter(i, thing, name) for name in PARAMETERS if _has(thing, name)]
    down = -scene.gravity[2]
    ends = min(0.0, down), max(LARGEST_GRAVITY, down)
    found.append(Number("gravity", "gravity", "m/s^2", down, *ends))
    rubs = [rough for one in scene.boundaries if (rough := _friction(one)) > 0]
    if rubs:
        most = max(LARGEST_FRICTION, *rubs)
        found.append(Number("friction", "friction", "", rubs[0], LEAST_FRICTION, most))
    return found


def with_number(scene: Scene, key: str, value: float) -> Scene:
    """The scene with another number, as a scene's file would have it.

    Raises:
        InputError: it is out of range.
    """
    if key == "gravity":
        return replace(scene, gravity=(*scene.gravity[:2], -value))
    if key == "friction":
        listed = tuple(
            _rubbing(one, value) if _friction(one) > 0 else one for one in scene.boundaries
        )
        return replace(scene, boundaries=listed)
    _, place, name = key.split(".")
    i = int(place)
    thing = scene.objects[i]
    own = {k: v for k, v in thing.parameters.items() if k not in _same(thing, name)}
    changed = replace(thing, parameters=own | {name: value})
    return replace(scene, objects=(*scene.objects[:i], changed, *scene.objects[i + 1 :]))


def with_material(scene: Scene, i: int, material: str) -> Scene:
    """The scene with object `i` made of a material, with its own parameters."""
    get_material(material)
    thing = scene.objects[i].made_of(material)
    return replace(scene, objects=(*scene.objects[:i], thing, *scene.objects[i + 1 :]))


def _friction(boundary: AnyBoundary) -> float:
    """The one coefficient of a boundary; 0: none, or several."""
    friction = getattr(boundary, "friction", None)
    return float(friction) if isinstance(friction, float | int) else 0.0


def _rubbing(boundary: Any, friction: float) -> Any:
    return replace(boundary, friction=friction)


def _same(thing: Object, name: str) -> set[str]:
    """Names under which a material takes a parameter."""
    others = material_of(thing).alternatives
    return {name, *(given for given, other in others.items() if other.instead_of == name)}


def _values(thing: Object) -> dict:
    return material_values(material_of(thing), thing.parameters)


def _has(thing: Object, name: str) -> bool:
    # What is zero is left out of the program, and so has no slider.
    return float(_values(thing).get(name, 0.0)) != 0.0


def _parameter(i: int, thing: Object, name: str) -> Number:
    declared = material_of(thing).declared[name]
    value = float(_values(thing)[name])
    key, label = f"objects.{i}.{name}", name.replace("_", " ")
    if math.isinf(declared.high):
        factor = 10**DECADES
        ends = value / factor, value * factor
        return Number(key, label, declared.unit, value, *ends, logarithmic=True)
    margin = 0.01 * (declared.high - max(declared.low, 0.0))
    low, high = max(declared.low, 0.0) + margin, declared.high - margin
    return Number(key, label, declared.unit, value, min(low, value), max(high, value))
