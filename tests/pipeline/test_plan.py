"""What a plan says against the program that runs: by its primitives, and by running it."""

import json
from dataclasses import replace
from functools import partial

import jax
import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.mpm.loop.rollout import step
from jaxphys.pipeline.frames import simulate
from jaxphys.pipeline.plan import (
    OPTIONAL,
    as_text,
    describe,
    make_plan,
    measured,
    program_parts,
)
from jaxphys.scene import Domain, Filling, Ground, Object, Plane, Scene, write_scene
from jaxphys.scene.build import build
from tests.mpm.cases import count_primitives


def scene(material="elastic", **changes):
    thing = Object(material=material, size=0.4, centre=(0.5, 0.5, 0.6), filling=None)
    plain = Scene(
        objects=(thing,),
        domain=Domain((1.0, 1.0, 1.0), 1 / 10),
        gravity=(0.0, 0.0, 0.0),
        regularise_colours=False,
        frames=3,
        frame_time=0.01,
        width=64,
        height=48,
    )
    return replace(plain, **changes)


def with_object(scene, **changes):
    return replace(scene, objects=(replace(scene.objects[0], **changes),))


@pytest.fixture(scope="module")
def plain():
    return make_plan(scene())


def test_the_plainest_scene_holds_nothing_optional(plain):
    assert set(OPTIONAL) & set(plain.included) <= {"polar rotation", "compensated sums"}
    assert "law fixed corotated" in plain.included
    assert {"law von Mises", "gravity", "eigen-decomposition", "boundaries", "filling"} <= set(
        plain.left_out
    )


@pytest.mark.parametrize(
    ("part", "changed"),
    [
        ("gravity", scene(gravity=(0.0, 0.0, -1.0))),
        ("eigen-decomposition", scene("metal")),
        ("return map", scene("metal")),
        ("history", scene("fracture")),
        ("mean volume", with_object(scene(), mean_volume=True)),
        ("second deformation gradient", scene("metal")),
        ("colour regularisation", scene(regularise_colours=True)),
        ("drawn floor", scene(ground=Ground(0.1))),
        ("still Gaussians", with_object(scene(), area=(-0.5, 0.5, -0.5, 0.5, -0.4, 0.5))),
        ("boundary 0 plane", scene(boundaries=(Plane((0.5, 0.5, 0.2)),))),
        ("contact", scene(boundaries=(Plane((0.5, 0.5, 0.2)),))),
        ("friction", scene(boundaries=(Plane((0.5, 0.5, 0.2), friction=0.5),))),
        ("filling", with_object(scene(), filling=Filling())),
        ("law Drucker-Prager", scene("sand")),
    ],
)
def test_each_part_comes_with_what_asks_for_it(plain, part, changed):
    assert part not in plain.included
    # The stand-in of an area fills it; half of it must stay outside to stand still.
    if part == "still Gaussians":
        from jaxphys.pipeline.plan import ball

        assert part in describe(changed, build(changed, ball())).included
        return
    assert part in make_plan(changed).included


def test_no_plan_names_a_part_that_the_step_has_no_primitives_of():
    """Decompositions show in the jaxpr by their barriers, gravity by one addition to the grid."""

    def primitives(asked, name):
        simulation, _ = build(asked, *(_stand_ins(asked)))
        jaxpr = jax.make_jaxpr(partial(step, simulation.config))(
            simulation.model, simulation.state, simulation.dt
        )
        return count_primitives(jaxpr.jaxpr, name)

    still, falling = scene(), scene(gravity=(0.0, 0.0, -1.0))
    # Once in each of two passes.
    assert primitives(falling, "add") == primitives(still, "add") + 2
    rough = scene(boundaries=(Plane((0.5, 0.5, 0.2), friction=0.5),))
    smooth = scene(boundaries=(Plane((0.5, 0.5, 0.2), friction=0.0),))
    assert primitives(rough, "sqrt") > primitives(smooth, "sqrt")
    assert "friction" not in make_plan(smooth).included


def _stand_ins(asked):
    from jaxphys.pipeline.plan import stand_in

    return [stand_in(thing, "objects[0]") for thing in asked.objects]


def test_the_plan_is_of_the_program_that_runs():
    asked = scene(boundaries=(Plane((0.5, 0.5, 0.3)),), gravity=(0.0, 0.0, -9.81))
    built = build(asked, *_stand_ins(asked))
    plan = describe(asked, built)
    motion = simulate(built.simulation, asked.frames).check()
    assert plan.steps == int(motion.status.taken[-1])
    assert plan.particles == motion.position.shape[1]
    assert set(program_parts(asked, built)) & set(OPTIONAL) <= set(plan.included)
    given = replace(asked, substep=plan.substep / 3)
    assert describe(given, build(given, *_stand_ins(given))).reason == "the scene's own substep"


def test_an_area_has_a_stand_in_of_its_own():
    area = (4.0, 5.0, -1.0, 1.0, 2.0, 2.6)
    plan = make_plan(with_object(scene(), area=area))
    assert plan.gaussians == 4000 and "still Gaussians" in plan.left_out


def test_the_command_says_the_same(tmp_path, capsys):
    path = tmp_path / "scene.json"
    write_scene(path, scene("sand"))
    assert run(["plan", str(path), "--json", "--no-measure"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["seconds"] is None
    expected = make_plan(scene("sand"))
    assert said["included"] == expected.included and said["steps"] == expected.steps
    assert np.isclose(said["substep"], expected.substep)
    text = as_text(expected)
    assert "law Drucker-Prager" in text and "limited by" in text


def test_time_is_measured_on_the_programs_that_run():
    asked = scene(frames=5)
    built = build(asked, *_stand_ins(asked))
    plan = describe(asked, built)
    assert plan.seconds is None and "time" not in as_text(plan).splitlines()[-1]
    told = measured(asked, built, plan)
    assert set(told.seconds) == {"compile", "simulate", "render"}
    assert min(told.seconds.values()) > 0 and "time on this machine" in as_text(told)
    assert replace(told, seconds=None) == plan


def test_how_devices_share_the_window_is_told():
    plan = replace(make_plan(scene("jelly")), devices=4, chunk=4096, sent=409_600)
    assert "of 4096; each has the window as a whole" in as_text(plan)
    assert "and adds its own to the others', 410 kB a device and step" in as_text(plan)
    slabs = as_text(replace(plan, slab=12))
    assert "each has 12 planes of the window and tells its neighbours, 410 kB" in slabs
    assert "each has" not in as_text(replace(plan, devices=1))


def test_a_law_without_what_is_zero_is_told_as_such():
    plan = make_plan(scene("metal"))
    assert "law von Mises without hardening" in plan.included
    assert plan.left_out["hardening"] == "is zero" and "law von Mises" not in plan.left_out
    assert "law Drucker-Prager" in plan.left_out
    thing = scene("metal").objects[0]
    hard = replace(thing, parameters={"hardening": 1e4})
    plan = make_plan(replace(scene("metal"), objects=(hard,)))
    assert "law von Mises" in plan.included and "hardening" not in plan.left_out
