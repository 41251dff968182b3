"""A scene from a file, whichever of the two formats it holds."""

import os

from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.scene.json import scene_from_json
from jaxphys.scene.physgaussian import Imported, from_physgaussian, is_physgaussian

LARGEST_FILE = 16 * 1024 * 1024


def read_scene(path: str | os.PathLike) -> Imported:
    """The scene of a JSON file, ours or PhysGaussian's, with the notes of the latter.

    Raises:
        InputError: one line that names the file, the field and what is expected.
    """
    with reading(path):
        value = read_json(path, LARGEST_FILE)
        if is_physgaussian(value):
            return from_physgaussian(value, str(path))
        return Imported(scene_from_json(value, str(path)), ())
