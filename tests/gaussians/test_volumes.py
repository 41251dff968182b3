import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from jaxphys.gaussians.filling import FillingConfig, fill
from jaxphys.gaussians.gaussians import from_points, transform
from jaxphys.gaussians.lone import lone_points
from jaxphys.gaussians.surface import gaussians_from_mesh
from jaxphys.gaussians.volumes import cell_volumes
from tests.gaussians.test_mesh import plain

TURN = Rotation.from_rotvec([0.3, 0.5, 0.9]).as_matrix()
SHAPES = {
    "ball": trimesh.creation.icosphere(subdivisions=4),
    "box": trimesh.creation.box(extents=[2, 1, 1]),
    "cone": trimesh.creation.cone(0.6, 1.5),
}
CONFIG = FillingConfig(0.15)


def lattice(*shape):
    ticks = [np.arange(n, dtype=float) for n in shape]
    return np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)


def skin(name, count=3000):
    return gaussians_from_mesh(plain(SHAPES[name]), count, seed=1, dtype=jnp.float64)


@pytest.mark.parametrize("name", SHAPES)
def test_a_filled_mesh_has_the_volume_of_the_mesh(name):
    g = skin(name)
    for spacing in (0.12, 0.2):
        volumes = fill(g, FillingConfig(spacing)).volumes
        # By the divergence theorem, which the filling knows nothing of.
        np.testing.assert_allclose(volumes.sum(), SHAPES[name].volume, rtol=0.01)


def test_nothing_depends_on_the_place_and_the_volume_not_on_the_turn():
    g = skin("cone")
    filled = fill(g, CONFIG)
    for shift in ([0.15 / 3, 0.05, -0.02], [1.9, 7.0, 3.01]):
        moved = fill(transform(g, translation=jnp.asarray(shift)), CONFIG)
        np.testing.assert_allclose(moved.points - shift, filled.points, atol=1e-6)
        np.testing.assert_allclose(moved.volumes, filled.volumes, rtol=1e-3, atol=1e-9)
    larger = fill(transform(g, scale=4.0), FillingConfig(0.6))
    np.testing.assert_allclose(larger.points, 4 * filled.points, atol=1e-5)
    np.testing.assert_allclose(larger.volumes, 64 * filled.volumes, rtol=1e-3)
    turned = fill(transform(g, jnp.asarray(TURN)), CONFIG).volumes
    np.testing.assert_allclose(turned.sum(), filled.volumes.sum(), rtol=5e-3)


def test_no_particle_of_a_body_is_off_its_share():
    g = skin("ball")
    filled = fill(g, CONFIG)
    inner = filled.volumes[g.count :] / CONFIG.pitch**3
    assert inner.min() > 1 / 1.51 and inner.max() < 1.51
    outer = filled.volumes[: g.count]
    assert outer.max() < 1.5 * outer.mean() and outer.min() > outer.mean() / 1.5
    # The skin's layer reaches from the surface about half a pitch down, where the filling begins.
    depth = outer.sum() / SHAPES["ball"].area / CONFIG.pitch
    assert 0.25 < depth < 1.0
    # The centre of mass is that of the ball.
    points = np.concatenate([np.asarray(g.means), filled.points])
    middle = filled.volumes @ points / filled.volumes.sum()
    assert np.abs(middle).max() < 0.01


def test_the_filling_is_inside_and_evenly_spread():
    g = skin("ball")
    points = fill(g, CONFIG).points
    assert np.linalg.norm(points, axis=1).max() < 1 - 0.2 * CONFIG.pitch
    distance = cKDTree(points).query(points, k=2)[0][:, 1] / CONFIG.pitch
    # Drawn at random within cells: 0.3 and more of the mean, and some almost coincide.
    assert distance.min() > 0.5 and distance.std() / distance.mean() < 0.16
    assert cKDTree(np.asarray(g.means)).query(points)[0].min() > 0.5 * CONFIG.pitch


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
@pytest.mark.parametrize("shape", [(6, 6, 6), (12, 12, 12)])
def test_a_block_of_points_has_a_cube_for_each(shape, turn):
    for shift in (0.0, 0.4999999):
        points = 0.05 * (lattice(*shape) @ turn.T + shift)
        share = cell_volumes(points, 1.0) / 0.05**3
        assert abs(share.mean() - 1) < 0.01
        assert share.min() > 1 / 1.5 and share.max() < 1.5


def test_sheets_threads_and_single_particles():
    sheet = cell_volumes(lattice(12, 12, 1), 1.0)
    assert np.median(sheet) == pytest.approx(1.0, abs=0.05) and sheet.max() < 2.5
    thread = cell_volumes(lattice(40, 1, 1), 1.0)
    assert 1.0 < thread.mean() < 3.0
    np.testing.assert_allclose(cell_volumes(lattice(2, 1, 1), 0.3), 0.3**3)
    assert cell_volumes(np.zeros((0, 3)), 0.3).shape == (0,)
    together = cell_volumes(np.repeat(lattice(5, 5, 5), 2, axis=0), 1.0)
    assert together.min() > 0 and np.isfinite(together).all()


def test_particles_at_one_place_share_what_one_has():
    lattice = np.stack(np.meshgrid(*[0.1 * np.arange(4.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    alone = cell_volumes(lattice, 0.05)
    twice = cell_volumes(np.concatenate([lattice, lattice[:1], lattice[:1]]), 0.05)
    np.testing.assert_allclose(twice[1:64], alone[1:])
    np.testing.assert_allclose(twice[[0, 64, 65]], alone[0] / 3)
    np.testing.assert_allclose(cell_volumes(np.ones((5, 3)), 0.05), 0.05**3 / 5)


def test_a_random_cloud_is_filled_between_its_points():
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3))
    assert cell_volumes(points, 1.0).sum() == pytest.approx(8.0, rel=0.12)


def test_lone_points():
    ball = np.asarray(skin("ball", 600).means)
    far = np.array([[0.0, 0.0, 1.4], [0.0, 0.0, 1.42], [2.0, 0.0, 0.0]])
    both = np.concatenate([ball, far])
    np.testing.assert_array_equal(np.flatnonzero(lone_points(both, 0.3)), [600, 601, 602])
    assert not lone_points(both, 1.1).any()
    # Two things of a kind are two things; a cloud that nowhere hangs together stays whole.
    assert not lone_points(np.concatenate([ball, ball + 3]), 0.3).any()
    assert not lone_points(ball, 1e-3).any()


def test_a_splat_beside_the_body_weighs_a_little():
    g = skin("ball", 1000)
    fin = np.concatenate([np.asarray(g.means), [[0.0, 0.0, 1.15]]])
    volumes = fill(from_points(fin, np.ones(3), 0.08), CONFIG).volumes
    assert 0 < volumes[1000] <= volumes[:1000].mean()


def test_two_cells_deep_or_not_at_all():
    # Thinner than a cell of the search: a plate of two skins keeps the volume between them.
    plate = trimesh.creation.box(extents=[1, 1, 0.06])
    g = gaussians_from_mesh(plain(plate), 4000, seed=0, dtype=jnp.float64)
    volumes = fill(g, dataclasses.replace(CONFIG, spacing=0.1)).volumes
    np.testing.assert_allclose(volumes.sum(), plate.volume, rtol=0.05)
