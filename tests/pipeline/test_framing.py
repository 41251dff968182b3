import math

import numpy as np
import pytest

from jaxphys.pipeline.framing import frame_cameras
from jaxphys.render.camera import position, to_camera, to_pixels
from jaxphys.scene.scene import View


@pytest.mark.parametrize("view", [View(), View(azimuth=100.0, elevation=60.0, turn=90.0)])
@pytest.mark.parametrize("size", [(160, 90), (90, 160)])
def test_the_whole_motion_is_in_the_picture_and_fills_it(view, size):
    random = np.random.default_rng(0)
    start = random.uniform(-1, 1, (500, 3)) * (0.5, 0.2, 0.4) + (1.0, 2.0, 3.0)
    frames = [start + i * np.array([0.1, 0.0, -0.3]) for i in range(4)]
    cameras = frame_cameras(view, frames, 4.0, *size)
    share = []
    for frame, camera in zip(frames, cameras, strict=True):
        pixels = np.asarray(to_pixels(camera, frame)) / size
        assert np.mean((pixels > 0) & (pixels < 1)) > 0.995
        share.append(np.abs(pixels - 0.5).max())
    assert 0.35 < max(share) < 0.55


def test_what_is_given_is_kept():
    view = View(azimuth=0.0, elevation=0.0, distance=5.0, target=(1.0, 1.0, 1.0), approach=-1.0)
    cameras = frame_cameras(view, [np.zeros((1, 3))] * 3, 2.0, 64, 48)
    assert np.allclose(position(cameras[0]), (6, 1, 1), atol=1e-5)
    assert np.allclose(position(cameras[2]), (5, 1, 1), atol=1e-5)


def test_turning_camera_keeps_its_distance():
    view = View(elevation=0.0, target=(0.0, 0.0, 0.0), turn=90.0)
    cameras = frame_cameras(view, [np.ones((5, 3))] * 3, 1.0, 64, 48)
    places = np.array([position(camera) for camera in cameras])
    lengths = np.linalg.norm(places, axis=1)
    assert np.allclose(lengths, lengths[0], rtol=1e-5)
    assert math.isclose(places[0] @ places[1], 0.0, abs_tol=1e-4)


def test_single_point_gives_a_usable_camera():
    camera = frame_cameras(View(), [np.zeros((1, 3))], 1.0, 64, 48)[0]
    assert np.isfinite(np.asarray(to_camera(camera, np.zeros((1, 3))))).all()
