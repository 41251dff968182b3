import json
import struct
import tracemalloc

import ml_dtypes
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from safetensors.numpy import save, save_file

from jaxphys.core.errors import InputError
from jaxphys.weights.safetensors_files import open_arrays

DTYPES = (np.float32, np.float16, ml_dtypes.bfloat16, np.float64, np.int64)
SMALL = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.ones(2, np.float32)}


def refused(match, path, stem="model"):
    with pytest.raises(InputError, match=match) as error:
        open_arrays(path, stem)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def sharded(folder, weight_map=None, files=None):
    """Array a in the first shard, b in the second, and their index."""
    for name, arrays in (files or {"1": {"a": SMALL["a"]}, "2": {"b": SMALL["b"]}}).items():
        save_file(arrays, folder / f"model-{name}.safetensors")
    listed = {"a": "model-1.safetensors", "b": "model-2.safetensors"}
    content = {"metadata": {}, "weight_map": listed if weight_map is None else weight_map}
    index = folder / "model.safetensors.index.json"
    index.write_text(json.dumps(content))
    return index


def assert_small(arrays):
    assert set(arrays) == set(SMALL) and len(arrays) == len(SMALL)
    for name, expected in SMALL.items():
        np.testing.assert_array_equal(arrays[name], expected)


@pytest.mark.parametrize("dtype", DTYPES)
def test_every_precision_arrives_as_it_is(tmp_path, dtype):
    expected = np.linspace(-3, 3, 12).reshape(3, 4).astype(dtype)
    save_file({"x": expected, "scalar": np.array(expected[0, 0])}, tmp_path / "a.safetensors")
    arrays = open_arrays(tmp_path / "a.safetensors")
    assert arrays["x"].dtype == expected.dtype and arrays["scalar"].shape == ()
    np.testing.assert_array_equal(arrays["x"], expected)


def test_a_folder_with_a_whole_file(tmp_path):
    save_file(SMALL, tmp_path / "model.safetensors")
    assert_small(open_arrays(str(tmp_path)))


def test_shards(tmp_path):
    sharded(tmp_path)
    assert_small(open_arrays(tmp_path))


def test_full_precision_before_half(tmp_path):
    half = {name: array.astype(np.float16) for name, array in SMALL.items()}
    save_file(half, tmp_path / "net.fp16.safetensors")
    assert open_arrays(tmp_path, "net")["a"].dtype == np.float16
    save_file(SMALL, tmp_path / "net.safetensors")
    assert open_arrays(tmp_path, "net")["a"].dtype == np.float32


def test_links_out_of_the_folder_are_followed(tmp_path):
    """The hub's cache consists of them."""
    (tmp_path / "blobs").mkdir()
    (tmp_path / "snapshot").mkdir()
    save_file(SMALL, tmp_path / "blobs" / "0123")
    (tmp_path / "snapshot" / "model.safetensors").symlink_to("../blobs/0123")
    assert_small(open_arrays(tmp_path / "snapshot"))


def test_arrays_are_read_one_at_a_time(tmp_path):
    arrays = {f"{i}": np.full(1_000_000, i, np.float32) for i in range(8)}  # 4 MB each
    save_file(arrays, tmp_path / "model.safetensors")
    tracemalloc.start()
    try:
        opened = open_arrays(tmp_path)
        assert tracemalloc.get_traced_memory()[1] < 1e6
        assert [float(opened[name][-1]) for name in sorted(opened)] == list(range(8))
        assert tracemalloc.get_traced_memory()[1] < 9e6
    finally:
        tracemalloc.stop()


def test_a_mapping_like_any_other(tmp_path):
    save_file(SMALL, tmp_path / "model.safetensors")
    arrays = open_arrays(tmp_path)
    assert "a" in arrays and "c" not in arrays
    with pytest.raises(KeyError):
        arrays["c"]


def with_header(header, data=b""):
    content = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(content)) + content + data


@pytest.mark.parametrize(
    "content",
    {
        "empty": b"",
        "short": b"abc",
        "truncated": save(SMALL)[:-1],
        "longer": save(SMALL) + b"x",
        "pickle": b"\x80\x02}q\x00." + b"x" * 100,
        "zip": b"PK\x03\x04" + bytes(100),
        "web page": b"<!DOCTYPE html><html><body>Not Found</body></html>",
        "git lfs pointer": b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n",
        "overlong header": struct.pack("<Q", 10**15) + b"{}",
        "header past the end": struct.pack("<Q", 50) + b"{}",
        "not JSON": with_header(b"hello wo"),
        "no object": with_header([1, 2]),
        "out of bounds": with_header({"a": {"dtype": "F32", "shape": [1], "data_offsets": [0, 4]}}),
        "offsets of another size": with_header(
            {"a": {"dtype": "F32", "shape": [9], "data_offsets": [0, 4]}}, bytes(4)
        ),
        "overflow": with_header(
            {"a": {"dtype": "F32", "shape": [2**62, 8], "data_offsets": [0, 4]}}, bytes(4)
        ),
        "unknown type": with_header(
            {"a": {"dtype": "F33", "shape": [1], "data_offsets": [0, 4]}}, bytes(4)
        ),
    }.values(),
)
def test_what_is_no_safetensors_file(tmp_path, content):
    (tmp_path / "model.safetensors").write_bytes(content)
    refused("not a whole safetensors file", tmp_path / "model.safetensors")
    with pytest.raises(InputError, match=r"model\.safetensors: not a whole"):
        open_arrays(tmp_path)


def test_a_type_that_numpy_has_not(tmp_path):
    header = {"a": {"dtype": "F8_E4M3", "shape": [4], "data_offsets": [0, 4]}}
    (tmp_path / "model.safetensors").write_bytes(with_header(header, bytes(4)))
    with pytest.raises(InputError, match="array 'a' holds F8_E4M3; readable: F32"):
        open_arrays(tmp_path)["a"]


def test_nothing_there(tmp_path):
    refused("is missing", tmp_path / "none.safetensors")
    refused(r"no model\.safetensors", tmp_path)
    save_file(SMALL, tmp_path / "model.safetensors")
    refused(r"no unet\.safetensors", tmp_path, "unet")
    (tmp_path / "net.safetensors").mkdir()
    refused(r"no net\.safetensors", tmp_path, "net")


@pytest.mark.parametrize(
    ("weight_map", "match"),
    [
        ({}, "lists no arrays"),
        ([], "lists no arrays"),
        ({"a": 3}, "no .safetensors file"),
        ({"a": "model-1.bin"}, "no .safetensors file"),
        ({"a": "../model-1.safetensors"}, "not a file of the same folder"),
        ({"a": "/tmp/model-1.safetensors"}, "not a file of the same folder"),
        ({"a": "sub/model-1.safetensors"}, "not a file of the same folder"),
        ({"a": "..\\model-1.safetensors"}, "not a file of the same folder"),
        ({"a": "model-1.safetensors"} | {"c": "model-2.safetensors"}, "'b' is in model-2"),
        ({"a": "model-1.safetensors", "b": "model-1.safetensors"}, "'b' is in no shard"),
        ({"a": "model-2.safetensors", "b": "model-1.safetensors"}, "'a' is in model-1.*model-2"),
    ],
)
def test_an_index_that_does_not_fit_its_shards(tmp_path, weight_map, match):
    sharded(tmp_path, weight_map)
    with pytest.raises(InputError, match=match) as error:
        open_arrays(tmp_path)
    assert "index.json" in str(error.value)


def test_a_missing_shard_is_named(tmp_path):
    sharded(tmp_path)
    (tmp_path / "model-2.safetensors").unlink()
    with pytest.raises(InputError, match=r"model-2\.safetensors: is missing"):
        open_arrays(tmp_path)


def test_an_array_in_two_shards(tmp_path):
    sharded(tmp_path, files={"1": SMALL, "2": {"b": SMALL["b"]}})
    with pytest.raises(InputError, match=r"'b' is also in model-1"):
        open_arrays(tmp_path)


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", "not json", '{"weight_map": 3}', "[" * 100_000]
)
def test_an_index_that_is_none(tmp_path, content):
    index = sharded(tmp_path)
    index.write_text(content)
    with pytest.raises(InputError, match=r"index\.json: (not an index|'weight_map' lists)"):
        open_arrays(tmp_path)


@given(st.data())
def test_a_changed_byte_is_an_error_or_other_arrays_but_never_anything_else(tmp_path_factory, data):
    content = bytearray(save(SMALL))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("changed") / "a.safetensors"
    path.write_bytes(content)
    try:
        arrays = open_arrays(path)
        assert all(isinstance(arrays[name], np.ndarray) for name in arrays)
    except InputError as error:
        assert str(path) in str(error)


@pytest.mark.parametrize("dtype", [np.float32, np.float16, ml_dtypes.bfloat16, np.float64])
def test_numbers_that_are_not_finite_are_refused_by_name(tmp_path, dtype):
    spoiled = np.ones((3, 4), dtype)
    spoiled[2, 1] = np.nan
    save_file({"good": np.ones(2, dtype), "layer.bad": spoiled}, tmp_path / "a.safetensors")
    arrays = open_arrays(tmp_path / "a.safetensors")
    assert arrays["good"].sum() == 2
    with pytest.raises(InputError, match=r"a\.safetensors: array 'layer\.bad' .*not finite"):
        arrays["layer.bad"]


def test_shards_at_half_precision_as_diffusers_names_them(tmp_path):
    stem = "diffusion_pytorch_model"
    listed = {}
    for i, (name, array) in enumerate(SMALL.items(), 1):
        file = f"{stem}.fp16-0000{i}-of-00002.safetensors"
        save_file({name: array}, tmp_path / file)
        listed[name] = file
    index = tmp_path / f"{stem}.safetensors.index.fp16.json"
    index.write_text(json.dumps({"metadata": {}, "weight_map": listed}))
    assert_small(open_arrays(tmp_path, stem))
    assert_small(open_arrays(index))
    # Full precision counts before half, whole files before shards.
    save_file({"full": SMALL["a"]}, tmp_path / f"{stem}.safetensors")
    assert set(open_arrays(tmp_path, stem)) == {"full"}
