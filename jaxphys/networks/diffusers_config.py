"""What a config.json in diffusers' layout says of a convolutional network.

Fields are named as in the file. Their defaults are those of the published format, which leaves some
out. An option that would need another computation than ours is refused, by its name.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, shown
from jaxphys.core.fields import between

SIZE = between(1, 1_000_000)
LAYERS = between(1, 100)
NUMBER = between(0, 1e6)


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

    in_channels: int = field(metadata=SIZE)
    out_channels: int = field(metadata=SIZE)
    block_out_channels: tuple[int, ...] = field(metadata=SIZE)
    layers_per_block: int = field(metadata=LAYERS)
    down_block_types: tuple[str, ...]
    up_block_types: tuple[str, ...]
    norm_num_groups: int = field(metadata=SIZE)
    attention_slice: int | None = field(metadata=SIZE)

    def __post_init__(self):
        for name, known in (
            ("down_block_types", self.DOWN_BLOCKS),
            ("up_block_types", self.UP_BLOCKS),
        ):
            types = getattr(self, name)
            if not types:
                raise InputError(f"{name}: is empty; a network has one block at least")
            if len(types) != len(self.block_out_channels):
                raise InputError(
                    f"{name}: {len(types)} blocks, but block_out_channels has"
                    f" {len(self.block_out_channels)}"
                )
            for entry in types:
                if entry not in known:
                    raise InputError(f"{name}: {shown(entry)} is not supported, only {_or(known)}")
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
        found = values.get("_class_name", cls.CLASS_NAME)
        if found != cls.CLASS_NAME:
            raise InputError(
                f"{source}: _class_name: expected {cls.CLASS_NAME!r}, found {shown(found)}"
            )

        def unknown(name: str, value: Any) -> None:
            if not (name.startswith("_") or name in cls.IDLE):
                cls._refuse_unless_plain(name, value, source)

        return from_json(cls, values, f"{source}: ", unknown)

    @classmethod
    def _refuse_unless_plain(cls, name: str, value: Any, source: str) -> None:
        """Options that are not named at all must be off."""
        plain = cls.PLAIN.get(name, (None, False))
        if isinstance(value, list) or value not in plain:
            raise InputError(
                f"{source}: {name}: {shown(value)} is not supported, only {_or(plain)}"
            )


def _or(values: tuple) -> str:
    return " or ".join(map(repr, values))
