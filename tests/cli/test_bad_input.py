"""What users get wrong is answered with one line, status 2, and nothing on the disk."""

import json
import subprocess
import sys

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.ply import write_ply


@pytest.fixture
def ball(tmp_path):
    points = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    write_ply(tmp_path / "ball.ply", from_points(points, np.full(3, 0.5), 0.1))
    return tmp_path / "ball.ply"


def refused(capsys, out, *arguments):
    """The one line that a command with these arguments is refused with."""
    assert run([*map(str, arguments)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxphys: ")
    assert not out.exists() or not any(out.iterdir())
    return lines[0]


@pytest.fixture
def animate(capsys, tmp_path):
    out = tmp_path / "out"
    return lambda *arguments: refused(capsys, out, "animate", *arguments, "--out", out)


def config(tmp_path, value):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(value))
    return path


def test_unknown_material(animate, ball):
    assert "'jelly'" in animate(ball, "--material", "jely")


@pytest.mark.parametrize("name", ["none.ply", "none.glb", "ball.txt", "folder"])
def test_missing_or_foreign_object(animate, tmp_path, name):
    if name == "ball.txt":
        (tmp_path / name).write_text("hello")
    if name == "folder":
        (tmp_path / name).mkdir()
    assert name in animate(tmp_path / name, "--material", "jelly")


def test_no_object_at_all(animate):
    assert "OBJECT" in animate("--material", "jelly")


@pytest.mark.parametrize("content", [b"", b"ply\n", b"solid x", b"\x00" * 100])
def test_broken_splats(animate, tmp_path, content):
    (tmp_path / "x.ply").write_bytes(content)
    assert "x.ply" in animate(tmp_path / "x.ply", "--material", "jelly")


def test_truncated_splats(animate, ball):
    ball.write_bytes(ball.read_bytes()[:-100])
    assert "ball.ply" in animate(ball, "--material", "jelly")


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"youngs_modulus": 0}, ["youngs_modulus", "> 0"]),
        ({"youngs_modulus": -1e5}, ["youngs_modulus", "> 0"]),
        ({"poisson_ratio": 0.5}, ["poisson_ratio", "-1", "0.5"]),
        ({"density": -2}, ["density", "> 0"]),
        ({"yeld_stress": 1}, ["yeld_stress"]),
    ],
)
def test_parameters_out_of_range(animate, ball, tmp_path, parameters, words):
    line = animate(ball, "--config", config(tmp_path, {"objects": [{"parameters": parameters}]}))
    assert "objects[0].parameters" in line
    assert all(word in line for word in words)


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        ({"centre": [9, 0, 0]}, ["objects[0]", "domain"]),
        ({"size": 90}, ["objects[0]", "domain"]),
        ({"opacity_threshold": 1.0}, ["opacity_threshold"]),
        ({"area": [50, 51, 50, 51, 50, 51]}, ["area"]),
        ({"rotation": [{"axis": [0, 0, 0], "degrees": 3}]}, ["rotation[0].axis"]),
    ],
)
def test_objects_that_do_not_fit(animate, ball, tmp_path, thing, words):
    thing = {"filling": None} | thing
    line = animate(ball, "--config", config(tmp_path, {"objects": [thing]}))
    assert all(word in line for word in words)


def test_unstable_substep_names_the_largest_safe_one(animate, ball, tmp_path):
    scene = config(tmp_path, {"objects": [{"filling": None}]})
    assert "largest safe" in animate(ball, "--config", scene, "--substep", "1.0")


def test_numbers_of_the_command_line(animate, ball):
    assert "--frames" in animate(ball, "--frames", "0")
    assert "--width" in animate(ball, "--width", "1000000")
    assert "--splats" in animate(ball, "--splats", "-3")


def test_out_is_a_file(capsys, ball, tmp_path):
    scene = config(tmp_path, {"objects": [{"filling": None}]})
    before = ball.read_bytes()
    assert run(["animate", str(ball), "--config", str(scene), "--out", str(ball)]) == 2
    assert "is a file" in capsys.readouterr().err
    assert ball.read_bytes() == before


def test_other_commands(capsys, tmp_path, ball):
    out = tmp_path / "out"
    assert "none.glb" in refused(
        capsys, out, "splat", tmp_path / "none.glb", "--out", tmp_path / "a.ply"
    )
    assert ".ply or .splat" in refused(capsys, out, "splat", ball, "--out", tmp_path / "a.glb")
    assert "none.ply" in refused(
        capsys, out, "render", tmp_path / "none.ply", "--out", tmp_path / "a.png"
    )
    assert "--views" in refused(capsys, out, "render", ball, "--out", out, "--views", "0")
    assert "prompt" in refused(capsys, out, "generate", "  ", "--out", out)
    assert "none.json" in refused(capsys, out, "plan", tmp_path / "none.json")
    assert not (tmp_path / "a.ply").exists() and not (tmp_path / "a.png").exists()


def test_the_command_itself_prints_no_traceback(tmp_path):
    command = [sys.executable, "-m", "jaxphys", "plan", str(tmp_path / "none.json")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "none.json: no such file" in done.stderr
