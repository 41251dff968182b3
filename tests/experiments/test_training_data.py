"""What the networks are trained on: phrases, fields of distance and colour, and the optimiser."""

import jax.numpy as jnp
import numpy as np

from experiments.priors import judge
from experiments.priors.clouds import Cloud, winding_inside
from experiments.priors.fields import field_at, field_targets
from experiments.priors.muon import is_hidden, orthogonalise
from experiments.priors.phrases import PHRASES, PhraseEncoder, drop_phrases
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig
from jaxphys.library.palette import golden_directions

CONFIG = AutoencoderConfig(thickness=0.01, reach=0.1)


def ball(count=4096, radius=0.4):
    normals = golden_directions(count)
    colours = 0.5 + 0.5 * normals
    inside = lambda places: np.linalg.norm(places, axis=1) < radius  # noqa: E731
    return Cloud(radius * normals, normals, colours, "a ball", inside)


def places(count=500, seed=1):
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 3))


def test_field_of_a_ball_is_its_signed_distance_less_the_thickness():
    at = places()
    distance, colour = field_at(ball(), at, CONFIG)
    radius = np.linalg.norm(at, axis=1)
    wanted = np.clip(radius - 0.4 - CONFIG.thickness, -CONFIG.reach, CONFIG.reach)
    np.testing.assert_allclose(distance, wanted, atol=1.5e-3)
    near = radius > 0.3
    towards = 0.5 + 0.5 * at / radius[:, None]
    assert np.abs(colour - towards)[near].max() < 0.06


def test_a_sheet_without_inside_still_has_one_in_the_field():
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-0.5, 0.5, (4096, 2)), np.zeros((4096, 1))], 1)
    normals = np.tile([0.0, 0, 1], (4096, 1))
    sheet = Cloud(points, normals, points + 0.5, "a sheet", lambda places: np.zeros(len(places)))
    height = np.array([-0.05, -0.005, 0.0, 0.005, 0.02])
    at = np.concatenate([np.full((5, 2), 0.1), height[:, None]], 1)
    distance, _ = field_at(sheet, at, CONFIG)
    np.testing.assert_allclose(distance, np.abs(height) - CONFIG.thickness, atol=1e-9)


def test_most_targets_lie_near_the_surface():
    targets = field_targets(ball(), 600, np.random.default_rng(2), CONFIG)
    assert targets.places.shape == targets.colour.shape == (600, 3)
    assert np.mean(np.abs(targets.distance + CONFIG.thickness) < 0.03) > 0.5
    assert (targets.distance > 0.09).any() and (targets.distance < -0.02).any()


def test_oriented_points_wind_around_their_inside():
    cloud, at = ball(1000), places()
    found = winding_inside(cloud.points, cloud.normals, at)
    sure = np.abs(np.linalg.norm(at, axis=1) - 0.4) > 0.03
    np.testing.assert_array_equal(found[sure], cloud.inside(at)[sure])
    # Normals the other way round enclose nothing.
    assert not winding_inside(cloud.points, -cloud.normals, at).any()


def test_captions_are_embedded_phrase_by_phrase_and_remembered():
    asked = []

    def encode(texts):
        asked.extend(texts)
        return np.array([[len(text), 1.0] for text in texts], np.float32)

    encoder = PhraseEncoder(encode)
    found = encoder(["a mug, red", "a mug"])
    assert found.shape == (2, 1 + PHRASES, 2)
    np.testing.assert_array_equal(found[0, :3], [[5, 1], [3, 1], [0, 0]])
    np.testing.assert_array_equal(found[1, 1:], 0)
    encoder(["a mug, tall"])
    assert sorted(asked) == ["a mug", "red", "tall"]


def test_phrases_are_dropped_but_never_the_object():
    text = np.ones((400, 4, 3), np.float32)
    kept = drop_phrases(text, np.random.default_rng(0))[..., 0]
    assert (kept[:, 0] == 1).all()
    assert 0.85 < kept[:, 1:].mean() < 0.95


def test_hidden_matrices_are_large_or_of_stacked_layers():
    assert is_hidden("layers/attention/queries/kernel", np.zeros((3, 4, 5)))
    assert is_hidden("think/0/perceptron/inner/kernel", np.zeros((192, 512)))
    assert not is_hidden("output/kernel", np.zeros((192, 6)))
    assert not is_hidden("layers/attention/queries/bias", np.zeros((300, 400)))
    x = np.random.default_rng(0).normal(size=(1, 6, 9))
    values = np.linalg.svd(np.asarray(orthogonalise(jnp.asarray(x)))[0], compute_uv=False)
    assert values.min() > 0.5 and values.max() < 1.4


def test_distance_to_a_moved_and_repainted_cloud():
    rng = np.random.default_rng(0)
    one = judge.Cloud(rng.uniform(size=(300, 3)), np.full((300, 3), 0.25))
    other = judge.Cloud(one.points + np.array([0, 0, 1e-4]), np.full((300, 3), 0.75))
    found = judge.distance(one, other)
    np.testing.assert_allclose([found.shape, found.colour], [1e-4, 0.5], rtol=1e-6)
    assert judge.nearest(one, [other, one]).shape == 0
