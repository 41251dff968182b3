import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import axes, scales
from jaxphys.gaussians.harmonics import dc_to_rgb
from jaxphys.guidance.library import is_known, library_object, nearest_kinds


def test_an_object_is_what_the_words_say():
    gaussians, made = library_object("a blue ball, striped", seed=2, count=2000)
    assert made["kind"] == "ball" and gaussians.count == 2000
    points = np.asarray(gaussians.means)
    radius = np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(radius, 0.5, atol=0.01)
    # Discs: thin along the third axis, which is the normal, and as wide as to close the surface.
    size = np.asarray(scales(gaussians))
    assert (size[:, 2] < 0.2 * size[:, 0]).all()
    normal = np.asarray(axes(gaussians))[:, 2].T / size[:, 2:]
    assert np.abs((normal * points).sum(1) / radius).min() > 0.97
    area = (2 * np.pi * size[:, 0] ** 2).sum()
    assert 1.5 < area / (4 * np.pi * 0.25) < 6


def test_same_seed_same_object_and_colours_as_asked():
    (one, _), (again, _) = (library_object("a red mug", 1, 500) for _ in range(2))
    other, made = library_object("a green mug", 2, 500)
    np.testing.assert_array_equal(one.means, again.means)
    assert np.abs(np.asarray(one.means) - np.asarray(other.means)).max() > 1e-3
    red, green = (np.median(dc_to_rgb(g.harmonics[:, 0]), axis=0) for g in (one, other))
    assert red[0] > red[1] and green[1] > green[0]
    assert made["colours"]["body"] == "green"


def test_the_unknown_is_refused_with_what_is_near():
    assert is_known("a teapot") and not is_known("a zebrafish")
    with pytest.raises(InputError, match=r"'a hamster'.*cat.*jaxphys priors"):
        library_object("a hamster, brown", count=10)
    assert nearest_kinds("a lemonade lemon")[0] == "lemon"
