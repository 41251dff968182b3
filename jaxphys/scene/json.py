"""Scenes as JSON: read strictly, written completely, the same bytes for the same scene."""

import dataclasses
import os
from typing import Any

import jax
import numpy as np

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.files import write_json
from jaxphys.scene.scene import Scene


def to_json(value: Any) -> Any:
    """Dictionaries, lists and plain values of a dataclass; classes of a union carry their `type`.
    Arrays become lists, numbers of numpy plain ones and paths texts, as the file has them.
    """
    if dataclasses.is_dataclass(value):
        fields = {
            entry.name: to_json(getattr(value, entry.name))
            for entry in dataclasses.fields(value)
            if entry.metadata.get("keys") != ()
        }
        return {"type": value.type} | fields if hasattr(value, "type") else fields
    if isinstance(value, tuple | list):
        return [to_json(part) for part in value]
    if isinstance(value, dict):
        return {key: to_json(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | np.generic | jax.Array):
        return value.tolist()
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def scene_from_json(value: Any, where: str = "scene") -> Scene:
    """A `Scene` from decoded JSON; raises `InputError` that names the field."""
    return from_json(Scene, value, where)


def write_scene(path: str | os.PathLike, scene: Scene) -> None:
    """Writes every field of a scene, defaults too, with sorted keys."""
    write_json(path, to_json(scene))
