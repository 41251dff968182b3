from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx
from jax import Array

from experiments.parity.arrays import pseudo_random, weights
from jaxphys.core.errors import InputError
from jaxphys.networks.autoencoder import (
    DECODER_IGNORES,
    ENCODER_IGNORES,
    RENAMES,
    AutoencoderConfig,
    Decoder,
    Encoder,
)
from jaxphys.networks.parameters import fill
from tests.networks.published import (
    bytes_of_file,
    difference,
    golden,
    manifest,
    offered,
    wanted,
)

# vae/config.json of Stable Diffusion 1.5 and 2.1-base.
SD = {
    "_class_name": "AutoencoderKL", "_diffusers_version": "0.6.0", "act_fn": "silu",
    "block_out_channels": [128, 256, 512, 512], "down_block_types": ["DownEncoderBlock2D"] * 4,
    "in_channels": 3, "latent_channels": 4, "layers_per_block": 2, "norm_num_groups": 32,
    "out_channels": 3, "sample_size": 512, "up_block_types": ["UpDecoderBlock2D"] * 4,
}  # fmt: skip
TINY = AutoencoderConfig(
    block_out_channels=(8, 16),
    down_block_types=("DownEncoderBlock2D",) * 2,
    up_block_types=("UpDecoderBlock2D",) * 2,
    layers_per_block=1,
    norm_num_groups=4,
)
OLD_NAMES = {"to_q": "query", "to_k": "key", "to_v": "value", "to_out.0": "proj_attn"}
PARTS = {"encoder": (Encoder, ENCODER_IGNORES), "decoder": (Decoder, DECODER_IGNORES)}


def old_names(arrays: dict) -> dict:
    for new, old in OLD_NAMES.items():
        arrays = {key.replace(f".0.{new}.", f".0.{old}."): value for key, value in arrays.items()}
    return arrays


def filled(part: str, dtype=jnp.float32, arrays=None, config=TINY):
    kind, ignores = PARTS[part]
    arrays = weights(manifest("sd_vae_tiny")) if arrays is None else arrays
    options = {"source": "test", "renames": RENAMES, "ignore": ignores, "dtype": dtype}
    return fill(lambda: kind(config), arrays, **options)


@nnx.jit
def encode(encoder, images, cotangents):
    """What it says, and the gradient of its product with the cotangents."""
    said, pull = jax.vjp(encoder, images)
    return *said, pull(cotangents)[0]


@nnx.jit
def decode(decoder, latents):
    return decoder(latents)


def run_encoder(encoder, dtype=jnp.float32) -> dict[str, Array]:
    images = jnp.asarray(pseudo_random("images", (2, 10, 16, 3)), dtype)
    cotangents = tuple(
        jnp.asarray(pseudo_random(name, (2, 5, 8, 4)), dtype)
        for name in ("to mean", "to log-variance")
    )
    names = ("mean", "log_variance", "gradient")
    return dict(zip(names, encode(encoder, images, cotangents), strict=True))


def run_decoder(decoder, dtype=jnp.float32) -> Array:
    return decode(decoder, jnp.asarray(pseudo_random("latents", (2, 5, 8, 4), 1.7), dtype))


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_encoder_and_its_gradient_equal_the_original(dtype):
    found = run_encoder(filled("encoder", dtype), dtype)
    for name, expected in golden("sd_encoder").items():
        assert found[name].dtype == dtype
        assert difference(found[name], expected) < 1e-5, name


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_decoder_equals_the_original(dtype):
    found = run_decoder(filled("decoder", dtype), dtype)
    assert found.dtype == dtype
    assert difference(found, golden("sd_decoder")["output"]) < 1e-5


@pytest.mark.parametrize(
    "array",
    ["encoder.mid_block.attentions.0.to_k.weight", "quant_conv.weight", "encoder.conv_in.bias"],
)
def test_a_hundredth_off_in_one_array_is_noticed(array):
    arrays = weights(manifest("sd_vae_tiny"))
    arrays[array] = arrays[array] * 1.01
    found = run_encoder(filled("encoder", arrays=arrays))
    expected = golden("sd_encoder")
    assert max(difference(found[name], expected[name]) for name in expected) > 1e-5


def test_old_names_of_the_attention_load_as_well():
    arrays = weights(manifest("sd_vae_tiny"))
    named = old_names(arrays)
    assert len(set(named) - set(arrays)) == 16
    for part in PARTS:
        new, old = (nnx.state(filled(part, arrays=found)) for found in (arrays, named))
        jax.tree.map(np.testing.assert_array_equal, new, old)


@pytest.mark.parametrize(("part", "other"), [("encoder", "decoder"), ("decoder", "encoder")])
def test_a_half_leaves_the_other_half_in_the_file(part, other):
    class Lazy(dict):
        def __getitem__(self, key):
            assert other not in key
            return super().__getitem__(key)

    filled(part, arrays=Lazy(weights(manifest("sd_vae_tiny"))))


def test_an_array_of_neither_half_is_an_error():
    arrays = weights(manifest("sd_vae_tiny")) | {"loss.weight": np.zeros(3, np.float32)}
    for part in PARTS:
        with pytest.raises(InputError, match=r"loss\.weight"):
            filled(part, arrays=arrays)


def test_queries_in_slices_change_nothing():
    config = replace(TINY, attention_slice=7)
    whole, sliced = run_encoder(filled("encoder")), run_encoder(filled("encoder", config=config))
    for name in whole:
        assert difference(sliced[name], np.asarray(whole[name])) < 1e-6


def test_log_variance_is_clipped():
    arrays = weights(manifest("sd_vae_tiny"))
    arrays["quant_conv.bias"] = np.repeat(np.float32([0, 50, -50]), [4, 2, 2])
    found = run_encoder(filled("encoder", arrays=arrays))["log_variance"]
    np.testing.assert_array_equal(found[..., :2], 20)
    np.testing.assert_array_equal(found[..., 2:], -30)


def test_half_precision_is_close():
    found = run_encoder(filled("encoder", jnp.bfloat16), jnp.bfloat16)
    for name, expected in golden("sd_encoder").items():
        assert found[name].dtype == jnp.bfloat16
        assert difference(found[name], expected) < 0.04, name


@pytest.mark.parametrize("name", ["sd_vae", "sd_vae_old_names"])
def test_published_files_map_one_to_one(name):
    config = AutoencoderConfig.from_json(SD, "test")
    for kind, ignores in PARTS.values():
        want = wanted(lambda kind=kind: kind(config))
        assert offered(manifest(name), RENAMES, ignores) == want
        assert offered(manifest(name), (), ignores) != want


@pytest.mark.parametrize(
    ("name", "dtype", "published"),
    [
        # The file of Stable Diffusion 1.5 and that of 2.1-base: its size tells the old names.
        ("sd_vae_old_names", "F32", 334_643_276),
        ("sd_vae", "F32", 334_643_268),  # of SDXL
        ("sd_vae", "F16", 167_335_342),  # of 1.5: its half-precision file has the new names
    ],
)
def test_manifests_describe_the_published_files_to_the_byte(name, dtype, published):
    assert bytes_of_file(manifest(name), dtype) == published


def test_what_a_file_leaves_out_has_the_published_default():
    assert AutoencoderConfig.from_json({}, "test") == AutoencoderConfig()
    config = AutoencoderConfig.from_json(SD | {"force_upcast": True}, "test")
    assert config.scaling_factor == 0.18215 and config.block_out_channels[-1] == 512
    assert AutoencoderConfig.from_json({"scaling_factor": 0.5}, "test").scaling_factor == 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"act_fn": "relu"}, "act_fn: 'relu' is not supported"),
        ({"use_quant_conv": False}, "use_quant_conv: False is not supported, only True"),
        ({"shift_factor": 0.1}, "shift_factor: 0.1 is not supported"),
        ({"latents_mean": [0.0]}, "latents_mean"),
        ({"mid_block_add_attention": False}, "mid_block_add_attention: False"),
        ({"down_block_types": ["AttnDownEncoderBlock2D"] * 4}, "down_block_types: 'AttnDown"),
        ({"norm_num_groups": 48}, "block_out_channels: 128 is no multiple of norm_num_groups 48"),
        ({"_class_name": "VQModel"}, "_class_name: expected 'AutoencoderKL', found 'VQModel'"),
    ],
)
def test_settings_that_cannot_be_used_are_named(change, message):
    with pytest.raises(InputError, match=f"^vae/config.json: {message}"):
        AutoencoderConfig.from_json(SD | change, "vae/config.json")
