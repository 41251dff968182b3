"""The Llama network and its configuration against transformers' own (`experiments/parity`)."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.parity.arrays import weights
from experiments.parity.llama_cases import CASES, IDS, READ, SMOLLM2
from jaxphys.core.errors import InputError
from jaxphys.networks.joined import JoinedArrays
from jaxphys.networks.llama import JOINED, Llama, empty_cache
from jaxphys.networks.llama_config import LlamaConfig
from jaxphys.networks.parameters import fill
from tests.networks.published import difference, golden, manifest, of_llama, wanted

GGUF = {  # SmolLM2-135M-Instruct's metadata
    "general.architecture": "llama", "llama.block_count": 30, "llama.context_length": 8192,
    "llama.embedding_length": 576, "llama.feed_forward_length": 1536, "llama.vocab_size": 49152,
    "llama.attention.head_count": 9, "llama.attention.head_count_kv": 3,
    "llama.rope.freq_base": 100000.0, "llama.rope.dimension_count": 64,
    "llama.attention.layer_norm_rms_epsilon": 1e-5,
}  # fmt: skip


def small(name: str, dtype=jnp.float32, **changes) -> Llama:
    config = dataclasses.replace(LlamaConfig.from_json(CASES[name], name), **changes)
    return filled(config, weights(of_llama(config)), dtype)


def filled(config: LlamaConfig, arrays: dict[str, np.ndarray], dtype=jnp.float32) -> Llama:
    joined = JoinedArrays(arrays, JOINED, source="x")
    return fill(lambda: Llama(config), joined, source="x", dtype=dtype)


@nnx.jit
def read(model: Llama, ids, cache, start):
    hidden, cache = model(ids, cache, start)
    return model.logits(hidden), cache


def read_at_once(model: Llama, dtype=jnp.float32):
    return read(model, IDS, empty_cache(model.config, IDS.shape[1], len(IDS), dtype), 0)[0]


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("name", CASES)
def test_logits_are_those_of_transformers(name, dtype):
    found = read_at_once(small(name, dtype), dtype)
    assert found.dtype == dtype
    assert difference(found, golden(name)["logits"]) < 1e-5


@pytest.mark.parametrize("name", CASES)
def test_reading_on_from_a_cache_is_reading_at_once(name):
    model = small(name)
    # Padding behind what is read does no harm, nor does room that is never used.
    padded = np.pad(IDS[:, :READ], ((0, 0), (0, 3)), constant_values=17)
    logits, cache = read(model, padded, empty_cache(model.config, 16, len(IDS)), 0)
    last = [logits[:, READ - 1]]
    for position in range(READ, IDS.shape[1]):
        logits, cache = read(model, IDS[:, position : position + 1], cache, position)
        last.append(logits[:, -1])
    found = jnp.stack(last, 1)
    assert difference(found, golden(name)["cached"]) < 1e-5
    assert difference(found, golden(name)["logits"][:, READ - 1 :]) < 1e-5


@pytest.mark.parametrize(
    "changes", [{"rope_theta": 5000.0}, {"rms_norm_eps": 0.1}, {"num_key_value_heads": 2}]
)
def test_every_option_counts(changes):
    found = read_at_once(small("llama_untied", **changes))
    assert difference(found, golden("llama_untied")["logits"]) > 1e-3


def test_weights_of_16_bits_are_computed_with_in_32():
    found = read_at_once(small("llama_tied", jnp.bfloat16))
    assert found.dtype == jnp.float32
    assert 1e-4 < difference(found, golden("llama_tied")["logits"]) < 5e-2


def test_names_are_those_of_the_published_checkpoint():
    config = LlamaConfig.from_json(SMOLLM2, "config.json")
    published = manifest("smollm2_135m_instruct")
    assert of_llama(config) == published
    assert sum(np.prod(shape) for shape in published.values()) == 134515008
    arrays = {name: np.broadcast_to(np.float32(0), shape) for name, shape in published.items()}
    joined = JoinedArrays(arrays, JOINED, source="x")
    assert wanted(lambda: Llama(config)) == {name: joined[name].shape for name in joined}
    untied = dataclasses.replace(config, tie_word_embeddings=False)
    assert wanted(lambda: Llama(untied)).keys() - set(joined) == {"lm_head.weight"}


def test_both_formats_say_the_same():
    found = LlamaConfig.from_gguf(GGUF, "a.gguf")
    expected = LlamaConfig.from_json(SMOLLM2, "config.json")
    assert dataclasses.replace(found, tie_word_embeddings=True) == expected
    assert (found.head_dim, found.num_key_value_heads) == (64, 3)


@pytest.mark.parametrize(
    "changes",
    [
        {"model_type": "gemma"},
        {"hidden_act": "gelu"},
        {"rope_scaling": {"rope_type": "llama3", "factor": 32.0}},
        {"rope_parameters": {"rope_type": "yarn"}},
        {"rope_parameters": 3},
        {"attention_bias": True},
        {"mlp_bias": True},
        {"quantization_config": {"bits": 4}},
        {"hidden_size": None},
        {"hidden_size": 577},
        {"num_hidden_layers": -1},
        {"num_hidden_layers": True},
        {"num_key_value_heads": 2},
        {"rms_norm_eps": "small"},
        {"tie_word_embeddings": 1},
        {"head_dim": 7},
    ],
)
def test_what_is_not_supported_is_named(changes):
    with pytest.raises(InputError) as error:
        LlamaConfig.from_json(SMOLLM2 | changes, "config.json")
    assert str(error.value).startswith("config.json: ") and "\n" not in str(error.value)
    assert next(iter(changes)) in str(error.value) or "num_attention_heads" in str(error.value)


@pytest.mark.parametrize(
    "changes",
    [
        {"general.architecture": "qwen2"},
        {"llama.rope.scaling.type": "linear"},
        {"llama.rope.dimension_count": 32},
        {"llama.expert_count": 8},
        {"llama.attention.head_count": [9, 9]},
        {"llama.block_count": 0},
    ],
)
def test_what_is_not_supported_is_named_of_gguf(changes):
    with pytest.raises(InputError, match=r"^a\.gguf: "):
        LlamaConfig.from_gguf(GGUF | changes, "a.gguf")


def test_a_checkpoint_of_another_size_is_refused():
    config = LlamaConfig.from_json(CASES["llama_tied"], "tied")
    arrays = weights(of_llama(config))
    with pytest.raises(InputError, match=r"x: array 'model\.norm\.bias' belongs to no part"):
        filled(config, arrays | {"model.norm.bias": np.zeros(48)})
    narrow = dataclasses.replace(config, num_key_value_heads=3)
    with pytest.raises(InputError, match=r"qkv_proj\.weight' has shape \(80, 48\) instead of"):
        filled(narrow, arrays)
