import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import Gaussians, concatenate, from_points, to_splats
from jaxphys.gaussians.harmonics import dc_to_rgb
from jaxphys.gaussians.surface import gaussians_from_mesh
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.transfer.kernels import QUADRATIC
from jaxphys.render.camera import orbit, position
from jaxphys.render.renderer import render
from jaxphys.scene.build import build
from jaxphys.scene.place import place
from jaxphys.scene.scene import Domain, Filling, Object, Rotation, Scene
from tests.gaussians.test_mesh import plain

SPACING = 1 / 12
GRID = Grid((30, 30, 30), SPACING)
CONE = trimesh.creation.cone(0.6, 1.2)  # 1.2 across and high
THING = Object(size=0.9, centre=(1.2, 1.2, 1.2))


def cone(count=2000) -> Gaussians:
    g = gaussians_from_mesh(plain(CONE), count, seed=0)
    z = np.asarray(g.means)[:, 2]
    stripes = np.stack([z % 0.2 < 0.1, z > 0.5, np.ones_like(z)], axis=1).astype(np.float32)
    return dataclasses.replace(g, harmonics=jnp.asarray((stripes[:, None] - 0.5) / 0.2821))


def put(thing, gaussians=None):
    return place(
        cone() if gaussians is None else gaussians, thing, GRID, QUADRATIC, "objects[0]", 0
    )


def volume_of(placed):
    """Volume of the cone at the scale it was placed at: that of the box of its splats, by a chord,
    since no splat sits on the very tip.
    """
    chords = [np.asarray(g.means)[[0, 1000]] for g in (placed.moving, cone())]
    placed_chord, own = (np.linalg.norm(ends[1] - ends[0]) for ends in chords)
    return CONE.volume * (placed_chord / own) ** 3


def test_mass_is_that_of_the_mesh_at_every_place_and_turn():
    here = put(THING)
    assert np.ptp(np.asarray(here.moving.means), axis=0).max() == pytest.approx(0.9, rel=1e-5)
    assert here.volumes.shape == (here.moving.count + len(here.filling),)
    assert here.volumes.sum() == pytest.approx(volume_of(here), rel=0.01)
    third = np.array([1, -1, 2]) * SPACING / 3
    there = put(dataclasses.replace(THING, centre=tuple(np.array(THING.centre) + third)))
    np.testing.assert_array_equal(there.volumes, here.volumes)
    np.testing.assert_allclose(there.filling - third, here.filling, atol=1e-6)
    turned = put(dataclasses.replace(THING, rotation=(Rotation((1.0, 2.0, 0.5), 37.0),)))
    assert turned.volumes.sum() == pytest.approx(volume_of(turned), rel=0.01)


def test_the_solver_weighs_what_was_placed():
    scene = Scene(objects=(THING,), domain=Domain((2.4, 2.4, 2.4), SPACING), frame_time=0.01)
    g = cone()
    placed = put(THING, g)
    model = build(scene, g, placed=(placed,)).simulation.model
    density = float(model.mass[0] / model.volume[0])
    assert float(jnp.sum(model.mass)) == pytest.approx(density * volume_of(placed), rel=0.01)


def test_a_block_of_points_that_stays_as_it_is_has_a_cube_for_each():
    ticks = np.arange(8.0)
    points = np.stack(np.meshgrid(ticks, ticks, ticks), -1).reshape(-1, 3).astype(np.float32)
    thing = dataclasses.replace(THING, size=0.7, filling=None)
    placed = put(thing, from_points(points, np.ones(3), 0.3))
    np.testing.assert_allclose(placed.volumes.sum(), 512 * 0.1**3, rtol=0.01)


def pictures(gaussians: Gaussians):
    found = []
    for azimuth, elevation in [(0.3, 0.2), (2.4, 0.9), (4.4, -0.7)]:
        camera = orbit(THING.centre, 2.6, azimuth, elevation, width=96, height=96)
        splats = to_splats(gaussians, position(camera))
        found.append(np.asarray(render(splats, camera, background=(1.0, 1.0, 1.0)).colour))
    return np.stack(found)


def test_a_drawn_filling_is_not_seen_before_the_object_comes_apart():
    plain_look, shown = (
        put(dataclasses.replace(THING, filling=Filling(show=show))) for show in (False, True)
    )
    assert len(shown.filling) == 0
    assert shown.moving.count == plain_look.moving.count + len(plain_look.filling)
    np.testing.assert_array_equal(shown.volumes, plain_look.volumes)
    difference = np.abs(pictures(shown.moving) - pictures(plain_look.moving))
    assert difference.mean() < 1 / 255 and difference.max() < 0.12
    # Negative control: round splats of the usual size at the same places do show.
    points = jnp.asarray(plain_look.filling)
    blocks = concatenate([plain_look.moving, from_points(points, np.ones(3), 0.4 * SPACING / 2)])
    assert np.abs(pictures(blocks) - pictures(plain_look.moving)).max() > 0.2


def test_grains_are_round_and_each_darker_by_a_share_of_its_own():
    thing = dataclasses.replace(THING, filling=Filling(show=True))
    even, grained, again = (
        put(dataclasses.replace(thing, grain=grain)) for grain in (0.0, 0.4, 0.4)
    )
    before, after = (np.asarray(dc_to_rgb(one.moving.harmonics[:, 0])) for one in (even, grained))
    lit = before > 0.5  # a channel of the cone is on or off
    kept = np.where(lit, after / np.where(lit, before, 1), np.nan)
    assert np.nanmin(kept) >= 0.6 - 1e-5 and np.nanmax(kept) <= 1 + 1e-5
    np.testing.assert_allclose(after[~lit], 0, atol=1e-3)
    # The same for every channel of one, and spread evenly over all of them.
    assert (
        np.ptp(np.nan_to_num(kept, nan=np.nanmin(kept, axis=1, keepdims=True)), axis=1).max() < 1e-4
    )
    assert np.std(kept[:, 2]) == pytest.approx(0.4 / np.sqrt(12), rel=0.05)
    # The cone's discs are round grains now, half as wide; what fills it was round already.
    discs, width = 2000, np.median(even.moving.log_scales, axis=1, keepdims=True)
    expected = np.broadcast_to(
        width - np.log(2) * (np.arange(len(width)) < discs)[:, None], (len(width), 3)
    )
    np.testing.assert_allclose(grained.moving.log_scales, expected, atol=1e-5)
    assert np.ptp(np.asarray(even.moving.log_scales)[:discs], axis=1).min() > 1
    for name in ("means", "opacity_logits"):
        np.testing.assert_array_equal(getattr(grained.moving, name), getattr(even.moving, name))
    np.testing.assert_array_equal(grained.volumes, even.volumes)
    np.testing.assert_array_equal(again.moving.harmonics, grained.moving.harmonics)


def test_lone_splats_are_left_out_and_hollow_things_kept():
    g = cone()
    away = np.asarray(g.means).max(0) + np.array([[0.3, 0.3, 0.3], [0.5, 0.0, 0.0]])
    both = concatenate([g, from_points(away.astype(np.float32), np.ones(3), 0.02)])
    placed = put(THING, both)
    assert placed.lone == 2 and placed.moving.count == g.count
    np.testing.assert_allclose(placed.volumes, put(THING, g).volumes)
    cloud = np.random.default_rng(0).uniform(-1, 1, (60, 3)).astype(np.float32)
    cloud[0] = (-2, 0, 0)
    sparse = put(dataclasses.replace(THING, filling=None), from_points(cloud, np.ones(3), 0.1))
    assert sparse.lone == 0 and sparse.moving.count == 60


def test_fewer_splats_are_where_all_of_them_are():
    """A body with a thin stalk, of which hardly a splat is left: where it is and how large all of
    them say, and not those that stay."""
    random = np.random.default_rng(0)
    stalk = np.zeros((40, 3))
    stalk[:, 2] = np.linspace(0.5, 2.0, 40)
    points = np.concatenate([random.uniform(-0.5, 0.5, (2000, 3)), stalk]).astype(np.float32)
    thing, grid = Object(size=0.5, centre=(0.5, 0.5, 0.5), filling=None), Grid((16,) * 3, 1 / 15)
    gaussians = from_points(points, np.full(3, 0.5), 0.02)
    whole, some = (
        place(gaussians, thing, grid, QUADRATIC, "objects[0]", 0, most) for most in (None, 100)
    )
    assert some.moving.count == 100 and some.placement == whole.placement
    body = np.asarray(some.moving.means)[:, :2]
    np.testing.assert_allclose(np.ptp(body, axis=0), 0.5 / 2.5, atol=0.02)


def test_what_cannot_be_placed_names_its_field():
    def refuse(match, **changes):
        with pytest.raises(InputError, match=match):
            put(dataclasses.replace(THING, **changes))

    refuse(r"objects\[0\]\.opacity_threshold", opacity_threshold=0.999)
    refuse(r"objects\[0\]\.area: holds none", area=(5.0, 6.0, 5.0, 6.0, 5.0, 6.0))
    refuse(r"objects\[0\]\.rotation\[0\]\.axis", rotation=(Rotation((0.0, 0.0, 0.0), 3.0),))
    refuse(r"objects\[0\]\.filling: .* more than the maximum of 5", filling=Filling(maximum=5))
    refuse(r"objects\[0\]: reaches from .* change its size or centre", centre=(0.3, 1.2, 1.2))
