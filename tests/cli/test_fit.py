"""`jaxphys fit` from files to a result, stopped on the way and taken up again."""

import json

import numpy as np
import pytest

import jaxphys.pipeline.fit as fit_module
from jaxphys.cli.main import run
from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.ply import write_ply
from jaxphys.pipeline.fit import fit_file
from jaxphys.pipeline.frames import simulate
from jaxphys.scene.build import build
from jaxphys.scene.json import scene_from_json, to_json

MODULUS, SPEED = 3e3, 0.4
LATTICE = np.stack(np.meshgrid(*3 * [np.linspace(-1, 1, 5)], indexing="ij"), -1).reshape(-1, 3)


def block(grey):
    """A lattice of Gaussians."""
    return from_points(LATTICE.astype(np.float32), np.full((125, 3), grey), 0.3)


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """A folder with a block that is thrown at a floor, and its tracks; the fit starts elsewhere."""
    folder = tmp_path_factory.mktemp("fit")
    gaussians = block(0.5)
    write_ply(folder / "block.ply", gaussians)
    thing = {
        "source": "block.ply",
        "material": "elastic",
        "size": 0.4,
        "centre": [0.5, 0.5, 0.45],
        "velocity": [SPEED, 0.0, -1.0],
        "filling": None,
        "parameters": {"youngs_modulus": MODULUS, "density": 1000.0},
    }
    written = {
        "objects": [thing],
        "boundaries": [{"type": "plane", "point": [0, 0, 0.18], "friction": 0.2}],
        "domain": {"size": [1.0, 1.0, 1.0], "spacing": 0.1},
        "frame_time": 0.02,
        "frames": 9,
    }
    motion = simulate(build(scene_from_json(written), gaussians).simulation, 9)
    np.savez(folder / "tracks.npz", positions=motion.position, times=motion.time)
    thing |= {"velocity": [0.0, 0.0, -1.0], "parameters": {"density": 1000.0}}
    (folder / "scene.json").write_text(json.dumps(to_json(scene_from_json(written))))
    config = {
        "scene": "scene.json",
        "free": {
            "youngs_modulus": {"type": "log", "start": 2e3},
            "velocity": {"type": "free", "start": [0.0, 0.0, -1.0]},
        },
        "observed": [{"type": "tracks", "file": "tracks.npz", "noise": 0.001}],
    }
    (folder / "fit.json").write_text(json.dumps(config))
    return folder


def bytes_of(folder):
    files = sorted(p for p in folder.rglob("*") if p.is_file() and not p.name.startswith("."))
    return {str(p.relative_to(folder)): p.read_bytes() for p in files if p.suffix != ".mp4"}


def test_a_command_finds_what_moved_so(asked, capsys):
    assert run(["fit", str(asked / "fit.json"), "--out", str(asked / "found")]) == 0
    assert "youngs_modulus" in capsys.readouterr().out
    result = json.loads((asked / "found" / "result.json").read_text())
    assert result["values"]["youngs_modulus"] == pytest.approx(MODULUS, rel=0.02)
    np.testing.assert_allclose(result["values"]["velocity"], [SPEED, 0, -1], atol=0.01)
    made = {p.name for p in (asked / "found").iterdir()}
    assert {"values.npz", "history.jsonl", "curves.html", "comparison.mp4"} <= made
    page = (asked / "found" / "curves.html").read_text()
    assert (
        page.count("<svg") == 3
        and "youngs_modulus" in page
        and "http" not in page.split("<body>")[1]
    )


@pytest.mark.slow
def test_stopped_after_any_evaluation_it_ends_the_same(asked):
    """Each run is stopped at its second evaluation beyond what earlier ones have kept."""
    out, seen, stopped = asked / "again", [], 0

    def watch(evaluations):
        seen.append(evaluations)
        if len(seen) == 2:
            raise KeyboardInterrupt

    while True:
        seen.clear()
        try:
            fit_file(asked / "fit.json", out, watch=watch)
        except KeyboardInterrupt:
            stopped += 1
            continue
        break
    assert stopped >= 2
    assert bytes_of(out) == bytes_of(asked / "found")


def test_an_obstacles_mesh_lies_beside_the_scene_and_decides_the_request(
    asked, tmp_path, monkeypatch
):
    """From anywhere; the search, which has tests of its own, is left out."""
    scene = json.loads((asked / "scene.json").read_text())
    peg = {"type": "mesh", "source": "peg.obj", "centre": [0.8, 0.8, 0.3], "size": 0.1}
    scene["boundaries"].append(peg | {"resolution": 8})
    config = json.loads((asked / "fit.json").read_text()) | {"scene": "pegged.json"}
    (asked / "pegged.json").write_text(json.dumps(scene))
    (asked / "pegged_fit.json").write_text(json.dumps(config))
    monkeypatch.setattr(fit_module, "fit", stopped)
    monkeypatch.chdir(tmp_path)
    marks = []
    for height in (1, 2):
        corners = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {height}\n"
        (asked / "peg.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        with pytest.raises(KeyboardInterrupt):
            fit_file(asked / "pegged_fit.json", tmp_path / f"out{height}")
        marks.append((tmp_path / f"out{height}/.jaxphys-run").read_text())
    assert marks[0] != marks[1]


def test_a_runs_folder_is_a_scene(asked, tmp_path, monkeypatch):
    """With the splats that lie in it; they decide the request, as a file's do."""
    run_folder = tmp_path / "run"
    run_folder.mkdir()
    scene = json.loads((asked / "scene.json").read_text())
    del scene["objects"][0]["source"]
    (run_folder / "config.json").write_text(json.dumps(scene))
    config = json.loads((asked / "fit.json").read_text()) | {"scene": "run"}
    config["observed"][0]["file"] = str(asked / "tracks.npz")
    (tmp_path / "fit.json").write_text(json.dumps(config))
    monkeypatch.setattr(fit_module, "fit", stopped)
    with pytest.raises(InputError, match=r"run: holds neither gaussians\.ply"):
        fit_file(tmp_path / "fit.json", tmp_path / "none")
    marks = []
    for grey in (0.5, 0.6):
        write_ply(run_folder / "gaussians.ply", block(grey))
        with pytest.raises(KeyboardInterrupt):
            fit_file(tmp_path / "fit.json", tmp_path / f"out{grey}")
        marks.append((tmp_path / f"out{grey}/.jaxphys-run").read_text())
    assert marks[0] != marks[1]


def stopped(*_, **__):
    raise KeyboardInterrupt


def test_one_line_names_what_cannot_be_read(asked, capsys):
    config = json.loads((asked / "fit.json").read_text())
    config["free"]["young"] = config["free"].pop("youngs_modulus")
    (asked / "wrong.json").write_text(json.dumps(config))
    assert run(["fit", str(asked / "wrong.json"), "--out", str(asked / "none")]) == 2
    told = capsys.readouterr().err.strip()
    assert "young" in told and "youngs_modulus" in told and "\n" not in told
    assert not (asked / "none").exists()
