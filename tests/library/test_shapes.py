"""The vocabulary of shapes: closed surfaces that know their inside."""

import numpy as np
import pytest

from jaxphys.library import shapes
from jaxphys.library.model import finish
from jaxphys.library.palette import COLOURS
from jaxphys.library.solids import each, together

PLAIN = {name: np.array(colour) for name, colour in COLOURS.items()}
SQUARE = shapes.oblong(0.8, 0.6)
SHAPES = {
    "ball": (shapes.ball(0.5, 0.3, 0.2), 4 / 3 * np.pi * 0.5 * 0.3 * 0.2),
    "cylinder": (shapes.cylinder(0.3, 0.8), np.pi * 0.09 * 0.8),
    "cone": (shapes.cone(0.4, 0.9), np.pi * 0.16 * 0.9 / 3),
    "ring": (shapes.ring(0.4, 0.1), 2 * np.pi**2 * 0.4 * 0.01),
    "block": (shapes.block(0.8, 0.6, 0.5), 0.24),
    "slab": (shapes.slab(SQUARE, 0.5, top=0.5), 0.24 * (1 + 0.5 + 0.25) / 3),
    "rod": (shapes.rod((0.1, 0.2, 0), (0.5, -0.3, 0.6), 0.1), np.pi * 0.01 * np.sqrt(0.77)),
    "limb": (
        shapes.limb((0, 0, 0), (0, 0.6, 0), 0.2),
        np.pi * 0.04 * 0.6 + 4 / 3 * np.pi * 0.008,
    ),
    "tube": (shapes.tube([(0, 0, 0), (0, 0, 0.9)], 0.2), np.pi * 0.04 * 0.9),
    "hull": (
        shapes.hull([(-0.5, 0.2, -0.2, 0.2), (0.5, 0.2, -0.2, 0.2)], sharp=True),
        np.pi * 0.04,
    ),
    "cup": (
        shapes.lathe([(0, 0), (0.4, 0), (0.4, 0.6), (0.3, 0.6), (0.3, 0.1), (0, 0.1)], sharp=True),
        np.pi * (0.16 * 0.6 - 0.09 * 0.5),
    ),
    "washer": (
        shapes.lathe([(0.2, 0), (0.4, 0), (0.4, 0.1), (0.2, 0.1), (0.2, 0)], sharp=True),
        np.pi * (0.16 - 0.04) * 0.1,
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_volume_by_inside_and_by_surface(name):
    solid, volume = SHAPES[name]
    model = finish({"red": solid}, PLAIN, {})
    size = 1 / model.scale
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (40_000, 3))
    inside = model.inside(places).mean() * size**3
    np.testing.assert_allclose(inside, volume, rtol=0.06)
    # The divergence theorem on the fine triangles: three times the volume if they face outward.
    corners, _ = model.triangles(6)
    enclosed = np.linalg.det(corners).sum() / 6 * size**3
    np.testing.assert_allclose(enclosed, volume, rtol=0.04)


@pytest.mark.parametrize("name", SHAPES)
def test_samples_lie_on_the_surface_with_its_normals(name):
    model = finish({"red": SHAPES[name][0]}, PLAIN, {})
    surface = model.sample(1500, np.random.default_rng(0))
    step = 0.012
    assert model.inside(surface.points - step * surface.normals).mean() > 0.9
    assert model.inside(surface.points + step * surface.normals).mean() < 0.1


def test_samples_are_even():
    ball = finish({"red": shapes.ball(0.5)}, PLAIN, {})
    points, colours, normals = ball.sample(20_000, np.random.default_rng(0))
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.5, atol=1e-9)
    np.testing.assert_allclose(normals, points / 0.5, atol=1e-3)
    # Archimedes: a ball's area between two heights is in proportion to their difference.
    np.testing.assert_allclose(np.histogram(points[:, 2], 8)[0] / 20_000, 0.125, atol=0.02)
    assert np.unique(colours, axis=0).shape == (1, 3)


def test_what_lies_inside_another_solid_is_not_sampled():
    parts = {"red": shapes.ball(0.5), "blue": [shapes.ball(0.3), shapes.ball(0.2).at(x=0.5)]}
    surface = finish(parts, PLAIN, {}).sample(4000, np.random.default_rng(0))
    scale = 1 / 1.2
    centre = np.array([0.1, 0, 0])
    places = surface.points / scale + centre
    assert (np.linalg.norm(places, axis=1) > 0.49).all()
    blue = surface.colours[:, 2] > surface.colours[:, 0]
    assert 0.02 < blue.mean() < 0.2  # the half of the small ball that stands out
    assert (np.linalg.norm(places[blue] - (0.5, 0, 0), axis=1) < 0.21).all()


def test_mirrored_and_turned_copies_face_outward():
    one = shapes.cone(0.1, 0.3).turn("x", 40).at(0, 0.3, 0.1)
    model = finish({"red": one.both("y").both("x")}, PLAIN, {})
    assert len(model.solids[0].linear) == 4
    surface = model.sample(2000, np.random.default_rng(0))
    assert model.inside(surface.points - 0.01 * surface.normals).mean() > 0.95
    corners, _ = model.triangles(3)
    assert np.linalg.det(corners).sum() > 0


def test_coats_are_painted_where_they_say_over_what_was_there():
    half = shapes.ball(0.5).coat("blue", lambda u, v, p: p[:, 2] > 0).shade(lambda u, v, p: 0.5)
    surface = finish({"red": half}, PLAIN, {}).sample(2000, np.random.default_rng(0))
    upper = surface.points[:, 2] > 0.01
    np.testing.assert_allclose(surface.colours[upper], [0.5 * PLAIN["blue"]] * upper.sum())
    lower = surface.points[:, 2] < -0.01
    np.testing.assert_allclose(surface.colours[lower], [0.5 * PLAIN["red"]] * lower.sum())


def test_assemblies_join_parts_of_one_name():
    one, two = {"a": shapes.ball(0.1)}, {"a": shapes.ball(0.2), "b": [shapes.ball(0.3)]}
    whole = together(one, each(two, lambda s: s.at(z=1.0)))
    assert [len(whole[name]) for name in ("a", "b")] == [2, 1]
    assert [s.offset[0, 2] for s in whole["a"]] == [0, 1]
