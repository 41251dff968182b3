"""Scenes as JSON: read strictly, written completely, the same bytes for the same scene."""

import dataclasses
import json
import os
import types
import typing
from pathlib import Path
from typing import Any

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.files import write_json
from jaxphys.scene.scene import Scene

LARGEST_FILE = 16 * 1024 * 1024


def to_json(value: Any) -> Any:
    """Dictionaries, lists and plain values of a dataclass; classes of a union carry their
    `type`.
    """
    if dataclasses.is_dataclass(value):
        fields = {entry.name: to_json(getattr(value, entry.name)) for entry in _declared(value)}
        return {"type": value.type} | fields if hasattr(value, "type") else fields
    if isinstance(value, tuple):
        return [to_json(part) for part in value]
    if isinstance(value, dict):
        return {key: to_json(part) for key, part in value.items()}
    return value


def _declared(cls: Any) -> list[dataclasses.Field]:
    """The fields of a dataclass that a file has a name for."""
    return [entry for entry in dataclasses.fields(cls) if entry.metadata.get("keys") != ()]


def _fail(where: str, expected: str, value: Any) -> typing.NoReturn:
    shown = json.dumps(value)
    shown = shown if len(shown) < 60 else shown[:57] + "..."
    raise InputError(f"{where}: expected {expected}, found {shown}")


def _read_class(cls: type, value: Any, where: str) -> Any:
    if not isinstance(value, dict):
        _fail(where, "an object { ... }", value)
    entries = {entry.name: entry for entry in _declared(cls)}
    known = set(entries) | ({"type"} if hasattr(cls, "type") else set())
    for key in value:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}; {nearest(key, known)}")
    hints = typing.get_type_hints(cls)
    arguments = {
        key: _read(hints[key], part, f"{where}.{key}")
        for key, part in value.items()
        if key in entries
    }
    for name, entry in entries.items():
        required = (
            entry.default is dataclasses.MISSING and entry.default_factory is dataclasses.MISSING
        )
        if required and name not in arguments:
            raise InputError(f"{where}: the key {name!r} is missing")
    try:
        return cls(**arguments)
    except InputError as error:
        raise InputError(f"{where}.{error}") from None


def _read_union(kinds: tuple, value: Any, where: str) -> Any:
    if type(None) in kinds:
        rest = tuple(kind for kind in kinds if kind is not type(None))
        if value is None:
            return None
        return _read(rest[0], value, where) if len(rest) == 1 else _read_union(rest, value, where)
    classes = {kind.type: kind for kind in kinds}
    if not isinstance(value, dict):
        _fail(where, "an object { ... }", value)
    tag = value.get("type")
    if not isinstance(tag, str):
        raise InputError(f"{where}: the key 'type' is missing; valid: {', '.join(sorted(classes))}")
    if tag not in classes:
        raise InputError(f"{where}.type: unknown type {tag!r}; {nearest(tag, classes)}")
    return _read_class(classes[tag], value, where)


def _read_tuple(parts: tuple, value: Any, where: str) -> tuple:
    if not isinstance(value, list):
        _fail(where, "a list [ ... ]", value)
    if parts[-1] is Ellipsis:
        parts = (parts[0],) * len(value)
    if len(value) != len(parts):
        _fail(where, f"a list of {len(parts)} values", value)
    return tuple(
        _read(part, item, f"{where}[{i}]")
        for i, (part, item) in enumerate(zip(parts, value, strict=True))
    )


def _read(kind: Any, value: Any, where: str) -> Any:
    """`value` as a `kind`: a dataclass, a union, a tuple, a Literal, dict[str, float], or a
    plain type.
    """
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return _read_union(typing.get_args(kind), value, where)
    if origin is tuple:
        return _read_tuple(typing.get_args(kind), value, where)
    if origin is dict:
        if not isinstance(value, dict):
            _fail(where, "an object { ... }", value)
        return {key: _read(float, part, f"{where}.{key}") for key, part in value.items()}
    if origin is typing.Literal:
        if value not in typing.get_args(kind):
            names = [str(name) for name in typing.get_args(kind)]
            raise InputError(f"{where}: unknown value {value!r}; {nearest(str(value), names)}")
        return value
    if dataclasses.is_dataclass(kind):
        return _read_class(kind, value, where)
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if kind is float and number:
        return float(value)
    if kind in (bool, str, int) and type(value) is kind:
        return value
    names = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
    _fail(where, names[kind], value)


def scene_from_json(value: Any, where: str = "scene") -> Scene:
    """A `Scene` from decoded JSON; raises `InputError` that names the field."""
    return _read_class(Scene, value, where)


def read_json(path: str | os.PathLike) -> Any:
    """The decoded JSON of a file; raises `InputError` for a missing, enormous or malformed one.

    NaN and infinities, which JSON does not know, are refused.
    """
    path = Path(path)

    def refuse(name: str) -> typing.NoReturn:
        raise InputError(f"{path}: {name} is not a number that JSON knows; write a finite one")

    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{path}: more than {LARGEST_FILE >> 20} MiB is no scene file")
        return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file; a scene is JSON in UTF-8") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"{path}: not valid JSON at line {error.lineno}, column {error.colno}: {error.msg}"
        ) from None
    except RecursionError:
        raise InputError(f"{path}: nested too deeply for a scene file") from None


def write_scene(path: str | os.PathLike, scene: Scene) -> None:
    """Writes every field of a scene, defaults too, with sorted keys."""
    write_json(path, to_json(scene))
