"""A scene from a file, whichever of the two formats it holds."""

import os
from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.scene.json import read_json, scene_from_json
from jaxphys.scene.physgaussian import Imported, from_physgaussian, is_physgaussian


def read_scene(path: str | os.PathLike) -> Imported:
    """The scene of a JSON file, ours or PhysGaussian's, with the notes of the latter.

    Raises:
        InputError: one line that names the file, the field and what is expected.
    """
    value = read_json(path)
    name = str(Path(path))
    if not isinstance(value, dict):
        raise InputError(f"{name}: expected an object {{ ... }}, found {type(value).__name__}")
    if is_physgaussian(value):
        return from_physgaussian(value, name)
    return Imported(scene_from_json(value, name), ())
