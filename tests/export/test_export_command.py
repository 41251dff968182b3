"""`jaxphys export`: from a file and from a run to every format, and what it refuses."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.core.errors import InputError
from jaxphys.export import FORMATS, read_compressed_ply, read_spz
from jaxphys.gaussians import from_points, read_ply, read_splat, write_ply, write_splat
from jaxphys.pipeline.export import chosen_frames
from tests.export.test_gltf import read_glb
from tests.export.test_usd import parsed

BALL = Path(__file__).parents[1] / "data" / "ball.ply"
SCENE = {
    "objects": [{"size": 0.4, "centre": [0.5, 0.5, 0.5], "velocity": [0, 0, -1], "filling": None}],
    "domain": {"size": [1.0, 1.0, 1.0], "spacing": 1 / 14},
    "frames": 3,
    "frame_time": 0.01,
    "fps": 12,
    "width": 32,
    "height": 24,
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A finished run that kept its frames, and the same one that did not."""
    folder = tmp_path_factory.mktemp("runs")
    points = np.random.default_rng(0).normal(size=(40, 3)).astype(np.float32)
    sizes = np.full((40, 3), [0.3, 0.2, 0.1])
    write_ply(folder / "ball.ply", from_points(points, np.full(3, 0.5), sizes))
    (folder / "scene.json").write_text(json.dumps(SCENE))
    command = ["animate", f"{folder / 'ball.ply'}", "--config", f"{folder / 'scene.json'}"]
    assert run([*command, "--out", f"{folder / 'kept'}", "--save-splats"]) == 0
    shutil.copytree(folder / "kept", folder / "bare")
    shutil.rmtree(folder / "bare" / "splats")
    return folder


def export(source, to, *options):
    return run(["export", str(source), "--to", to, *map(str, options)])


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused(capsys, status, words):
    lines = capsys.readouterr().err.strip().splitlines()
    assert status == 2 and len(lines) == 1 and lines[0].startswith("jaxphys: ")
    assert words in lines[0]


@pytest.mark.parametrize("to", FORMATS)
def test_a_file_becomes_a_file(tmp_path, capsys, to):
    shutil.copy(BALL, tmp_path / "ball.ply")
    out = tmp_path / f"out{FORMATS[to].suffix}"
    assert export(tmp_path / "ball.ply", to, "--out", out) == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert sorted(contents(tmp_path)) == sorted(["ball.ply", out.name])
    given = read_ply(BALL)
    means = {
        "ply": lambda: read_ply(out).means,
        "compressed-ply": lambda: read_compressed_ply(out).means,
        "spz": lambda: read_spz(out).means,
        "gltf": lambda: read_glb(out)[2]["POSITION"],
        "usd": lambda: parsed(out)[2]["positions"][1][None].reshape(-1, 3),
    }[to]()
    assert len(means) == given.count
    # Whatever the order and the upward axis.
    lengths = np.sort(np.linalg.norm(np.asarray(means), axis=1))
    wanted = np.sort(np.linalg.norm(np.asarray(given.means), axis=1))
    np.testing.assert_allclose(lengths, wanted, atol=2e-3)


def test_the_default_stands_beside_the_file(tmp_path):
    shutil.copy(BALL, tmp_path / "ball.ply")
    assert export(tmp_path / "ball.ply", "spz") == 0
    assert (tmp_path / "ball.spz").exists()


@pytest.mark.parametrize("to", ["ply", "compressed-ply", "gltf", "spz"])
def test_a_run_becomes_numbered_files(runs, tmp_path, to):
    out = tmp_path / "out"
    assert export(runs / "kept", to, "--out", out) == 0
    names = [f"frame{i:04d}{FORMATS[to].suffix}" for i in range(3)]
    made = contents(out)
    assert sorted(made) == sorted([".jaxphys-run", *names])
    # And once more, over what is there: the same request, the same bytes.
    assert export(runs / "kept", to, "--out", out) == 0
    assert contents(out) == made


def test_a_run_becomes_one_usd_with_time_samples(runs, tmp_path):
    out = tmp_path / "run.usda"
    assert export(runs / "kept", "usd", "--out", out) == 0
    _, settings, attributes = parsed(out)
    assert settings["timeCodesPerSecond"] == "12" and settings["endTimeCode"] == "2"
    samples = attributes["positions"][1]
    assert sorted(samples) == [0, 1, 2]
    for number, sample in samples.items():
        kept = read_ply(runs / "kept" / "splats" / f"{int(number):04d}.ply")
        np.testing.assert_array_equal(sample.reshape(-1, 3), kept.means)


def test_a_run_without_frames_is_simulated_again(runs, tmp_path, capsys):
    """To the same motion; a range of frames keeps its numbers."""
    assert export(runs / "bare", "ply", "--out", tmp_path / "b", "--frames", "1:") == 0
    assert "--save-splats" in capsys.readouterr().err
    assert export(runs / "kept", "ply", "--out", tmp_path / "k", "--frames", "1:") == 0
    bare, kept = contents(tmp_path / "b"), contents(tmp_path / "k")
    assert sorted(bare) == [".jaxphys-run", "frame0001.ply", "frame0002.ply"]
    assert bare.keys() == kept.keys()
    for name in ("frame0001.ply", "frame0002.ply"):
        assert bare[name] == kept[name]


def test_one_frame_is_one_file(runs, tmp_path):
    out = tmp_path / "one.spz"
    assert export(runs / "kept", "spz", "--frames", "2", "--out", out) == 0
    kept = read_ply(runs / "kept" / "splats" / "0002.ply")
    np.testing.assert_allclose(read_spz(out).means, kept.means, atol=2e-5)
    assert export(runs / "kept", "spz", "--frames", "2") == 0
    assert (runs / "kept-0002.spz").read_bytes() == out.read_bytes()


def test_the_folder_that_one_stands_in(runs, tmp_path, monkeypatch):
    shutil.copytree(runs / "kept", tmp_path / "run")
    monkeypatch.chdir(tmp_path / "run")
    assert export(".", "spz", "--frames", "0:1") == 0
    assert (tmp_path / "run-spz" / "frame0000.spz").exists()


def test_a_splat_file_is_read(tmp_path):
    given = read_ply(BALL)
    write_splat(tmp_path / "a.splat", given)
    assert export(tmp_path / "a.splat", "ply") == 0
    got = read_ply(tmp_path / "a.ply")
    assert got.count == given.count and got.degree == 0
    np.testing.assert_array_equal(got.means, read_splat(tmp_path / "a.splat").means)


def test_nothing_of_others_is_replaced(runs, tmp_path, capsys):
    shutil.copy(BALL, tmp_path / "ball.ply")
    (tmp_path / "a.spz").write_text("mine")
    refused(capsys, export(tmp_path / "ball.ply", "spz", "--out", tmp_path / "a.spz"), "there")
    assert (tmp_path / "a.spz").read_text() == "mine"
    options = ("--out", tmp_path / "a.spz", "--overwrite")
    assert export(tmp_path / "ball.ply", "spz", *options) == 0
    assert read_spz(tmp_path / "a.spz").count
    capsys.readouterr()
    refused(capsys, export(tmp_path / "ball.ply", "ply", "--overwrite"), "is what is read")
    # A folder of others, and the run's own.
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "frame0000.spz").write_text("mine")
    options = ("--out", tmp_path / "mine", "--overwrite")
    refused(capsys, export(runs / "kept", "spz", *options), "no run made")
    before = contents(runs / "kept")
    for options in ([], ["--overwrite"]):
        command = ["--out", runs / "kept", *options]
        refused(capsys, export(runs / "kept", "spz", *command), "kept")
    assert contents(runs / "kept") == before
    assert contents(tmp_path / "mine") == {"frame0000.spz": b"mine"}


def test_another_format_needs_to_be_told_to_replace(runs, tmp_path, capsys):
    assert export(runs / "kept", "spz", "--out", tmp_path / "out") == 0
    capsys.readouterr()
    refused(capsys, export(runs / "kept", "ply", "--out", tmp_path / "out"), "--overwrite")
    assert export(runs / "kept", "ply", "--out", tmp_path / "out", "--overwrite") == 0
    names = [".jaxphys-run", *(f"frame000{i}.ply" for i in range(3))]
    assert sorted(contents(tmp_path / "out")) == names


def test_another_object_of_the_same_scene_is_another_request(runs, tmp_path, capsys):
    shutil.copytree(runs / "kept", tmp_path / "run")
    assert export(tmp_path / "run", "spz", "--out", tmp_path / "out") == 0
    shutil.copy(tmp_path / "run" / "splats" / "0002.ply", tmp_path / "run" / "gaussians.ply")
    capsys.readouterr()
    refused(capsys, export(tmp_path / "run", "spz", "--out", tmp_path / "out"), "another request")


def test_what_fails_half_way_leaves_no_frame(runs, tmp_path, capsys):
    shutil.copytree(runs / "kept", tmp_path / "run")
    last = tmp_path / "run" / "splats" / "0002.ply"
    last.write_bytes(last.read_bytes()[:-3])
    for to, out in (("spz", "out"), ("usd", "out.usda")):
        assert export(tmp_path / "run", to, "--out", tmp_path / out) == 2
        assert "cut off" in capsys.readouterr().err.splitlines()[-1]
    assert sorted(contents(tmp_path / "out")) == [".jaxphys-run"]
    assert not (tmp_path / "out.usda").exists()
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".jaxphys-")]


@pytest.mark.parametrize(
    ("source", "options", "words"),
    [
        ("none.ply", [], "no such file"),
        ("folder", [], "config.json"),
        ("a.txt", [], "neither splats"),
        ("a.ply", [], "not a .ply"),
        ("a.spz", [], "no SPZ file"),
        ("a.splat", [], "no whole number"),
        ("ball.ply", ["--frames", "0:1"], "one frame"),
        ("ball.ply", ["--out", "x.glb"], ".spz"),
        ("kept", ["--out", "x.spz"], "name a folder"),
        ("kept", ["--frames", "2:1"], "frames 0 to 2"),
        ("kept", ["--frames", "3"], "frames 0 to 2"),
        ("kept", ["--frames", "0:9"], "frames 0 to 2"),
        ("kept", ["--frames", "x"], "a:b"),
        ("kept", ["--frames", "-1:"], "a:b"),
    ],
)
def test_bad_input_is_one_line(runs, tmp_path, capsys, monkeypatch, source, options, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    for name in ("a.txt", "a.ply", "a.spz", "a.splat"):
        (tmp_path / name).write_text("hello")
    shutil.copy(BALL, tmp_path / "ball.ply")
    before = sorted(tmp_path.iterdir())
    path = runs / "kept" if source == "kept" else tmp_path / source
    options = [f"--frames={options[1]}"] if options[:1] == ["--frames"] else options
    refused(capsys, export(path, "spz", *options), words)
    assert sorted(tmp_path.iterdir()) == before


def test_frames_are_chosen_as_slices_are():
    assert chosen_frames(None, 5) == (range(5), False)
    assert chosen_frames("1:3", 5) == (range(1, 3), False)
    assert chosen_frames(":3", 5) == (range(3), False)
    assert chosen_frames("3:", 5) == (range(3, 5), False)
    assert chosen_frames("4", 5) == (range(4, 5), True)
    assert chosen_frames(":", 5) == (range(5), False)
    for bad in ("", "5", "5:", "0:6", "1:1", "1:2:3", "a", "٣", "1" * 12):
        with pytest.raises(InputError):
            chosen_frames(bad, 5)


def test_the_table_of_the_documents_is_that_of_the_program():
    text = (Path(__file__).parents[2] / "docs" / "formats.md").read_text()
    for name, form in FORMATS.items():
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{name}` |")]
        assert f"| {form.up} |" in row and row.endswith(f"| {form.loses} |")
        assert f"`{form.suffix}`" in row
