import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.pipeline.backdrop import CELLS, backdrop, shadow_map
from jaxphys.render.camera import orbit, to_pixels

LOOK = {"height": 0.0, "colour": (0.5, 0.5, 0.5), "shadow": 0.8, "background": (1.0, 1.0, 1.0)}
MIDDLE, EXTENT = jnp.zeros(2, jnp.float32), jnp.float32(1.0)


def above(height):
    """A disc of points at some height."""
    turn = np.linspace(0, 40, 400)
    radius = 0.2 * np.sqrt(np.linspace(0, 1, 400))
    points = [radius * np.cos(turn), radius * np.sin(turn), np.full(400, height)]
    return jnp.asarray(np.stack(points, 1), jnp.float32)


def view(elevation=0.5):
    return orbit((0.0, 0.0, 0.2), 3.0, 0.3, elevation, width=96, height=64)


def at(picture, point):
    column, row = np.asarray(to_pixels(view(), jnp.asarray([point], jnp.float32)))[0]
    return float(picture[int(row), int(column), 0])


def test_shadow_lies_under_the_object_and_fades_with_height():
    near = backdrop(view(), above(0.01), MIDDLE, EXTENT, **LOOK)
    far = backdrop(view(), above(1.0), MIDDLE, EXTENT, **LOOK)
    none = backdrop(view(), above(0.01), MIDDLE, EXTENT, **{**LOOK, "shadow": 0.0})
    origin, aside = (0.0, 0.0, 0.0), (0.0, 0.9, 0.0)
    assert at(near, origin) < 0.6 * at(none, origin)
    assert at(near, origin) < at(far, origin) < at(none, origin)
    assert abs(at(near, aside) - at(none, aside)) < 0.02


def test_floor_is_its_colour_near_by_and_background_far_away():
    none = backdrop(view(), above(5.0), MIDDLE, EXTENT, **{**LOOK, "shadow": 0.0})
    assert abs(at(none, (0.0, 0.0, 0.0)) - 0.5) < 0.01
    level = backdrop(view(0.0), above(5.0), MIDDLE, EXTENT, **LOOK)
    assert np.allclose(level[0], 1.0)


def test_seen_from_below_there_is_no_floor():
    below = backdrop(view(-0.5), above(0.1), MIDDLE, EXTENT, **LOOK)
    assert np.allclose(below, 1.0)


def test_gradient_is_finite_with_a_point_on_the_floor_and_outside():
    points = jnp.array([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [99.0, 0.0, 0.5]], jnp.float32)

    def total(points):
        return jnp.sum(backdrop(view(), points, MIDDLE, EXTENT, **LOOK))

    assert np.isfinite(np.asarray(jax.grad(total)(points))).all()


def ball(count, gap, radius=0.45):
    """Points on a ball (a Fibonacci lattice) whose lowest is `gap` above the floor."""
    index = np.arange(count) + 0.5
    z, turn = 1 - 2 * index / count, np.pi * (1 + 5**0.5) * index
    ring = np.sqrt(1 - z * z)
    points = radius * np.stack([ring * np.cos(turn), ring * np.sin(turn), z + 1], axis=1)
    return jnp.asarray(points + np.array([0, 0, gap]), jnp.float32)


def profile(count, gap):
    """Mean darkness of the shadow of a ball at distances of whole cells."""
    corner, side = jnp.full(2, -1.6, jnp.float32), jnp.float32(3.2)
    dark = np.asarray(shadow_map(ball(count, gap), 0.0, corner, side))
    middle = np.arange(CELLS) + 0.5 - CELLS / 2
    distance = np.hypot(middle[:, None], middle).astype(int)
    return np.array([dark[distance == k].mean() for k in range(30)])


def test_shadow_of_a_ball_falls_off_without_rings_however_densely_it_is_sampled():
    for gap in (0.0, 0.3):
        sparse, dense = profile(1500, gap), profile(20_000, gap)
        assert np.all(np.diff(dense) < 0) and np.all(np.diff(sparse) < 0)
        assert np.abs(np.diff(dense, 2)).max() < 0.05 * dense[0]  # nor steps
        np.testing.assert_allclose(sparse, dense, atol=0.05 * dense[0])


def test_the_floor_fades_without_bands():
    smooth = LOOK | {"shadow": 0.0, "colour": (0.99, 0.99, 0.99)}
    camera = view()
    picture = np.asarray(backdrop(camera, above(5.0), MIDDLE, EXTENT, **smooth))[..., 0]
    levels = np.round(255 * picture.astype(np.float64))
    # Where each pixel's ray meets z = 0, and the fading there.
    focal, centre = np.asarray(camera.focal), np.asarray(camera.centre)
    column, row = np.meshgrid(np.arange(96) + 0.5, np.arange(64) + 0.5)
    local = np.stack([(column - centre[0]) / focal[0], (row - centre[1]) / focal[1], 1 + 0 * row])
    turn = np.asarray(camera.rotation, np.float64).T
    rays, eye = np.einsum("ij,jhw->ihw", turn, local), -turn @ np.asarray(camera.translation)
    floor = eye[:2, None, None] - eye[2] / rays[2] * rays[:2]
    wanted = 255 * (1 - 0.01 * np.exp(-0.5 * np.sum(floor**2, axis=0)))

    def worst(levels):
        """Largest error of the mean over blocks of the lower half of the picture [levels]."""
        return np.abs((levels - wanted)[32:].reshape(4, 8, 12, 8).mean(axis=(1, 3))).max()

    assert worst(levels) < 0.1 < 0.3 < worst(np.round(wanted))
