"""A motion goes on from what is whole of its checkpoint, wherever it was killed or damaged."""

import shutil
import sys
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
import pytest

from jaxphys.mpm.motion import Frame
from jaxphys.mpm.state import Status
from jaxphys.pipeline.resume import MotionCheckpoint

LAST = 7
CARRIERS = np.arange(4, dtype=np.int32)
CHANGES = {"open", "os.mkdir", "os.remove", "os.rename", "os.rmdir"}


class Counted(NamedTuple):
    """Stands for a state: how far it came."""

    steps: np.ndarray


def frames_until(last):
    """What a motion looks like up to a frame, every number another one."""
    frames = []
    for number in range(last + 1):
        position = np.full((4, 3), number, np.float32)
        gradient = np.full((4, 3, 3), -number, np.float32)
        status = Status(*(np.int32(number) for _ in Status._fields))
        frames.append(Frame(position, gradient, np.float32(number / 8), status, CARRIERS))
    return frames, [{"frame": number, "é": [0.5]} for number in range(last + 1)]


def same(one, other):
    return all(
        np.array_equal(a, b) for a, b in zip(*map(jax.tree.leaves, (one, other)), strict=True)
    )


def run(folder, saves=(2, 3, LAST)):
    """Computes up to the last frame from where the checkpoint is; the first frame that it has to
    compute."""
    checkpoint = MotionCheckpoint(folder, "a")
    found = checkpoint.restore(Counted(np.int32(0)))
    first = 0
    if found is not None:
        number, state, frames, metrics = found
        assert state.steps == number and same((frames, metrics), frames_until(number))
        first = number + 1
    for last in saves:
        if last >= first:
            checkpoint.save(Counted(np.int32(last)), *frames_until(last))
    return first


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept") / "checkpoint"
    assert run(folder) == 0
    return folder


@pytest.fixture
def folder(kept, tmp_path):
    return shutil.copytree(kept, tmp_path / "checkpoint")


def pieces(folder):
    return sorted(int(path.name) for path in (folder / "frames").iterdir())


def size(folder):
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def test_the_newest_state_comes_back_with_all_its_frames(folder, capsys):
    assert run(folder) == LAST + 1
    assert not capsys.readouterr().err


def test_a_frame_is_saved_once(tmp_path):
    checkpoint = MotionCheckpoint(tmp_path, "a")
    frames, metrics = frames_until(40)
    noise = np.random.default_rng(0)  # does not compress
    frames = [replace(frame, position=noise.normal(size=(1000, 3))) for frame in frames]
    sizes = []
    for last in (9, 19, 29, 39):
        checkpoint.save(Counted(np.int32(last)), frames[: last + 1], metrics[: last + 1])
        sizes.append(size(tmp_path / "frames" / str(last)))
    assert pieces(tmp_path) == [9, 19, 29, 39]
    assert max(sizes) < 1.05 * min(sizes) and min(sizes) > 9 * 1000 * 3 * 8
    assert len(list((tmp_path / "state").iterdir())) == 2


@pytest.mark.parametrize(
    ("broken", "first"),
    [
        ("state/7", 4),  # the state before, whose frames are all there
        ("frames/7", 4),
        ("frames/3", 0),  # a state whose frames are not all there is of no use
        ("frames/2", 0),
        ("state", 0),
        ("frames", 0),
    ],
)
def test_what_is_damaged_is_computed_again_and_said(folder, capsys, broken, first):
    victim = folder / broken
    for path in [path for path in victim.rglob("*") if path.is_file()]:
        content = path.read_bytes()
        path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    assert run(folder) == first
    told = capsys.readouterr().err
    assert "is not used, its" in told
    assert ("starts anew" if first == 0 else f"goes on from frame {first - 1}") in told
    assert run(folder) == LAST + 1 and pieces(folder)[-1] == LAST


def test_another_request_starts_anew(folder):
    assert MotionCheckpoint(folder, "b").restore(Counted(np.int32(0))) is None


def test_a_run_that_is_killed_anywhere_goes_on_to_the_same_frames(tmp_path, capsys):
    """The folder as it was before each change that Python makes in it while saving: a kill at that
    moment leaves exactly this."""
    folder, left = tmp_path / "checkpoint", []

    def changing(event, arguments):
        if event in CHANGES and watching and str(arguments[0]).startswith(str(folder)):
            watching.clear()  # the copy's own changes are none
            copy = tmp_path / f"{len(left):04d}"
            shutil.copytree(folder, copy, symlinks=True) if folder.is_dir() else copy.mkdir()
            left.append(copy)
            watching.append(True)

    watching = [True]
    sys.addaudithook(changing)  # cannot be taken away, so that it must be told to stop
    try:
        run(folder)
    finally:
        watching.clear()
    assert len(left) > 40
    firsts = {run(left[i]) for i in np.random.default_rng(0).choice(len(left), 12, replace=False)}
    assert {0, 3, 4} <= firsts
    for line in capsys.readouterr().err.splitlines():
        assert "not finished" in line or line.startswith("jaxphys: the simulation ")
