"""Files that are missing, cut short, changed or not readable are each told from the right ones."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save

from jaxphys.core.errors import InputError
from jaxphys.weights.catalogue import CATALOGUE, Entry, File
from jaxphys.weights.verify import verify

GOLDEN = Path(__file__).parent / "golden"
ARRAYS = save({"a": np.arange(6, dtype=np.float32)})
HALF = save({"a": np.arange(6, dtype=np.float16)})


def known(path, content):
    return File(path, len(content), hashlib.sha256(content).hexdigest())


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A network whose files are all there and right."""
    made = Entry(
        "net",
        "a test",
        "MIT",
        (
            known("unet/net.safetensors", ARRAYS),
            File("vae/net.safetensors", len(ARRAYS)),
            File("unet/config.json", 100, exact=False),
            File("head.pt", (GOLDEN / "state.pt").stat().st_size),
        ),
        half=(known("unet/net.fp16.safetensors", HALF),),
    )
    monkeypatch.setitem(CATALOGUE, "net", made)
    monkeypatch.setenv("JAXPHYS_WEIGHTS", str(tmp_path))
    folder = tmp_path / "net"
    for part in ("unet", "vae"):
        (folder / part).mkdir(parents=True)
        (folder / part / "net.safetensors").write_bytes(ARRAYS)
    (folder / "unet/config.json").write_text("{}")
    shutil.copy(GOLDEN / "state.pt", folder / "head.pt")
    return folder


def verdicts():
    return {verdict.path: verdict for verdict in verify("net")[1]}


def problems():
    return {path: verdict.problem for path, verdict in verdicts().items() if verdict.problem}


def test_right_files_and_what_is_known_of_them(folder):
    assert verify("net")[0] == folder
    found = verdicts()
    assert not problems()
    assert {path: verdict.sha256 for path, verdict in found.items()} == {
        "unet/net.safetensors": "matches",
        "vae/net.safetensors": "not known",
        "unet/config.json": "not known",
        "head.pt": "not known",
    }
    assert found["unet/net.safetensors"].size == len(ARRAYS)


def test_a_missing_file(folder):
    (folder / "head.pt").unlink()
    assert problems() == {"head.pt": "missing"}
    assert verdicts()["head.pt"].size is None


def test_nothing_at_all(folder):
    shutil.rmtree(folder)
    assert set(problems().values()) == {"missing"} and len(problems()) == 4


@pytest.mark.parametrize("path", ["unet/net.safetensors", "vae/net.safetensors", "head.pt"])
def test_a_file_that_was_cut_short(folder, path):
    (folder / path).write_bytes((folder / path).read_bytes()[:-1])
    assert set(problems()) == {path} and "bytes instead of" in problems()[path]


def test_a_changed_byte_of_a_known_file(folder):
    path = folder / "unet/net.safetensors"
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    assert "SHA-256 differs" in problems()["unet/net.safetensors"]


@pytest.mark.parametrize("path", ["vae/net.safetensors", "unet/config.json", "head.pt"])
def test_a_file_of_which_nothing_is_known_is_opened(folder, path):
    size = (folder / path).stat().st_size
    (folder / path).write_bytes(bytes(size))
    assert set(problems()) == {path} and str(folder / path) in problems()[path]


def test_half_precision_is_compared_with_its_own_hash(folder):
    (folder / "unet/net.safetensors").unlink()
    half = folder / "unet/net.fp16.safetensors"
    half.write_bytes(HALF)
    assert verdicts()["unet/net.fp16.safetensors"].sha256 == "matches" and not problems()
    half.write_bytes(HALF[:-1] + b"x")
    assert "SHA-256 differs" in problems()["unet/net.fp16.safetensors"]


def test_shards_are_opened(folder):
    (folder / "vae/net.safetensors").rename(folder / "vae/part.safetensors")
    index = folder / "vae/net.safetensors.index.json"
    index.write_text(json.dumps({"weight_map": {"a": "part.safetensors"}}))
    assert not problems()
    index.write_text(json.dumps({"weight_map": {"b": "part.safetensors"}}))
    assert "'a' is in part.safetensors" in problems()["vae/net.safetensors.index.json"]


def test_an_unknown_name():
    with pytest.raises(InputError, match="unknown name"):
        verify("nothing")
