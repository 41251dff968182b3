"""The small CLIP models that are compared, and what they read: for `clip.py` and for the tests."""

import numpy as np

from experiments.parity.arrays import pseudo_random

# Texts as Stable Diffusion 1.5 reads them: the end mark is the largest id and the padding.
END_PADDED = {
    "model_type": "clip_text_model", "vocab_size": 60, "hidden_size": 32, "intermediate_size": 48,
    "num_hidden_layers": 2, "num_attention_heads": 4, "max_position_embeddings": 11,
    "hidden_act": "quick_gelu", "eos_token_id": 2, "bos_token_id": 0, "pad_token_id": 1,
}  # fmt: skip
# As Stable Diffusion 2.1: exact GELU, padding with id 0; here with the later rule for the end.
ZERO_PADDED = END_PADDED | {"hidden_act": "gelu", "eos_token_id": 40, "num_attention_heads": 2}
WHOLE = {
    "model_type": "clip",
    "projection_dim": 12,
    "text_config": END_PADDED | {"num_hidden_layers": 1},
    "vision_config": {
        "hidden_size": 24, "intermediate_size": 40, "num_hidden_layers": 2,
        "num_attention_heads": 3, "image_size": 12, "patch_size": 4,
    },
}  # fmt: skip
# With the vocabulary of `clip_tokenizer.json`, and embeddings as wide as aesthetic heads read.
SCORED = {
    "model_type": "clip",
    "projection_dim": 768,
    "text_config": END_PADDED | {"vocab_size": 814, "max_position_embeddings": 77},
    "vision_config": WHOLE["vision_config"] | {"image_size": 28, "patch_size": 14},
}
SENTENCE = "A hat"  # in this space it fits some of PICTURES and not others
IDS = {
    "end": np.array([[58, 5, 17, 17, 59, 59, 59, 59, 59, 59, 59], [58, *range(1, 10), 59]]),
    # The largest id is not the end mark, so the two rules differ.
    "zero": np.array([[41, 5, 50, 3, 40, 0, 0, 0, 0, 0, 0], [41, 40, 0, 0, 0, 0, 0, 0, 0, 0, 0]]),
}
PIXELS = pseudo_random("pixels", (3, 12, 12, 3), 2.0)
SIZE = 32
PICTURES = {  # larger and smaller than the square of SIZE pixels, wide and tall
    name: np.round(127.5 + 127.5 * pseudo_random(name, shape)).astype(np.uint8)
    for name, shape in {"wide": (61, 150, 3), "tall": (47, 33, 3), "tiny": (9, 20, 3)}.items()
}
EMBEDDINGS = pseudo_random("embeddings", (5, 768))
LINEAR_HEAD = {"weight": (1, 768), "bias": (1,)}
DEEP_HEAD = {
    f"layers.{index}.{kind}": (outputs, inputs) if kind == "weight" else (outputs,)
    for index, inputs, outputs in (
        (0, 768, 1024), (2, 1024, 128), (4, 128, 64), (6, 64, 16), (7, 16, 1),
    )
    for kind in ("weight", "bias")
}  # fmt: skip
