"""Implicit steps along the whole path: a scene in JSON, its frames, its plan, its gradient."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.mpm.loop.frames import rollout_frames
from jaxphys.mpm.stepping import Adaptive, Implicit
from jaxphys.mpm.transfer import FLIP, Transfer
from jaxphys.pipeline.frames import simulate
from jaxphys.pipeline.plan import describe
from jaxphys.scene.build import build
from jaxphys.scene.json import scene_from_json

CORNERS = np.stack(np.meshgrid(*3 * [np.linspace(-1, 1, 4)], indexing="ij"), -1).reshape(-1, 3)
GAUSSIANS = from_points(CORNERS.astype(np.float32), np.full((64, 3), 0.5), 0.3)


def scene(material="elastic", **changes):
    """A stiff block on a floor, thrown sideways, whose frames are some 30 explicit steps long."""
    thing = {
        "material": material,
        "size": 0.4,
        "centre": [0.5, 0.5, 0.45],
        "velocity": [0.4, 0.0, 0.0],
        "filling": None,
    }
    if material == "elastic":
        thing["parameters"] = {"youngs_modulus": 3e6, "density": 1000.0}
    written = {
        "objects": [thing],
        "boundaries": [{"type": "plane", "point": [0, 0, 0.18], "friction": 0.3}],
        "domain": {"size": [1.0, 1.0, 1.0], "spacing": 0.1},
        "frame_time": 0.03,
        "frames": 3,
        "stepping": {"type": "implicit"},
    }
    return replace(scene_from_json(written), **changes)


@pytest.mark.slow
def test_frames_are_those_of_explicit_steps():
    """The middle falls as far. On the floor it slides a little further: backward Euler does not
    leap up again, so that it is pressed, and rubs, half as much.
    """
    asked = scene()
    assert asked.stepping == Implicit()
    built = build(asked, GAUSSIANS)
    implicit = simulate(built.simulation, 3)
    explicit = simulate(build(replace(asked, stepping=Adaptive()), GAUSSIANS).simulation, 3)
    assert implicit.status.taken[-1] < 0.3 * explicit.status.taken[-1]
    np.testing.assert_allclose(implicit.time, [0, 0.03, 0.06], rtol=1e-6)
    here, there = (motion.position.mean(axis=1) for motion in (implicit, explicit))
    np.testing.assert_allclose(here[1], there[1], atol=5e-4)
    slid, other = (middle[2, 0] - middle[0, 0] for middle in (here, there))
    assert 0.8 * slid < other < slid < 0.4 * 0.06 and here[0, 2] - here[1, 2] > 0.003
    assert implicit.position[-1][:, 2].min() > 0.18 + 0.05
    plan = describe(asked, built)
    assert "implicit step" in plan.included and plan.stepping.startswith("implicit")
    assert plan.steps_per_frame <= 5 and "an implicit step is" in plan.advice


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (scene("water"), "Newtonian fluid.*explicit"),
        (scene(transfer=Transfer(FLIP())), "APIC and quadratic"),
    ],
)
def test_what_does_not_go_with_them_is_refused_before_anything_runs(asked, words):
    with pytest.raises(InputError, match=words):
        build(asked, GAUSSIANS)


def test_a_step_and_implicit_ones_exclude_each_other():
    with pytest.raises(InputError, match="substep"):
        scene(substep=1e-3)


@pytest.mark.slow
def test_the_gradient_of_a_motion_is_that_of_central_differences():
    exact = Implicit(tolerance=1e-12, reduction=1e-12)
    simulation = build(scene(stepping=exact), GAUSSIANS).simulation
    weights = np.random.default_rng(0).normal(size=(2, 64, 3))

    def loss(scale):
        changed = simulation.with_(youngs_modulus=3e5 * scale, velocity=[0.4, 0.0, -0.5 * scale])
        return (weights * rollout_frames(changed, 3).position[1:]).sum()

    value = jax.jit(loss)
    slope = float(jax.jit(jax.grad(loss))(1.0))
    h = 1e-4
    expected = float(value(1 + h) - value(1 - h)) / (2 * h)
    assert abs(expected) > 1e-2
    assert slope == pytest.approx(expected, rel=1e-3)
