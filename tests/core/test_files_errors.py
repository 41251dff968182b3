import gc
import json
import os
import resource
import subprocess
import sys

import numpy as np
import pytest

from jaxphys.core.checkpoints import Checkpoints
from jaxphys.core.errors import InputError, nearest
from jaxphys.core.files import atomic_path, remove_asides, write_json
from jaxphys.pipeline.video import write_picture


def test_nearest_names_the_likeliest_first_then_all():
    text = nearest("jely", ["sand", "jelly", "metal"])
    assert text.startswith("did you mean 'jelly'?")
    assert text.endswith("valid: jelly, metal, sand")
    assert "did you mean" not in nearest("xyz", ["sand", "jelly"])


def test_an_input_error_is_a_value_error():
    with pytest.raises(ValueError, match="what"):
        raise InputError("what")


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "new" / "a.txt"
    with atomic_path(path) as aside:
        assert aside.suffix == ".txt" and aside.parent == path.parent
        aside.write_text("whole")
        assert not path.exists()
    assert path.read_text() == "whole"
    with pytest.raises(RuntimeError), atomic_path(path) as aside:
        aside.write_text("half")
        raise RuntimeError
    assert path.read_text() == "whole"
    assert [p.name for p in path.parent.iterdir()] == ["a.txt"]


def test_equal_values_give_equal_bytes(tmp_path):
    write_json(tmp_path / "a.json", {"b": 1, "a": [2.5]})
    write_json(tmp_path / "b.json", {"a": [2.5], "b": 1})
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": [2.5], "b": 1}


def test_a_value_that_is_not_json_leaves_the_old_file(tmp_path):
    write_json(tmp_path / "a.json", 1)
    with pytest.raises(TypeError):
        write_json(tmp_path / "a.json", object())
    assert (tmp_path / "a.json").read_text() == "1\n"


@pytest.fixture
def full_disk():
    """No file may grow beyond 4096 bytes, which a process is told as by a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_is_one_line_and_leaves_the_old_file(tmp_path, full_disk, monkeypatch):
    write_json(tmp_path / "a.json", 1)
    with pytest.raises(InputError, match=r"a\.json: cannot be written \(File too large") as error:
        write_json(tmp_path / "a.json", "x" * 10_000)
    assert "\n" not in str(error.value)
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
    assert (tmp_path / "a.json").read_text() == "1\n"
    told = []
    monkeypatch.setattr(sys, "unraisablehook", told.append)
    for side in (38, 64):  # a file that is too large as it is closed, and one before that
        picture = np.random.default_rng(0).integers(0, 256, (side, side, 3), np.uint8)
        with pytest.raises(InputError, match=r"a\.png: cannot be written"):
            write_picture(tmp_path / "a.png", picture)
    gc.collect()
    assert not told
    checkpoints = Checkpoints(tmp_path / "steps", "a")
    checkpoints.save(0, {"a": np.zeros(4)})
    with pytest.raises(InputError, match="the checkpoint cannot be saved"):
        checkpoints.save(1, {"a": np.random.default_rng(0).normal(size=10_000)})
    assert Checkpoints(tmp_path / "steps", "a").newest()[0] == 0


def test_what_fails_for_another_reason_is_not_blamed_on_the_disk(tmp_path):
    for error in (ConnectionResetError("gone"), FileNotFoundError(2, "no", "elsewhere")):
        with pytest.raises(type(error)), atomic_path(tmp_path / "a") as aside:
            aside.write_text("")
            raise error
    assert not list(tmp_path.iterdir())


def test_a_path_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    for path in ("file/below", "folder", "x" * 300):
        with pytest.raises(InputError, match="cannot be written"):
            write_json(tmp_path / path, 1)


def test_what_killed_processes_left_aside_goes(tmp_path):
    """Of this file, and of all where nobody else may write; a living process keeps its own."""
    gone = subprocess.Popen(["true"])
    gone.wait()
    names = [
        f".jaxphys-{gone.pid}-a",
        f".jaxphys-{gone.pid}-b",
        f".jaxphys-{os.getppid()}-a",
        "mine",
    ]
    for name in names:
        (tmp_path / name).write_text("half")
    write_json(tmp_path / "a", 1)
    assert {path.name for path in tmp_path.iterdir()} == {"a", *names[1:]}
    remove_asides(tmp_path, alone=True)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "mine"}
