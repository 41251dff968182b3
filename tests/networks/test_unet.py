from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.parity.arrays import pseudo_random, weights
from jaxphys.core.errors import InputError
from jaxphys.networks.parameters import fill
from jaxphys.networks.timestep import waves
from jaxphys.networks.unet import RENAMES, UNet, UNetConfig
from tests.networks.published import (
    bytes_of_file,
    difference,
    golden,
    manifest,
    offered,
    wanted,
)

# unet/config.json of Stable Diffusion 1.5 and 2.1-base.
SD15 = {
    "_class_name": "UNet2DConditionModel", "_diffusers_version": "0.6.0", "act_fn": "silu",
    "attention_head_dim": 8, "block_out_channels": [320, 640, 1280, 1280],
    "center_input_sample": False, "cross_attention_dim": 768,
    "down_block_types": ["CrossAttnDownBlock2D"] * 3 + ["DownBlock2D"], "downsample_padding": 1,
    "flip_sin_to_cos": True, "freq_shift": 0, "in_channels": 4, "layers_per_block": 2,
    "mid_block_scale_factor": 1, "norm_eps": 1e-05, "norm_num_groups": 32, "out_channels": 4,
    "sample_size": 64, "up_block_types": ["UpBlock2D"] + ["CrossAttnUpBlock2D"] * 3,
}  # fmt: skip
SD21 = SD15 | {
    "_diffusers_version": "0.10.0.dev0", "attention_head_dim": [5, 10, 20, 20],
    "cross_attention_dim": 1024, "dual_cross_attention": False, "num_class_embeds": None,
    "only_cross_attention": False, "upcast_attention": True, "use_linear_projection": True,
}  # fmt: skip
TINY15 = UNetConfig(
    sample_size=8,
    block_out_channels=(8, 16),
    layers_per_block=2,
    down_block_types=("CrossAttnDownBlock2D", "DownBlock2D"),
    up_block_types=("UpBlock2D", "CrossAttnUpBlock2D"),
    cross_attention_dim=12,
    attention_head_dim=2,
    norm_num_groups=4,
)
TINY21 = replace(
    TINY15,
    block_out_channels=(8, 12, 16),
    layers_per_block=1,
    down_block_types=("CrossAttnDownBlock2D", "CrossAttnDownBlock2D", "DownBlock2D"),
    up_block_types=("UpBlock2D", "CrossAttnUpBlock2D", "CrossAttnUpBlock2D"),
    attention_head_dim=(1, 2, 4),
)
# Sizes that cannot be halved, too: the first odd, the second on the way down.
CASES = {"sd15_unet": (TINY15, 8, 6), "sd21_unet": (TINY21, 7, 10)}
RUN = nnx.jit(lambda network, *inputs: network(*inputs))


def run(name: str, dtype=jnp.float32, change=lambda arrays: None, **options):
    config, height, width = CASES[name]
    config = replace(config, **options)
    arrays = weights(manifest(f"{name}_tiny"))
    change(arrays)
    network = fill(lambda: UNet(config), arrays, source="test", renames=RENAMES, dtype=dtype)
    latents = jnp.asarray(pseudo_random("latents", (2, height, width, 4), 1.7), dtype)
    states = jnp.asarray(pseudo_random("states", (2, 5, 12)), dtype)
    return RUN(network, latents, jnp.array([0.5, 981.0], jnp.float32), states)


@pytest.mark.parametrize("name", CASES)
def test_equals_the_original(name):
    found = run(name)
    assert found.dtype == jnp.float32
    assert difference(found, golden(name)["output"]) < 1e-5


def test_equals_the_original_in_double_precision():
    # Not better than above: the original computes the waves, and writes, in single precision.
    found = run("sd15_unet", jnp.float64)
    assert found.dtype == jnp.float64
    assert difference(found, golden("sd15_unet")["output"]) < 1e-5


@pytest.mark.parametrize(
    "array",
    [
        "time_embedding.linear_1.weight",
        "down_blocks.0.attentions.1.transformer_blocks.0.attn2.to_v.weight",
        "mid_block.attentions.0.transformer_blocks.0.ff.net.0.proj.bias",
        "up_blocks.1.resnets.2.conv_shortcut.weight",
    ],
)
def test_a_hundredth_off_in_one_array_is_noticed(array):
    def change(arrays):
        arrays[array] = arrays[array] * 1.01

    assert difference(run("sd15_unet", change=change), golden("sd15_unet")["output"]) > 1e-5


def test_queries_in_slices_change_nothing():
    sliced = run("sd15_unet", attention_slice=7)
    assert difference(sliced, np.asarray(run("sd15_unet"))) < 1e-6


def test_half_precision_is_close():
    found = run("sd15_unet", jnp.bfloat16)
    assert found.dtype == jnp.bfloat16
    assert difference(found, golden("sd15_unet")["output"]) < 0.04


def test_waves():
    step = jnp.array([0, 7, 981])
    rates = 1e4 ** (-np.arange(4) / 4)
    phase = np.asarray(step)[:, None] * rates
    expected = np.concatenate([np.cos(phase), np.sin(phase)], -1)
    np.testing.assert_allclose(waves(step.astype(jnp.float64), 8), expected, atol=1e-4)
    np.testing.assert_allclose(waves(step, 8), expected, atol=1e-4)  # whole steps as well
    flipped = waves(step, 8, flip_sin_to_cos=False)
    np.testing.assert_allclose(flipped, np.roll(expected, 4, axis=1), atol=1e-4)
    # A shift of 1 stretches the waves until the slowest has 10,000 steps a radian.
    slowest = waves(jnp.array([5000.0]), 8, freq_shift=1)[0, 7]
    np.testing.assert_allclose(slowest, np.sin(0.5), atol=1e-5)


@pytest.mark.parametrize(("name", "config"), [("sd15_unet", SD15), ("sd21_unet", SD21)])
def test_published_files_map_one_to_one(name, config):
    config = UNetConfig.from_json(config, "test")
    assert offered(manifest(name), RENAMES) == wanted(lambda: UNet(config))


def test_a_file_of_another_network_does_not_map():
    other = UNetConfig.from_json(SD21, "test")
    assert offered(manifest("sd15_unet"), RENAMES) != wanted(lambda: UNet(other))
    assert offered(manifest("sd15_unet"), ()) != wanted(
        lambda: UNet(UNetConfig.from_json(SD15, "test"))
    )


@pytest.mark.parametrize(
    ("name", "dtype", "published"),
    [
        ("sd15_unet", "F32", 3_438_167_536),
        ("sd15_unet", "F16", 1_719_125_304),
        ("sd21_unet", "F32", 3_463_726_504),
        ("sd21_unet", "F16", 1_731_904_736),
    ],
)
def test_manifests_describe_the_published_files_to_the_byte(name, dtype, published):
    assert bytes_of_file(manifest(name), dtype) == published


def test_what_a_file_leaves_out_has_the_published_default():
    assert UNetConfig.from_json({}, "test") == UNetConfig()
    assert UNetConfig.from_json(SD15, "test") == UNetConfig(cross_attention_dim=768)
    assert UNetConfig.from_json(SD15, "test").heads == (8, 8, 8, 8)
    assert UNetConfig.from_json(SD21, "test").heads == (5, 10, 20, 20)
    assert UNetConfig.from_json(SD15 | {"attention_slice": 64}, "test").attention_slice == 64


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"act_fn": "gelu"}, "act_fn: 'gelu' is not supported, only 'silu' or 'swish'"),
        ({"only_cross_attention": [True]}, r"only_cross_attention: \[True\] is not supported"),
        ({"dual_cross_attention": True}, "dual_cross_attention: True is not supported"),
        ({"class_embed_type": "timestep"}, "class_embed_type: 'timestep' is not supported"),
        ({"addition_embed_type": "text_time"}, "addition_embed_type: 'text_time'"),
        ({"num_class_embeds": 1000}, "num_class_embeds: 1000 is not supported"),
        ({"conv_in_kernel": 1}, "conv_in_kernel: 1 is not supported, only 3"),
        ({"time_embedding_type": "fourier"}, "time_embedding_type: 'fourier'"),
        ({"mid_block_type": None}, "mid_block_type: None is not supported"),
        ({"transformer_layers_per_block": [1, 2, 10]}, "transformer_layers_per_block"),
        ({"a_later_option": 0.5}, "a_later_option: 0.5 is not supported"),
        ({"down_block_types": ["AttnDownBlock2D"] * 4}, "down_block_types: 'AttnDownBlock2D'"),
        ({"up_block_types": ["UpBlock2D"]}, "up_block_types: 1 blocks"),
        ({"block_out_channels": [320, 640, 1280, 1281]}, "block_out_channels: 1281 is no multiple"),
        ({"block_out_channels": 320}, "block_out_channels: expected a list"),
        ({"attention_head_dim": [8, 8]}, "attention_head_dim: 2 blocks"),
        ({"attention_head_dim": 7}, "attention_head_dim: 7 heads do not divide 320"),
        ({"layers_per_block": [2, 2, 2, 2]}, "layers_per_block: expected a whole number"),
        ({"cross_attention_dim": True}, "cross_attention_dim: expected a whole number"),
        ({"norm_eps": "small"}, "norm_eps: expected a number"),
        ({"attention_slice": 0}, "attention_slice: 0 must be at least 1"),
        ({"_class_name": "AutoencoderKL"}, "_class_name: expected 'UNet2DConditionModel'"),
    ],
)
def test_settings_that_cannot_be_used_are_named(change, message):
    with pytest.raises(InputError, match=f"^unet/config.json: {message}"):
        UNetConfig.from_json(SD15 | change, "unet/config.json")
