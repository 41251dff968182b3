"""The pictures and points that the priors learn from, made of the parametric kinds."""

import numpy as np

from experiments.priors import records
from experiments.priors.clouds import cloud_source, kind_of
from experiments.priors.data import splat
from experiments.priors.data.parametric import prepared
from experiments.priors.data.pictures import pictures
from jaxphys.guidance import views
from jaxphys.library import PRINCIPAL
from jaxphys.library.palette import golden_directions


def sphere(radius, count):
    """Points and normals (count, 3) of a sphere about the origin."""
    unit = golden_directions(count)
    return radius * unit, unit


def test_what_is_inside_is_left_out_and_normals_point_outward():
    rng = np.random.default_rng(0)
    outer, inner = sphere(0.5, 60000), sphere(0.3, 15000)
    points, normals = (
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
    points, _ = sphere(0.5, 60000)
    colours = np.stack([points[:, 0] > 0, points[:, 1] > 0, 0 * points[:, 2]], -1)
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
    lit = views.lit(white, np.array([[0, 0, 1.0], [0, 0, -1.0]]))
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
    (once, captions), (again, same) = (prepared("mushroom", 0, 4) for _ in range(2))
    assert once.points.shape == once.colours.shape == once.normals.shape == (4096, 3)
    assert once.points.dtype == np.float16 and once.colours.dtype == np.uint8
    length = np.linalg.norm(once.normals.astype(float) / 127, axis=1)
    np.testing.assert_allclose(length, 1, atol=0.01)
    assert np.abs(once.points).max() <= 0.52
    assert once.images.shape == (4, 64, 64, 4) and once.images.dtype == np.uint8
    assert (once.images[..., 3].mean((1, 2)) > 10).all()
    low, high = views.ELEVATIONS
    assert (once.elevation >= low - 1e-6).all() and (once.elevation <= high + 1e-6).all()
    assert captions == same and len(captions) > 1
    for first, second in zip(once, again, strict=True):
        np.testing.assert_array_equal(first, second)


def test_fresh_clouds_are_lit_new_and_repeatable():
    kinds = [kind_of(name) for name in ("parametric-t-shirt-003", "parametric-fir_tree-011")]
    assert kinds == ["t-shirt", "fir tree"]
    assert kind_of("furniture-chairs-one") is None and kind_of("emoji-1f34e") is None
    draw = cloud_source(None, ["mushroom"], 256)
    one, two = draw(np.random.default_rng(1), 2)
    assert one.points.shape == one.colours.shape == one.normals.shape == (256, 3)
    assert "mushroom" in one.caption or "toadstool" in one.caption
    again = draw(np.random.default_rng(1), 2)
    np.testing.assert_array_equal(one.points, again[0].points)
    assert not np.array_equal(one.points, two.points)


def test_kinds_are_drawn_alike_however_many_variants_there_are():
    principal = PRINCIPAL[0].replace(" ", "_")
    names = [f"parametric-mug-{k:03d}" for k in range(8)] + ["parametric-car-000"]
    names += [f"parametric-{principal}-000", "furniture-a-b", "furniture-a-c", "emoji-1f34e"]
    fields = dict.fromkeys(records.Records.__dataclass_fields__)
    held_out = np.arange(len(names)) == 0
    weight = records.Records(**fields | {"name": np.array(names), "held_out": held_out}).weights()
    assert weight[0] == 0
    np.testing.assert_allclose(weight[1:8].sum(), weight[8])
    np.testing.assert_allclose(weight[9], records.PRINCIPAL_WEIGHT * weight[8])
    np.testing.assert_allclose(weight[:10].sum(), records.SHARES["parametric"])
    np.testing.assert_allclose(weight[10:12].sum(), records.SHARES["furniture"])
    np.testing.assert_allclose(weight[10], weight[11])
