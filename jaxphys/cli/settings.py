"""`--set NAME=VALUE`: any field of a scene, through the reader of its file."""

import json
from typing import Any

from jaxphys.core.errors import InputError, nearest
from jaxphys.mpm.materials.catalogue import get_material
from jaxphys.scene.build import validate
from jaxphys.scene.json import scene_from_json, to_json
from jaxphys.scene.scene import Scene


def with_settings(scene: Scene, settings: tuple[str, ...]) -> Scene:
    """The scene with fields changed in the order given.

    A name is a path in the scene's file with a dot before each step (`objects.0.velocity`,
    `boundaries.0.friction`), or for short a parameter of the first object's material or a field of
    that object (`youngs_modulus`, `filling.show`). A value is JSON (`2e4`, `[0,0,-2]`, `null`), and
    what is not is a text.

    Raises:
        InputError: by its name, a setting that names nothing or whose value cannot be.
    """
    if not settings:
        return scene
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or not name:
            raise InputError(
                f"--set {setting}: give a name and a value, such as youngs_modulus=2e4"
            )
        written = to_json(scene)
        _put(written, name, _path(scene, name), _value(text))
        try:
            scene = scene_from_json(written)
        except InputError as error:
            raise InputError(f"--set {name}: {str(error).removeprefix('scene.')}") from None
    try:
        validate(scene)
    except InputError as error:
        raise InputError(f"--set: {error}") from None
    return scene


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _path(scene: Scene, name: str) -> list[str]:
    steps = name.split(".")
    first = scene.objects[0]
    if hasattr(scene, steps[0]):
        return steps
    parameters = get_material(first.material, first.law).declared
    if name in parameters:
        return ["objects", "0", "parameters", name]
    if hasattr(first, steps[0]):
        return ["objects", "0", *steps]
    known = {*parameters, *to_json(first), *to_json(scene)}
    raise InputError(
        f"--set {name}: unknown key {steps[0]!r}, no field of the scene nor a parameter or a field "
        f"of the first object; {nearest(steps[0], known)}"
    )


def _put(written: Any, name: str, path: list[str], value: Any) -> None:
    """Sets a place in decoded JSON; one that is `null` so far may hold an object."""
    place = written
    for i, step in enumerate(path[:-1]):
        key = _key(place, step, name)
        if place[key] is None:
            place[key] = {}
        place = place[key]
        if not isinstance(place, dict | list):
            before = ".".join(path[: i + 1])
            raise InputError(f"--set {name}: {before} is one value and has no fields")
    if isinstance(place, dict) and (path[-2:-1] == ["parameters"] or not place):
        place[path[-1]] = value  # what belongs there its reader knows
        return
    place[_key(place, path[-1], name)] = value


def _key(place: Any, step: str, name: str) -> str | int:
    if isinstance(place, dict):
        if step not in place:
            raise InputError(f"--set {name}: unknown key {step!r}; {nearest(step, place)}")
        return step
    if not step.isascii() or not step.isdigit() or int(step) >= len(place):
        raise InputError(f"--set {name}: {step!r} is no number below {len(place)}, of an entry")
    return int(step)
