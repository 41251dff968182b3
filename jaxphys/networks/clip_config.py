"""What a CLIP checkpoint's config.json says of its two towers (Radford et al. 2021).

Fields are named as in the file. Their defaults are those of the published format, which leaves out
what does not differ from them.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any, Self

from jaxphys.core.errors import InputError, nearest
from jaxphys.networks.layers import gelu, quick_gelu

ACTIVATIONS = {"quick_gelu": quick_gelu, "gelu": gelu}
LEGACY_END = 2


@dataclass(frozen=True)
class _Tower:
    def __post_init__(self):
        if self.hidden_act not in ACTIVATIONS:
            tail = nearest(self.hidden_act, ACTIVATIONS)
            raise InputError(f"hidden_act: {self.hidden_act!r} is not supported; {tail}")
        if self.hidden_size % self.num_attention_heads:
            raise InputError(
                f"num_attention_heads: {self.num_attention_heads} does not divide"
                f" hidden_size {self.hidden_size}"
            )

    @classmethod
    def from_json(cls, values: dict[str, Any], source: str) -> Self:
        """The tower's part of a config.json, or all of it where it is of this tower alone.

        Raises:
            InputError: another kind of model, or a field that cannot be used; names `source`.
        """
        part = values
        if values.get("model_type") == "clip" or cls.PART in values:
            part = {}
            # Early files say what differs from the defaults a second time, in `..._dict`.
            for key in (cls.PART, f"{cls.PART}_dict"):
                found = values.get(key) or {}
                if not isinstance(found, dict):
                    raise InputError(f"{source}: {key}: expected an object {{ ... }}")
                part |= found
            # The two towers meet in one space, whose size is not theirs to say.
            part["projection_dim"] = values.get("projection_dim")
        elif values.get("model_type") != cls.MODEL_TYPE:
            raise InputError(
                f"{source}: model_type: expected 'clip' or {cls.MODEL_TYPE!r},"
                f" found {values.get('model_type')!r}"
            )
        fields = {entry.name: entry.type for entry in dataclasses.fields(cls)}
        given = {name: part[name] for name in fields if part.get(name) is not None}
        try:
            for name, value in given.items():
                _check(name, fields[name], value)
            return cls(**given)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None


def _check(name: str, kind: type, value: Any) -> None:
    if kind is str:
        good, expected = isinstance(value, str), "a string"
    else:
        types = int if kind is int else (int, float)
        good = isinstance(value, types) and not isinstance(value, bool) and value > 0
        expected = "a positive integer" if kind is int else "a positive number"
    if not good:
        raise InputError(f"{name}: expected {expected}, found {value!r}")


@dataclass(frozen=True)
class TextConfig(_Tower):
    """The text tower. `eos_token_id` is 2 in early files, whatever the vocabulary: there the end
    of a text is its largest id.
    """

    PART = "text_config"
    MODEL_TYPE = "clip_text_model"

    vocab_size: int = 49408
    hidden_size: int = 512
    intermediate_size: int = 2048
    projection_dim: int = 512
    num_hidden_layers: int = 12
    num_attention_heads: int = 8
    max_position_embeddings: int = 77
    hidden_act: str = "quick_gelu"
    layer_norm_eps: float = 1e-5
    eos_token_id: int = 49407


@dataclass(frozen=True)
class VisionConfig(_Tower):
    """The picture tower: squares of `image_size` pixels in patches of `patch_size`."""

    PART = "vision_config"
    MODEL_TYPE = "clip_vision_model"

    hidden_size: int = 768
    intermediate_size: int = 3072
    projection_dim: int = 512
    num_hidden_layers: int = 12
    num_attention_heads: int = 12
    image_size: int = 224
    patch_size: int = 32
    hidden_act: str = "quick_gelu"
    layer_norm_eps: float = 1e-5
