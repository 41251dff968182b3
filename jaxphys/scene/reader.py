"""Typed look-ups in foreign JSON."""

import math
from typing import Any

from jaxphys.core.errors import InputError, nearest


class Reader:
    """Typed look-ups in one JSON object, with errors that name the field."""

    def __init__(self, values: Any, known: set[str], where: str):
        if not isinstance(values, dict):
            raise InputError(f"{where}: expected an object {{ ... }}")
        for key in values:
            if key not in known:
                raise InputError(f"{where}: unknown key {key!r}; {nearest(key, known)}")
        self.values, self.where = values, where

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number; required where there is no default."""
        value = self.values.get(key, default)
        if (
            isinstance(value, bool)
            or not isinstance(value, (int, float))
            or not math.isfinite(value)
        ):
            raise InputError(f"{self.where}.{key}: expected a number, found {value!r}")
        return float(value)

    def whole(self, key: str, default: int) -> int:
        """A whole number, also written as 1e5."""
        value = self.number(key, default)
        if value != int(value):
            raise InputError(f"{self.where}.{key}: expected a whole number, found {value}")
        return int(value)

    def text(self, key: str, default: str) -> str:
        """A string."""
        value = self.values.get(key, default)
        if not isinstance(value, str):
            raise InputError(f"{self.where}.{key}: expected a text, found {value!r}")
        return value

    def numbers(self, key: str, count: int | None, default: list | None = None) -> tuple:
        """A list of finite numbers, of the given length unless that is None."""
        value = self.values.get(key, default)
        good = isinstance(value, list) and all(
            isinstance(part, (int, float)) and not isinstance(part, bool) and math.isfinite(part)
            for part in value
        )
        if not good or (count is not None and len(value) != count):
            size = "numbers" if count is None else f"{count} numbers"
            raise InputError(f"{self.where}.{key}: expected a list of {size}, found {value!r}")
        return tuple(float(part) for part in value)

    def flag(self, key: str, default: bool = False) -> bool:
        """true, false, 0 or 1."""
        value = self.values.get(key, default)
        if value not in (True, False, 0, 1):
            raise InputError(f"{self.where}.{key}: expected true or false, found {value!r}")
        return bool(value)

    def items(self, key: str) -> list:
        """A list, empty where the key is absent."""
        value = self.values.get(key, [])
        if not isinstance(value, list):
            raise InputError(f"{self.where}.{key}: expected a list, found {value!r}")
        return value
