"""Files of published networks, as the tests know them: by names, shapes and sizes."""

import json
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from flax import nnx

from jaxphys.networks.llama_config import LlamaConfig
from jaxphys.networks.parameters import Renames, named_parameters, published_name, published_shape

HERE = Path(__file__).parent


def golden(name: str) -> dict[str, np.ndarray]:
    """What the original computes."""
    with np.load(HERE / "golden" / f"{name}.npz") as arrays:
        return dict(arrays)


def manifest(name: str) -> dict[str, tuple[int, ...]]:
    """Shapes of a checkpoint's arrays by name."""
    text = (HERE / "manifests" / f"{name}.json").read_text()
    return {key: tuple(shape) for key, shape in json.loads(text).items()}


def wanted(build: Callable[[], nnx.Module]) -> dict[str, tuple[int, ...]]:
    """Shapes of the arrays that a module asks a checkpoint for, by name."""
    parameters = named_parameters(nnx.eval_shape(build))
    return {published_name(n): published_shape(n, leaf.shape) for n, leaf in parameters.items()}


def of_llama(config: LlamaConfig) -> dict[str, tuple[int, ...]]:
    """Shapes of the arrays in a Llama checkpoint, by name; those of SmolLM2 are a manifest."""
    width, inner = config.hidden_size, config.num_attention_heads * config.head_dim
    shared = config.num_key_value_heads * config.head_dim
    block = {
        "input_layernorm": (width,),
        "self_attn.q_proj": (inner, width),
        "self_attn.k_proj": (shared, width),
        "self_attn.v_proj": (shared, width),
        "self_attn.o_proj": (width, inner),
        "post_attention_layernorm": (width,),
        "mlp.gate_proj": (config.intermediate_size, width),
        "mlp.up_proj": (config.intermediate_size, width),
        "mlp.down_proj": (width, config.intermediate_size),
    }
    table = (config.vocab_size, width)
    layers = {"model.embed_tokens": table, "model.norm": (width,)}
    for index in range(config.num_hidden_layers):
        layers |= {f"model.layers.{index}.{name}": shape for name, shape in block.items()}
    if not config.tie_word_embeddings:
        layers["lm_head"] = table
    return {f"{name}.weight": shape for name, shape in layers.items()}


def offered(
    shapes: dict[str, tuple[int, ...]], renames: Renames, ignore: Sequence[str] = ()
) -> dict[str, tuple[int, ...]]:
    """What a checkpoint offers, under the names that modules have; 1 x 1 kernels as matrices."""
    found = {}
    for key, shape in shapes.items():
        for pattern, replacement in renames:
            key = re.sub(pattern, replacement, key)
        if not any(re.fullmatch(pattern, key) for pattern in ignore):
            assert key not in found, key
            found[key] = shape[:2] if shape[2:] == (1, 1) else shape
    return found


def bytes_of_file(shapes: dict[str, tuple[int, ...]], dtype: str) -> int:
    """Size of the safetensors file that holds these arrays: a header, which spells every name, and
    then the numbers. dtype: "F32" or "F16"."""
    header, end = {"__metadata__": {"format": "pt"}}, 0
    for name, shape in sorted(shapes.items()):
        start, end = end, end + math.prod(shape) * int(dtype[1:]) // 8
        header[name] = {"dtype": dtype, "shape": shape, "data_offsets": [start, end]}
    length = len(json.dumps(header, separators=(",", ":")))
    return 8 + -(-length // 8) * 8 + end


def difference(found, expected: np.ndarray) -> float:
    """The largest, relative to the largest entry."""
    assert found.shape == expected.shape
    found = np.asarray(found, np.float64)
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))
