import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.parity.arrays import pseudo_random, weights
from jaxphys.core.errors import InputError
from jaxphys.networks.parameters import (
    fill,
    named_parameters,
    published_name,
    published_shape,
    with_parameters,
)
from jaxphys.networks.point_e import PointEBase, PointEConfig, PointEUpsampler, step_waves

HERE = Path(__file__).parent
CONFIG = PointEConfig(width=16, layers=2, heads=2, text=8, grid=(3, 6))
SCALES = np.array([2.0, 2.0, 2.0, 0.007843137255, 0.007843137255, 0.007843137255])
BIASES = np.array([0.0, 0.0, 0.0, -1.0, -1.0, -1.0])
TEXTS = pseudo_random("text", (3, 8))
TEXTS = TEXTS / np.linalg.norm(TEXTS, axis=1, keepdims=True)
TEXTS[2] = 0.0
LOW = (pseudo_random("low", (2, 5, 6)) - BIASES) / SCALES
RUN = nnx.jit(lambda network, *inputs: network(*inputs))


def shapes(build) -> dict[str, tuple]:
    """Arrays of a network as its checkpoint has them."""
    found = named_parameters(nnx.eval_shape(build))
    return {published_name(n): published_shape(n, leaf.shape) for n, leaf in found.items()}


def golden(name: str) -> dict[str, np.ndarray]:
    with np.load(HERE / "golden" / f"{name}.npz") as arrays:
        return dict(arrays)


def base(dtype=jnp.float32, config=CONFIG, **changes):
    arrays = weights(shapes(lambda: PointEBase(config))) | changes
    return fill(lambda: PointEBase(config), arrays, source="test", dtype=dtype)


def upsampler(dtype=jnp.float32, config=CONFIG):
    arrays = weights(shapes(lambda: PointEUpsampler(config)))
    arrays |= {"channel_scales": SCALES, "channel_biases": BIASES}
    return fill(lambda: PointEUpsampler(config), arrays, source="test", dtype=dtype)


def run_base(network, dtype=jnp.float32, texts=TEXTS):
    noisy = jnp.asarray(pseudo_random("noisy", (3, 10, 6)), dtype)
    return RUN(network, noisy, jnp.array([0, 500, 1023]), jnp.asarray(texts, dtype))


def run_upsampler(network, grid=None, dtype=jnp.float32):
    noisy = jnp.asarray(pseudo_random("noisy", (2, 7, 6)), dtype)
    return RUN(network, noisy, jnp.array([3, 900]), jnp.asarray(LOW, dtype), grid)


def error(found, expected) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_base_is_the_reference(dtype):
    found = run_base(base(dtype), dtype)
    assert found.dtype == dtype and found.shape == (3, 10, 12)
    assert error(found, golden("point_e_base")["prediction"]) < 1e-5


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_upsampler_is_the_reference_with_a_picture_and_without(dtype):
    expected, network = golden("point_e_upsampler"), upsampler(dtype)
    grid = jnp.asarray(pseudo_random("grid", (2, 3, 6)), dtype)
    assert error(run_upsampler(network, grid, dtype), expected["told"]) < 1e-5
    assert error(run_upsampler(network, None, dtype), expected["untold"]) < 1e-5
    assert error(expected["told"], expected["untold"]) > 1e-2


def test_wrong_layouts_are_noticed():
    """Heads' queries, keys and values are side by side, not all queries first; and no text is a
    zero embedding before its layer, whose bias stays."""
    expected = golden("point_e_base")["prediction"]
    kernel = weights(shapes(lambda: PointEBase(CONFIG)))["backbone.resblocks.0.attn.c_qkv.weight"]
    apart = kernel.reshape(2, 3, 8, 16).transpose(1, 0, 2, 3).reshape(48, 16)
    assert (
        error(run_base(base(**{"backbone.resblocks.0.attn.c_qkv.weight": apart})), expected) > 0.01
    )
    found = run_base(base(**{"clip_embed.bias": np.zeros(16, np.float32)}))
    assert error(found[2], expected[2]) > 0.01
    assert error(run_base(base(), texts=TEXTS / 8**0.5), expected) > 0.01


def test_points_have_no_order():
    network, order = base(jnp.float64), np.random.default_rng(0).permutation(10)
    noisy = jnp.asarray(pseudo_random("noisy", (3, 10, 6)), jnp.float64)
    step, text = jnp.array([0.0, 500.0, 1023.0]), jnp.asarray(TEXTS, jnp.float64)
    found = RUN(network, noisy, step, text)
    turned = RUN(network, noisy[:, order], step, text)
    np.testing.assert_allclose(turned, found[:, order], atol=1e-12)
    assert np.abs(turned - found).max() > 0.1


def test_attention_in_slices_is_the_same():
    sliced = PointEConfig(width=16, layers=2, heads=2, text=8, grid=(3, 6), slice_size=5)
    found = run_upsampler(upsampler(config=sliced))
    assert error(found, golden("point_e_upsampler")["untold"]) < 1e-5


def test_half_precision_computes_in_it_and_stays_near():
    found = run_base(base(jnp.bfloat16), jnp.bfloat16)
    assert found.dtype == jnp.bfloat16
    assert error(found.astype(jnp.float32), golden("point_e_base")["prediction"]) < 0.1


@pytest.mark.parametrize(
    ("name", "build", "parameters"),
    [("base", PointEBase, 40_333_836), ("upsampler", PointEUpsampler, 40_470_552)],
)
def test_published_networks_have_these_arrays(name, build, parameters):
    expected = json.loads((HERE / "manifests" / f"point_e_{name}.json").read_text())
    assert shapes(build) == {key: tuple(shape) for key, shape in expected.items()}
    assert sum(np.prod(shape) for shape in expected.values()) == parameters


def test_checkpoint_of_another_network_is_refused():
    arrays = weights(shapes(lambda: PointEBase(CONFIG)))
    with pytest.raises(InputError, match=r"clip\.pt: .*clip_embed"):
        fill(lambda: PointEUpsampler(CONFIG), arrays, source="clip.pt")


def test_step_waves_are_cosines_then_sines_of_the_step():
    found = step_waves(jnp.array([0, 7], jnp.int32), 8)
    rates = 10_000.0 ** (-np.arange(4) / 4)
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found[0], [1, 1, 1, 1, 0, 0, 0, 0], atol=1e-7)
    np.testing.assert_allclose(found[1, :4], np.cos(7 * rates), atol=1e-6)
    np.testing.assert_allclose(found[1, 4:], np.sin(7 * rates), atol=1e-6)


def test_networks_are_pytrees_of_their_arrays():
    network = base()
    doubled = with_parameters(network, jax.tree.map(lambda x: 2 * x, named_parameters(network)))
    assert error(run_base(doubled), run_base(network)) > 0.1


@pytest.mark.parametrize("name", ["base", "upsampler"])
def test_sizes_are_read_off_the_published_arrays(name):
    expected = json.loads((HERE / "manifests" / f"point_e_{name}.json").read_text())
    arrays = {key: np.broadcast_to(np.float32(0), shape) for key, shape in expected.items()}
    assert PointEConfig.of_arrays(arrays, "file") == PointEConfig()
    with pytest.raises(InputError, match=r"^file: is no checkpoint of Point-E's"):
        PointEConfig.of_arrays({"weight": np.zeros((2, 2))}, "file")
