"""CLIP's towers, its pictures and its files against transformers' own (`experiments/parity`)."""

import json
import math
import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx
from jax import Array

from experiments.parity import clip_cases as cases
from experiments.parity.arrays import weights
from jaxphys.core.errors import InputError
from jaxphys.networks import clip_text, clip_vision
from jaxphys.networks.clip_block import unit_norm
from jaxphys.networks.clip_config import TextConfig, VisionConfig
from jaxphys.networks.clip_pictures import as_pixels, middle_square
from jaxphys.networks.clip_text import ClipText, TextTower, load_clip_text, load_text_tower
from jaxphys.networks.clip_vision import ClipVision, load_clip_vision
from jaxphys.networks.parameters import named_parameters, published_name, published_shape

FOLDER = Path(__file__).parent
STYLES = {"end": cases.END_PADDED, "zero": cases.ZERO_PADDED}
SD15 = {  # of its text_encoder/config.json
    "architectures": ["CLIPTextModel"], "bos_token_id": 0, "eos_token_id": 2, "pad_token_id": 1,
    "hidden_act": "quick_gelu", "hidden_size": 768, "intermediate_size": 3072,
    "layer_norm_eps": 1e-05, "max_position_embeddings": 77, "model_type": "clip_text_model",
    "num_attention_heads": 12, "num_hidden_layers": 12, "projection_dim": 768, "vocab_size": 49408,
}  # fmt: skip
SD21 = SD15 | {
    "hidden_act": "gelu", "hidden_size": 1024, "intermediate_size": 4096,
    "num_attention_heads": 16, "num_hidden_layers": 23, "projection_dim": 512,
}  # fmt: skip
LARGE = {
    "model_type": "clip",
    "projection_dim": 768,
    "text_config": {"eos_token_id": 2, "projection_dim": 512},
    "text_config_dict": {
        "hidden_size": 768, "intermediate_size": 3072, "num_attention_heads": 12,
        "num_hidden_layers": 12,
    },
    "vision_config": {
        "hidden_size": 1024, "intermediate_size": 4096, "num_attention_heads": 16,
        "num_hidden_layers": 24, "image_size": 224, "patch_size": 14,
    },
}  # fmt: skip


def golden(name: str) -> dict[str, np.ndarray]:
    with np.load(FOLDER / "golden" / f"{name}.npz") as arrays:
        return dict(arrays)


def manifest(name: str) -> dict[str, list[int]]:
    return json.loads((FOLDER / "manifests" / f"{name}.json").read_text())


def shapes(module: nnx.Module, prefix: str = "") -> dict[str, tuple[int, ...]]:
    """Names and shapes that the file of a module has."""
    return {
        prefix + published_name(name): published_shape(name, leaf.shape)
        for name, leaf in named_parameters(module).items()
    }


def tower_arrays(config: dict) -> dict[str, np.ndarray]:
    tower = nnx.eval_shape(lambda: TextTower(TextConfig.from_json(config, "test")))
    return weights(shapes(tower, "text_model."))


def whole_arrays() -> dict[str, np.ndarray]:
    text = nnx.eval_shape(lambda: ClipText(TextConfig.from_json(cases.WHOLE, "test")))
    vision = nnx.eval_shape(lambda: ClipVision(VisionConfig.from_json(cases.WHOLE, "test")))
    return weights(shapes(text) | shapes(vision) | {"logit_scale": ()}) | {
        "text_model.embeddings.position_ids": np.arange(11)[None],
        "vision_model.embeddings.position_ids": np.arange(10)[None],
    }


@nnx.jit
def run(module: nnx.Module, inputs: Array):
    return module(inputs)


def assert_close(found: Array, expected: np.ndarray, tolerance: float = 1e-5) -> None:
    assert found.shape == expected.shape
    assert np.max(np.abs(found - expected)) <= tolerance * np.max(np.abs(expected))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("style", STYLES)
def test_text_tower_is_the_original(style, dtype):
    config = STYLES[style]
    arrays = tower_arrays(config)
    tower = load_text_tower(arrays, TextConfig.from_json(config, "test"), "test", dtype)
    output = run(tower, jnp.asarray(cases.IDS[style]))
    assert output.hidden.dtype == dtype
    expected = golden(f"clip_text_{style}")
    assert_close(output.hidden, expected["hidden"])
    assert_close(output.pooled, expected["pooled"])


@pytest.mark.parametrize(
    "change",
    [
        {"hidden_act": "quick_gelu"},  # instead of the exact one
        {"eos_token_id": 2},  # the largest id instead of the one that ends a text
        {"eos_token_id": 41},
        {"num_attention_heads": 4},
        {"layer_norm_eps": 1e-3},
    ],
)
def test_a_wrong_setting_is_noticed(change):
    config = cases.ZERO_PADDED
    arrays = tower_arrays(config)
    wrong = TextConfig.from_json(config | change, "test")
    pooled = run(load_text_tower(arrays, wrong, "test"), jnp.asarray(cases.IDS["zero"])).pooled
    with pytest.raises(AssertionError):
        assert_close(pooled, golden("clip_text_zero")["pooled"])


def test_text_reads_only_what_comes_before():
    config = TextConfig.from_json(cases.END_PADDED, "test")
    tower = load_text_tower(tower_arrays(cases.END_PADDED), config, "test")
    ids = jnp.asarray(cases.IDS["end"])
    changed = run(tower, ids.at[:, 6:].set(7)).hidden
    hidden = run(tower, ids).hidden
    np.testing.assert_allclose(changed[:, :6], hidden[:, :6], atol=1e-6)
    assert np.abs(changed[:, 6:] - hidden[:, 6:]).max() > 0.1


def test_embeddings_are_the_original():
    arrays, expected = whole_arrays(), golden("clip_embeddings")
    text = load_clip_text(arrays, TextConfig.from_json(cases.WHOLE, "test"), "test")
    vision = load_clip_vision(arrays, VisionConfig.from_json(cases.WHOLE, "test"), "test")
    assert_close(run(text, jnp.asarray(cases.IDS["end"])), expected["text"])
    images = run(vision, jnp.asarray(cases.PIXELS))
    assert_close(images, expected["image"])
    np.testing.assert_allclose(jnp.linalg.norm(unit_norm(images), axis=1), 1, atol=1e-6)
    # A negative control: rows for columns.
    with pytest.raises(AssertionError):
        assert_close(run(vision, jnp.asarray(cases.PIXELS.swapaxes(1, 2))), expected["image"])


def test_files_load_with_and_without_the_prefix_and_from_a_whole_clip():
    config = TextConfig.from_json(cases.WHOLE, "test")
    arrays = whole_arrays()
    bare = {
        name.removeprefix("text_model."): array
        for name, array in arrays.items()
        if name.startswith("text_model.")
    }
    ids = jnp.asarray(cases.IDS["end"])
    whole, alone = (load_text_tower(files, config, "test") for files in (arrays, bare))
    np.testing.assert_array_equal(run(whole, ids).hidden, run(alone, ids).hidden)


def test_a_missing_array_is_named():
    arrays = tower_arrays(cases.END_PADDED)
    del arrays["text_model.encoder.layers.1.mlp.fc2.bias"]
    config = TextConfig.from_json(cases.END_PADDED, "test")
    with pytest.raises(InputError, match=r"there/x: .*encoder\.layers\.1\.mlp\.fc2\.bias"):
        load_text_tower(arrays, config, "there/x")


@pytest.mark.parametrize(
    "name, values, build, renames, ignores",
    [
        ("sd15_text_encoder", SD15, (TextConfig, TextTower), clip_text.TOWER_RENAMES,
         clip_text.TOWER_IGNORES),
        ("sd21_text_encoder", SD21, (TextConfig, TextTower), clip_text.TOWER_RENAMES,
         clip_text.TOWER_IGNORES),
        ("clip_vit_large_patch14", LARGE, (TextConfig, TextTower), clip_text.TOWER_RENAMES,
         clip_text.TOWER_IGNORES),
        ("clip_vit_large_patch14", LARGE, (TextConfig, ClipText), (), clip_text.TEXT_IGNORES),
        ("clip_vit_large_patch14", LARGE, (VisionConfig, ClipVision), (),
         clip_vision.VISION_IGNORES),
    ],
)  # fmt: skip
def test_published_files_hold_every_parameter_once(name, values, build, renames, ignores):
    config, module = build[0].from_json(values, "test"), build[1]
    found = {}
    for key, shape in manifest(name).items():
        for pattern, replacement in renames:
            key = re.sub(pattern, replacement, key)
        if not any(re.fullmatch(pattern, key) for pattern in ignores):
            assert key not in found
            found[key] = tuple(shape)
    assert found == shapes(nnx.eval_shape(lambda: module(config)))


@pytest.mark.parametrize(
    "name, kind, published",
    [
        ("clip_vit_large_patch14", "F32", 1_710_540_580),
        ("sd15_text_encoder", "F16", 246_144_864),
        ("sd21_text_encoder", "F16", 680_821_096),
    ],
)
def test_manifests_describe_the_published_files_to_the_byte(name, kind, published):
    # A safetensors file is its header, which spells every name, and then the numbers.
    arrays = [
        (shape, key, ("I64", 8) if key.endswith("position_ids") else (kind, int(kind[1:]) // 8))
        for key, shape in manifest(name).items()
    ]
    header, end = {"__metadata__": {"format": "pt"}}, 0
    for shape, key, (dtype, width) in sorted(arrays, key=lambda entry: (-entry[2][1], entry[1])):
        start, end = end, end + math.prod(shape) * width
        header[key] = {"dtype": dtype, "shape": shape, "data_offsets": [start, end]}
    length = len(json.dumps(header, separators=(",", ":")))
    assert 8 + -(-length // 8) * 8 + end == published


@pytest.mark.parametrize(
    "cls, change, message",
    [
        (TextConfig, {"hidden_act": "gelu_new"}, "hidden_act: 'gelu_new' is not supported; .*gelu"),
        (TextConfig, {"hidden_act": 3}, "hidden_act: expected a text"),
        (TextConfig, {"num_attention_heads": 5}, "num_attention_heads: 5 does not divide"),
        (TextConfig, {"vocab_size": "many"}, "vocab_size: expected a whole number"),
        (TextConfig, {"num_hidden_layers": True}, "num_hidden_layers: expected a whole number"),
        (TextConfig, {"layer_norm_eps": 0}, "layer_norm_eps: 0 must be above 0"),
        (TextConfig, {"model_type": "llama"}, "model_type: expected 'clip' or .* found 'llama'"),
        (TextConfig, {"text_config": 3}, "text_config: expected an object"),
        (VisionConfig, {}, "model_type: expected 'clip' or 'clip_vision_model'"),
    ],
)
def test_settings_that_cannot_be_used_are_named(cls, change, message):
    with pytest.raises(InputError, match=f"there/config.json: {message}"):
        cls.from_json(SD15 | change, "there/config.json")


def test_settings_of_a_whole_clip():
    text = TextConfig.from_json(LARGE, "test")
    assert (text.hidden_size, text.num_hidden_layers, text.projection_dim) == (768, 12, 768)
    assert VisionConfig.from_json(LARGE, "test").patch_size == 14
    assert TextConfig.from_json(SD21, "test").num_hidden_layers == 23


def test_wrong_sizes_are_refused():
    config = TextConfig.from_json(cases.END_PADDED, "test")
    tower = load_text_tower(tower_arrays(cases.END_PADDED), config, "test")
    with pytest.raises(InputError, match="11 tokens at most, got 12"):
        tower(jnp.zeros((1, 12), int))
    vision = ClipVision(VisionConfig.from_json(cases.WHOLE, "test"))
    with pytest.raises(InputError, match=r"\(12, 12, 3\), got \(16, 12, 3\)"):
        vision(jnp.zeros((1, 16, 12, 3)))


@pytest.mark.parametrize("name", cases.PICTURES)
def test_pictures_are_prepared_as_the_original_does(name):
    expected = golden("clip_pictures")[name]
    found = as_pixels(middle_square(cases.PICTURES[name], cases.SIZE))
    assert found.dtype == np.float32
    assert_close(found, expected)
    # A negative control: another part of the picture, or the colours the wrong way round.
    with pytest.raises(AssertionError):
        assert_close(found[..., ::-1], expected)
