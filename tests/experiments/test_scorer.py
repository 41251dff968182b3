"""The image-text scorer of the twelve-prompt test: loss, ranking, pictures, shipped weights."""

import json
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.scorer import model, ranking, renders, twelve
from experiments.scorer.augment import augment
from experiments.scorer.evaluate import judge, on_ground
from experiments.scorer.sentences import MODEL_NAMES, SENTENCES
from experiments.scorer.train import contrastive_loss, read_captions
from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.networks.parameters import named_parameters

SEED = 3000  # neither trained on nor held out


def test_loss_of_distinct_items_is_the_softmax_of_their_own_pair():
    vectors, sharpness = jnp.eye(2), 3.0
    loss = contrastive_loss(vectors, vectors, jnp.eye(2, dtype=bool), sharpness)
    np.testing.assert_allclose(loss, math.log(1 + math.exp(-sharpness)), rtol=1e-12)
    swapped = contrastive_loss(vectors, vectors[::-1], jnp.eye(2, dtype=bool), sharpness)
    np.testing.assert_allclose(swapped, math.log(1 + math.exp(sharpness)), rtol=1e-12)


def test_loss_counts_items_of_one_subject_as_right():
    pictures = jnp.array([[1.0, 0], [1, 0], [0, 1]])
    texts, belongs = pictures, jnp.array([[1, 1, 0], [1, 1, 0], [0, 0, 1]], bool)
    e = math.exp(2.0)
    rows = [math.log((2 * e + 1) / e)] * 2 + [math.log((e + 2) / e)]
    np.testing.assert_allclose(contrastive_loss(pictures, texts, belongs, 2.0), np.mean(rows))
    # Taken for different, the same pictures would be pushed apart: a gradient between them.
    pull = jax.grad(lambda p, b: contrastive_loss(p, texts, b, 2.0))
    together = pull(pictures, belongs)
    np.testing.assert_allclose(together[0], together[1], atol=1e-12)
    apart = jax.grad(lambda t: contrastive_loss(pictures, t, jnp.eye(3, dtype=bool), 2.0))(
        jnp.array([[1.0, 0], [0.9, 0.1], [0, 1]])
    )
    assert not np.allclose(apart[0], apart[1], atol=1e-3)


def test_captions_of_one_subject_share_its_number():
    items = [
        {"captions": ["a can", "a red can"]},
        {"captions": ["a can", "a blue can"]},
        {"captions": ["a rose"]},
    ]
    captions = read_captions(items)
    assert captions.subject[0] == captions.subject[1] != captions.subject[2]
    assert captions.vectors.shape == (4, 384)
    assert [len(numbers) for numbers in captions.of_item] == [2, 2, 1]


def test_first_place_wants_more_than_a_tie_and_a_number():
    scores = np.array([[[2.0, 1, 1], [1, 1, 0], [0, 2, 1], [np.nan, 0, 0], [1, np.nan, 0]]])
    assert ranking.ranked_first(scores).tolist() == [[True, False, False, False, False]]
    # The second object's own sentence is the second.
    scores = np.array([[[1.0, 0], [0, 1]], [[1, 0], [0, 1]]])
    assert ranking.ranked_first(scores).tolist() == [[True, False], [False, True]]


def test_table_of_made_up_vectors():
    sentences = np.eye(3)
    pictures = np.array(
        [
            [[1.0, 0, 0], [1, 0, 0], [1, 0, 0], [0.6, 0.8, 0]],
            [[0, 1, 0], [0, 0, 1], [0, 0, 1], [1, 0, 0]],
            [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]],
        ]
    )
    scores = ranking.similarities(pictures, sentences)
    rows = ranking.table(scores, ["can", "rose", "sponge"])
    assert [row.first for row in rows] == [0.75, 0.25, 1.0]
    assert [row.mistaken for row in rows] == [{"rose": 1}, {"sponge": 2, "can": 1}, {}]
    text = ranking.report(rows)
    assert "2 of 3 prompts reach 75% of their views" in text and "below: rose" in text
    assert "66.7%" in text and "all views together: below 75%" in text
    shifted = ranking.table(np.roll(scores, 1, axis=0), ["can", "rose", "sponge"])
    assert [row.first for row in shifted] == [0, 0.25, 0.5]


def test_vectors_have_unit_norm_and_survive_the_file(tmp_path):
    config = model.ScorerConfig(widths=(8, 16), blocks=(1, 0))
    scorer = model.Scorer(config, rngs=nnx.Rngs(0))
    pictures = np.random.default_rng(0).random((3, 64, 64, 3))
    vectors = model.embed(scorer, pictures)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-4)
    path = tmp_path / "weights.safetensors"
    model.save(path, named_parameters(scorer), config)
    loaded = model.load(path)
    assert loaded.config == config
    np.testing.assert_allclose(model.embed(loaded, pictures), vectors, atol=2e-3)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="holds no weights"):
        model.load(path)
    with pytest.raises(InputError, match="holds no weights"):
        model.load(tmp_path / "absent.safetensors")
    with pytest.raises(InputError, match="pictures of shape"):
        model.embed(scorer, pictures[..., :2])


def test_windows_and_blocks_hold_what_they_say():
    x = jnp.arange(16.0).reshape(1, 4, 4, 1)
    np.testing.assert_array_equal(
        model.windows(x)[0, 1, 2], jnp.array([1.0, 2, 3, 5, 6, 7, 9, 10, 11])
    )
    assert model.windows(x)[0, 0, 0, :4].tolist() == [0, 0, 0, 0]
    assert model.to_depth(x)[0, 1, 0].tolist() == [8, 9, 12, 13]


def ball(count: int = 20_000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, normals and grey colours of a ball of diameter 1."""
    normals = np.random.default_rng(0).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return 0.5 * normals, normals, np.full((count, 3), 0.5)


def shot(**changes) -> renders.Shot:
    plain = renders.Shot(0, 0, 0, 0.3, 0.5, np.zeros(2), np.array([0, 0, 1.0]), 0.5, 0.5, 0)
    return plain._replace(**changes)


def test_a_ball_fills_its_share_and_is_lit_from_the_light():
    rng = np.random.default_rng(0)
    image = renders.picture(*ball(), shot(), rng) / 255
    # Seen from near, a ball of diameter 1 is wider than its section: 1 / sqrt(1 - (r / d)^2).
    radius = 0.25 / math.sqrt(1 - (0.5 * 2 * 0.5 * math.tan(0.15)) ** 2)
    # A point covers the finer pixels whose centres are within one of it in row and column, which
    # widens the outline by 4 / pi of them on average over directions.
    radius += 4 / math.pi / 128
    np.testing.assert_allclose(image[..., 3].mean(), math.pi * radius**2, rtol=0.02)
    np.testing.assert_allclose(image[32, 32, 3], 1)
    top, bottom = image[20, 32, 0], image[44, 32, 0]
    assert top > bottom + 0.1  # light from above, picture rows downwards
    aside = renders.picture(*ball(), shot(shift=np.array([0.2, 0])), rng) / 255
    assert aside[..., 32:, 3].sum() > 4 * aside[:, :32, 3].sum()


def test_nearer_points_hide_farther_ones():
    points, normals, _ = ball()
    front = points[:, 0] > 0  # the camera stands at +x
    colours = np.where(front[:, None], [1.0, 0, 0], [0, 0, 1.0])
    flat = shot(ambient=1.0, diffuse=0.0)
    image = renders.picture(points, normals, colours, flat, np.random.default_rng(0)) / 255
    inner = image[24:40, 24:40]
    assert (inner[..., 0] > 0.99).all() and (inner[..., 2] < 0.01).all()


def test_objects_are_others_than_the_priors():
    for part in renders.SEEDS:
        assert min(seed for _, seed in renders.objects(part)) >= 1000
    train, held_out = (set(renders.objects(part)) for part in renders.SEEDS)
    assert train and held_out and not train & held_out
    assert {name for name, _ in held_out} == set(MODEL_NAMES.values())
    assert list(SENTENCES) == list(MODEL_NAMES)


def test_augmented_pictures_show_only_what_is_there():
    rng = np.random.default_rng(0)
    images = rng.integers(0, 256, (4, 64, 64, 4), dtype=np.uint8)
    images[:2, ..., 3] = 0
    other = images.copy()
    other[:, ..., :3] = 255 - other[:, ..., :3]
    first, second = (np.asarray(augment(x, jax.random.key(1))) for x in (images, other))
    assert first.shape == (4, 64, 64, 3) and first.min() >= 0 and first.max() <= 1
    np.testing.assert_array_equal(first[:2], second[:2])
    assert np.abs(first[2:] - second[2:]).max() > 0.1


def test_frame_leaves_out_strays_and_what_is_not_seen():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (4000, 3)).astype(np.float32)
    points[0] = 40
    opacity = np.full(4000, 0.9, np.float32)
    points[-400:] += 10
    opacity[-400:] = 0.01
    grey = np.full((4000, 3), 0.5, np.float32)
    centre, side = twelve.frame(from_points(points, grey, 0.01, opacity=opacity))
    np.testing.assert_allclose(centre, 0, atol=0.02)
    np.testing.assert_allclose(side, 1, atol=0.03)


def test_sheet_marks_what_is_not_first():
    pictures = np.full((2, 3, 16, 16, 3), 0.5)
    first = np.array([[True, True, False], [True, True, True]])
    sheet = twelve.contact_sheet(pictures, first)
    assert sheet.shape == (32, 48, 3)
    red = (sheet[..., 0] > 200) & (sheet[..., 1] < 50)
    assert red[0, 40] and red[8, 32] and not red[8, 40]
    assert red.sum() == 16 * 16 - 12 * 12


def test_overview_has_two_columns_of_every_other_view():
    pictures = np.linspace(0, 1, 12 * 8).reshape(12, 8, 1, 1, 1) * np.ones((12, 8, 4, 4, 3))
    sheet = twelve.overview(pictures)
    assert sheet.shape == (6 * 4, 8 * 4, 3)
    values = np.rint(255 * np.linspace(0, 1, 12 * 8)).reshape(12, 8)
    np.testing.assert_array_equal(sheet[::4, ::4, 0][:, :4], values[:6, ::2])
    np.testing.assert_array_equal(sheet[::4, ::4, 0][:, 4:], values[6:, ::2])


def test_a_missing_object_is_named(tmp_path):
    with pytest.raises(InputError, match=r"strawberry/gaussians\.ply: is missing"):
        twelve.run(tmp_path, model.Scorer(rngs=nnx.Rngs(0)))


shipped = pytest.mark.skipif(not model.WEIGHTS.exists(), reason="the weights are not trained yet")


@pytest.fixture(scope="module")
def unseen() -> np.ndarray:
    """(12, 4, 64, 64, 3): one new object of each prompt."""
    return np.stack(
        [
            on_ground(renders.shots_of(name, SEED, plain=True)[0][::2])
            for name in MODEL_NAMES.values()
        ]
    )


@shipped
def test_shipped_weights_know_unseen_objects(unseen):
    scorer, sentences = model.load(), list(SENTENCES.values())
    assert model.WEIGHTS.stat().st_size < 1.5e6
    told = judge(scorer, unseen, sentences)
    assert told.total >= 0.85
    assert judge(scorer, unseen, sentences[1:] + sentences[:1]).total < 0.1
    assert judge(scorer, 1 - unseen[:, :, ::-1], sentences).total < told.total - 0.2
    untrained = model.Scorer(scorer.config, rngs=nnx.Rngs(0))
    assert judge(untrained, unseen, sentences).total < 0.3


def test_the_whole_test_writes_what_it_found(tmp_path):
    """Balls for all twelve: at most one sentence can be first, and the files say so."""
    points, _, colours = ball(400)
    from jaxphys.gaussians.ply import write_ply

    for prompt in SENTENCES:
        path = twelve.path_of(tmp_path, prompt)
        path.parent.mkdir()
        write_ply(path, from_points(points.astype(np.float32), colours.astype(np.float32), 0.05))
    rows = twelve.run(tmp_path, model.Scorer(rngs=nnx.Rngs(0)))
    found = json.loads((tmp_path / "twelve.json").read_text())
    assert np.shape(found["similarities"]) == (12, 8, 12)
    assert sum(row.first for row in rows) <= 1 + 1e-9
    assert found["prompts"]["rose"]["first"] == rows[1].first
    assert (tmp_path / "twelve.png").stat().st_size > 1000
