"""Decoded JSON as dataclasses, which declare all there is to know: names, types, defaults, ranges.

A field's metadata may hold, besides the range of its numbers (`jaxphys.core.fields`), "keys": the
names that the file has for it, where they are not the field's own; the last one that is there
counts, and none at all leaves the field out of files. "zero_or_one" lets a truth be a number.
"""

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol, TypeVar

from jaxphys.core.errors import InputError, nearest, one_line, shown
from jaxphys.core.fields import check_number

MOST_ENTRIES = 10_000


class Declared(Protocol):
    """Any dataclass."""

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]


T = TypeVar("T", bound=Declared)
Unknown = Callable[[str, Any], None]
NAMES = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}


def from_json(cls: type[T], value: Any, where: str, unknown: Unknown | None = None) -> T:
    """A dataclass out of decoded JSON.

    Types of fields may be: bool, int, float, str, Literal, dataclasses, dict[str, T] and
    tuples of these, unions with None, of plain types, or of dataclasses told apart by `type`. Whole
    numbers may be written as 1e5.

    Args:
        cls: the dataclass; what its `__post_init__` raises counts as of this place.
        value: what `json` made.
        where: file or field, for errors; a name is joined by a dot, unless a space ends it.
        unknown: called with each key that no field has, and its value; None refuses such keys.

    Raises:
        InputError: naming the field.
    """
    if not isinstance(value, Mapping):
        _fail(where, "an object { ... }", value)
    hints = typing.get_type_hints(cls)
    entries = {key: entry for entry in dataclasses.fields(cls) for key in _keys(entry)}
    known = set(entries) | ({"type"} if hasattr(cls, "type") else set())
    for key in value:
        if key in known:
            continue
        if unknown is None:
            raise InputError(
                f"{where.rstrip(': ')}: unknown key {shown(key)}; {nearest(key, known)}"
            )
        unknown(key, value[key])
    arguments = {
        entry.name: _read(hints[entry.name], value[key], _at(where, key), entry.metadata)
        for key, entry in entries.items()
        if key in value
    }
    for entry in dataclasses.fields(cls):
        defaults = (entry.default, entry.default_factory)
        if entry.name not in arguments and defaults == (dataclasses.MISSING, dataclasses.MISSING):
            raise InputError(f"{where.rstrip(': ')}: the key {_keys(entry)[0]!r} is missing")
    try:
        return cls(**arguments)
    except InputError as error:
        if str(error).startswith(one_line(where)):
            raise
        raise InputError(_at(where, str(error))) from None


def _at(where: str, key: str) -> str:
    return f"{where}{key}" if where.endswith(" ") else f"{where}.{key}"


def _keys(entry: dataclasses.Field) -> tuple[str, ...]:
    return entry.metadata.get("keys", (entry.name,))


def _fail(where: str, expected: str, value: Any) -> typing.NoReturn:
    raise InputError(f"{where.rstrip(': ')}: expected {expected}, found {shown(value)}")


def _read(kind: Any, value: Any, where: str, rules: Mapping[str, Any]) -> Any:
    """`value` as a `kind`; its numbers within the range in `rules`."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return _read_union(parts, value, where, rules)
    if origin is tuple:
        return _read_tuple(parts, value, where, rules)
    if origin is dict:
        if not isinstance(value, Mapping):
            _fail(where, "an object { ... }", value)
        return {key: _read(parts[1], part, _at(where, key), rules) for key, part in value.items()}
    if origin is typing.Literal:
        if not isinstance(value, str) or value not in parts:
            raise InputError(f"{where}: unknown value {shown(value)}; {nearest(str(value), parts)}")
        return value
    if dataclasses.is_dataclass(kind):
        return from_json(typing.cast(type[Any], kind), value, where)
    return _read_plain(kind, value, where, rules)


def _read_plain(kind: type, value: Any, where: str, rules: Mapping[str, Any]) -> Any:
    if kind is bool and (isinstance(value, bool) or (value in (0, 1) and "zero_or_one" in rules)):
        return bool(value)
    if kind is str and isinstance(value, str):
        if "\0" in value or (not value.isascii() and any("\ud800" <= c <= "\udfff" for c in value)):
            _fail(where, "a text of whole characters", value)
        return value
    if kind in (int, float) and isinstance(value, (int, float)) and not isinstance(value, bool):
        check_number(where, value, rules)
        if kind is float or value == int(value):
            return kind(value)
    _fail(where, NAMES[kind], value)


def _read_union(kinds: tuple, value: Any, where: str, rules: Mapping[str, Any]) -> Any:
    if value is None and types.NoneType in kinds:
        return None
    kinds = tuple(kind for kind in kinds if kind is not types.NoneType)
    if len(kinds) > 1 and all(map(dataclasses.is_dataclass, kinds)):
        return _read_tagged({kind.type: kind for kind in kinds}, value, where)
    # Of plain types, only a list can be told from the others by its form.
    lists = [kind for kind in kinds if typing.get_origin(kind) is tuple]
    others = [kind for kind in kinds if kind not in lists]
    chosen = lists if lists and (isinstance(value, list) or not others) else others
    return _read(chosen[0], value, where, rules)


def _read_tagged(classes: Mapping[str, type], value: Any, where: str) -> Any:
    if not isinstance(value, Mapping):
        _fail(where, "an object { ... }", value)
    tag = value.get("type")
    if not isinstance(tag, str):
        raise InputError(f"{where}: the key 'type' is missing; valid: {', '.join(sorted(classes))}")
    if tag not in classes:
        raise InputError(f"{where}.type: unknown type {shown(tag)}; {nearest(tag, classes)}")
    return from_json(classes[tag], value, where)


def _read_tuple(parts: tuple, value: Any, where: str, rules: Mapping[str, Any]) -> tuple:
    if not isinstance(value, list):
        _fail(where, "a list [ ... ]", value)
    if parts[-1] is Ellipsis:
        if len(value) > MOST_ENTRIES:
            raise InputError(f"{where}: {len(value)} entries, more than {MOST_ENTRIES}")
        parts = (parts[0],) * len(value)
    if len(value) != len(parts):
        _fail(where, f"a list of {len(parts)} values", value)
    return tuple(
        _read(part, item, f"{where}[{i}]", rules)
        for i, (part, item) in enumerate(zip(parts, value, strict=True))
    )
