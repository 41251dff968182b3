"""Pictures of a fit show obstacles where a trial's numbers, and what pushes them, put them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.fitting import Free, Masks
from jaxphys.fitting.layout import layout
from jaxphys.fitting.motion import motion_at, some, still
from jaxphys.gaussians.gaussians import from_points
from jaxphys.mpm.boundaries import Ball, Steady
from jaxphys.mpm.boundaries import Free as Pushed
from jaxphys.mpm.motion import BodyFrame, Motion
from jaxphys.pipeline.draw import placed_solids
from jaxphys.render.camera import look_at
from jaxphys.scene import Domain, Object, Scene
from jaxphys.scene.build import build

CENTRE, SHIFT = np.array([0.7, 0.4, 0.6]), 0.25


def built(motion):
    """A grain of sand in a corner, and a ball that is drawn."""
    thing = Object(size=0.02, centre=(0.25, 0.25, 0.25), filling=None)
    scene = Scene(
        (thing,), boundaries=(Ball(tuple(CENTRE), 0.1, motion=motion),),
        domain=Domain((1.0, 1.0, 1.0), 1 / 10), frame_time=0.01,
    )  # fmt: skip
    points = np.random.default_rng(0).normal(size=(8, 3)).astype(np.float32)
    return build(scene, from_points(points, np.full((8, 3), 0.5), 0.1), dtype=np.float32)


@pytest.fixture(scope="module")
def pushed():
    return built(Pushed(density=500.0))


def test_a_silhouette_has_the_body_where_it_was_pushed(pushed):
    """Seen along x, a body that went along y by d went by focal d / distance pixels."""
    simulation, look = pushed
    first = still(simulation, (0.0, 0.1))
    centres = jnp.asarray(CENTRE + np.outer([0, SHIFT], [0, 1, 0]), jnp.float32)
    there = BodyFrame(centres, first.body.orientation)
    motion = Motion(*(getattr(first, n) for n in ("position", "deformation", "time", "status",
                                                  "carriers")), there)  # fmt: skip
    camera = look_at((3.7, 0.5, 0.6), (0.7, 0.5, 0.6), width=64, height=36)
    masks = Masks(np.zeros((2, 36, 64)), camera, np.array([0.0, 0.1]))
    stacked = jax.tree.map(lambda part: part[None], camera)
    _, drawn = masks.drawn(motion, look, stacked, masks.capacity(motion, look))
    weights = np.asarray(drawn)[:, 0, :18]  # the upper half, which the grain is not in
    middle = (weights.sum(1) * (np.arange(64) + 0.5)).sum(1) / weights.sum((1, 2))
    expected = float(camera.focal[0]) * SHIFT / 3.0
    assert abs(abs(middle[1] - middle[0]) - expected) < 0.05 * expected


def test_every_motion_of_a_fit_knows_where_the_body_is(pushed):
    simulation, _ = pushed
    traced = jax.eval_shape(lambda s: motion_at(s, (0.0, 0.01, 0.02), 2), simulation)
    assert traced.body.centre.shape == (3, 3) and traced.body.orientation.shape == (3, 4)
    motion = still(simulation, (0.0, 0.01))
    np.testing.assert_allclose(motion.body.centre, [CENTRE, CENTRE], rtol=1e-6)
    assert some(motion, np.array([1])).body.centre.shape == (1, 3)


def test_what_is_drawn_follows_the_free_numbers():
    simulation, look = built(Steady(velocity=(1.0, 0.0, 0.0)))
    free = {
        "boundaries.0.centre": Free((0.7, 0.4, 0.7)),
        "boundaries.0.motion.velocity": Free((0.0, 2.0, 0.0)),
    }
    numbers = layout(free, simulation, look)
    changed, seen = numbers.applied(simulation, look, jnp.asarray(numbers.start(), jnp.float32))
    frame = still(changed, (0.1,))[0]
    (before,), (after,) = placed_solids(look, frame), placed_solids(seen, frame)
    # By hand: 0.1 s at each of the two velocities, and 0.1 m higher.
    np.testing.assert_allclose(
        np.mean(after.means - before.means, axis=0), [-0.1, 0.2, 0.1], atol=1e-5
    )
