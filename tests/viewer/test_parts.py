"""Queue, rays, sliders and films of the viewer: what needs neither browser nor simulation."""

import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Plane
from jaxphys.page.motion_data import Moving
from jaxphys.pipeline.replay import Replay
from jaxphys.render.camera import position
from jaxphys.scene.scene import Object, Scene
from jaxphys.viewer.events import Pause, Play, Poke, Queue, Reset, Seek, SetNumber, Step
from jaxphys.viewer.numbers import numbers_of, with_material, with_number
from jaxphys.viewer.panel import upright
from jaxphys.viewer.picking import met
from jaxphys.viewer.playback import Playback, splats_of

RNG = np.random.default_rng(5)


def test_a_slider_that_is_dragged_leaves_its_last_place():
    queue = Queue()
    for value in (1.0, 2.0, 3.0):
        queue.put(SetNumber("gravity", value))
    queue.put(SetNumber("friction", 0.5))
    queue.put(Step())
    queue.put(Step())
    queue.put(SetNumber("gravity", 4.0))
    assert queue.take() == [
        SetNumber("gravity", 3.0),
        SetNumber("friction", 0.5),
        Step(),
        Step(),
        SetNumber("gravity", 4.0),
    ]
    assert queue.take() == []


def test_who_waits_is_woken():
    queue = Queue()
    timer = threading.Timer(0.05, lambda: queue.put(Play()))
    timer.start()
    begin = time.monotonic()
    assert queue.take(30.0) == [Play()]
    assert time.monotonic() - begin < 20
    timer.join()


def test_a_ray_meets_the_first_point_near_it():
    points = np.array([[3.0, 0.05, 0], [1.0, 0.3, 0], [2.0, 0, -0.05], [-1.0, 0, 0]])
    assert met(points, np.zeros(3), np.array([5.0, 0, 0]), 0.1) == 2
    assert met(points, np.zeros(3), np.array([5.0, 0, 0]), 0.5) == 1
    assert met(points, np.zeros(3), np.array([0, 0, 1.0]), 0.1) is None


def test_a_plane_is_shown_across_its_normal():
    for normal in RNG.standard_normal((20, 3)):
        w, x, y, z = upright(tuple(normal))
        turned = Turn.from_quat([x, y, z, w]).apply([0, 0, 1])
        np.testing.assert_allclose(turned, normal / np.linalg.norm(normal), atol=1e-12)
    w, x, y, z = upright((0.0, 0.0, -2.0))
    np.testing.assert_allclose(Turn.from_quat([x, y, z, w]).apply([0, 0, 1]), [0, 0, -1])


def test_sliders_are_those_that_the_material_reads():
    scene = Scene(boundaries=(Plane(friction=0.4), Plane(friction=0.0)))
    found = {number.key: number for number in numbers_of(scene)}
    assert {"objects.0.youngs_modulus", "objects.0.poisson_ratio", "gravity"} <= set(found)
    assert found["gravity"].value == 9.81 and found["friction"].value == 0.4
    for number in found.values():
        assert number.low <= number.value <= number.high
        assert math.isfinite(number.low) and math.isfinite(number.high)
    water = {number.key for number in numbers_of(with_material(scene, 0, "water"))}
    assert "objects.0.youngs_modulus" not in water


def test_a_number_is_set_where_a_file_would_have_it():
    scene = Scene(boundaries=(Plane(friction=0.4), Plane(friction=0.0)))
    scene = with_number(scene, "objects.0.youngs_modulus", 5e4)
    assert scene.objects[0].parameters == {"youngs_modulus": 5e4}
    scene = with_number(scene, "friction", 0.7)
    assert [one.friction for one in scene.boundaries] == [0.7, 0.0]
    assert with_number(scene, "gravity", 1.62).gravity == (0.0, 0.0, -1.62)
    with pytest.raises(InputError, match="unknown material"):
        with_material(scene, 0, "cheese")


def moving(frames: int = 4, count: int = 6) -> Moving:
    return Moving(
        means=RNG.standard_normal((frames, count, 3)),
        quaternions=RNG.standard_normal((frames, count, 4)),
        log_scales=RNG.standard_normal((frames, count, 3)),
        colours=RNG.random((count, 3)),
        opacities=RNG.random(count),
        seconds=0.1 * np.arange(frames),
        notes=("Thinned.",),
    )


@pytest.fixture
def film():
    view = {
        "target": [1.0, 2.0, 3.0],
        "distance": 4.0,
        "azimuth": 0.0,
        "elevation": math.pi / 6,
        "axes": np.eye(3).tolist(),
        "field": 0.6,
        "aspect": 1.5,
    }
    return Playback(Replay(replace(Scene(), width=60, height=40), moving(), view, {}))


def test_a_film_plays_on_and_begins_again(film):
    assert film.message == "Thinned." and film.count == 4
    film.do(Play())
    assert film.playing
    seen = []
    for _ in range(5):
        film.advance()
        seen.append(film.shown().number)
    assert seen == [1, 2, 3, 0, 1]
    film.do(Pause())
    film.do(Step())
    assert not film.playing and film.shown().number == 2
    assert film.shown().time == pytest.approx(0.2)
    film.do(Seek(99))
    assert film.shown().number == 3
    film.do(Reset())
    assert film.shown().number == 0
    film.do(Poke((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0))
    assert "finished run" in film.message


def test_a_films_camera_stands_where_its_view_says(film):
    eye = np.asarray(position(film.camera))
    expected = [1 + 4 * math.cos(math.pi / 6), 2, 3 + 4 * math.sin(math.pi / 6)]
    np.testing.assert_allclose(eye, expected, atol=1e-5)


def test_covariances_are_those_of_scales_and_quaternions():
    some = moving()
    covariances = np.asarray(splats_of(some, 2).covariances)
    turns = Turn.from_quat(np.roll(some.quaternions[2], -1, axis=1)).as_matrix()
    squares = np.exp(2 * some.log_scales[2])
    expected = np.einsum("nij,nj,nkj->nik", turns, squares, turns)
    np.testing.assert_allclose(covariances, expected, rtol=1e-4, atol=1e-5)


def test_what_is_not_finite_is_not_shown():
    some = moving()
    some.means[1, 0, 0] = np.nan
    splats_of(some, 0)
    with pytest.raises(InputError, match="frame 1"):
        splats_of(some, 1)


def test_objects_without_numbers_of_their_own_have_defaults():
    thing = Object(material="sand")
    keys = [number.key for number in numbers_of(Scene(objects=(thing,)))]
    assert "objects.0.friction_angle" in keys
