"""GGUF files, read back from what the `gguf` package writes."""

import builtins
import struct
from pathlib import Path

import gguf
import numpy as np
import pytest

from experiments.parity.arrays import weights
from jaxphys.core.errors import InputError
from jaxphys.networks.llama_config import LlamaConfig
from jaxphys.weights.gguf_file import read_gguf
from jaxphys.weights.gguf_tokenizer import tokenizer_from_gguf
from tests.networks.published import of_llama
from tests.weights.gguf_files import CONFIG, TOKENS, write_gguf

ARRAYS = weights(of_llama(LlamaConfig.from_json(CONFIG, "tiny")))
QUERIES, KEYS = (f"model.layers.1.self_attn.{part}_proj.weight" for part in "qk")


def rounded(array: np.ndarray, kind: str) -> np.ndarray:
    """What is left of an array after quantisation, from the definition of the two types: blocks of
    32 numbers of a row, d q in 8 bits, or d q + m in 4 (with d, m and the largest q of a block
    chosen as llama.cpp does)."""
    blocks = array.astype(np.float32).reshape(-1, 32)
    if kind == "Q8_0":
        d = np.abs(blocks).max(1, keepdims=True) / np.float32(127)
        q = np.sign(blocks) * np.floor(np.abs(blocks) / d + 0.5)
        return (d.astype(np.float16).astype(np.float32) * q).reshape(array.shape)
    low, high = blocks.min(1, keepdims=True), blocks.max(1, keepdims=True)
    d = (high - low) / np.float32(15)
    q = np.clip(np.trunc((blocks - low) / d + np.float32(0.5)), 0, 15)
    d, low = (v.astype(np.float16).astype(np.float32) for v in (d, low))
    return (d * q + low).reshape(array.shape)


def test_arrays_come_back_under_their_original_names(tmp_path):
    found = read_gguf(write_gguf(tmp_path / "a.gguf", ARRAYS)).arrays
    assert set(found) == set(ARRAYS) and len(found) == len(ARRAYS)
    for name, array in ARRAYS.items():
        assert found[name].dtype == np.float32
        np.testing.assert_array_equal(found[name], array)


def test_an_untied_output_layer_has_its_name(tmp_path):
    arrays = ARRAYS | {"lm_head.weight": ARRAYS["model.embed_tokens.weight"][::-1].copy()}
    found = read_gguf(write_gguf(tmp_path / "a.gguf", arrays)).arrays
    np.testing.assert_array_equal(found["lm_head.weight"], arrays["lm_head.weight"])


def test_quantised_blocks_and_the_order_of_rows(tmp_path):
    found = read_gguf(write_gguf(tmp_path / "a.gguf", ARRAYS, quantised="Q4_1")).arrays
    table = "model.embed_tokens.weight"
    np.testing.assert_allclose(found[table], rounded(ARRAYS[table], "Q8_0"), rtol=1e-6)
    for name in (QUERIES, KEYS, "model.layers.0.mlp.down_proj.weight"):
        expected = rounded(ARRAYS[name], "Q4_1")
        # A number on the edge of two steps may fall on either side of it.
        step = np.ptp(ARRAYS[name]) / 15
        assert np.abs(found[name] - expected).max() <= step
        assert np.mean(found[name] == expected) > 0.999
        assert 0 < np.abs(expected - ARRAYS[name]).max() < step
    # The rows of a file are in another order; unread as such they would be far off.
    unordered = ARRAYS[QUERIES].reshape(4, 2, 8, 64).swapaxes(1, 2).reshape(64, 64)
    assert np.abs(found[QUERIES] - unordered).max() > 10 * np.ptp(ARRAYS[QUERIES]) / 15 / 2


@pytest.mark.parametrize("kind", ["F16", "BF16", "Q4_0", "Q5_1", "Q8_0"])
def test_other_types(tmp_path, kind):
    found = read_gguf(write_gguf(tmp_path / "a.gguf", ARRAYS, quantised=kind)).arrays
    error = np.abs(found[KEYS] - ARRAYS[KEYS]).max() / np.abs(ARRAYS[KEYS]).max()
    assert 0 < error < 0.15


def test_metadata_is_that_of_the_package(tmp_path):
    path = write_gguf(tmp_path / "a.gguf", ARRAYS)
    found = read_gguf(path).metadata
    reader = gguf.GGUFReader(path)
    theirs = {k: f.contents() for k, f in reader.fields.items() if not k.startswith("GGUF.")}
    assert found == theirs
    assert found["tokenizer.ggml.tokens"] == TOKENS
    config = LlamaConfig.from_gguf(found, "a.gguf")
    assert (config.num_key_value_heads, config.rope_theta) == (2, 1e5)


@pytest.fixture
def tokenizer(tmp_path):
    file = read_gguf(write_gguf(tmp_path / "a.gguf", ARRAYS))
    return tokenizer_from_gguf(file.metadata, "a.gguf")


def test_merges_digits_and_marks(tokenizer):
    assert tokenizer.encode("a red inn").tokens == ["a", "Ġred", "Ġ", "in", "n"]
    # Every digit is by itself, so that the merge of 1 and 2 is never used.
    assert tokenizer.encode("12 3").tokens == ["1", "2", "Ġ", "3"]
    assert tokenizer.encode("<|im_start|>red<|im_end|>").ids[0] == 1
    assert tokenizer.encode("<|im_start|>red<|im_end|>").tokens[1:] == ["red", "<|im_end|>"]
    text = "crème brûlée, 日本  \n\tdon't"
    assert tokenizer.decode(tokenizer.encode(text).ids) == text


def test_the_gpt2_cut_keeps_digits_together(tmp_path):
    path = write_gguf(tmp_path / "a.gguf", ARRAYS, tokenizer__ggml__pre="gpt-2")
    tokenizer = tokenizer_from_gguf(read_gguf(path).metadata, "a.gguf")
    assert tokenizer.encode("12").tokens == ["12"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"tokenizer__ggml__model": "llama"}, "tokenizer.ggml.model: 'llama'"),
        ({"tokenizer__ggml__pre": "smolm"}, "did you mean 'smollm'"),
        ({"tokenizer__ggml__tokens": [*TOKENS[:-1], "a"]}, "tokens: a token is there twice"),
        ({"tokenizer__ggml__merges": ["a b"]}, "merges: 'a b'"),
        ({"tokenizer__ggml__merges": ["abc"]}, "merges: 'abc'"),
        ({"tokenizer__ggml__token_type": [1]}, "token_type"),
    ],
)
def test_other_tokenizers_are_refused(tmp_path, changes, said):
    metadata = read_gguf(write_gguf(tmp_path / "a.gguf", ARRAYS, **changes)).metadata
    with pytest.raises(InputError, match=r"^a\.gguf: tokenizer\.ggml\.") as error:
        tokenizer_from_gguf(metadata, "a.gguf")
    assert said in str(error.value) and "\n" not in str(error.value)


def refused(path: Path) -> str:
    with pytest.raises(InputError) as error:
        file = read_gguf(path)
        for name in file.arrays:
            file.arrays[name]
    said = str(error.value)
    assert said.startswith(f"{path}: ") and "\n" not in said
    return said


def test_a_file_that_ends_early_is_refused_wherever_it_does(tmp_path):
    content = write_gguf(tmp_path / "a.gguf", ARRAYS).read_bytes()
    path = tmp_path / "b.gguf"
    ends = [*range(0, 400), *range(400, len(content), 4001), len(content) - 1]
    for end in ends:
        path.write_bytes(content[:end])
        refused(path)


def test_wrong_bytes_never_bring_more_than_one_line(tmp_path):
    """Any byte of the header may be wrong: the file is refused, or read as something else."""
    content = bytearray(write_gguf(tmp_path / "a.gguf", ARRAYS).read_bytes())
    path, random = tmp_path / "b.gguf", np.random.default_rng(0)
    outcomes = set()
    for offset in [*range(4, 100), *random.integers(100, 12000, 300)]:
        damaged = content.copy()
        damaged[offset] ^= 0xFF
        path.write_bytes(damaged)
        try:
            file = read_gguf(path)
            for name in file.arrays:
                file.arrays[name]
            outcomes.add("read")
        except InputError as error:
            assert str(path) in str(error) and "\n" not in str(error)
            outcomes.add("refused")
    assert outcomes == {"read", "refused"}


def test_lengths_that_no_file_has_are_refused_at_once(tmp_path):
    path = tmp_path / "a.gguf"
    counts = struct.pack("<QQ", 0, 1)
    key = struct.pack("<Q", 1) + b"k"
    for kind in (0, 4, 8, 10):  # a list of 2^60 numbers or strings
        entry = key + struct.pack("<IIQ", 9, kind, 2**60)
        path.write_bytes(b"GGUF" + struct.pack("<I", 3) + counts + entry + bytes(64))
        assert "ends early" in refused(path)
    path.write_bytes(b"GGUF" + struct.pack("<IQQ", 3, 2**60, 2**60) + bytes(64))
    refused(path)
    path.write_bytes(b"GGUF" + struct.pack("<I", 3) + counts + struct.pack("<Q", 2**63))
    assert "ends early" in refused(path)


def test_files_of_another_kind(tmp_path):
    path = tmp_path / "a.gguf"
    assert "no such file" in refused(path)
    path.write_bytes(b"")
    assert "is empty" in refused(path)
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    assert "does not begin with 'GGUF'" in refused(path)
    path.write_bytes(b"GGUF" + struct.pack(">IQQ", 3, 0, 0))  # of the other byte order
    assert "version 50331648" in refused(path)
    path.write_bytes(b"GGUF" + struct.pack("<IQQ", 1, 0, 0))
    assert "version 1" in refused(path)
    assert "is a folder" in refused(tmp_path)


def test_numbers_that_are_not_finite_are_refused(tmp_path):
    damaged = ARRAYS["model.norm.weight"].copy()
    damaged[5] = np.nan
    path = write_gguf(tmp_path / "a.gguf", ARRAYS | {"model.norm.weight": damaged})
    assert "'model.norm.weight' holds numbers that are not finite" in refused(path)


def test_the_missing_package_is_named(tmp_path, monkeypatch):
    path = write_gguf(tmp_path / "a.gguf", ARRAYS)
    real = builtins.__import__

    def without(name, *rest, **more):
        if name.split(".")[0] == "gguf":
            raise ModuleNotFoundError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pip install 'jaxphys-splats\[models\]'"):
        read_gguf(path)
