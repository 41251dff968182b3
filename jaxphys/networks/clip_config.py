"""What a CLIP checkpoint's config.json says of its two towers (Radford et al. 2021).

Fields are named as in the file. Their defaults are those of the published format, which leaves out
what does not differ from them.
"""

from dataclasses import Field, dataclass, field
from typing import Any, ClassVar, Self

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, nearest, shown
from jaxphys.core.fields import between
from jaxphys.networks.layers import gelu, quick_gelu

ACTIVATIONS = {"quick_gelu": quick_gelu, "gelu": gelu}
LEGACY_END = 2
SIZE = between(1, 10_000_000)
LAYERS = between(1, 1000)
EPSILON = {"above": 0, "most": 1.0}


class _Tower:
    """Base of the two, which are dataclasses."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    PART: ClassVar[str]
    MODEL_TYPE: ClassVar[str]
    hidden_act: str
    hidden_size: int
    num_attention_heads: int

    def __post_init__(self):
        if self.hidden_act not in ACTIVATIONS:
            tail = nearest(self.hidden_act, ACTIVATIONS)
            raise InputError(f"hidden_act: {shown(self.hidden_act)} is not supported; {tail}")
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
                f" found {shown(values.get('model_type'))}"
            )
        # Published files write null for what has its default.
        given = {key: value for key, value in part.items() if value is not None}
        return from_json(cls, given, f"{source}: ", unknown=lambda key, value: None)


@dataclass(frozen=True)
class TextConfig(_Tower):
    """The text tower. `eos_token_id` is 2 in early files, whatever the vocabulary: there the end
    of a text is its largest id.
    """

    PART: ClassVar[str] = "text_config"
    MODEL_TYPE: ClassVar[str] = "clip_text_model"

    vocab_size: int = field(default=49408, metadata=SIZE)
    hidden_size: int = field(default=512, metadata=SIZE)
    intermediate_size: int = field(default=2048, metadata=SIZE)
    projection_dim: int = field(default=512, metadata=SIZE)
    num_hidden_layers: int = field(default=12, metadata=LAYERS)
    num_attention_heads: int = field(default=8, metadata=SIZE)
    max_position_embeddings: int = field(default=77, metadata=SIZE)
    hidden_act: str = "quick_gelu"
    layer_norm_eps: float = field(default=1e-5, metadata=EPSILON)
    eos_token_id: int = field(default=49407, metadata=SIZE)


@dataclass(frozen=True)
class VisionConfig(_Tower):
    """The picture tower: squares of `image_size` pixels in patches of `patch_size`."""

    PART: ClassVar[str] = "vision_config"
    MODEL_TYPE: ClassVar[str] = "clip_vision_model"

    hidden_size: int = field(default=768, metadata=SIZE)
    intermediate_size: int = field(default=3072, metadata=SIZE)
    projection_dim: int = field(default=512, metadata=SIZE)
    num_hidden_layers: int = field(default=12, metadata=LAYERS)
    num_attention_heads: int = field(default=12, metadata=SIZE)
    image_size: int = field(default=224, metadata=SIZE)
    patch_size: int = field(default=32, metadata=SIZE)
    hidden_act: str = "quick_gelu"
    layer_norm_eps: float = field(default=1e-5, metadata=EPSILON)
