"""A trained model's folder in place of a file of splats."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from jaxphys.cli.scenes import scene_for, with_source
from jaxphys.core.errors import InputError
from jaxphys.gaussians.ply import read_ply
from jaxphys.scene.model_folder import cameras_beside
from jaxphys.scene.source import find, load

BALL = Path(__file__).parent.parent / "data" / "ball.ply"
CAMERA = {
    "width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "position": [0, 0, 0],
    "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
}  # fmt: skip


@pytest.fixture
def model(tmp_path):
    """Iterations 7000, 30000 and, to no use, `best`; the last one alone can be read."""
    for name in ("7000", "30000", "best"):
        folder = tmp_path / "model" / "point_cloud" / f"iteration_{name}"
        folder.mkdir(parents=True)
        (folder / "point_cloud.ply").write_text("none")
    shutil.copy(BALL, tmp_path / "model/point_cloud/iteration_30000/point_cloud.ply")
    (tmp_path / "model" / "cameras.json").write_text(json.dumps([CAMERA]))
    return tmp_path / "model"


def test_the_last_iteration_is_read(model):
    np.testing.assert_array_equal(load(model).means, read_ply(BALL).means)
    assert find("model", model.parent) == model / "point_cloud/iteration_30000/point_cloud.ply"


def test_the_command_line_takes_it_with_and_without_a_config(model, tmp_path):
    scene, _ = with_source(scene_for(None, None, {}, model), model, None, None)
    assert Path(scene.objects[0].source) == find(str(model), None)
    config = tmp_path / "theirs.json"
    config.write_text(json.dumps({"g": [0, 0, 0], "default_camera_index": 0}))
    scene = scene_for(config, None, {}, model)
    assert (scene.width, scene.height) == (640, 480)
    assert scene.camera.photograph.focal == (500 / 640, 500 / 640)


@pytest.mark.parametrize("source", [".", "point_cloud/iteration_30000/point_cloud.ply", "a.ply"])
def test_cameras_are_found_beside_whatever_names_the_model(model, source):
    assert len(cameras_beside(model / source)) == 1


def test_elsewhere_there_are_none(tmp_path):
    assert cameras_beside(tmp_path) is None and cameras_beside(tmp_path / "a.ply") is None


def test_a_folder_with_neither_says_what_was_looked_for(tmp_path):
    (tmp_path / "point_cloud" / "iteration_x").mkdir(parents=True)
    words = f"{tmp_path}: holds neither gaussians.ply nor point_cloud/iteration_N/point_cloud.ply"
    for read in (load, lambda folder: find(str(folder), None)):
        with pytest.raises(InputError, match=words):
            read(tmp_path)
