import jax.numpy as jnp
import numpy as np

from jaxphys.guidance.view_prompts import unwanted_views, view_mixture


def at(degrees, elevation=0.0):
    azimuth = jnp.deg2rad(jnp.asarray(degrees, float))
    return azimuth, jnp.full_like(azimuth, np.deg2rad(elevation))


def test_mixtures_of_views():
    found = view_mixture(*at([0, 30, 90, -90, 135, 180, 330])).T
    expected = [
        [1, 0, 0, 0],
        [2 / 3, 1 / 3, 0, 0],
        [0, 1, 0, 0],
        [0, 1, 0, 0],
        [0, 0.5, 0.5, 0],
        [0, 0, 1, 0],
        [2 / 3, 1 / 3, 0, 0],
    ]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_allclose(view_mixture(*at([20, 180], 70)).T, [[0, 0, 0, 1]] * 2)


def test_weights_of_views():
    """By hand: 4 e^-r/2 - 2.426 towards the front and side, e^-r/2 + 0.967 and - 0.606 behind."""
    root, half = np.exp(-0.5), np.exp(-0.25)
    found = unwanted_views(*at([0, 45, 90, 135, 180, -135])).T
    behind = [half + 0.967, half - 0.606]
    expected = [
        [4 * root - 2.426, 4 - 2.426],
        [4 * half - 2.426, 4 * half - 2.426],
        [root + 0.967, root - 0.606],
        behind,
        [1.967, 0.394],
        behind,
    ]
    np.testing.assert_allclose(found, expected, atol=6e-4)  # the numbers have three digits
    # Next to nothing against the view itself, and no jump at the side.
    assert found[0, 0] < 2e-3 and found[2, 1] < 2e-3
    near = unwanted_views(*at([89.999, 90.001]))
    assert np.abs(near[:, 0] - near[:, 1]).max() < 2e-3
    assert (unwanted_views(*at(np.arange(360))) >= 0).all()
    np.testing.assert_array_equal(unwanted_views(*at([0, 90, 180], 70)), 0)
