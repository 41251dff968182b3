"""Files of `torch.save` are read as PyTorch would, and nothing in them is ever run.

`golden/` was written by `python -m experiments.parity.torch_file`.
"""

import io
import os
import pickle
import struct
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import ml_dtypes
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.parity.arrays import pseudo_random
from jaxphys.core.errors import InputError
from jaxphys.weights.torch_zip import read_torch_zip

GOLDEN = Path(__file__).parent / "golden"
BASE = pseudo_random("base", (6, 8))


@pytest.fixture(scope="module")
def state():
    return read_torch_zip(GOLDEN / "state.pt")


@pytest.mark.parametrize(
    ("name", "expected"),
    {
        "norm.weight": np.ones(3, np.float32),
        "norm.running_var": np.ones(3, np.float32),
        "norm.num_batches_tracked": np.array(0),
        "base": BASE,
        "transposed": BASE.T,
        "part": BASE[1:5:2, 3:],
        "parameter": BASE[:2],
        "half": BASE.astype(np.float16),
        "bfloat": BASE.astype(ml_dtypes.bfloat16),
        "double": BASE.astype(np.float64),
        "scalar": np.array(2.5, np.float32),
        "empty": np.zeros((0, 3), np.float32),
        "nested.whole": np.arange(4),
        "nested.deeper.int": np.arange(3, dtype=np.int32),
        "mask": np.array([True, False, True]),
        "bytes": np.array([0, 127, 255], np.uint8),
    }.items(),
)
def test_tensors_are_those_that_torch_wrote(state, name, expected):
    assert state[name].dtype == expected.dtype
    assert state[name].shape == expected.shape
    np.testing.assert_array_equal(state[name], expected)
    assert not state[name].flags.writeable


def test_only_tensors_are_listed_in_the_files_order(state):
    assert len(state) == 18 and not {"epoch", "rate", "note", "shape"} & set(state)
    assert [name for name in state if name in ("base", "half", "nested.whole", "bytes")] == [
        "base",
        "half",
        "nested.whole",
        "bytes",
    ]


def test_shared_memory_stays_shared(state):
    assert np.shares_memory(state["base"], state["transposed"])
    assert np.shares_memory(state["base"], state["part"])
    assert not np.shares_memory(state["base"], state["parameter"])


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("before_1_6.pt", "before 1.6"),
        ("module.pt", "torch.nn.modules.linear Linear"),
        ("script.pt", "TorchScript"),
    ],
)
def test_other_files_of_torch_are_refused_by_name(name, why):
    with pytest.raises(InputError, match=why) as refused:
        read_torch_zip(GOLDEN / name)
    assert name in str(refused.value) and "\n" not in str(refused.value)


# Files written here. A pickle is spelled out in its own instructions.

STOP, MARK, TUPLE, REDUCE = b".", b"(", b"t", b"R"
FLOATS = b"ctorch\nFloatStorage\n"
REBUILD = b"ctorch._utils\n_rebuild_tensor_v2\n"


def text(value):
    return b"X" + struct.pack("<I", len(value.encode())) + value.encode()


def integer(value):
    """LONG1, which has room for numbers of any size up to 255 bytes."""
    content = value.to_bytes(value.bit_length() // 8 + 1, "little", signed=True)
    return b"\x8a" + bytes([len(content)]) + content


def numbers(*values):
    return MARK + b"".join(map(integer, values)) + TUPLE


def storage(key="0", count=4, kind=FLOATS):
    return MARK + text("storage") + kind + text(key) + text("cpu") + integer(count) + TUPLE + b"Q"


def tensor(offset=0, shape=(4,), strides=(1,), stored=None):
    stored = storage() if stored is None else stored
    place = integer(offset) + numbers(*shape) + numbers(*strides)
    return REBUILD + MARK + stored + place + b"\x89}" + TUPLE + REDUCE


def dictionary(*pairs):
    return b"}" + b"".join(text(key) + value + b"s" for key, value in pairs)


def torch_file(path, value, members=None, *, compression=zipfile.ZIP_STORED, root="archive"):
    """A file whose pickle is `value`, beside the storage 0: four float32, 0 to 3."""
    members = {"data/0": np.arange(4, dtype="<f4").tobytes()} if members is None else members
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr(f"{root}/data.pkl", b"\x80\x02" + value + STOP)
        for name, content in members.items():
            archive.writestr(f"{root}/{name}", content)
    return path


def refused(path, match):
    with pytest.raises(InputError, match=match) as error:
        read_torch_zip(path)
    message = str(error.value)
    assert path.name in message and "\n" not in message and len(message) < 600
    return message


def test_a_written_file_is_read(tmp_path):
    path = torch_file(tmp_path / "a.pt", dictionary(("x", tensor()), ("y", tensor(1, (2,), (2,)))))
    found = read_torch_zip(str(path))
    assert list(found) == ["x", "y"]
    np.testing.assert_array_equal(found["x"], [0, 1, 2, 3])
    np.testing.assert_array_equal(found["y"], [1, 3])


def test_big_endian_numbers(tmp_path):
    members = {"byteorder": b"big", "data/0": np.arange(4, dtype=">f4").tobytes()}
    path = torch_file(tmp_path / "a.pt", dictionary(("x", tensor())), members)
    np.testing.assert_array_equal(read_torch_zip(path)["x"], [0, 1, 2, 3])
    torch_file(path, dictionary(("x", tensor())), {**members, "byteorder": b"middle"})
    refused(path, "byte order")


@pytest.mark.parametrize(
    ("value", "match"),
    {
        "os.system": (b"cos\nsystem\n" + text("touch SENTINEL") + b"\x85R", "'os system'"),
        "builtins.eval": (b"cbuiltins\neval\n" + text("1") + b"\x85R", "'builtins eval'"),
        "getattr": (b"cbuiltins\ngetattr\n", "'builtins getattr'"),
        "another function of torch": (b"ctorch\nload\n", "'torch load'"),
        "global without a line end": (b"cos", "newline|readline"),
        "by stack": (text("os") + text("system") + b"\x93", "STACK_GLOBAL"),
        "instance": (MARK + b"ios\nsystem\n", "INST"),
        "object": (MARK + b"cos\nsystem\no", "'os system'"),
        "new object": (b"ccollections\nOrderedDict\n)\x81", "NEWOBJ"),
        "extension registry": (b"\x82\x01", "EXT1"),
        "object of a protocol-4 pickle": (b"\x95" + struct.pack("<Q", 1) + b"}", "FRAME"),
        "python 2 string": (b"U\x01a", "SHORT_BINSTRING"),
        "calling a storage type": (FLOATS + b")R", "calls"),
        "calling a number": (integer(1) + b")R", "calls"),
        "dictionary from pairs": (b"ccollections\nOrderedDict\n]\x85R", "OrderedDict"),
        "attributes of a tensor": (tensor() + b"}" + text("_metadata") + b"}sb", "attributes"),
        "other attributes": (b"}}" + text("__class__") + b"}sb", "attributes"),
        "no dictionary": (tensor(), "ndarray"),
        "no value": (b"", "pickle ends"),
        "two values": (b"}}", "pickle ends"),
        "open mark": (b"}(", "pickle ends"),
        "empty stack": (b"s", "pop from empty list"),
        "pop of a mark": (b"t", "pop from empty list"),
        "unknown memo": (b"h\x07", "7"),
        "unknown instruction": (b"\xff", "opcode"),
        "key without a value": (b"}(" + text("a") + b"u", "key without"),
        "items of a tuple": (b"))" + integer(1) + b"s", "sets items"),
        "append to a dictionary": (b"})a", "appends"),
        "tuple as key": (b"}))s", "key"),
        "bool as key": (b"}\x88Ns", "key"),
    }.values(),
)
def test_pickles_that_are_no_dictionary_of_tensors(tmp_path, monkeypatch, value, match):
    monkeypatch.chdir(tmp_path)
    refused(torch_file(tmp_path / "bad.pt", value), match)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.pt"]


class Touches:
    """Unpickled, it writes a file: what an attacker would send."""

    def __init__(self, sentinel, function=os.system):
        self.call = (function, (f"touch {sentinel}",))

    def __reduce__(self):
        return self.call


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@pytest.mark.parametrize("function", [os.system, eval, exec, __import__])
def test_a_pickle_that_runs_a_command_is_not_run(tmp_path, protocol, function):
    sentinel = tmp_path / "sentinel"
    content = pickle.dumps({"x": Touches(sentinel, function)}, protocol)
    with zipfile.ZipFile(tmp_path / "bad.pt", "w") as archive:
        archive.writestr("bad/data.pkl", content)
    refused(tmp_path / "bad.pt", "wants the global|instruction")
    assert not sentinel.exists()
    if function is os.system:  # the test's own proof that the file is dangerous
        pickle.loads(content)
        assert sentinel.exists()


@pytest.mark.parametrize(
    ("arguments", "match"),
    {
        "past the end": ({"shape": (5,)}, "needs 5 numbers of a storage of 4"),
        "offset": ({"offset": 1}, "needs 5"),
        "stride": ({"shape": (2,), "strides": (4,)}, "needs 5"),
        "negative offset": ({"offset": -1}, "-1"),
        "negative stride": ({"strides": (-1,)}, "-1"),
        "negative shape": ({"shape": (-4,)}, "-4"),
        "huge": ({"shape": (2**61, 2**61), "strides": (1, 1)}, "needs"),
        "overflow": ({"shape": (2**40, 2**40), "strides": (0, 0)}, "needs"),
        "offset overflow": ({"offset": 2**61 + 1}, "needs"),
        "wider than 64 bits": ({"shape": (2**70,)}, "shape or strides"),
        "huge but empty": ({"shape": (0, 2**61), "strides": (1, 1)}, "empty tensor"),
        "repeated": ({"shape": (1000,), "strides": (0,)}, "needs 1000"),
        "strides are missing": ({"strides": ()}, "belong together"),
        "dimensions": ({"shape": (1,) * 33, "strides": (1,) * 33}, "33 dimensions"),
        "count": ({"stored": storage(count=5)}, "16 bytes"),
        "huge count": ({"stored": storage(count=2**70)}, "16 bytes"),
        "kind": ({"stored": storage(kind=b"ctorch\nDoubleStorage\n")}, "16 bytes"),
        "function as kind": ({"stored": storage(kind=REBUILD)}, "no storage"),
        "missing": ({"stored": storage("1")}, "lacks its member 'archive/data/1'"),
        "outside": ({"stored": storage("../../etc/passwd")}, "named by a number"),
        "no storage": ({"stored": b"}"}, "other kinds"),
        "number as storage": ({"stored": integer(3) + b"Q"}, "no storage"),
        "tensor as storage": ({"stored": tensor() + b"Q"}, "no storage"),
    }.values(),
)
def test_tensors_outside_of_their_storage(tmp_path, arguments, match):
    refused(torch_file(tmp_path / "bad.pt", dictionary(("x", tensor(**arguments)))), match)


def test_strides_of_single_rows_do_not_matter(tmp_path):
    value = dictionary(("x", tensor(shape=(1, 4), strides=(2**61, 1))))
    assert read_torch_zip(torch_file(tmp_path / "a.pt", value))["x"].shape == (1, 4)


def test_dictionaries_within_themselves(tmp_path):
    within = b"}q\x00" + text("a") + b"h\x00s"
    refused(torch_file(tmp_path / "bad.pt", within), "within itself")


def test_doubling_dictionaries_end_quickly(tmp_path):
    """Sixty dictionaries, each with the one before twice: 2^60 tensors."""
    value = dictionary(("x", tensor()))
    for level in range(60):
        place = bytes([level])
        value = dictionary(("a", value + b"q" + place), ("b", b"h" + place))
    refused(torch_file(tmp_path / "bad.pt", value), "two places")


def test_doubling_tuples_are_never_hashed_or_printed(tmp_path):
    doubled = b")"
    for level in range(100):
        doubled += b"q" + bytes([level]) + b"h" + bytes([level]) + b"\x86"
    refused(torch_file(tmp_path / "a.pt", b"}" + doubled + b"Ns"), "a key .a tuple.")
    refused(torch_file(tmp_path / "b.pt", doubled), "tuple")
    refused(torch_file(tmp_path / "c.pt", REBUILD + doubled + REDUCE), "other kinds")
    refused(torch_file(tmp_path / "d.pt", doubled + b"Q"), "no storage")


def test_deep_nesting_is_refused_without_recursion(tmp_path):
    deep = b"}" + text("a") + (b"}" + text("a")) * 20_000 + b"N" + b"s" * 20_001
    refused(torch_file(tmp_path / "bad.pt", deep), "a name of")


def test_two_tensors_of_one_name(tmp_path):
    inner = dictionary(("b", tensor()))
    refused(torch_file(tmp_path / "bad.pt", dictionary(("a.b", tensor()), ("a", inner))), "'a.b'")


# What is wrong with the zip file itself.


def test_a_deflated_bomb_is_refused_before_it_is_read(tmp_path):
    members = {"data/0": bytes(200 * 1024**2)}
    value = dictionary(("x", tensor(stored=storage(count=50 * 1024**2))))
    bomb = torch_file(tmp_path / "bad.pt", value, members, compression=zipfile.ZIP_DEFLATED)
    assert bomb.stat().st_size < 1024**2
    tracemalloc.start()
    try:
        refused(bomb, "compressed")
        assert tracemalloc.get_traced_memory()[1] < 5 * 1024**2
    finally:
        tracemalloc.stop()


def test_members_that_claim_to_be_larger_than_the_file(tmp_path):
    path = torch_file(tmp_path / "bad.pt", dictionary(("x", tensor())))
    content = path.read_bytes()
    at = content.rindex(b"PK\x01\x02")  # the directory entry of data/0
    for field in (20, 24):
        content = content[: at + field] + struct.pack("<I", 2**31) + content[at + field + 4 :]
    path.write_bytes(content)
    refused(path, "larger than the file")


def test_overlapping_members_cannot_multiply_a_file(tmp_path):
    """A thousand directory entries, all of the same megabyte."""
    path, content = tmp_path / "bad.pt", bytes(1024**2)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/data.pkl", b"\x80\x02}.")
        archive.writestr("a/data/0", content)
        first = archive.getinfo("a/data/0")
        for index in range(1, 1000):
            copy = zipfile.ZipInfo(f"a/data/{index}")
            for field in ("CRC", "file_size", "compress_size", "header_offset"):
                setattr(copy, field, getattr(first, field))
            archive.filelist.append(copy)
            archive.NameToInfo[copy.filename] = copy
    refused(path, "larger than the file")


@pytest.mark.parametrize("kept", [0, 2, 10, 100, 500, -1, -30])
def test_truncated(tmp_path, kept):
    content = (GOLDEN / "state.pt").read_bytes()
    (tmp_path / "bad.pt").write_bytes(content[:kept])
    refused(tmp_path / "bad.pt", "not readable as PyTorch weights")


def test_flipped_bits_of_a_storage_are_noticed(tmp_path):
    path = torch_file(tmp_path / "bad.pt", dictionary(("x", tensor())))
    content = path.read_bytes()
    path.write_bytes(content.replace(np.float32(3).tobytes(), np.float32(5).tobytes()))
    refused(path, "CRC")


def test_members_of_one_name(tmp_path):
    path = torch_file(tmp_path / "bad.pt", dictionary(("x", tensor())))
    with zipfile.ZipFile(path, "a") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        archive.writestr("archive/data.pkl", b"\x80\x02}.")
    refused(path, "two members of one name")


def test_two_pickles_or_none(tmp_path):
    path = torch_file(tmp_path / "bad.pt", b"}")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("other/data.pkl", b"\x80\x02}.")
    refused(path, "2 members")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("model/picture.png", b"")
    refused(path, "0 members")


def test_an_encrypted_member(tmp_path):
    path = torch_file(tmp_path / "bad.pt", b"}")
    content = bytearray(path.read_bytes())
    content[content.index(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)
    refused(path, "encrypted")


def test_too_long_a_pickle(tmp_path):
    refused(torch_file(tmp_path / "bad.pt", b"0" * 5 * 1024**2), "is larger than")


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match=r"none\.pt.*no such file"):
        read_torch_zip(tmp_path / "none.pt")
    with pytest.raises(InputError, match="folder"):
        read_torch_zip(tmp_path)


@given(st.data())
def test_a_changed_byte_is_an_error_or_other_tensors_but_never_anything_else(
    tmp_path_factory, data
):
    content = bytearray((GOLDEN / "state.pt").read_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("changed") / "state.pt"
    path.write_bytes(content)
    read_or_refused(path)


@given(st.data())
def test_any_pickle_is_an_error_or_tensors_but_never_anything_else(tmp_path_factory, data):
    """As above, with a directory and checksums that are right, so that the pickle is reached."""
    with zipfile.ZipFile(GOLDEN / "state.pt") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    program = bytearray(members["state/data.pkl"])
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(program) - 1))
        program[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for name, content in {**members, "state/data.pkl": bytes(program)}.items():
            archive.writestr(name, content)
    path = tmp_path_factory.mktemp("changed") / "state.pt"
    path.write_bytes(target.getvalue())
    read_or_refused(path)


def read_or_refused(path):
    try:
        found = read_torch_zip(path)
    except InputError as error:
        assert str(path) in str(error)
    else:
        assert all(isinstance(value, np.ndarray) for value in found.values())
