import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.pipeline.backdrop import backdrop
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
