"""What a declared number may be: its range and unit, stated once in the field's metadata, checked
wherever the value comes from.
"""

import dataclasses
import math
from typing import Any

from jaxphys.core.errors import InputError

POSITIVE = {"above": 0}
NON_NEGATIVE = {"least": 0}


def between(least: float, most: float) -> dict[str, float]:
    """Metadata for a number in [least, most]."""
    return {"least": least, "most": most}


def _numbers(value: Any) -> list[float]:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return [value]
    if isinstance(value, tuple):
        return [number for part in value for number in _numbers(part)]
    if isinstance(value, dict):
        return [number for part in value.values() for number in _numbers(part)]
    return []


def check_ranges(instance: Any) -> None:
    """Raises `InputError` where a number of a dataclass is not finite or outside the range in
    its field's metadata.
    """
    for entry in dataclasses.fields(instance):
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
