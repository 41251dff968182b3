"""A run writes into its own folder and touches nothing that is not its own."""

import fcntl
import json
import os
import subprocess
import sys

import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.run_folder import MARK, added_file, run_folder

NAMES = ("a.txt", "sub/b.txt", "tree/")


def make(path, identity="one", names=NAMES, text="made", **options):
    """A run that writes all its files."""
    with run_folder(path, identity, names, **options) as folder:
        for name in names:
            if name.endswith("/"):
                folder.file(name).mkdir(exist_ok=True)
                (folder.path / name / "c.txt").write_text(text)
            else:
                folder.file(name).parent.mkdir(exist_ok=True)
                folder.file(name).write_text(text)
    return path


def contents(path):
    return {
        entry.relative_to(path).as_posix(): entry.read_bytes()
        for entry in path.rglob("*")
        if entry.is_file() and entry.name != MARK
    }


def refused(path, match, identity="one", **options):
    """The run is refused with one line, and the folder is as it was."""
    before = contents(path) if os.path.isdir(path) else None
    with pytest.raises(InputError, match=match) as error:
        make(path, identity, **options)
    assert "\n" not in str(error.value) and len(str(error.value)) < 400
    assert before == (contents(path) if os.path.isdir(path) else None)


@pytest.mark.parametrize("there", [False, True])
def test_a_new_and_an_empty_folder_are_taken(tmp_path, there):
    out = tmp_path / "deep/out"
    if there:
        out.mkdir(parents=True)
    make(out)
    assert set(contents(out)) == {"a.txt", "sub/b.txt", "tree/c.txt"}


def test_what_is_refused_later_leaves_everything_as_it_was(tmp_path):
    for out in (tmp_path / "deep/out", tmp_path / "there"):
        if out.name == "there":
            out.mkdir()
        with pytest.raises(InputError, match="bad"), run_folder(out, "one", NAMES):
            raise InputError("bad")
    assert [path.name for path in tmp_path.iterdir()] == ["there"]
    assert not list((tmp_path / "there").iterdir())


@pytest.mark.parametrize("name", ["splats/0000.ply", "checkpoint/x", "motion.mp4", ".hidden"])
def test_a_folder_with_files_of_others_is_refused_by_name(tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("mine")
    for overwrite in (False, True):
        refused(tmp_path, f"{tmp_path}: holds '{name.split('/')[0]}'", overwrite=overwrite)


def test_the_same_request_may_be_repeated(tmp_path):
    make(tmp_path)
    make(tmp_path, text="again")
    assert set(contents(tmp_path).values()) == {b"again"}


def test_another_request_replaces_only_what_a_run_made_and_only_if_told(tmp_path):
    make(tmp_path)
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / "sub/mine.txt").write_text("mine")
    refused(tmp_path, "another request.*--overwrite", "two")
    make(tmp_path, "two", ["z.txt"], overwrite=True)
    assert contents(tmp_path) == {
        "z.txt": b"made", "mine.txt": b"mine", "sub/mine.txt": b"mine"
    }  # fmt: skip


def test_nothing_of_the_old_run_goes_before_the_new_one_makes_something(tmp_path):
    make(tmp_path)
    before = contents(tmp_path)
    options = {"overwrite": True}
    with pytest.raises(InputError), run_folder(tmp_path, "two", NAMES, **options):
        raise InputError("bad")
    assert contents(tmp_path) == before
    make(tmp_path)  # and it still is the first one's


def test_a_file_of_others_in_the_way(tmp_path):
    make(tmp_path, names=["a.txt"])
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/b.txt").write_text("mine")
    refused(tmp_path, "sub/b.txt: is in the way and no run made it")
    (tmp_path / "sub/b.txt").unlink()
    (tmp_path / "tree").mkdir()
    refused(tmp_path, "tree/?: is in the way", overwrite=True)


@pytest.mark.parametrize("name", ["a.txt", "sub", "tree"])
def test_links_in_place_of_what_was_made_are_not_followed(tmp_path, name):
    out = make(tmp_path / "out")
    (out / name).rename(tmp_path / "moved")
    (out / name).symlink_to(tmp_path / "moved")
    refused(out, f"{name}: is not what a run makes")
    make(out, "two", ["z.txt"], overwrite=True)
    held = contents(tmp_path / "moved") if name != "a.txt" else [(tmp_path / "moved").read_text()]
    assert len(held) == 1  # what the link leads to is as it was


@pytest.mark.parametrize("name", ["a.txt", "tree/c.txt"])
def test_an_input_is_never_replaced(tmp_path, name):
    make(tmp_path)
    refused(tmp_path, f"{name}: is read by this run", inputs=[tmp_path / name])
    refused(
        tmp_path, f"{name}: is read", "two", names=["z"], overwrite=True, inputs=[tmp_path / name]
    )
    (tmp_path / "mine.txt").write_text("mine")
    make(tmp_path, "two", ["z"], overwrite=True, inputs=[tmp_path / "mine.txt"])
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_what_is_no_folder(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("mine")
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "nowhere").symlink_to(tmp_path / "gone")
    (tmp_path / "round").symlink_to(tmp_path / "round")
    refused(tmp_path / "file", "is a file")
    refused(tmp_path / "file/below", "cannot be written")
    refused(tmp_path / "fifo", "is no folder")
    refused(tmp_path / "nowhere", "leads nowhere")
    refused(tmp_path / "round", "leads nowhere")
    refused(tmp_path / ("x" * 300), "cannot be")
    monkeypatch.chdir(tmp_path)
    for current in ("", "."):
        with pytest.raises(InputError, match="is the current folder"):
            make(current)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_link_to_a_folder_is_that_folder(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    make(tmp_path / "link")
    assert (tmp_path / "real/a.txt").exists()


def test_a_folder_that_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # who runs tests may be root
    refused(tmp_path, "cannot be written")


def test_two_runs_at_once(tmp_path):
    with run_folder(tmp_path, "one", NAMES):
        refused(tmp_path, "another run is writing there")
        refused(tmp_path, "another run is writing there", "two", overwrite=True)
    make(tmp_path)


def test_a_killed_run_leaves_no_lock_and_what_it_left_aside_goes(tmp_path):
    """Also where it was killed amid the line that notes a file."""
    code = (
        "import os, sys; from pathlib import Path; from jaxphys.core.files import aside_path\n"
        "from jaxphys.core.run_folder import run_folder\n"
        "with run_folder(sys.argv[1], 'one', ['a.txt', 'sub/b.txt', 'tree/']) as folder:\n"
        "    aside_path(folder.file('a.txt')).write_text('half')\n"
        "    path = folder.file('sub/b.txt'); path.parent.mkdir()\n"
        "    aside_path(path).write_text('half'); os.kill(os.getpid(), 9)\n"
    )
    assert subprocess.run([sys.executable, "-c", code, tmp_path]).returncode == -9
    assert len(contents(tmp_path)) == 2
    with (tmp_path / MARK).open("a") as mark:
        mark.write('"tre')
    make(tmp_path)
    assert set(contents(tmp_path)) == {"a.txt", "sub/b.txt", "tree/c.txt"}
    make(tmp_path, "two", ["z"], overwrite=True)
    assert set(contents(tmp_path)) == {"z"}


@pytest.mark.parametrize(
    "text",
    [
        b"x\n", b"\xff\xfe\n", b"[]\n", b'{"identity": 3}\n', b'{"identity": "one"}\n3\n',
        b'{"identity": "one"}\n"../mine.txt"\n', b'{"identity": "one"}\n"/etc/hosts"\n',
        b'{"identity": "one"}\n"sub/../../mine.txt"\n', b'{"identity": "one"}\n""\n',
        b"[" * 100_000 + b"\n",
    ],
)  # fmt: skip
def test_a_mark_that_is_damaged_or_names_files_elsewhere(tmp_path, text):
    out = make(tmp_path / "out")
    (tmp_path / "mine.txt").write_text("mine")
    (out / MARK).write_bytes(text)
    refused(out, "is damaged", "two", overwrite=True)
    assert (tmp_path / "mine.txt").exists()


@pytest.mark.parametrize("kind", ["fifo", "folder", "link"])
def test_a_mark_that_is_no_file(tmp_path, kind):
    mark = tmp_path / MARK
    if kind == "link":
        (tmp_path / "z").write_text(json.dumps({"identity": "one"}) + "\n")
        mark.symlink_to(tmp_path / "z")
    else:
        os.mkfifo(mark) if kind == "fifo" else mark.mkdir()
    refused(tmp_path, "is no file of a run")


def test_only_declared_files_are_made(tmp_path):
    with run_folder(tmp_path, "one", NAMES) as folder, pytest.raises(ValueError, match="declared"):
        folder.file("other.txt")


def test_removing_takes_what_was_made(tmp_path):
    with run_folder(tmp_path, "one", NAMES) as folder:
        folder.file("a.txt").write_text("")
        folder.file("tree/").mkdir()
        folder.remove(*NAMES)
    assert contents(tmp_path) == {} and not (tmp_path / "tree").exists()


def test_a_file_is_added_to_a_run(tmp_path):
    make(tmp_path)
    for text in "ab":
        with added_file(tmp_path, "score.json") as path:
            path.write_text(text)
            with (tmp_path / MARK).open() as mark, pytest.raises(BlockingIOError):
                fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
    make(tmp_path)  # it still is the same request's
    make(tmp_path, "two", ["z"], overwrite=True)
    assert set(contents(tmp_path)) == {"z"}
    (tmp_path / "score.json").write_text("mine")
    with pytest.raises(InputError, match="in the way"), added_file(tmp_path, "score.json"):
        pass


def test_a_file_is_added_to_a_folder_without_a_mark(tmp_path):
    for overwrite in (False, True):
        with added_file(tmp_path, "score.json", overwrite=overwrite) as path:
            path.write_text("")
    with pytest.raises(InputError, match="--overwrite"), added_file(tmp_path, "score.json"):
        pass
