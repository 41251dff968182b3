"""Llama: what transformers computes, at once and token by token, and the names in its files."""

from functools import partial

import numpy as np
import torch
from transformers import LlamaConfig, LlamaForCausalLM

from experiments.parity.arrays import weights
from experiments.parity.llama_cases import CASES, IDS, READ, SMOLLM2


def names(config: dict) -> dict[str, tuple[int, ...]]:
    """Arrays of a checkpoint; a tied output layer is not among them."""
    with torch.device("meta"):
        model = LlamaForCausalLM(LlamaConfig(**config))
    return {name: tuple(tensor.shape) for name, tensor in model.named_parameters()}


@torch.no_grad()
def logits(config: dict) -> dict[str, np.ndarray]:
    """Predictions after every token (B, T, vocabulary), and those of the last ones made from a
    cache."""
    model = LlamaForCausalLM(LlamaConfig(**config)).eval()
    arrays = {name: torch.from_numpy(array) for name, array in weights(names(config)).items()}
    missing, left = model.load_state_dict(arrays, strict=False)
    assert not left and set(missing) <= {"lm_head.weight"}, (missing, left)
    ids = torch.from_numpy(IDS)
    cached = model(ids[:, :READ], use_cache=True)
    last = [cached.logits[:, -1]]
    for token in ids[:, READ:].T:
        cached = model(token[:, None], past_key_values=cached.past_key_values, use_cache=True)
        last.append(cached.logits[:, -1])
    return {"logits": model(ids).logits.numpy(), "cached": torch.stack(last, 1).numpy()}


GOLDEN = {name: partial(logits, config) for name, config in CASES.items()}
MANIFESTS = {"smollm2_135m_instruct": partial(names, SMOLLM2)}
