"""A checkpoint comes back exactly, or is said to be damaged and not used."""

import os
import shutil
import signal
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import pytest

import jaxphys.core.checkpoints as checkpoints_module
from jaxphys.core.checkpoints import Checkpoints, by_name, fingerprint, from_names
from jaxphys.core.errors import InputError

ARRAYS = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.int32(4)}


def later(number):
    return {**ARRAYS, "b": np.int32(number)}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder with the steps 3 and 12 of the request "a"."""
    folder = tmp_path_factory.mktemp("kept") / "steps"
    checkpoints = Checkpoints(folder, "a")
    for step in (1, 3, 12):
        checkpoints.save(step, later(step))
    return folder


@pytest.fixture
def folder(kept, tmp_path):
    return shutil.copytree(kept, tmp_path / "steps")


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


def test_the_newest_comes_back_exactly(folder):
    assert sorted(path.name for path in folder.iterdir()) == ["12", "3"]
    step, found = Checkpoints(folder, "a").newest()
    assert step == 12 and set(found) == {"a", "b"}
    assert found["b"] == 12 and found["b"].dtype == np.int32
    assert found["a"].dtype == np.float32 and np.array_equal(found["a"], ARRAYS["a"])


def test_arrays_without_entries_keep_shape_and_type(tmp_path):
    arrays = {"none": np.zeros((0, 3), np.float16), "one": np.ones(1)}
    Checkpoints(tmp_path, "a").save(0, arrays)
    _, found = Checkpoints(tmp_path, "a").newest()
    assert found["none"].shape == (0, 3) and found["none"].dtype == np.float16


def test_all_are_kept_where_that_is_asked_for(tmp_path):
    checkpoints = Checkpoints(tmp_path, "a", keep=None)
    for step in range(4):
        checkpoints.save(step, later(step))
    assert Checkpoints(tmp_path, "a").steps() == [0, 1, 2, 3]
    checkpoints.drop_after(1)
    assert checkpoints.steps() == [0, 1] == Checkpoints(tmp_path, "a").steps()


def test_another_request_neither_reads_nor_keeps_them(folder, capsys):
    other = Checkpoints(folder, "b")
    assert other.newest() is None and not capsys.readouterr().err
    other.save(2, ARRAYS)
    assert Checkpoints(folder, "b").steps() == [2]
    assert Checkpoints(folder, "a").newest() is None


def test_a_step_that_is_repeated_replaces_what_came_after(folder):
    Checkpoints(folder, "a").save(3, later(5))
    assert Checkpoints(folder, "a").steps() == [3]
    assert Checkpoints(folder, "a").load(3)["b"] == 5


def test_what_orbax_had_not_finished_is_not_used(folder):
    shutil.copytree(folder / "3", folder / "20.orbax-checkpoint-tmp-1")
    assert Checkpoints(folder, "a").steps() == [3, 12]
    assert not (folder / "20.orbax-checkpoint-tmp-1").exists()


def test_what_was_not_sealed_is_not_used(folder, capsys):
    (folder / "12/sha256.json").unlink()
    assert Checkpoints(folder, "a").newest()[0] == 3
    assert "12: is not used, it was not finished" in capsys.readouterr().err


@pytest.mark.parametrize("seed", range(2))
def test_a_flipped_bit_in_any_file_is_noticed(kept, tmp_path, capsys, seed):
    """And the checkpoint before it is used."""
    random = np.random.default_rng(seed)
    names = [path.relative_to(kept) for path in files(kept / "12")]
    assert len(names) > 5
    for number, name in enumerate(names):
        folder = shutil.copytree(kept, tmp_path / str(number))
        content = bytearray((folder / name).read_bytes())
        content[random.integers(len(content))] ^= 1 << random.integers(8)
        (folder / name).write_bytes(content)
        step, found = Checkpoints(folder, "a").newest()
        assert step == 3 and found["b"] == 3
        assert f"{folder / '12'}: is not used" in capsys.readouterr().err
        assert not (folder / "12").exists()


def damaged(folder, random):
    """Does one thing to one file or folder below `folder`."""
    paths = sorted(folder.rglob("*"))
    path = paths[random.integers(len(paths))]
    what = random.integers(6)
    if what == 0:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    elif what == 1 and path.is_file():
        path.write_bytes(path.read_bytes()[: random.integers(path.stat().st_size + 1)][:-1])
    elif what == 2 and path.is_file():
        path.write_bytes(path.read_bytes() + b"x")
    elif what == 3:
        path.with_name("stranger").write_text("?")
    elif what == 4:
        moved = path.with_name("moved")
        path.rename(moved)
        path.symlink_to(moved)
    else:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
        path.mkdir() if random.integers(2) else path.write_bytes(b"")


def test_damaged_folders_never_end_in_an_error(kept, tmp_path, capsys):
    """What comes back is one of the two that were saved, or nothing, and saving goes on."""
    random = np.random.default_rng(0)
    seen = set()
    for number in range(60):
        folder = shutil.copytree(kept, tmp_path / str(number))
        for _ in range(random.integers(1, 3)):
            damaged(folder, random)
        there = os.path.lexists(folder / "12")
        newest = Checkpoints(folder, "a").newest()
        seen.add(None if newest is None else newest[0])
        told = capsys.readouterr().err.splitlines()
        assert all(line.startswith("jaxphys: ") for line in told)
        if there and (newest is None or newest[0] == 3):
            assert told
        if newest is not None:
            assert newest[1]["b"] == newest[0] and np.array_equal(newest[1]["a"], ARRAYS["a"])
        if number % 10 == 0:
            Checkpoints(folder, "a").save(15, later(15))
            assert Checkpoints(folder, "a").newest()[1]["b"] == 15
            capsys.readouterr()
    assert seen == {None, 3, 12}


def test_a_file_or_a_link_in_place_of_the_folder(kept, tmp_path, capsys):
    (tmp_path / "file").write_text("?")
    assert Checkpoints(tmp_path / "file", "a").newest() is None
    assert "is no folder" in capsys.readouterr().err
    shutil.copytree(kept, tmp_path / "real")
    (tmp_path / "real/12").rename(tmp_path / "elsewhere")
    (tmp_path / "real/12").symlink_to(tmp_path / "elsewhere")
    assert Checkpoints(tmp_path / "real", "a").newest()[0] == 3
    assert len(files(tmp_path / "elsewhere")) > 5  # what the link leads to is not touched


def test_a_disk_that_refuses_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="the checkpoint cannot be saved") as error:
        Checkpoints(tmp_path / "file" / "steps", "a").save(0, ARRAYS)
    assert "\n" not in str(error.value)


def test_a_pytree_comes_back_by_name():
    class Pair(NamedTuple):
        left: dict
        right: tuple

    tree = Pair({"b.kernel": jnp.arange(3), "a": jnp.ones(2)}, (jnp.zeros(1), None))
    arrays = by_name(tree)
    assert set(arrays) == {"left/b.kernel", "left/a", "right/0"}
    found = from_names(tree, arrays)
    assert np.array_equal(found.left["b.kernel"], [0, 1, 2]) and found.right[1] is None


def test_fingerprint_sees_every_number_shape_and_type():
    same = fingerprint(b"x", ARRAYS)
    assert same == fingerprint(b"x", {k: np.array(v) for k, v in ARRAYS.items()})
    changed = [
        fingerprint(b"y", ARRAYS),
        fingerprint(b"x", {**ARRAYS, "b": np.int32(5)}),
        fingerprint(b"x", {**ARRAYS, "b": np.int64(4)}),
        fingerprint(b"x", {**ARRAYS, "b": np.array([4], np.int32)}),
        fingerprint(b"x", {**ARRAYS, "a": ARRAYS["a"].T}),
        fingerprint(b"xy", ARRAYS),
        fingerprint(b"x", b"y", ARRAYS),
    ]
    assert len({same, *changed}) == 8


def test_an_interrupt_while_saving_counts_when_all_is_whole(tmp_path, monkeypatch):
    """Orbax's threads would go on otherwise, and fail when the program ends."""
    sealed = checkpoints_module.seal

    def interrupted(*arguments, **options):
        os.kill(os.getpid(), signal.SIGINT)
        sealed(*arguments, **options)

    monkeypatch.setattr(checkpoints_module, "seal", interrupted)
    # Who runs the suite in the background may have it ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            Checkpoints(tmp_path, "a").save(4, later(4))
    finally:
        signal.signal(signal.SIGINT, before)
    assert Checkpoints(tmp_path, "a").newest()[1]["b"] == 4
