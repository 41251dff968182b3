"""What a scene does not list is not in its program: one test a part, by its primitives.

Each part is asked for once, as a control: then its primitives are there.
"""

from dataclasses import replace
from functools import partial
from typing import get_args

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.program import parts
from jaxphys.gaussians.gaussians import Gaussians, to_splats
from jaxphys.mpm import APIC, FLIP, PIC, Adaptive, Checkpointed, Plain, Transfer
from jaxphys.mpm import boundaries as listed
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.adaptive import rollout_adaptively
from jaxphys.mpm.loop.rollout import rollout, step
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN
from jaxphys.mpm.materials.fracture import FRACTURE
from jaxphys.mpm.materials.plasticity import (
    DRUCKER_PRAGER,
    PERFECT_VON_MISES,
    UNCORRECTED_DRUCKER_PRAGER,
)
from jaxphys.mpm.state import Config, Model, initial_state
from jaxphys.pipeline.deform import deform
from jaxphys.render import Settings, look_at, render
from tests.mpm.cases import count_primitives

COUNT = 24
PLACE = 0.3 + 0.3 * np.random.default_rng(0).random((COUNT, 3))


def scene(
    law=NEO_HOOKEAN,
    *,
    bounds=(),
    gravity=False,
    dtype=jnp.float64,
    laws=None,
    field=None,
    **options,
):
    """(config, model, state): the smallest scene, with what is asked for."""
    grid = Grid((10, 10, 10), 0.1)
    config = Config(grid, laws or ((law, 0, COUNT),), check_step=False, **options)
    setting = listed.Setting(grid, PLACE, np.full(COUNT, 1e-4), np.dtype(dtype))
    made = listed.prepare(bounds, setting)
    names = {name for one, _, _ in config.segments for name in one.parameters}
    model = Model(
        mass=jnp.full(COUNT, 0.1, dtype),
        volume=jnp.full(COUNT, 1e-4, dtype),
        parameters={name: jnp.full(COUNT, 0.3, dtype) for name in names},
        gravity=jnp.array([0, 0, -9.8], dtype) if gravity else None,
        boundaries=made,
        field=field,
    )
    return config, model, initial_state(config, PLACE, dtype=dtype, boundaries=made)


def marks(config, model, state):
    """Parts of a step that are marked, with how many primitives each has."""
    return parts(partial(step, config), model, state, 1e-3)


def count(config, model, state, *names):
    jaxpr = jax.make_jaxpr(partial(step, config))(model, state, 1e-3).jaxpr
    return sum(count_primitives(jaxpr, name) for name in names)


@pytest.fixture(scope="module")
def smallest():
    return marks(*scene())


def test_the_smallest_scene_has_a_law_and_nothing_else(smallest):
    assert set(smallest) == {"law neo-Hookean"}


MARKED = {
    "return map": scene(PERFECT_VON_MISES),
    "eigen-decomposition": scene(HENCKY),
    "polar rotation": scene(FIXED_COROTATED),
    "history": scene(FRACTURE),
    "second deformation gradient": scene(PERFECT_VON_MISES, track_total=True),
    "gravity": scene(gravity=True),
    "compensated sums": scene(dtype=jnp.float32),
    "velocity of its own": scene(transfer=Transfer(FLIP(0.9))),
    "contact between objects": scene(fields=2, field=jnp.arange(COUNT, dtype=jnp.int32) % 2),
    "contact": scene(bounds=(listed.Plane((0, 0, 0.2), (0, 0, 1.0), friction=0.0),)),
    "friction": scene(bounds=(listed.Plane((0, 0, 0.2), (0, 0, 1.0), friction=0.4),)),
}


@pytest.mark.parametrize("name", MARKED)
def test_a_marked_part_is_there_where_it_is_asked_for_alone(smallest, name):
    assert name not in smallest
    assert marks(*MARKED[name])[name] > 0


MIDDLE, SOME = (0.4, 0.4, 0.4), (0.2, 0.2, 0.2)
UP = (0.0, 0.0, 1.0)
BOUNDARIES = (
    listed.Walls(),
    listed.Plane((0.0, 0.0, 0.2), UP),
    listed.Box(MIDDLE, SOME),
    listed.Ball((0.4, 0.4, 0.1), 0.1),
    listed.Cuboid((0.4, 0.4, 0.1), (0.1, 0.1, 0.05)),
    listed.Cylinder((0.4, 0.4, 0.1), 0.1, 0.05),
    listed.Capsule((0.4, 0.4, 0.1), 0.1, 0.05),
    listed.Impulse(MIDDLE, SOME, (0.0, 0.0, 1.0)),
    listed.Translate(MIDDLE, SOME, (0.0, 0.0, 1.0)),
    listed.Rotate(MIDDLE, UP, 0.2, 0.2, angular_velocity=1.0),
    listed.Release(UP, 0.3, 0.5),
    listed.Cut(MIDDLE, UP),
    listed.Damping(1.0),
)


@pytest.mark.parametrize("boundary", BOUNDARIES, ids=lambda boundary: boundary.type)
def test_a_boundary_costs_those_who_list_it(smallest, boundary):
    assert not any("boundary" in mark for mark in smallest)
    found = [mark for mark in marks(*scene(bounds=(boundary,))) if "boundary" in mark]
    assert found == [f"boundary 0 {boundary.type}"]


def test_every_boundary_is_among_them():
    known = {boundary.type for boundary in BOUNDARIES} | {listed.MeshObstacle.type}
    assert known == {one.type for one in get_args(listed.AnyBoundary)}


def test_one_material_has_the_code_of_one():
    one, two = (
        scene(laws=((NEO_HOOKEAN, 0, COUNT // 2), (other, COUNT // 2, COUNT)))
        for other in (NEO_HOOKEAN, FIXED_COROTATED)
    )
    laws = [[mark for mark in marks(*made) if mark.startswith("law ")] for made in (one, two)]
    assert laws == [["law neo-Hookean"], ["law neo-Hookean", "law fixed corotated"]]
    # Two segments of one law are one run of chunks: as many transfers as one segment has.
    names = ("gather", "scatter-add")
    assert count(*one, *names) == count(*scene(), *names) < count(*two, *names)


def test_what_corrects_no_volume_keeps_no_record_of_it():
    corrected, plain = scene(DRUCKER_PRAGER), scene(UNCORRECTED_DRUCKER_PRAGER)
    assert "history" in marks(*corrected) and "history" not in marks(*plain)
    assert plain[2].history is None and count(*plain, "add") < count(*corrected, "add")


def test_a_transfer_without_affine_terms_does_not_compute_them():
    names = ("mul", "add")
    plain, affine = (count(*scene(transfer=Transfer(s)), *names) for s in (PIC(), APIC()))
    assert plain < affine


def _loops(adjoint, differentiate):
    config, model, state = scene()

    def loss(position):
        end = rollout(
            config, model, state._replace(position=position), dt=1e-3, steps=6, adjoint=adjoint
        )
        return jnp.sum(end.position)

    function = jax.grad(loss) if differentiate else loss
    return jax.make_jaxpr(function)(state.position).jaxpr


def test_what_is_not_differentiated_keeps_no_checkpoints():
    names = ("checkpoint", "remat", "remat2")

    def kept(adjoint, differentiate):
        jaxpr = _loops(adjoint, differentiate)
        return sum(count_primitives(jaxpr, name) for name in names)

    assert kept(Plain(), False) == kept(Plain(), True) == 0
    assert kept(Checkpointed(2), True) > 0


def test_fixed_steps_have_no_look_at_the_bounds():
    config, model, state = scene()
    fixed = jax.make_jaxpr(partial(rollout, config, steps=6))(model, state, dt=1e-3).jaxpr
    adaptive = jax.make_jaxpr(
        lambda m, s: rollout_adaptively(config, m, s, Adaptive(), duration=1e-2)
    )(model, state).jaxpr
    for name in ("while", "acos"):
        assert count_primitives(fixed, name) == 0 < count_primitives(adaptive, name)


def test_the_empty_grid_is_not_computed():
    config, model, state = scene()
    wide = replace(config, grid=Grid((40, 40, 40), 0.1))

    def largest(config):
        jaxpr = jax.make_jaxpr(partial(step, config))(model, state, 1e-3).jaxpr
        sizes = [v.aval.size for e in jaxpr.eqns for v in e.outvars if hasattr(v.aval, "size")]
        return max(sizes)

    assert largest(wide) >= 4 * 40**3
    assert largest(windowed(wide, state)) < 4 * 12**3 + 1


# Pictures.

CAMERA = look_at((0.0, -2.0, 0.5), (0.0, 0.0, 0.0), width=16, height=16)


def gaussians(degree):
    return Gaussians(
        means=jnp.zeros((COUNT, 3)),
        log_scales=jnp.full((COUNT, 3), -3.0),
        quaternions=jnp.tile(jnp.array([1.0, 0, 0, 0]), (COUNT, 1)),
        opacity_logits=jnp.zeros(COUNT),
        harmonics=jnp.zeros((COUNT, (degree + 1) ** 2, 3)),
    )


def test_harmonics_have_the_terms_of_their_degree():
    eye = jnp.zeros(3) + 1.0
    sizes = [
        len(str(jax.make_jaxpr(to_splats)(gaussians(degree), eye)).splitlines())
        for degree in (0, 1, 2, 3)
    ]
    assert sizes == sorted(set(sizes))
    turned = [
        parts(deform, gaussians(degree), jnp.zeros((COUNT, 3)), jnp.zeros((COUNT, 3, 3)), eye)
        for degree in (0, 1)
    ]
    assert "turned view directions" not in turned[0] and "turned view directions" in turned[1]


def test_a_picture_without_depth_blends_one_number_less():
    splats = to_splats(gaussians(0), jnp.zeros(3))
    pixels = Settings().tile_size ** 2

    def blended(settings, numbers):
        """How many arrays hold so many numbers of every pixel of a tile."""
        image = partial(render, settings=settings, capacity=256)
        text = str(jax.make_jaxpr(lambda s: image(s, CAMERA)[:2])(splats))
        return text.count(f",{numbers},{pixels}]")

    # Colours, depth and what is covered; or without depth.
    full, plain = Settings(), Settings(depth=False)
    assert blended(full, 5) > 0 == blended(plain, 5)
    assert blended(plain, 4) > 0 == blended(full, 4)
    assert render(splats, CAMERA, settings=plain).depth is None
