"""A scene from a file, whichever of the two formats it holds."""

import os
from pathlib import Path

from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.scene.json import scene_from_json
from jaxphys.scene.model_folder import cameras_beside
from jaxphys.scene.physgaussian import Imported, from_physgaussian, is_physgaussian

LARGEST_FILE = 16 * 1024 * 1024


def read_scene(path: str | os.PathLike, model: str | os.PathLike | None = None) -> Imported:
    """The scene of a JSON file, ours or PhysGaussian's, with the notes of the latter.

    Args:
        path: the file.
        model: the folder or .ply of the model that a file of PhysGaussian's is meant for, whose
            `cameras.json` has the lens and, where the file asks for it, the place of the camera.

    Raises:
        InputError: one line that names the file, the field and what is expected.
    """
    with reading(path):
        value = read_json(path, LARGEST_FILE)
        if is_physgaussian(value):
            cameras = None if model is None else cameras_beside(Path(model))
            return from_physgaussian(value, str(path), cameras)
        return Imported(scene_from_json(value, str(path)), ())
