"""From command line arguments to a scene."""

import dataclasses
import math
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np

from jaxphys.core.errors import InputError, one_line
from jaxphys.core.reading import reading
from jaxphys.mpm.materials.catalogue import get_material
from jaxphys.mpm.stepping import Adaptive, Fixed, Implicit
from jaxphys.scene.build import validate
from jaxphys.scene.defaults import default_scene
from jaxphys.scene.model_folder import (
    CAMERAS,
    GENERATED,
    cameras_beside,
    is_trained,
    splats_in,
)
from jaxphys.scene.read import read_scene
from jaxphys.scene.scene import Rotation, Scene, Up
from jaxphys.scene.source import MESHES, SPLATS

LEANING = 0.85  # of what photographs call up the part along z, below which a line is said


def scene_file(config: Path | None, material: str | None, source: Path | None) -> Path | None:
    """The file that the scene of a command is read from, None where it is the material's own.

    Without file and material, that is the config.json of a directory of `generate` or `animate`.
    """
    if config is not None or material is not None or source is None or not source.is_dir():
        return config
    kept = source / "config.json"
    if not kept.exists() and (is_trained(source) or (source / GENERATED).exists()):
        return None  # of photographs, with no scene yet
    return kept


def scene_for(
    config: Path | None,
    material: str | None,
    changes: dict[str, Any],
    source: Path | None = None,
    base: Scene | None = None,
) -> Scene:
    """The scene of a file or of a material, with the given fields changed where they are not None.

    Prints the notes of an imported file on standard error. Without file and material it is that of
    jelly. Another material comes with its own parameters, and steps that are asked for by name
    replace a step that the file has.

    Args:
        config: as `scene_file` finds it.
        source: the model that a file of PhysGaussian's is for.

    Raises:
        InputError: an unknown material, a bad file or a value out of range.
    """
    if base is not None:
        scene = base
    elif config is not None:
        with reading(config):
            loaded = read_scene(config, source)
            validate(loaded.scene)
        scene = loaded.scene
        for note in loaded.notes:
            print(one_line(f"note: {note}"), file=sys.stderr)
        if material not in (None, scene.objects[0].material):
            get_material(material)
            first = scene.objects[0].made_of(material)
            scene = dataclasses.replace(scene, objects=(first, *scene.objects[1:]))
    else:
        scene = default_scene(material or "jelly")
    given = {name: value for name, value in changes.items() if value is not None}
    if given.get("stepping", Fixed()) != Fixed() and "substep" not in given:
        given["substep"] = None
    try:
        return dataclasses.replace(scene, **given)
    except InputError as error:
        raise InputError(f"--{error}") from None


def stepping_for(name: str | None, substep: float | None = None) -> dict[str, Any]:
    """The change of a scene for `--stepping`; a `--substep` is a fixed step."""
    if name is None:
        return {} if substep is None else {"stepping": Fixed()}
    return {"stepping": {"adaptive": Adaptive, "fixed": Fixed, "implicit": Implicit}[name]()}


def as_captured(scene: Scene, source: Path | None, up: str | None, crop: bool, told: bool) -> Scene:
    """The scene with its first object upright and cropped as `--up` and `--crop` say.

    A trained model's cameras say what is up: for "auto" they turn it, and without `--up` a line on
    standard error tells where they disagree with the scene, if it is `told`.

    Raises:
        InputError: "auto", and there are no cameras.
    """
    first = scene.objects[0]
    if crop:
        first = dataclasses.replace(first, crop=True)
    seen = _up_in_photographs(source) if source is not None else None
    if up == "auto":
        if seen is None:
            raise InputError(
                f"--up auto: there is no {CAMERAS} beside the splats; name the axis, such as -y"
            )
        first = dataclasses.replace(first, up="z", rotation=(*_turn_to_z(seen), *first.rotation))
    elif up is not None:
        first = dataclasses.replace(first, up=cast(Up, up))
    elif told and seen is not None and seen[2] < LEANING and first.up == "z":
        axis = np.argmax(np.abs(seen))
        named = ("-" if seen[axis] < 0 else "") + "xyz"[axis]
        line = f"note: the photographs say that {named} is up: --up auto stands the object upright"
        print(line, file=sys.stderr)
    return dataclasses.replace(scene, objects=(first, *scene.objects[1:]))


def _up_in_photographs(source: Path) -> np.ndarray | None:
    """What is up on the mean in a trained model's photographs, (3,) of length 1, if anything is."""
    cameras = cameras_beside(source)
    if not cameras:
        return None
    up = np.mean([-np.asarray(camera.rotation)[:, 1] for camera in cameras], axis=0)
    length = np.linalg.norm(up)
    return up / length if length > 0.1 else None


def _turn_to_z(up: np.ndarray) -> tuple[Rotation, ...]:
    axis = np.cross(up, (0.0, 0.0, 1.0))
    angle = math.degrees(math.atan2(np.linalg.norm(axis), up[2]))
    if np.linalg.norm(axis) < 1e-6:
        if up[2] > 0:
            return ()
        axis = np.array([1.0, 0.0, 0.0])
    x, y, z = (float(a) for a in axis / np.linalg.norm(axis))
    return (Rotation((x, y, z), angle),)


def is_object(path: Path) -> bool:
    """Whether a path is that of an object, or of a folder with one, and not of a scene's file."""
    return path.is_dir() or path.suffix.lower() in (*SPLATS, *MESHES)


def files_read(config: Path | None, source: Path | None = None) -> tuple[Path, ...]:
    """The scene file and the object that a command reads, which it must not replace."""
    if source is not None and source.is_dir():
        return tuple(path for path in (config, source / "config.json") if path is not None)
    return tuple(path for path in (config, source) if path is not None)


def with_source(
    scene: Scene,
    source: Path | None,
    config: Path | None,
    splats: int | None,
    required: bool = True,
) -> tuple[Scene, Path | None]:
    """The scene with its first object read from `source`, and the directory that relative sources
    of
    other objects are looked up in first.

    Raises:
        InputError: no object is named anywhere.
    """
    first = scene.objects[0]
    beside = config.parent if config is not None else None
    if source is not None:
        if source.is_dir():
            source = splats_in(source)
        first = dataclasses.replace(first, source=str(source.absolute()))
    elif first.source is None and required:
        raise InputError(
            "OBJECT: name splats (.ply), a mesh (.obj, .glb), a directory of generate or the "
            "folder of a trained model"
        )
    if splats is not None:
        try:
            first = dataclasses.replace(first, splats=splats)
        except InputError as error:
            raise InputError(f"--{error}") from None
    return dataclasses.replace(scene, objects=(first, *scene.objects[1:])), beside
