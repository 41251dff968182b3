import dataclasses
import json

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.mesh import write_triangles
from jaxphys.gaussians.ply import read_ply, write_ply
from jaxphys.mpm.loop.status import SimulationError
from jaxphys.pipeline.animate import animate
from jaxphys.scene import (
    Domain,
    Filling,
    Ground,
    MeshObstacle,
    Object,
    Plane,
    Scene,
    read_scene,
)

FILES = (
    "config.json",
    "gaussians.ply",
    "motion.mp4",
    "metrics.jsonl",
    "contact_sheet.png",
    "report.html",
)


def sphere(count=200):
    """A coloured sphere of Gaussians."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    ring = np.sqrt(1 - z**2)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return from_points(points.astype(np.float32), 0.5 * points + 0.5, 0.12)


def small_scene(**changes):
    thing = Object(
        material="jelly",
        parameters={"youngs_modulus": 2e3},
        size=0.4,
        centre=(0.5, 0.5, 0.5),
        velocity=(0.0, 0.0, -1.0),
        filling=None,
    )
    scene = Scene(
        objects=(thing,),
        boundaries=(Plane((0.5, 0.5, 0.2)),),
        domain=Domain((1.0, 1.0, 1.0), 1 / 14),
        frames=4,
        frame_time=0.02,
        width=64,
        height=48,
        ground=Ground(0.2),
    )
    return dataclasses.replace(scene, **changes)


def contents(directory):
    return {name: (directory / name).read_bytes() for name in FILES}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """An uninterrupted run, with every frame's splats."""
    out = tmp_path_factory.mktemp("runs") / "whole"
    return animate(small_scene(), out, objects=(sphere(),), save_splats=True)


def test_a_run_leaves_everything_it_promises(finished):
    assert all((finished / name).stat().st_size > 0 for name in FILES)
    assert not (finished / "checkpoint").exists()
    rows = [json.loads(line) for line in (finished / "metrics.jsonl").read_text().splitlines()]
    assert [row["frame"] for row in rows] == [0, 1, 2, 3]
    assert rows[3]["time"] == pytest.approx(0.06, rel=1e-4)
    assert rows[0]["momentum"][2] == pytest.approx(-rows[0]["mass"], rel=1e-4)
    assert len({row["mass"] for row in rows}) == 1
    timing = json.loads((finished / "timing.json").read_text())
    assert {"simulate", "render"} <= set(timing["stages"]) & set(timing["compile"])
    splats = sorted((finished / "splats").iterdir())
    assert [path.name for path in splats] == ["0000.ply", "0001.ply", "0002.ply", "0003.ply"]


def test_splats_move_as_the_metrics_say(finished):
    first, last = (read_ply(finished / "splats" / f"000{i}.ply") for i in (0, 3))
    assert np.asarray(first.means).mean(axis=0) == pytest.approx((0.5, 0.5, 0.5), abs=0.02)
    # Falls at 1 m/s for 0.06 s, and gravity adds g t^2 / 2 = 0.018 m.
    drop = np.asarray(first.means)[:, 2].mean() - np.asarray(last.means)[:, 2].mean()
    assert drop == pytest.approx(0.078, abs=0.004)


def test_the_written_config_repeats_the_run_to_the_byte(finished, tmp_path):
    scene = read_scene(finished / "config.json").scene
    again = animate(scene, tmp_path / "again", beside=finished)
    assert contents(again) == contents(finished)


@pytest.mark.parametrize(("stage", "frame"), [("simulate", 2), ("render", 1)])
def test_an_interrupted_run_resumes_to_the_same_bytes(finished, tmp_path, stage, frame):
    def interrupt(at, done):
        if (at, done) == (stage, frame):
            raise KeyboardInterrupt

    out, seen = tmp_path / "out", []
    with pytest.raises(KeyboardInterrupt):
        animate(small_scene(), out, objects=(sphere(),), watch=interrupt)
    assert (out / "checkpoint").exists() and not (out / "motion.mp4").exists()
    assert (out / "motion.partial.mp4").exists() == (stage == "render")
    animate(small_scene(), out, objects=(sphere(),), watch=lambda at, done: seen.append((at, done)))
    simulated = [done for at, done in seen if at == "simulate"]
    assert simulated == ([3] if stage == "simulate" else [])
    assert contents(out) == contents(finished)
    assert not (out / "checkpoint").exists() and not (out / "motion.partial.mp4").exists()


def test_a_checkpoint_of_another_scene_is_not_used(tmp_path):
    def interrupt(at, done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(small_scene(), tmp_path, objects=(sphere(),), watch=interrupt)
    seen = []
    other = small_scene(seed=1)
    with pytest.raises(InputError, match="another request"):
        animate(other, tmp_path, objects=(sphere(),))
    animate(
        other,
        tmp_path,
        objects=(sphere(),),
        overwrite=True,
        watch=lambda at, done: seen.append((at, done)),
    )
    assert [done for at, done in seen if at == "simulate"] == [1, 2, 3]


def test_a_failure_names_frame_and_remedy_and_keeps_the_last_good_frame(tmp_path):
    escaping = dataclasses.replace(small_scene().objects[0], velocity=(9.0, 0.0, 0.0))
    scene = small_scene(objects=(escaping,), boundaries=(), frames=10)
    with pytest.raises(SimulationError, match=r"frame \d+.*left the grid") as error:
        animate(scene, tmp_path, objects=(sphere(),))
    good = (tmp_path / "metrics.jsonl").read_text().splitlines()
    assert len(good) == error.value.frame
    assert (tmp_path / "last_good.png").exists() and not (tmp_path / "motion.mp4").exists()
    last = np.asarray(read_ply(tmp_path / "last_good.ply").means)
    assert np.isfinite(last).all() and last.max() < 1.0


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.zeros((5, 3))])
def test_one_particle_and_coincident_ones(tmp_path, points):
    gaussians = from_points(points.astype(np.float32), np.full(3, 0.5), 0.1)
    out = animate(small_scene(frames=2), tmp_path, objects=(gaussians,))
    assert "NaN" not in (out / "metrics.jsonl").read_text()


def test_two_objects_of_two_materials(tmp_path):
    first = small_scene().objects[0]
    second = dataclasses.replace(
        first, material="sand", parameters={"youngs_modulus": 5e3}, centre=(0.5, 0.5, 0.72),
        size=0.2, filling=Filling(relax=False),
    )  # fmt: skip
    scene = small_scene(objects=(first, second), frames=2)
    write_ply(tmp_path / "ball.ply", sphere())
    named = tuple(dataclasses.replace(thing, source="ball.ply") for thing in scene.objects)
    scene = dataclasses.replace(scene, objects=named)
    out = animate(scene, tmp_path / "out", beside=tmp_path)
    assert (out / "gaussians_1.ply").exists()
    again = animate(read_scene(out / "config.json").scene, tmp_path / "again", beside=out)
    assert contents(again) == contents(out)


def test_a_mesh_that_stands_in_the_way_is_kept_with_the_run(tmp_path):
    """And shown, where the scene does not hide it."""
    x = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[[[0, 2, 1], [0, 3, 2]]] - 0.5
    lower = np.concatenate([x, np.full((2, 3, 1), -0.5)], -1)
    half = np.concatenate([lower, np.roll(lower, 1, -1), np.roll(lower, 2, -1)])
    write_triangles(tmp_path / "rock.ply", np.concatenate([half, -half[:, ::-1]]))
    rock = MeshObstacle((0.5, 0.5, 0.1), "rock.ply", 0.25, resolution=8)
    scene = small_scene(frames=1, boundaries=(*small_scene().boundaries, rock))
    out = animate(scene, tmp_path / "one", objects=(sphere(),), beside=tmp_path)
    written = read_scene(out / "config.json").scene
    assert written.boundaries[1].source == "obstacle_1.ply"
    again = animate(written, tmp_path / "two", beside=out)
    for name in (*FILES, "obstacle_1.ply"):
        assert (out / name).read_bytes() == (again / name).read_bytes(), name
    hidden = dataclasses.replace(scene, obstacle_colour=None)
    bare = animate(hidden, tmp_path / "three", objects=(sphere(),), beside=tmp_path)
    picture = "contact_sheet.png"
    assert (bare / picture).read_bytes() != (out / picture).read_bytes()
    with pytest.raises(InputError, match=r"boundaries\[1\].source: .*rock.ply: no such file"):
        animate(scene, tmp_path / "four", objects=(sphere(),))
