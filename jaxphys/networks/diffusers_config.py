"""What a config.json in diffusers' layout says of a convolutional network.

Fields are named as in the file. Their defaults are those of the published format, which leaves some
out. An option that would need another computation than ours is refused, by its name.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from jaxphys.core.errors import InputError


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value >= 0


def _positive(value: Any) -> bool:
    return _number(value) and isinstance(value, int) and value > 0


def _list_of(kind: type, value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(entry, kind) for entry in value)


def _sizes(value: Any) -> bool:
    return _list_of(int, value) and all(map(_positive, value))


# By the annotation of a field: which values it takes, and how to say so.
KINDS = {
    int: (_positive, "a positive integer"),
    int | None: (lambda v: v is None or _positive(v), "a positive integer or null"),
    float: (_number, "a number of at least 0"),
    bool: (lambda v: isinstance(v, bool), "true or false"),
    tuple[int, ...]: (_sizes, "a list of positive integers"),
    tuple[str, ...]: (lambda v: _list_of(str, v), "a list of names"),
    int | tuple[int, ...]: (lambda v: _positive(v) or _sizes(v), "a positive integer or a list"),
}


@dataclass(frozen=True)
class DiffusersConfig:
    """What the networks have in common. `attention_slice` is ours and in no file: so many queries
    at a time, null for all (see `attend`).
    """

    CLASS_NAME: ClassVar[str]
    DOWN_BLOCKS: ClassVar[tuple[str, ...]]
    UP_BLOCKS: ClassVar[tuple[str, ...]]
    PLAIN: ClassVar[dict[str, tuple]]  # other options, with the values under which they do nothing
    IDLE: ClassVar[tuple[str, ...]]  # options that never do anything here

    in_channels: int
    out_channels: int
    block_out_channels: tuple[int, ...]
    layers_per_block: int
    down_block_types: tuple[str, ...]
    up_block_types: tuple[str, ...]
    norm_num_groups: int
    attention_slice: int | None

    def __post_init__(self):
        for name, known in (
            ("down_block_types", self.DOWN_BLOCKS),
            ("up_block_types", self.UP_BLOCKS),
        ):
            types = getattr(self, name)
            if len(types) != len(self.block_out_channels):
                raise InputError(
                    f"{name}: {len(types)} blocks, but block_out_channels has"
                    f" {len(self.block_out_channels)}"
                )
            for entry in types:
                if entry not in known:
                    raise InputError(f"{name}: {entry!r} is not supported, only {_or(known)}")
        for width in self.block_out_channels:
            if width % self.norm_num_groups:
                raise InputError(
                    f"block_out_channels: {width} is no multiple of norm_num_groups"
                    f" {self.norm_num_groups}"
                )

    @classmethod
    def from_json(cls, values: Mapping[str, Any], source: str) -> Self:
        """Out of a config.json.

        Raises:
            InputError: another kind of network, an option that is not supported, or a value that
                cannot be used; names `source` and the field.
        """
        if not isinstance(values, Mapping):
            raise InputError(f"{source}: expected an object {{ ... }}")
        kinds = {field.name: field.type for field in dataclasses.fields(cls)}
        given = {}
        try:
            found = values.get("_class_name", cls.CLASS_NAME)
            if found != cls.CLASS_NAME:
                raise InputError(f"_class_name: expected {cls.CLASS_NAME!r}, found {found!r}")
            for name, value in values.items():
                if name in kinds:
                    given[name] = _checked(name, kinds[name], value)
                elif not (name.startswith("_") or name in cls.IDLE):
                    cls._refuse_unless_plain(name, value)
            return cls(**given)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None

    @classmethod
    def _refuse_unless_plain(cls, name: str, value: Any) -> None:
        """Options that are not named at all must be off."""
        plain = cls.PLAIN.get(name, (None, False))
        if isinstance(value, list) or value not in plain:
            raise InputError(f"{name}: {value!r} is not supported, only {_or(plain)}")


def _checked(name: str, kind: Any, value: Any) -> Any:
    value = tuple(value) if isinstance(value, list) else value
    good, expected = KINDS[kind]
    if not good(value):
        raise InputError(f"{name}: expected {expected}, found {value!r}")
    return value


def _or(values: tuple) -> str:
    return " or ".join(map(repr, values))
