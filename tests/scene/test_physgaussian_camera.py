"""PhysGaussian's cameras: where they stand, in closed form, and where a point lands."""

import json
import math

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.render.camera import position, to_pixels
from jaxphys.scene.build import place_objects
from jaxphys.scene.model_folder import cameras_beside
from jaxphys.scene.physgaussian import from_physgaussian
from jaxphys.scene.placement import Placement
from jaxphys.scene.view import Photograph

BASE = {"g": [0, 0, 0], "frame_dt": 0.04, "mpm_space_viewpoint_center": [1.0, 1.2, 0.9]}
ORBIT = BASE | {
    "default_camera_index": -1, "init_azimuthm": 30.0, "init_elevation": 20.0, "init_radius": 3.0,
    "move_camera": True, "delta_a": 7.0, "delta_e": -2.0, "delta_r": 0.1,
}  # fmt: skip
# Looks along the file's x: right is -z, down is y, forward is x, as columns.
PHOTOGRAPH = {
    "id": 3, "img_name": "a", "width": 200, "height": 100, "fx": 100.0, "fy": 110.0,
    "position": [-2.0, 0.0, 0.0], "rotation": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
}  # fmt: skip
HALF = Placement.of(np.eye(3), 0.5, np.zeros(3), np.ones(3))


def filed(tmp_path, *entries):
    (tmp_path / "cameras.json").write_text(json.dumps(entries))
    return cameras_beside(tmp_path)


def cameras_of(scene, placement, count=3):
    points = [np.zeros((1, 3))] * count
    return frame_cameras(scene.camera, points, scene.fps, scene.width, scene.height, placement)


@pytest.mark.parametrize(
    ("up", "h1", "h2"),
    [
        ((0, 0, 1), (1, 1, 0), (1, -1, 0)),
        ((0, 2, 0), (1, 0, 1), (-1, 0, 1)),
        ((-1, 0, 0), (0, 1, 1), (0, -1, 1)),
    ],
)
def test_the_eye_stands_where_theirs_does(up, h1, h2):
    """h1 is (1, 1, 1) without its part along `up`, h2 = h1 x up; the radius is in the file's units,
    half a metre each here.
    """
    scene = from_physgaussian(ORBIT | {"mpm_space_vertical_upward_axis": list(up)}).scene
    h1, h2 = np.array(h1) / 2**0.5, np.array(h2) / 2**0.5
    upwards = np.array(up) / np.linalg.norm(up)
    np.testing.assert_allclose(np.cross(h1, upwards), h2, atol=1e-12)
    for i, camera in enumerate(cameras_of(scene, HALF)):
        a, e, r = math.radians(30 + 7 * i), math.radians(20 - 2 * i), 0.5 * (3 + 0.1 * i)
        away = math.cos(e) * (math.cos(a) * h1 + math.sin(a) * h2) + math.sin(e) * upwards
        np.testing.assert_allclose(position(camera), [1, 1.2, 0.9] + r * away, atol=2e-6)
        seen = to_pixels(camera, np.array([[1, 1.2, 0.9], [1, 1.2, 0.9] + 0.1 * upwards]))
        np.testing.assert_allclose(seen[0], [scene.width / 2, scene.height / 2], atol=1e-3)
        assert abs(seen[1, 0] - seen[0, 0]) < 1e-3 and seen[1, 1] < seen[0, 1] - 10


def test_an_upward_axis_without_a_horizon_is_refused():
    with pytest.raises(InputError, match=r"config.mpm_space_vertical_upward_axis: along \(1, 1, 1"):
        from_physgaussian(ORBIT | {"mpm_space_vertical_upward_axis": [2, 2, 2]})


def test_the_orbit_has_the_lens_and_the_picture_of_the_first_photograph(tmp_path):
    loaded = from_physgaussian(ORBIT, cameras=filed(tmp_path, PHOTOGRAPH))
    assert (loaded.scene.width, loaded.scene.height) == (200, 100)
    np.testing.assert_allclose(cameras_of(loaded.scene, HALF, 1)[0].focal, [100, 100], rtol=1e-5)
    assert not any("cameras.json" in note for note in loaded.notes)


def test_a_point_lands_on_the_pixel_where_the_photograph_has_it(tmp_path):
    """However the object is turned, scaled and moved: 0.1 to the right and 0.05 down at depth 2."""
    point = [0.0, 0.05, -0.1]
    corners = np.random.default_rng(0).uniform([-0.3, -0.2, -0.5], [0.6, 0.1, 0.2], (40, 3))
    gaussians = from_points(
        np.array([point, *corners], np.float32), np.full((41, 3), 0.5, np.float32), 0.1
    )
    config = BASE | {
        "default_camera_index": 1, "rotation_degree": [90.0, 25.0], "rotation_axis": [0, 2],
        "scale": 0.8,
    }  # fmt: skip
    other = PHOTOGRAPH | {"position": [0, 0, 5]}
    scene = from_physgaussian(config, cameras=filed(tmp_path, other, PHOTOGRAPH)).scene
    (placed,) = place_objects(scene, (gaussians,))
    assert placed.placement.scale != pytest.approx(1, abs=0.05)
    np.testing.assert_allclose(
        placed.placement.point(point), np.asarray(placed.moving.means[0]), atol=1e-6
    )
    camera = cameras_of(scene, placed.placement, 1)[0]
    expected = [100 * 0.1 / 2 + 100, 110 * 0.05 / 2 + 50]
    np.testing.assert_allclose(to_pixels(camera, placed.moving.means[:1])[0], expected, atol=2e-3)


def test_without_cameras_the_motion_is_framed_and_a_note_says_so():
    loaded = from_physgaussian(ORBIT | {"default_camera_index": 0})
    assert loaded.scene.camera.distance is None and loaded.scene.camera.turn == 0
    assert any(note.startswith("default_camera_index") for note in loaded.notes)


@pytest.mark.parametrize(
    ("entries", "index", "words"),
    [
        ([PHOTOGRAPH], 1, "default_camera_index: 1, but cameras.json holds 1 cameras, 0 to 0"),
        ([], 0, "cameras.json: holds no cameras"),
        ([PHOTOGRAPH, {"width": 3}], 0, r"cameras.json\[1\]: the key 'height' is missing"),
        ([PHOTOGRAPH | {"fx": 0}], 0, r"cameras.json\[0\].fx: 0 must be above 0"),
        ([PHOTOGRAPH | {"rotation": [[1, 0, 0]] * 3}], 0, "rotation: is no rotation"),
    ],
)
def test_bad_cameras_name_file_and_field(tmp_path, entries, index, words):
    with pytest.raises(InputError, match=words):
        from_physgaussian(BASE | {"default_camera_index": index}, cameras=filed(tmp_path, *entries))


def test_a_mirror_is_no_photograph():
    with pytest.raises(InputError, match="rotation: is no rotation"):
        Photograph((0.0, 0.0, 0.0), ((1.0, 0, 0), (0, 1.0, 0), (0, 0, -1.0)), (1.0, 1.0))
