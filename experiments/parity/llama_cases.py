"""Small Llama networks that between them use every option, and the texts that they read."""

import numpy as np

COMMON = {"model_type": "llama", "vocab_size": 61, "num_hidden_layers": 2}
CASES = {
    # Groups of three heads share keys; the output layer is the table of embeddings.
    "llama_tied": COMMON | {
        "hidden_size": 48, "intermediate_size": 80, "num_attention_heads": 6,
        "num_key_value_heads": 2, "rms_norm_eps": 1e-5, "tie_word_embeddings": True,
        "rope_parameters": {"rope_type": "default", "rope_theta": 100000.0},
    },
    # Every head has its own keys; heads are wider than the width divided among them.
    "llama_untied": COMMON | {
        "hidden_size": 32, "intermediate_size": 56, "num_attention_heads": 4, "head_dim": 12,
        "num_key_value_heads": 4, "rms_norm_eps": 1e-3, "tie_word_embeddings": False,
        "rope_parameters": {"rope_type": "default", "rope_theta": 10000.0},
    },
}  # fmt: skip
IDS = np.array([[3, 14, 15, 9, 26, 5, 35, 8, 60, 0, 32], [2, 7, 18, 28, 1, 8, 2, 8, 4, 59, 45]])
READ = 7  # tokens that are read at once; the others follow one by one

SMOLLM2 = {  # SmolLM2-135M-Instruct's config.json
    "model_type": "llama", "vocab_size": 49152, "hidden_size": 576, "intermediate_size": 1536,
    "num_hidden_layers": 30, "num_attention_heads": 9, "num_key_value_heads": 3,
    "max_position_embeddings": 8192, "rms_norm_eps": 1e-5, "rope_theta": 100000,
    "rope_scaling": None, "hidden_act": "silu", "attention_bias": False, "mlp_bias": False,
    "tie_word_embeddings": True, "bos_token_id": 1, "eos_token_id": 2,
}  # fmt: skip
