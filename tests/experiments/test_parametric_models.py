"""The parametric models that the priors learn from, and the pictures made of them."""

import numpy as np
import pytest
from experiments.priors.models.surfaces import ellipsoid, sample

from experiments.priors.data import splat
from experiments.priors.data.pictures import pictures
from experiments.priors.data.prepare import prepare
from experiments.priors.models import MODELS, PRINCIPAL, build
from jaxphys.guidance import views


@pytest.mark.parametrize("name", MODELS)
def test_is_finite_centred_and_of_unit_length(name):
    mesh, captions = build(name, 3)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    assert np.isfinite(mesh.vertices).all()
    np.testing.assert_allclose(low + high, 0, atol=1e-9)
    np.testing.assert_allclose((high - low).max(), 1)
    assert mesh.colours.min() >= 0 and mesh.colours.max() <= 1
    assert mesh.triangles.min() >= 0 and mesh.triangles.max() < len(mesh.vertices)
    assert len(captions) == len(set(captions)) >= 2
    assert all(caption == caption.strip() and caption for caption in captions)


def test_is_the_same_for_the_same_seed_only():
    for name in PRINCIPAL:
        first, again, other = build(name, 5), build(name, 5), build(name, 6)
        np.testing.assert_array_equal(first[0].vertices, again[0].vertices)
        np.testing.assert_array_equal(first[0].colours, again[0].colours)
        assert first[1] == again[1]
        assert not np.array_equal(first[0].colours, other[0].colours)


@pytest.mark.parametrize(
    "name, test",
    [
        ("strawberry", lambda r, g, b: (r > g + 0.25) & (r > b + 0.25)),  # red
        ("burger", lambda r, g, b: (r > g) & (g > b)),  # brown to yellow
        ("salmon nigiri", lambda r, g, b: r > b + 0.2),  # orange, beside white rice
        ("pancakes", lambda r, g, b: (r > g) & (g > b + 0.1)),  # golden
        ("cactus", lambda r, g, b: (g > r) & (g > b)),  # green
        ("carrot", lambda r, g, b: (r > g + 0.2) & (g > b)),  # orange
    ],
)
def test_has_its_colour(name, test):
    for seed in range(4):
        mesh, _ = build(name, seed)
        points, normals, colours = sample(mesh, 4000, np.random.default_rng(0))
        visible, _ = splat.visible_surface(
            points.astype(np.float32), normals.astype(np.float32), directions=8, resolution=32
        )
        assert test(*colours[visible].T).mean() > 0.35


def test_captions_name_the_drawn_colour():
    for seed in range(20):
        mesh, captions = build("sponge", seed)
        if any(caption.startswith("a light blue") for caption in captions):
            red, _, blue = mesh.colours.mean(0)
            assert blue > red
            return
    pytest.fail("no blue sponge among twenty")


def test_samples_lie_on_the_surface_with_its_normals():
    ball = ellipsoid((0, 0, 0), 0.5, (1, 0, 0), 96, 64)
    points, normals, colours = sample(ball, 5000, np.random.default_rng(0))
    radius = np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(radius, 0.5, atol=2e-3)
    assert np.abs((normals * points).sum(1) / radius).min() > 0.99
    np.testing.assert_allclose(points.mean(0), 0, atol=0.01)
    np.testing.assert_array_equal(colours, np.tile([1.0, 0, 0], (5000, 1)))


def test_what_is_inside_is_left_out_and_normals_point_outward():
    rng = np.random.default_rng(0)
    outer = sample(ellipsoid((0, 0, 0), 0.5, (1, 0, 0)), 60000, rng)
    inner = sample(ellipsoid((0, 0, 0), 0.3, (0, 0, 1)), 15000, rng)
    points, normals, _ = (
        np.concatenate(pair).astype(np.float32) for pair in zip(outer, inner, strict=True)
    )
    flipped = normals * rng.choice([-1, 1], (len(normals), 1)).astype(np.float32)
    visible, outward = splat.visible_surface(points, flipped)
    assert visible[:60000].mean() > 0.99
    assert visible[60000:].mean() < 0.01
    assert ((outward * points).sum(1)[visible] > 0).mean() > 0.99


def test_pictures_show_the_side_they_are_taken_from():
    # A red half to the front (+x) and a green half to the left of the front camera's right (+y).
    rng = np.random.default_rng(0)
    points, _, colours = sample(
        ellipsoid(
            (0, 0, 0), 0.5, lambda u, v, p: np.stack([p[..., 0] > 0, p[..., 1] > 0, 0 * u], -1)
        ),
        60000,
        rng,
    )
    even = splat.even_subset(points, 4096, rng)
    front, back = pictures(points[even], np.rint(255 * colours[even]), (0.0, np.pi), (0.0, 0.0))
    assert front.shape == (64, 64, 4)
    assert front[32, 20:44, 0].min() > 170
    assert front[32, 20:44, 0].mean() > 230
    # Seen from +x with z up, +y lies to the right.
    assert front[32, 40:50, 1].mean() > 200 > 50 > front[32, 14:24, 1].mean()
    assert back[32, 20:44, 0].mean() < 20
    # Of length 1 at distance 2.5: the silhouette of a ball is sin = 0.5 / 2.5.
    half = np.tan(np.arcsin(0.5 / views.DISTANCE)) / np.tan(views.FIELD_OF_VIEW / 2) * 32
    width = (front[32, :, 3] > 127).sum()
    assert 0 <= width - 2 * half < 4  # a Gaussian reaches some two deviations beyond its centre
    assert (front[..., :3][front[..., 3] == 0] == 0).all()


def test_light_comes_from_above():
    white = np.ones((2, 3))
    lit = splat.bake_light(white, np.array([[0, 0, 1.0], [0, 0, -1.0]]))
    np.testing.assert_allclose(
        lit[:, 0], [views.AMBIENT + views.DIFFUSE, views.AMBIENT - views.DIFFUSE]
    )


def test_view_features_know_what_is_unknown():
    features = views.view_features(
        np.array([0.3, 0.3]), np.array([0.1, 0.1]), np.array([True, False])
    )
    np.testing.assert_allclose(features[0], [np.sin(0.3), np.cos(0.3), 0.1, 1])
    np.testing.assert_array_equal(features[1], 0)
    np.testing.assert_allclose(views.camera_position(np.pi / 2, 0.0), [0, 2.5, 0], atol=1e-12)


def test_prepared_objects_have_the_promised_form():
    mesh, _ = build("mushroom", 0)
    once, again = (prepare(*sample(mesh, 8000, np.random.default_rng(1)), 7) for _ in range(2))
    assert once.points.shape == once.colours.shape == (4096, 3)
    assert once.points.dtype == np.float16 and once.colours.dtype == np.uint8
    assert np.abs(once.points).max() <= 0.5 + 1e-3
    assert once.images.shape == (16, 64, 64, 4) and once.images.dtype == np.uint8
    assert (once.images[..., 3].mean((1, 2)) > 10).all()
    low, high = views.ELEVATIONS
    assert (once.elevation >= low - 1e-6).all() and (once.elevation <= high + 1e-6).all()
    for first, second in zip(once, again, strict=True):
        np.testing.assert_array_equal(first, second)
