"""The simulation behind the viewer, without a browser."""

import json
from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.mpm.boundaries import Plane
from jaxphys.mpm.loop.frames import advance_adaptively
from jaxphys.pipeline.frames import simulate
from jaxphys.scene.build import build
from jaxphys.scene.json import scene_from_json, to_json
from jaxphys.scene.scene import Domain, Object, Scene
from jaxphys.viewer.events import (
    Drag,
    Grab,
    MoveBoundary,
    Play,
    Poke,
    Release,
    Reset,
    Seek,
    SetMaterial,
    SetNumber,
    Step,
)
from jaxphys.viewer.session import Session

SPACING, SIDE, FLOOR = 0.1, 1.5, 0.3
SIZE = 0.45
CENTRE = (0.75, 0.75, 0.75)
E0 = 2e4


def cube(count: int = 8):
    """Gaussians on a lattice, which are all the particles that there are."""
    steps = np.linspace(0, 1, count, dtype=np.float32)
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return from_points(points, np.full((count**3, 3), 0.5), 0.05)


def scene(**changes) -> Scene:
    thing = Object(
        material="elastic",
        size=SIZE,
        centre=CENTRE,
        filling=None,
        parameters={"youngs_modulus": E0, "density": 1000.0},
    )
    made = Scene(
        objects=(thing,),
        gravity=(0.0, 0.0, -5.0),
        boundaries=(Plane((0.75, 0.75, FLOOR), friction=0.4),),
        domain=Domain((SIDE,) * 3, SPACING),
        frame_time=0.02,
        frames=7,
    )
    return replace(made, **changes)


@pytest.fixture
def session():
    return Session(scene(), (cube(),))


def steps(session, count):
    for _ in range(count):
        session.do(Step())
        assert session.message == ""
    return places(session)


def places(session):
    return np.asarray(session.frame.carried()[0], np.float64)


def from_left(height=CENTRE[2]):
    return SimpleNamespace(origin=(0.05, 0.75, height), direction=(2.0, 0.0, 0.0))


def poke(speed=2.0, **where):
    ray = from_left(**where)
    return Poke(ray.origin, ray.direction, speed)


def grab():
    ray = from_left()
    return Grab(ray.origin, ray.direction)


def bytes_of(session):
    return [np.asarray(part).tobytes() for part in session.shown().splats]


def test_a_reset_gives_the_same_bytes(session):
    first = bytes_of(session)
    steps(session, 3)
    there = bytes_of(session)
    assert there != first
    session.do(Reset())
    assert session.shown().number == 0 and bytes_of(session) == first
    session.do(Play())
    assert session.playing
    for _ in range(3):
        session.advance()
    assert bytes_of(session) == there


def test_gravity_goes_to_zero_and_back_and_nothing_begins_anew(session):
    """In free flight momentum grows by m g t, and without gravity not at all."""
    mass, t = session.moment.metrics["mass"], scene().frame_time
    steps(session, 2)
    for gravity in (0.0, 5.0):
        before = session.shown().momentum[2]
        session.do(SetNumber("gravity", gravity))
        number = session.shown().number
        steps(session, 1)
        assert session.shown().number == number + 1 > 2
        grown = session.shown().momentum[2] - before
        assert grown == pytest.approx(-mass * gravity * t, abs=1e-3 * mass * t)
        assert session.saved().gravity[2] == -gravity


def test_a_frame_is_that_of_a_film(session):
    """The same motion as `animate` would draw: nobody's hands leave no trace."""
    steps(session, 6)
    film = simulate(build(scene().filmed(), cube()).simulation, 7)
    np.testing.assert_allclose(places(session), film[-1].carried()[0], atol=1e-5)


def test_a_poke_pushes_what_the_ray_meets_along_it():
    others = Session(scene(gravity=(0.0, 0.0, 0.0)), (cube(),))
    start = places(others)
    others.do(poke())
    moved = steps(others, 1) - start
    near = np.linalg.norm(start - [0.525, 0.75, 0.75], axis=1) < 0.1
    far = start[:, 0] > 0.9
    assert near.any() and far.any()
    along = moved[near].mean(axis=0)
    # 2 m/s at the end of 0.02 s: from half of 0.04 m in small steps to all of it in one, less what
    # the rest holds back.
    assert 0.004 < along[0] < 0.04
    assert np.abs(along[1:]).max() < 0.05 * along[0]
    assert np.abs(moved[far]).max() < 0.1 * along[0]


def test_a_poke_gives_the_momentum_that_it_says():
    free = Session(scene(gravity=(0.0, 0.0, 0.0)), (cube(),))
    free.do(poke())
    (made,) = free.saved().boundaries[1:]
    steps(free, 3)
    momentum = free.shown().momentum
    np.testing.assert_allclose(momentum, np.multiply(made.force, made.duration), atol=1e-3)
    assert momentum[0] > 1


@pytest.mark.slow
def test_in_single_precision_too():
    """As the command runs it: a poke lasts its frame to the rounding of the time."""
    with jax.enable_x64(False):
        free = Session(scene(gravity=(0.0, 0.0, 0.0)), (cube(),))
        assert free.built.simulation.state.position.dtype == np.float32
        steps(free, 3)
        free.do(poke())
        (made,) = free.saved().boundaries[1:]
        assert made.start == pytest.approx(0.06)
        steps(free, 1)
        momentum = free.shown().momentum
        np.testing.assert_allclose(momentum, np.multiply(made.force, made.duration), atol=2e-3)


def test_a_poke_past_everything_says_so_and_changes_nothing(session):
    session.do(poke(height=1.4))
    assert "passes all matter" in session.message
    assert session.saved() == session.scene
    session.do(Step())
    assert session.message == ""


def test_a_hand_pulls_and_lets_go():
    free = Session(scene(gravity=(0.0, 0.0, 0.0)), (cube(),))
    free.do(grab())
    x, y, z = free.held
    free.do(Drag((x, y, z + 0.1)))
    steps(free, 8)
    assert free.held[2] - z > 0.03
    free.do(Release())
    assert free.held is None
    momentum = free.shown().momentum
    steps(free, 3)
    np.testing.assert_allclose(free.shown().momentum, momentum, atol=1e-3)


def test_a_hand_never_pulls_farther_than_it_is_strong(session):
    session.do(grab())
    session.do(Drag((100.0, 0.0, 0.0)))
    steps(session, 5)
    assert np.isfinite(places(session)).all()


def test_a_stiffer_one_moves_otherwise_in_smaller_steps(session):
    soft = steps(session, 6)
    taken = session.moment.metrics["steps"]
    session.do(Reset())
    session.do(SetNumber("objects.0.youngs_modulus", 100 * E0))
    stiff = steps(session, 6)
    # The step goes as the square root of the modulus.
    assert session.moment.metrics["steps"] > 5 * taken
    assert np.abs(stiff - soft).max() > 1e-3
    fell = scene()
    fell = replace(fell, objects=(replace(fell.objects[0], parameters={
        "youngs_modulus": 100 * E0, "density": 1000.0,
    }),))  # fmt: skip
    film = simulate(build(fell.filmed(), cube()).simulation, 7)
    np.testing.assert_allclose(stiff, film[-1].carried()[0], atol=1e-5)


def test_numbers_out_of_range_are_refused_in_a_line(session):
    session.do(SetNumber("objects.0.poisson_ratio", 0.7))
    assert "poisson_ratio" in session.message and "\n" not in session.message
    assert session.scene == scene()


def test_what_is_saved_moves_the_same():
    session = Session(scene(), (cube(),))
    session.do(SetNumber("objects.0.youngs_modulus", 3 * E0))
    session.do(SetNumber("gravity", 2.0))
    session.do(SetNumber("friction", 0.1))
    session.do(Reset())
    steps(session, 2)
    session.do(poke())
    steps(session, 2)
    session.do(poke(1.0, height=0.6))
    seen = steps(session, 2)
    text = json.dumps(to_json(session.saved()))
    saved = scene_from_json(json.loads(text))
    assert len(saved.boundaries) == 3
    film = simulate(build(saved.filmed(), cube()).simulation, 7)
    np.testing.assert_allclose(seen, film[-1].carried()[0], atol=2e-5)
    without = simulate(build(session.scene.filmed(), cube()).simulation, 7)
    assert np.abs(seen - without[-1].carried()[0]).max() > 0.01


def test_one_compilation_for_all_hands_and_numbers(session):
    steps(session, 1)
    programs = advance_adaptively._cache_size()
    session.do(poke())
    steps(session, 1)
    session.do(grab())
    session.do(Drag((0.6, 0.75, 0.8)))
    steps(session, 1)
    session.do(Release())
    session.do(SetNumber("objects.0.youngs_modulus", 2 * E0))
    session.do(SetNumber("objects.0.density", 500.0))
    session.do(SetNumber("gravity", 1.0))
    session.do(SetNumber("friction", 0.2))
    session.do(MoveBoundary(0, (0.75, 0.75, 0.32)))
    steps(session, 2)
    session.do(Reset())
    steps(session, 1)
    assert advance_adaptively._cache_size() == programs
    # The count does count: another material is another program.
    session.do(SetMaterial(0, "metal"))
    steps(session, 1)
    assert advance_adaptively._cache_size() == programs + 1


def test_a_plane_goes_where_it_is_brought_and_takes_matter_along(session):
    steps(session, 25)
    lowest = places(session)[:, 2].min()
    session.do(MoveBoundary(0, (0.75, 0.75, FLOOR + 0.1)))
    steps(session, 1)
    # As fast as hands move: 1 m/s.
    assert session.movable[0].point[2] == pytest.approx(FLOOR + 0.02)
    steps(session, 14)
    assert session.movable[0].point[2] == pytest.approx(FLOOR + 0.1)
    assert places(session)[:, 2].min() > lowest + 0.05
    assert session.scene.boundaries[0].point[2] == pytest.approx(FLOOR + 0.1)


def test_a_failure_is_one_line_until_a_reset():
    thrown = scene(boundaries=(), gravity=(0.0, 0.0, -20.0))
    session = Session(thrown, (cube(),))
    first = bytes_of(session)
    for _ in range(30):
        session.do(Step())
        if session.message:
            break
    assert "left the grid" in session.message and "\n" not in session.message
    assert not session.playing
    there = session.shown()
    assert all(np.isfinite(part).all() for part in there.splats)
    session.do(Play())
    session.advance()
    assert not session.playing and session.shown().number == there.number
    assert "left the grid" in session.message
    session.do(Reset())
    assert session.message == "" and bytes_of(session) == first
    steps(session, 1)


@pytest.mark.slow
def test_a_larger_scene_runs_on_a_coarser_grid():
    fine = scene(domain=Domain((SIDE,) * 3, 0.02))
    session = Session(fine, (cube(),), nodes=5000, gaussians=100)
    assert np.prod(session.built.simulation.config.grid.shape) <= 5000
    assert session.built.look.gaussians.count == 100
    assert session.saved() == fine
    assert steps(session, 1).shape == (100, 3)


def test_energies_are_those_of_a_fall():
    """In free fall gravity's energy becomes motion, and nothing is stored."""
    free = Session(scene(boundaries=()), (cube(),))
    start = free.shown().energies
    steps(free, 4)
    taken, now = free.moment.metrics["steps"], free.shown().energies
    mass = 1000.0 * float(np.sum(np.asarray(free.built.simulation.model.volume)))
    fallen = 0.5 * 5.0 * 0.08**2
    assert start["kinetic"] == 0
    assert now["kinetic"] == pytest.approx(mass * 5.0 * fallen, rel=0.01)
    total = sum(now.values()) - sum(start.values())
    # Semi-implicit steps fall by g t^2 / 2 (1 + 1 / n).
    assert total == pytest.approx(-now["kinetic"] / taken, rel=0.05)
    assert now["elastic"] < 1e-3 * now["kinetic"]


def test_what_is_no_command_of_a_simulation_is_said(session):
    session.do(Seek(3))
    assert "Seek" in session.message


def test_a_scene_that_cannot_be_built_is_refused():
    with pytest.raises(InputError, match="material"):
        Session(scene(objects=(Object(material="cheese"),)), (cube(),))


def test_pictures_are_those_of_the_renderer():
    small = Session(scene(width=64, height=48, background=(0.0, 0.0, 0.0)), (cube(),))
    pixels = small.picture(small.camera)
    assert pixels.shape == (48, 64, 3) and pixels.dtype == np.uint8
    # Grey matter in the middle, nothing in the corners.
    assert (np.abs(pixels[22:26, 30:34].astype(int) - 128) < 6).all()
    assert (pixels[:3, :3] == 0).all()
