"""A run held to a tolerance, from the scene to what is said, on pilots made coarse for the test."""

import dataclasses
import json
from itertools import islice

import jax
import numpy as np
import pytest

from jaxphys.accuracy.convergence import NoOrder
from jaxphys.core.errors import InputError
from jaxphys.mpm.stepping import Implicit
from jaxphys.pipeline import pilots, tolerance
from jaxphys.pipeline.animate import animate
from jaxphys.pipeline.frames import frames
from jaxphys.pipeline.pace import pace, programs
from jaxphys.pipeline.plan import ball, make_plan
from jaxphys.scene import Domain, Object, Scene, read_scene
from jaxphys.scene.build import build


def spinning(**changes):
    """A jelly ball that spins in free space, and bulges: smooth, so that an order shows."""
    thing = Object(
        material="jelly",
        parameters={"youngs_modulus": 3e3},
        size=0.6,
        centre=(0.8, 0.8, 0.8),
        spin=(0.0, 2.0, 6.0),
    )
    scene = Scene(
        objects=(thing,),
        gravity=(0.0, 0.0, 0.0),
        domain=Domain((1.6, 1.6, 1.6), 1 / 12),
        frames=4,
        frame_time=0.03,
        width=32,
        height=24,
    )
    return dataclasses.replace(scene, **changes)


@pytest.fixture
def coarse(monkeypatch):
    monkeypatch.setattr(pilots, "CELLS", 3.0)
    monkeypatch.setattr(pilots, "MOST_PILOTS", 3)


@pytest.mark.slow
def test_a_run_held_to_a_tolerance_says_what_it_expects_and_what_came(coarse, tmp_path):
    said = []
    out = animate(
        spinning(), tmp_path / "run", objects=(ball(300),), tolerance=0.2, tell=said.append
    )
    told = json.loads((out / "accuracy.json").read_text())
    assert told["spacing"] == read_scene(out / "config.json").scene.domain.spacing
    assert told["expected_error"] <= 0.2 and 0.5 <= told["order"] <= 3
    assert 0 < told["estimated_error"] < 0.2
    before, after = said
    assert "pilots on grids of" in before and "is expected" in before
    assert "within the tolerance" in after and "NOT" not in after


@pytest.mark.slow
def test_a_plan_is_of_the_grid_that_the_tolerance_asks_for(coarse):
    said = []
    plan = make_plan(spinning(), tolerance=0.2, tell=said.append)
    assert plan.grid != spinning().domain.shape and len(said) == 1
    assert f"{plan.particles} particles" in said[0]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"substep": 1e-4}, "leave out substep"),
        ({"stepping": Implicit()}, "implicit"),
        ({"frames": 1}, "no motion"),
    ],
)
def test_scenes_that_pilots_say_nothing_of_are_refused(changes, why):
    with pytest.raises(InputError, match=why):
        tolerance.plan_for(spinning(**changes), (ball(300),), 0.1)


@pytest.mark.parametrize("value", [0.0, -1.0, 2.0, float("nan")])
def test_a_tolerance_out_of_range_is_refused(value):
    with pytest.raises(InputError, match="give a relative error"):
        tolerance.plan_for(spinning(), (ball(300),), value)


def test_matter_that_breaks_has_no_order():
    thing = dataclasses.replace(spinning().objects[0], material="fracture", parameters={})
    with pytest.raises(NoOrder, match="breaks"):
        tolerance.plan_for(spinning(objects=(thing,)), (ball(300),), 0.1)


def test_a_pilot_follows_the_points_of_a_rigid_flight(coarse):
    """What flies free keeps its shape: every point is where Galileo says."""
    thing = dataclasses.replace(spinning().objects[0], spin=(0.0, 0.0, 0.0), velocity=(1.0, 0, 0))
    scene = spinning(objects=(thing,), gravity=(0.0, 0.0, -2.0)).filmed()
    objects = (ball(300),)
    points = (np.arange(0, 300, 7),)
    flown = pilots.fly(scene, objects, points, 0.15)
    start = np.asarray(build(scene, *objects).look.gaussians.means)[points[0]]
    for number, place in enumerate(flown.motion):
        time = number * scene.seconds_per_frame
        expected = start + np.array([time, 0.0, -(time**2)])
        np.testing.assert_allclose(place, expected, atol=2e-3)
    assert flown.boxes.shape == (4, 2, 3) and np.all(flown.boxes[:, 0] < flown.boxes[:, 1])


def test_the_pace_is_that_of_steps_and_a_window_that_moves_is_compiled_again():
    simulation = build(spinning(), ball(300)).simulation
    measured = pace(simulation, budget=0.05)
    assert measured.compile > 0 and measured.step > 0 and measured.steps >= simulation.steps // 2
    compiled = []

    def note(name, seconds, **more):
        compiled.extend([name] * name.endswith("backend_compile_duration"))

    jax.monitoring.register_event_duration_secs_listener(note)
    list(islice(frames(simulation, particles=simulation.carriers), 2))
    assert not compiled  # it was all there, or its seconds would be nobody's
    list(islice(frames(simulation), 1))
    assert compiled  # another look is another program: the listener hears
    here = np.array([[0.5, 0.5, 0.5], [1.1, 1.1, 1.1]])
    large = np.array([[0.2, 0.2, 0.2], [1.4, 1.4, 1.4]])
    still = programs(simulation, np.stack([here] * 4))
    assert still == 1 and programs(simulation, np.stack([here, large, large, large])) <= 2
