"""A run of two objects and an obstacle, taken up by every command that reads a run's folder."""

import dataclasses
import json
import shutil

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.gaussians.harmonics import rgb_to_dc
from jaxphys.gaussians.ply import write_ply
from jaxphys.mpm.boundaries import Ball, MeshObstacle
from jaxphys.pipeline.replay import replay
from jaxphys.scene.json import write_scene
from tests.pipeline.test_animate import small_scene, sphere

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
RESULTS = ("motion.mp4", "metrics.jsonl", "gaussians.ply", "gaussians_1.ply", "obstacle_1.ply")


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """A folder with a scene and the files that it names; colours of one object leave [0, 1]. One
    frame: no step is compiled."""
    folder = tmp_path_factory.mktemp("asked")
    gaudy = 2 * np.random.default_rng(0).random((200, 1, 3)).astype(np.float32) - 0.5
    ball = sphere()
    write_ply(folder / "plain.ply", ball)
    write_ply(folder / "gaudy.ply", dataclasses.replace(ball, harmonics=rgb_to_dc(gaudy)))
    (folder / "peg.obj").write_text(TETRAHEDRON)
    scene = small_scene(frames=1)
    (thing,) = scene.objects
    things = (
        dataclasses.replace(thing, source="plain.ply", size=0.25, centre=(0.35, 0.5, 0.5)),
        dataclasses.replace(thing, source="gaudy.ply", size=0.25, centre=(0.65, 0.5, 0.5)),
    )
    pegs = (
        MeshObstacle((0.5, 0.5, 0.25), source="peg.obj", size=0.1, resolution=8),
        Ball((0.5, 0.75, 0.75), radius=0.05),
    )
    scene = dataclasses.replace(scene, objects=things, boundaries=(*scene.boundaries, *pegs))
    write_scene(folder / "scene.json", scene)
    return folder


@pytest.fixture(scope="module")
def finished(asked, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "first"
    command = ["animate", "--config", f"{asked / 'scene.json'}", "--out", f"{out}", "--quiet"]
    assert run([*command, "--save-splats"]) == 0
    return out


def test_a_runs_folder_is_its_whole_scene(finished, tmp_path, monkeypatch):
    """From anywhere: the second object and the obstacle are beside the run's config.json."""
    monkeypatch.chdir(tmp_path)
    assert run(["animate", f"{finished}", "--out", "again", "--quiet"]) == 0
    for name in RESULTS:
        assert (tmp_path / "again" / name).read_bytes() == (finished / name).read_bytes()


def test_what_a_page_shows_is_the_film_whether_splats_were_kept_or_not(finished, tmp_path):
    kept = replay(finished)
    bare = shutil.copytree(finished, tmp_path / "bare")
    shutil.rmtree(bare / "splats")
    again = replay(bare)
    assert kept.moving.colours == pytest.approx(again.moving.colours, abs=1e-6)
    assert kept.moving.means == pytest.approx(again.moving.means, abs=1e-6)
    for one, other in ((kept.view, again.view), (kept.surroundings, again.surroundings)):
        assert one.keys() == other.keys()
        for name in one:
            np.testing.assert_allclose(one[name], other[name], atol=1e-4, err_msg=name)
    # The plain object's colours are valid and stay; the obstacle's, shaded, are those that
    # the scene says.
    assert kept.moving.colours[:200] == pytest.approx(np.clip(_colours(200), 0, 1), abs=1e-5)
    assert kept.moving.colours[-1] == pytest.approx((0.45, 0.5, 0.58), abs=0.05)


def _colours(count):
    """Those of `sphere`."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    ring = np.sqrt(1 - z**2)
    return 0.5 * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1) + 0.5


def planned(capsys, *arguments):
    assert run(["plan", *map(str, arguments), "--no-measure", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    return {name: value for name, value in told.items() if name != "room"}


def test_a_plan_is_of_the_scene_that_animate_would_run(asked, finished, capsys):
    whole = planned(capsys, finished)
    assert whole == planned(capsys, finished / "config.json")
    coarse = ("--set", "domain.spacing=0.2")
    thing = planned(capsys, asked / "plain.ply", "--material", "sand", *coarse)
    assert thing == planned(capsys, "--material", "sand", "--object", asked / "plain.ply", *coarse)
    assert "material sand" in thing["included"] and thing["gaussians"] > 200


def test_an_object_named_twice_is_refused(asked, capsys):
    thing = f"{asked / 'plain.ply'}"
    assert run(["plan", thing, "--object", thing]) == 2
    assert "--object" in capsys.readouterr().err


def test_another_material_comes_without_the_first_ones_law_and_regions(asked, capsys):
    """A region of other fracture strain, and a law that sand has not."""
    scene = small_scene(frames=2)
    (thing,) = scene.objects
    odd = {"law": "neo-Hookean", "filling": None}
    write_scene(
        asked / "odd.json",
        dataclasses.replace(scene, objects=(dataclasses.replace(thing, **odd),)),
    )
    planned(capsys, asked / "odd.json", "--material", "sand")


def test_steps_by_name_replace_the_step_of_the_file(asked, capsys, tmp_path):
    scene = small_scene(frames=1, substep=1e-4)
    write_scene(asked / "step.json", scene)
    command = ["animate", f"{asked / 'plain.ply'}", "--config", f"{asked / 'step.json'}", "--quiet"]
    assert run([*command, "--stepping", "adaptive", "--out", f"{tmp_path / 'out'}"]) == 0
    written = json.loads((tmp_path / "out/config.json").read_text())
    assert written["substep"] is None and written["stepping"]["type"] == "adaptive"
    assert written["objects"][0]["filling"] is None
