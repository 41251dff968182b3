from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.shape_autoencoder import Field
from jaxphys.guidance.bundled.surface import surface_points


class Ball(nnx.Module):
    """The field of a ball of radius 0.3, red above and blue below."""

    def __init__(self, radius=0.3):
        self.radius = radius
        self.config = SimpleNamespace(half=0.54, grid=20, thickness=0.01, reach=0.1)

    def unfold(self, latents):
        return latents

    def field(self, features, places):
        length = jnp.sqrt(jnp.sum(places**2, -1) + 1e-12)
        distance = jnp.clip(length - self.radius - self.config.thickness, -0.1, 0.1)
        up = jnp.where(places[..., 2:] > 0, 1.0, 0.0)
        return Field(distance, jnp.concatenate([up, 0 * up, 1 - up], -1))


def test_points_lie_on_the_surface_and_know_its_normals_and_colours():
    found = surface_points(Ball(), jnp.zeros((1, 1)), 1500)
    assert found.points.shape == found.normals.shape == found.colours.shape == (1500, 3)
    radius = np.linalg.norm(found.points, axis=1)
    np.testing.assert_allclose(radius, 0.3, atol=1e-4)  # the thickness is taken off again
    np.testing.assert_allclose(found.normals, found.points / radius[:, None], atol=1e-3)
    np.testing.assert_array_equal(found.colours[:, 0], found.points[:, 2] > 0)
    # All around.
    assert np.abs(found.points.mean(0)).max() < 0.02


def test_the_seed_decides():
    one, again, other = (surface_points(Ball(), jnp.zeros((1, 1)), 100, s) for s in (0, 0, 1))
    np.testing.assert_array_equal(one.points, again.points)
    assert np.abs(one.points - other.points).max() > 1e-3


def test_no_surface_is_an_error_that_says_so():
    with pytest.raises(InputError, match="no surface"):
        surface_points(Ball(radius=-1.0), jnp.zeros((1, 1)), 100)
