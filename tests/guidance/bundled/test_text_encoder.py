"""The bundled text encoder against the original MiniLM-L6-v2, and the checks on weight files."""

import json
import shutil

import numpy as np
import pytest
from safetensors.numpy import save_file

from jaxphys import weights
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.quantise import pack, unpack
from jaxphys.guidance.bundled.text_encoder import load_text_encoder, prompt_embeddings

# Made with the original float32 weights, rounded to 5 decimals.
GOLDEN = "text_encoder_golden.json"


@pytest.fixture(scope="module")
def golden(request):
    return json.loads((request.path.parent / GOLDEN).read_text())


@pytest.fixture(scope="module")
def embedded(golden):
    return load_text_encoder()(golden["texts"])


def test_agrees_with_the_original(golden, embedded):
    original = np.array(golden["embeddings"])
    cosine = (embedded * original).sum(1)
    assert cosine.min() > 0.98
    # A negative control: other sentences are far from that.
    assert np.abs((embedded * np.roll(original, 1, 0)).sum(1)).max() < 0.8


def test_is_of_unit_norm_and_single_precision(embedded):
    assert embedded.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(embedded, axis=1), 1, atol=1e-5)


def test_does_not_depend_on_batch_or_padding(golden, embedded):
    encoder = load_text_encoder()
    longest = " ".join(["a long sentence of many words"] * 4)
    together = encoder([longest, *golden["texts"]])[1:]
    np.testing.assert_allclose(together, embedded, atol=2e-5)
    np.testing.assert_array_equal(encoder(golden["texts"]), embedded)


def test_a_prompt_is_read_to_its_end():
    """Its object by all that stands before the first comma, then phrase by phrase, zeros behind."""
    found = prompt_embeddings("a teapot with a long spout, blue", 4)
    said = ["a teapot with a long spout", "a teapot", "a long spout", "blue"]
    np.testing.assert_allclose(found[:4], load_text_encoder()(said), atol=2e-5)
    np.testing.assert_array_equal(found[4], 0.0)
    assert found.shape == (5, 384)


def test_near_things_are_near():
    texts = ["a hamburger", "a cheeseburger", "an acoustic guitar"]
    burger, other_burger, guitar = load_text_encoder()(texts)
    assert burger @ other_burger > burger @ guitar + 0.2


def test_case_accents_and_odd_texts():
    encoder = load_text_encoder()
    plain, shouted = encoder(["a creme caramel", "A Crème CARAMEL"])
    np.testing.assert_allclose(plain, shouted, atol=1e-6)
    assert np.isfinite(encoder(["", "花", "strawberry " * 1000])).all()
    assert encoder([]).shape == (0, 384)
    with pytest.raises(InputError, match="list of strings"):
        encoder("a rose")


@pytest.mark.parametrize("width, group", [(4, 96), (6, 128), (8, 32)])
def test_packing_loses_at_most_half_a_step(width, group):
    matrix = np.random.default_rng(0).normal(size=(5, 384)).astype(np.float32)
    packed = pack(matrix, width, group)
    assert packed.bits.shape == (5, 384 * width // 8)
    step = np.repeat(packed.scales.astype(np.float64), group, axis=1)
    error = np.abs(unpack(packed, width, group) - matrix)
    # Half-precision scales add a little to half a step at the far end.
    assert (error <= 0.5 * step + 1e-3 * np.abs(matrix)).all()


@pytest.fixture
def folder(tmp_path):
    source = tmp_path / "made.safetensors"
    save_file({"a": np.arange(6, dtype=np.float32)}, source)
    target = tmp_path / "weights"
    target.mkdir()
    weights.register("toy", source, target, licence="none", data="none", command="none", steps=3)
    return target


def test_registered_weights_load(folder):
    arrays, entry = weights.load("toy", folder)
    np.testing.assert_array_equal(arrays["a"], np.arange(6))
    assert entry["steps"] == 3


def test_changed_byte_is_refused(folder):
    path = folder / "toy.safetensors"
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    with pytest.raises(InputError, match="SHA-256"):
        weights.load("toy", folder)


def test_truncated_file_is_refused(folder):
    path = folder / "toy.safetensors"
    path.write_bytes(path.read_bytes()[:-5])
    with pytest.raises(InputError, match="bytes"):
        weights.load("toy", folder)


def test_missing_and_unknown_are_refused(folder):
    with pytest.raises(InputError, match="did you mean 'toy'"):
        weights.load("toys", folder)
    (folder / "toy.safetensors").unlink()
    with pytest.raises(InputError, match="missing"):
        weights.load("toy", folder)
    shutil.rmtree(folder)
    with pytest.raises(InputError, match="manifest"):
        weights.load("toy", folder)


def test_incomplete_entry_is_refused(tmp_path):
    with pytest.raises(InputError, match="licence"):
        weights.register("toy", tmp_path / "x", tmp_path, data="none", command="none")


def test_bundled_files_are_those_of_the_manifest():
    entries = weights.manifest()
    assert "text_encoder" in entries
    assert sum(entry["bytes"] for entry in entries.values()) < 30e6
    for name in entries:
        weights.load(name)
