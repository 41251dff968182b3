"""What a checkpoint says of a Llama network (Touvron et al. 2023), in either of its two formats.

Fields are named as in the config.json of the first format; GGUF files say the same in metadata.
What would need another computation than `llama` has is refused, by the name of the field.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, shown
from jaxphys.core.fields import between

# Fields of config.json that change the computation, with the values under which they do not.
PLAIN = {
    "hidden_act": ("silu",),
    "attention_bias": (False,),
    "mlp_bias": (False,),
    "rope_scaling": (None,),
    "partial_rotary_factor": (None, 1, 1.0),
    "sliding_window": (None,),
    "quantization_config": (None,),
}
SIZE = between(1, 10_000_000)
LAYERS = between(1, 1000)
GGUF_NAMES = {
    "hidden_size": "embedding_length",
    "intermediate_size": "feed_forward_length",
    "num_hidden_layers": "block_count",
    "num_attention_heads": "attention.head_count",
    "num_key_value_heads": "attention.head_count_kv",
    "head_dim": "attention.key_length",
    "max_position_embeddings": "context_length",
    "rms_norm_eps": "attention.layer_norm_rms_epsilon",
    "rope_theta": "rope.freq_base",
}


@dataclass(frozen=True)
class LlamaConfig:
    """Sizes of a network. `num_key_value_heads` and `head_dim` of 0 stand for what the others
    imply: as many as attention heads, and the width divided among them.
    """

    vocab_size: int = field(metadata=SIZE)
    hidden_size: int = field(metadata=SIZE)
    intermediate_size: int = field(metadata=SIZE)
    num_hidden_layers: int = field(metadata=LAYERS)
    num_attention_heads: int = field(metadata=SIZE)
    num_key_value_heads: int = field(default=0, metadata=between(0, 100_000))
    head_dim: int = field(default=0, metadata=between(0, 100_000))
    max_position_embeddings: int = field(default=2048, metadata=between(1, 100_000_000))
    rms_norm_eps: float = field(default=1e-6, metadata={"above": 0, "most": 1.0})
    rope_theta: float = field(default=10000.0, metadata={"above": 0, "most": 1e12})
    tie_word_embeddings: bool = False

    def __post_init__(self):
        heads, width = self.num_attention_heads, self.hidden_size
        if not self.head_dim and width % heads:
            raise InputError(f"num_attention_heads: {heads} does not divide hidden_size {width}")
        object.__setattr__(self, "head_dim", self.head_dim or width // heads)
        object.__setattr__(self, "num_key_value_heads", self.num_key_value_heads or heads)
        if heads % self.num_key_value_heads:
            raise InputError(
                f"num_key_value_heads: {self.num_key_value_heads} does not divide"
                f" num_attention_heads {heads}"
            )
        if self.head_dim % 2:
            raise InputError(f"head_dim: {self.head_dim} is odd; rotation needs pairs")

    @classmethod
    def from_json(cls, values: Mapping[str, Any], source: str) -> Self:
        """Out of a config.json. Raises InputError, naming `source` and the field, for another
        kind of network or one that computes something else.
        """
        if not isinstance(values, Mapping):
            raise InputError(f"{source}: expected an object {{ ... }}")
        if values.get("model_type") != "llama":
            raise InputError(
                f"{source}: model_type: expected 'llama', found {shown(values.get('model_type'))}"
            )
        for name, plain in PLAIN.items():
            if name in values and values[name] not in plain:
                raise InputError(f"{source}: {name}: {shown(values[name])} is not supported")
        rotary = values.get("rope_parameters") or {}
        if not isinstance(rotary, Mapping) or rotary.get("rope_type", "default") != "default":
            raise InputError(f"{source}: rope_parameters: {shown(rotary)} is not supported")
        return cls._checked({**rotary, **values}, source)

    @classmethod
    def from_gguf(cls, metadata: Mapping[str, Any], source: str) -> Self:
        """Out of GGUF metadata; `tie_word_embeddings` is for the caller, who knows the arrays.

        Raises InputError as `from_json` does.
        """
        kind = metadata.get("general.architecture")
        if kind != "llama":
            raise InputError(
                f"{source}: general.architecture: expected 'llama', found {shown(kind)}"
            )
        scaling = metadata.get("llama.rope.scaling.type", "none")
        if scaling != "none" or metadata.get("llama.rope.scale_linear", 1.0) != 1.0:
            raise InputError(
                f"{source}: llama.rope.scaling.type: {shown(scaling)} is not supported"
            )
        if metadata.get("llama.expert_count", 0):
            raise InputError(f"{source}: llama.expert_count: experts are not supported")
        values = {
            name: metadata[f"llama.{theirs}"]
            for name, theirs in GGUF_NAMES.items()
            if f"llama.{theirs}" in metadata
        }
        tokens = metadata.get("tokenizer.ggml.tokens", ())
        config = cls._checked(
            {"vocab_size": metadata.get("llama.vocab_size", len(tokens)), **values}, source
        )
        rotated = metadata.get("llama.rope.dimension_count", config.head_dim)
        if rotated != config.head_dim:
            raise InputError(
                f"{source}: llama.rope.dimension_count: {rotated} of {config.head_dim} rotated"
                " dimensions is not supported"
            )
        return config

    @classmethod
    def _checked(cls, values: Mapping[str, Any], source: str) -> Self:
        # Published files write null for what has its default.
        given = {key: value for key, value in values.items() if value is not None}
        return from_json(cls, given, f"{source}: ", unknown=lambda key, value: None)
