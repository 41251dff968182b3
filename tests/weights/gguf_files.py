"""Small GGUF files, written by the `gguf` package as llama.cpp's converter writes them."""

from pathlib import Path

import gguf
import numpy as np
from tokenizers.pre_tokenizers import ByteLevel

MARKS = ["<|endoftext|>", "<|im_start|>", "<|im_end|>"]
MERGES = ["Ġ a", "r e", "re d", "Ġ red", "i n", "1 2"]
TOKENS = [*MARKS, *sorted(ByteLevel.alphabet()), *(merge.replace(" ", "") for merge in MERGES)]
TEMPLATE = "{% for message in messages %}{{'<|im_start|>' + message['role'] }}{% endfor %}"

CONFIG = {
    "model_type": "llama", "vocab_size": len(TOKENS), "hidden_size": 64, "intermediate_size": 96,
    "num_hidden_layers": 2, "num_attention_heads": 4, "num_key_value_heads": 2,
    "max_position_embeddings": 512, "rms_norm_eps": 1e-5, "rope_theta": 100000.0,
    "tie_word_embeddings": True, "eos_token_id": 2,
}  # fmt: skip
THEIR_NAMES = (
    ("model.embed_tokens.", "token_embd."),
    ("model.norm.", "output_norm."),
    ("model.layers.", "blk."),
    ("self_attn.o_proj", "attn_output"),
    ("post_attention_layernorm", "ffn_norm"),
    ("input_layernorm", "attn_norm"),
    ("lm_head", "output"),
)


def their_name(name: str) -> str:
    for ours, theirs in THEIR_NAMES:
        name = name.replace(ours, theirs)
    for part in "qkv":
        name = name.replace(f"self_attn.{part}_proj", f"attn_{part}")
    for part in ("gate", "up", "down"):
        name = name.replace(f"mlp.{part}_proj", f"ffn_{part}")
    return name


def in_pairs(array: np.ndarray, heads: int) -> np.ndarray:
    """Rows of Q and K as llama.cpp has them: the two of a rotated pair next to each other."""
    halves = array.reshape(heads, 2, -1, array.shape[1])
    return halves.transpose(0, 2, 1, 3).reshape(array.shape)


def write_gguf(
    path: Path,
    arrays: dict[str, np.ndarray],
    config: dict = CONFIG,
    quantised: str = "F32",
    **changes,
) -> Path:
    """`arrays` by the names of the original checkpoint; matrices are stored as `quantised`, the
    table of embeddings as Q8_0 if they are quantised at all. `changes` replace metadata: names
    have `__` for dots."""
    writer = gguf.GGUFWriter(path, "llama")
    writer.add_name("tiny")
    writer.add_block_count(config["num_hidden_layers"])
    writer.add_context_length(config["max_position_embeddings"])
    writer.add_embedding_length(config["hidden_size"])
    writer.add_feed_forward_length(config["intermediate_size"])
    writer.add_head_count(config["num_attention_heads"])
    writer.add_head_count_kv(config["num_key_value_heads"])
    writer.add_rope_freq_base(config["rope_theta"])
    writer.add_layer_norm_rms_eps(config["rms_norm_eps"])
    writer.add_vocab_size(config["vocab_size"])
    writer.add_tokenizer_model(changes.get("tokenizer__ggml__model", "gpt2"))
    writer.add_tokenizer_pre(changes.get("tokenizer__ggml__pre", "smollm"))
    writer.add_token_list(changes.get("tokenizer__ggml__tokens", TOKENS))
    writer.add_token_types(
        changes.get("tokenizer__ggml__token_type", [3] * len(MARKS) + [1] * (len(TOKENS) - 3))
    )
    writer.add_token_merges(changes.get("tokenizer__ggml__merges", MERGES))
    writer.add_eos_token_id(2)
    writer.add_chat_template(changes.get("tokenizer__chat_template", TEMPLATE))
    for name, array in arrays.items():
        for part, heads in (("q_proj", "num_attention_heads"), ("k_proj", "num_key_value_heads")):
            if part in name:
                array = in_pairs(array, config[heads])
        kind = "F32" if array.ndim < 2 else quantised
        if kind != "F32" and "embed" in name:
            kind = "Q8_0"
        kind = gguf.GGMLQuantizationType[kind]
        writer.add_tensor(their_name(name), gguf.quants.quantize(array, kind), raw_dtype=kind)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    return path
