"""What `--out` names is written; nothing else is, and nothing of others is replaced."""

import json
import os

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.ply import write_ply

SCENE = {
    "objects": [{"size": 0.4, "centre": [0.5, 0.5, 0.5], "filling": None}],
    "domain": {"size": [1.0, 1.0, 1.0], "spacing": 1 / 14},
    "frames": 2,
    "frame_time": 0.01,
    "width": 32,
    "height": 24,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A ball, its scene, and a finished run of both."""
    folder = tmp_path_factory.mktemp("out")
    points = np.random.default_rng(0).normal(size=(40, 3)).astype(np.float32)
    write_ply(folder / "ball.ply", from_points(points, np.full(3, 0.5), 0.3))
    (folder / "scene.json").write_text(json.dumps(SCENE))
    assert animate(folder, folder / "run", "--save-splats") == 0
    return folder


def animate(folder, out, *options, ball="ball.ply"):
    return run(["animate", f"{folder / ball}", "--config", f"{folder / 'scene.json'}",
                "--out", f"{out}", *options])  # fmt: skip


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused(capsys, status, word):
    lines = capsys.readouterr().err.strip().splitlines()
    assert status == 2 and len(lines) == 1 and lines[0].startswith("jaxphys: ")
    assert word in lines[0]


@pytest.mark.parametrize("options", [(), ("--overwrite",)])
@pytest.mark.parametrize(
    "name", ["splats/0000.ply", "checkpoint/thesis.tex", "motion.mp4", "metrics.jsonl", "notes.txt"]
)
def test_a_folder_of_others_is_left_alone(folder, tmp_path, capsys, name, options):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("mine")
    refused(capsys, animate(folder, tmp_path, *options), name.split("/")[0])
    assert contents(tmp_path) == {tmp_path / name: b"mine"}


def test_an_input_in_the_folder_is_left_alone(folder, capsys):
    before = contents(folder)
    for name in ("gaussians.ply", "splats/0001.ply"):
        status = animate(folder, folder / "run", "--overwrite", "--seed", "3", ball=f"run/{name}")
        refused(capsys, status, name)
    config = ["--config", f"{folder / 'run/config.json'}", "--seed", "3", "--overwrite"]
    for command in (["animate", f"{folder / 'ball.ply'}"], ["generate", "a can"]):
        status = run([*command, *config, "--out", f"{folder / 'run'}"])
        refused(capsys, status, "config.json: is read by this run")
    assert contents(folder) == before


def test_the_current_folder_is_refused(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(capsys, animate(folder, ""), "current folder")
    refused(capsys, run(["render", f"{folder / 'ball.ply'}", "--out", ""]), "current folder")
    assert not list(tmp_path.iterdir())


def test_another_request_and_the_same(folder, capsys):
    known = contents(folder / "run")
    refused(capsys, animate(folder, folder / "run", "--seed", "3"), "--overwrite")
    assert contents(folder / "run") == known
    assert animate(folder, folder / "run", "--save-splats") == 0
    again = contents(folder / "run")
    del known[folder / "run/timing.json"], again[folder / "run/timing.json"]
    assert again == known


def test_overwriting_takes_what_the_run_before_made_and_only_this(folder, tmp_path):
    out = tmp_path / "out"
    assert animate(folder, out, "--save-splats") == 0
    (out / "notes.txt").write_text("mine")
    assert animate(folder, out, "--seed", "3", "--overwrite") == 0
    assert not (out / "splats").exists() and (out / "notes.txt").read_text() == "mine"
    assert not list(out.rglob(".jaxphys-[0-9]*"))


def test_a_picture_that_is_there(folder, tmp_path, capsys):
    picture = tmp_path / "a.png"
    render = ["render", f"{folder / 'ball.ply'}", "--width", "32", "--height", "24",
              "--out", f"{picture}"]  # fmt: skip
    picture.write_text("mine")
    refused(capsys, run(render), "a.png: is there already; --overwrite")
    assert picture.read_text() == "mine"
    assert run([*render, "--overwrite"]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    picture.unlink()
    os.mkfifo(picture)
    refused(capsys, run([*render, "--overwrite"]), "is no file")
    picture.unlink()
    picture.symlink_to(folder / "ball.ply")
    refused(capsys, run([*render, "--overwrite"]), "is a link")
    refused(capsys, run(["image", "x", "--out", f"{picture}"]), "is a link")


def test_a_turn_owns_its_folder(folder, tmp_path, capsys):
    render = ["render", f"{folder / 'ball.ply'}", "--width", "32", "--height", "24", "--views"]
    (tmp_path / "0001.png").write_text("mine")
    refused(capsys, run([*render, "2", "--out", f"{tmp_path}"]), "0001.png")
    assert run([*render, "3", "--out", f"{tmp_path / 'turn'}"]) == 0
    refused(capsys, run([*render, "2", "--out", f"{tmp_path / 'turn'}"]), "--overwrite")
    assert run([*render, "2", "--out", f"{tmp_path / 'turn'}", "--overwrite"]) == 0
    assert sorted(path.name for path in (tmp_path / "turn").glob("*.png")) == [
        "0000.png", "0001.png"
    ]  # fmt: skip


def test_what_is_read_is_never_written(folder, capsys):
    before = contents(folder)
    ball = f"{folder / 'ball.ply'}"
    refused(capsys, run(["splat", ball, "--out", ball]), "is what is read")
    refused(capsys, run(["splat", ball, "--out", ball, "--overwrite"]), "is what is read")
    assert contents(folder) == before
