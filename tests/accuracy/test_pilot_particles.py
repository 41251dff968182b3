import numpy as np

from jaxphys.accuracy.pilot_particles import carried, coarser
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.transfer.kernels import QUADRATIC
from jaxphys.pipeline.plan import ball
from jaxphys.scene.place import place
from jaxphys.scene.scene import Object

GRID = Grid((33, 33, 33), 1 / 16)


def placed(centre=(1.0, 1.0, 1.0)):
    return place(ball(3000), Object(size=0.8, centre=centre), GRID, QUADRATIC, "objects[0]", 0)


def test_matter_its_middle_and_its_filling_stay():
    fine = placed()
    coarse, owner, offset = coarser(fine, 0.1)
    assert 40 < coarse.moving.count < 600 and len(owner) == 3000
    assert np.isclose(coarse.volumes.sum(), np.sum(fine.volumes), rtol=1e-5)

    def middle(one):
        points = np.concatenate([np.asarray(one.moving.means), one.filling])
        return np.average(points, weights=one.volumes, axis=0)

    np.testing.assert_allclose(middle(coarse), middle(fine), atol=1e-5)
    np.testing.assert_array_equal(coarse.filling, fine.filling)
    means = np.asarray(coarse.moving.means)
    np.testing.assert_allclose(means[owner] + offset, fine.moving.means, atol=1e-5)
    assert np.abs(offset).max() <= 0.1


def test_each_particle_is_the_middle_of_its_own():
    fine = placed()
    coarse, owner, _ = coarser(fine, 0.1)
    own = np.asarray(fine.volumes)[:3000]
    for index in (0, 17):
        mine = owner == index
        np.testing.assert_allclose(
            np.average(np.asarray(fine.moving.means)[mine], weights=own[mine], axis=0),
            np.asarray(coarse.moving.means)[index],
            atol=1e-5,
        )
        assert np.isclose(coarse.volumes[index], own[mine].sum(), rtol=1e-5)


def test_a_pitch_that_parts_all_changes_nothing():
    fine = placed()
    coarse, owner, offset = coarser(fine, 1e-4)
    assert len(np.unique(owner)) == 3000 and np.abs(offset).max() < 1e-6
    order = np.argsort(owner)
    np.testing.assert_allclose(coarse.moving.means, np.asarray(fine.moving.means)[order], atol=1e-6)


def test_a_pilot_is_the_same_at_every_place():
    here, there = coarser(placed(), 0.1), coarser(placed((1.03, 0.98, 1.01)), 0.1)
    shift = np.asarray(there.placed.moving.means) - np.asarray(here.placed.moving.means)
    np.testing.assert_allclose(shift, np.broadcast_to([0.03, -0.02, 0.01], shift.shape), atol=1e-4)


def test_points_are_carried_by_an_affine_motion_exactly():
    random = np.random.default_rng(1)
    points, particles = random.normal(size=(2, 30, 3))
    A, b = random.normal(size=(3, 3)), random.normal(size=3)
    deformation = np.broadcast_to(A, (30, 3, 3))
    moved = carried(particles @ A.T + b, deformation, points - particles)
    np.testing.assert_allclose(moved, points @ A.T + b, atol=1e-12)
