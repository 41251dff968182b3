"""Splats of other tools as they come: on their side, off centre, in other units."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.gaussians import concatenate, covariances, from_points, read_ply, transform, write_ply
from jaxphys.scene.place import rotation_matrix
from jaxphys.scene.scene import Object

SCENE = {
    "objects": [{"size": 0.4, "centre": [0.5, 0.5, 0.5], "velocity": [0, 0, -1], "filling": None}],
    "domain": {"size": [1.0, 1.0, 1.0], "spacing": 1 / 14},
    "frames": 2,
    "frame_time": 0.01,
    "width": 32,
    "height": 24,
}
SIDE = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # its z is the capture's -y
SCALE, OFFSET = 0.3, np.array([4.0, -1.0, 2.5])


@pytest.fixture(scope="module")
def thing():
    """An egg with a pointed end up, in colours that depend on the view."""
    random = np.random.default_rng(0)
    points = random.normal(size=(300, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= [0.6, 0.4, 1.0] * (1.2 - 0.3 * points[:, 2:])
    sizes = np.tile([0.05, 0.03, 0.02], (300, 1))
    quaternions = random.normal(size=(300, 4))
    made = from_points(
        points, random.uniform(0.1, 0.9, (300, 3)), sizes, quaternions=quaternions, degree=1
    )
    harmonics = made.harmonics.at[:, 1:].set(0.2 * jnp.asarray(random.normal(size=(300, 3, 3))))
    return type(made)(*(*list(made.__dict__.values())[:4], harmonics))


@pytest.fixture(scope="module")
def runs(thing, tmp_path_factory):
    """Runs of the object itself and of its capture, and the capture's own object."""
    folder = tmp_path_factory.mktemp("captures")
    (folder / "scene.json").write_text(json.dumps(SCENE))
    own = transform(thing, SIDE, SCALE, OFFSET)
    random = np.random.default_rng(1)
    around = random.normal(size=(200, 3))
    around *= 8 / np.linalg.norm(around, axis=1, keepdims=True)
    far = from_points(OFFSET + around, np.full(3, 0.5), 0.5, degree=1)
    write_ply(folder / "thing.ply", thing)
    write_ply(folder / "capture.ply", concatenate([far, own]))
    for name, options in (("thing", ()), ("capture", ("--up=-y", "--crop"))):
        command = ["animate", f"{folder / name}.ply", "--config", f"{folder / 'scene.json'}"]
        out = ["--out", f"{folder / name}", "--save-splats", "--quiet"]
        assert run([*command, *options, *out]) == 0
    return folder, own


def alike(ours, theirs, atol):
    """The same Gaussians in any order."""
    a, b = (np.lexsort(np.round(np.asarray(g.means), 3).T) for g in (ours, theirs))
    assert ours.count == theirs.count
    for value in (
        lambda g: g.means,
        lambda g: covariances(g).reshape(-1, 9),
        lambda g: g.harmonics,
    ):
        x, y = np.asarray(value(ours))[a], np.asarray(value(theirs))[b]
        np.testing.assert_allclose(x, y, atol=atol * np.abs(y).max())


@pytest.mark.parametrize("frame", ["0000.ply", "0001.ply"])
def test_a_capture_moves_as_its_object_does(runs, frame):
    folder, _ = runs
    ours, theirs = (read_ply(folder / name / "splats" / frame) for name in ("capture", "thing"))
    alike(ours, theirs, 2e-4)


def test_frames_go_back_to_where_they_were_captured(runs):
    """Frame 0 is the capture's own object; in the next it has fallen along its own y."""
    folder, own = runs
    out = folder / "back"
    command = ["export", f"{folder / 'capture'}", "--to", "ply", "--as-file", "--out", f"{out}"]
    assert run(command) == 0
    first, second = (read_ply(path) for path in sorted(out.glob("*.ply")))
    alike(first, own, 2e-4)
    scene_units = SCALE * 2 * 1.5 / 0.4  # of the capture for a metre, about: the egg is 2.3 high
    fallen = np.mean(np.asarray(second.means) - np.asarray(first.means), axis=0)
    assert abs(fallen[0]) < 1e-4 and abs(fallen[2]) < 1e-4
    assert 0.3 * 0.01 * scene_units < fallen[1] < 0.01 * scene_units


def test_a_file_is_in_its_own_coordinates_already(runs, capsys):
    folder, _ = runs
    assert run(["export", f"{folder / 'thing.ply'}", "--to", "spz", "--as-file"]) == 2
    assert "own coordinates already" in capsys.readouterr().err


@pytest.mark.parametrize("up", ["x", "-x", "y", "-y", "z", "-z"])
def test_every_axis_can_be_up(up):
    turn = rotation_matrix(Object(up=up), "objects[0]")
    axis = (-1 if up[0] == "-" else 1) * np.eye(3)["xyz".index(up[-1])]
    np.testing.assert_allclose(turn @ axis, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)


def test_photographs_say_what_is_up(thing, tmp_path, capsys):
    """A trained model's cameras stand upright in a world whose -y is up: told, and turned to."""
    model = tmp_path / "model" / "point_cloud" / "iteration_7"
    model.mkdir(parents=True)
    write_ply(model / "point_cloud.ply", transform(thing, SIDE, SCALE, OFFSET))
    camera = {"width": 64, "height": 48, "fx": 50.0, "fy": 50.0, "position": [0, 0, 0],
              "rotation": np.eye(3).tolist()}  # fmt: skip
    (tmp_path / "model" / "cameras.json").write_text(json.dumps([camera]))
    small = ["--frames", "1", "--width", "32", "--height", "24", "--quiet", "--set"]
    small += ["domain.spacing=0.15", "--set", "filling=null"]
    told = "note: the photographs say that -y is up: --up auto stands the object upright"
    heights = {}
    for name, options in (("lying", []), ("upright", ["--up", "auto"]), ("asked", ["--up=-y"])):
        command = ["animate", f"{tmp_path / 'model'}", "--out", f"{tmp_path / name}", *small]
        assert run([*command, *options, "--save-splats"]) == 0
        assert (told in capsys.readouterr().err) == (name == "lying")
        means = np.asarray(read_ply(tmp_path / name / "splats" / "0000.ply").means)
        heights[name] = np.ptp(means, axis=0)
    np.testing.assert_allclose(heights["upright"], heights["asked"], atol=1e-4)
    assert np.abs(heights["upright"] - heights["lying"]).max() > 0.1


def test_auto_needs_photographs(runs, tmp_path, capsys):
    folder, _ = runs
    command = ["animate", f"{folder / 'thing.ply'}", "--out", f"{tmp_path / 'out'}", "--up", "auto"]
    assert run(command) == 2
    assert "--up auto: there is no cameras.json" in capsys.readouterr().err
