"""What a declared number may be: its range and unit, stated once in the field's metadata, checked
wherever the value comes from, before any arithmetic.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, get_args

import numpy as np

from jaxphys.core.errors import InputError, nearest, shown

# Where a field declares no bound of its own: squares and products of two still fit float32.
LARGEST = 1e15

POSITIVE = {"above": 0, "most": LARGEST}
NON_NEGATIVE = {"least": 0, "most": LARGEST}


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
    return vector(between(-1e6, 1e6)) | {"nonzero": True}


def one_of(names: Any) -> dict[str, Any]:
    """Metadata for a text, or each of several, that is one of a Literal's."""
    return {"one_of": get_args(names)}


# Of things that a person could mean, in SI units; wide enough to be in nobody's way.
PLACE = between(-1e6, 1e6)
LENGTH = {"above": 0} | between(1e-9, 1e6)
TIME = between(-1e9, 1e9)
DURATION = {"above": 0} | between(1e-12, 1e9)
SPEED = between(-1e8, 1e8)
RATE = between(-1e6, 1e6)
SEED = between(0, 2**31 - 1)


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
        if isinstance(text, str | bool) and {"least", "most", "above"} & set(rules):
            raise InputError(f"{name}: expected a number, found {shown(text)}")
        if "one_of" in rules and text is not None and text not in rules["one_of"]:
            raise InputError(
                f"{name}: unknown value {shown(text)}; {nearest(str(text), rules['one_of'])}"
            )


def check_number(name: str, number: float, rules: Mapping[str, Any]) -> None:
    """Raises `InputError` where a number is not finite or outside of the range in `rules`."""
    if number != number or number in (math.inf, -math.inf):
        raise InputError(f"{name}: {number} is not a finite number")
    least, most = rules.get("least", -LARGEST), rules.get("most", LARGEST)
    if "above" in rules and not number > rules["above"]:
        raise InputError(f"{name}: {shown(number)} must be above {_bound(rules['above'])}")
    if not number >= least:
        raise InputError(f"{name}: {shown(number)} must be at least {_bound(least)}")
    if not number <= most:
        raise InputError(f"{name}: {shown(number)} must be at most {_bound(most)}")


def _bound(value: float) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def numbers_of(name: str, value: Any) -> np.ndarray:
    """A number, or nested ones, as a float64 array; raises `InputError` where something is none."""
    try:
        return np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected numbers, found {shown(value)}") from None


def check_value(name: str, value: Any, rules: Mapping[str, Any]) -> None:
    """Raises `InputError` where a value, plain or a tuple of plain ones, breaks the rules of its
    field's metadata, or a number is not finite.
    """
    _check_form(name, value, rules)
    for number in _numbers(value):
        check_number(name, number, rules)


def check_ranges(instance: Any) -> None:
    """Raises `InputError` where a value of a dataclass breaks what its field's metadata says, or a
    number is not finite.
    """
    for entry in dataclasses.fields(instance):
        check_value(entry.name, getattr(instance, entry.name), entry.metadata)


class Checked:
    """Base of dataclasses whose numbers are checked as they are made."""

    def __post_init__(self):
        check_ranges(self)
