"""What a declared number may be: its range and unit, stated once in the field's metadata, checked
wherever the value comes from.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, get_args

from jaxphys.core.errors import InputError, nearest

POSITIVE = {"above": 0}
NON_NEGATIVE = {"least": 0}


def between(least: float, most: float) -> dict[str, float]:
    """Metadata for a number in [least, most]."""
    return {"least": least, "most": most}


def unit(symbol: str) -> dict[str, str]:
    """Metadata that says in which unit a number is."""
    return {"unit": symbol}


def vector(*rules: Mapping[str, Any]) -> dict[str, Any]:
    """Metadata for three numbers, to each of which the rules apply."""
    return {key: value for rule in rules for key, value in rule.items()} | {"count": 3}


def direction() -> dict[str, Any]:
    """Metadata for three numbers that give a direction, of any length but zero."""
    return vector() | {"nonzero": True}


def one_of(names: Any) -> dict[str, Any]:
    """Metadata for a text, or each of several, that is one of a Literal's."""
    return {"one_of": get_args(names)}


def _numbers(value: Any) -> list[float]:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return [value]
    if isinstance(value, tuple):
        return [number for part in value for number in _numbers(part)]
    if isinstance(value, dict):
        return [number for part in value.values() for number in _numbers(part)]
    return []


def _check_form(name: str, value: Any, rules: Mapping[str, Any]) -> None:
    if isinstance(value, tuple):
        if "count" in rules and len(value) != rules["count"]:
            raise InputError(f"{name}: expected {rules['count']} values, found {len(value)}")
        if "nonzero" in rules and not any(value):
            raise InputError(f"{name}: is zero; give a direction, of any length")
    for text in value if isinstance(value, tuple) else (value,):
        if "one_of" in rules and text is not None and text not in rules["one_of"]:
            raise InputError(f"{name}: unknown value {text!r}; {nearest(text, rules['one_of'])}")


def check_ranges(instance: Any) -> None:
    """Raises `InputError` where a value of a dataclass breaks what its field's metadata says, or a
    number is not finite.
    """
    for entry in dataclasses.fields(instance):
        _check_form(entry.name, getattr(instance, entry.name), entry.metadata)
        for number in _numbers(getattr(instance, entry.name)):
            if not math.isfinite(number):
                raise InputError(f"{entry.name}: {number} is not a finite number")
            rules = entry.metadata
            if "above" in rules and not number > rules["above"]:
                raise InputError(f"{entry.name}: {number} must be above {rules['above']}")
            if "least" in rules and not number >= rules["least"]:
                raise InputError(f"{entry.name}: {number} must be at least {rules['least']}")
            if "most" in rules and not number <= rules["most"]:
                raise InputError(f"{entry.name}: {number} must be at most {rules['most']}")


class Checked:
    """Base of dataclasses whose numbers are checked as they are made."""

    def __post_init__(self):
        check_ranges(self)
