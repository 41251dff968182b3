"""CLIP scores from words and pixels to the end, against transformers' own."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from flax import nnx

from experiments.parity import clip_cases as cases
from jaxphys.core.errors import InputError
from jaxphys.evaluate.clip_score import PUBLISHED, PUBLISHED_VISION, clip_score, load_clip, variant
from jaxphys.networks.clip_config import VisionConfig
from jaxphys.networks.clip_pictures import middle_square

GOLDEN = Path(__file__).parents[1] / "networks" / "golden" / "clip_cosines.npz"


@pytest.fixture(scope="module")
def clip(clip_folder):
    return load_clip(clip_folder)


@pytest.fixture(scope="module")
def pictures(clip):
    return np.stack([middle_square(picture, clip.size) for picture in cases.PICTURES.values()])


def test_cosines_are_those_of_the_original(clip, pictures):
    expected = np.load(GOLDEN)["cosines"]
    embeddings = clip.pictures(pictures)
    found = embeddings @ clip.texts([cases.SENTENCE])[0]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    # A negative control: another sentence.
    other = embeddings @ clip.texts(["a rose"])[0]
    assert np.abs(other - expected).min() > 1e-3


def test_padding_with_another_mark_is_harmless_but_another_end_is_not(clip):
    # Nothing behind the end mark is read, so that a swapped padding cannot show in CLIP's score.
    ids = clip.tokenizer([cases.SENTENCE])
    end = int(ids.max())
    padded = np.where(np.cumsum(ids == end, axis=1) > 1, 0, ids)
    assert (padded != ids).any()
    read = nnx.jit(lambda ids: clip.text(ids))
    expected = read(ids)
    np.testing.assert_allclose(read(padded), expected, atol=1e-6)
    cut = np.where(ids == end, 0, ids)
    cut[:, -1] = end
    assert np.abs(read(cut) - expected).max() > 1e-2


def test_embeddings_do_not_depend_on_the_batch(clip, pictures):
    many = np.concatenate([pictures] * 3)
    found = clip.pictures(many, batch=4)
    assert found.shape == (9, 768)
    np.testing.assert_allclose(found, np.tile(clip.pictures(pictures), (3, 1)), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-6)


def test_score_cuts_each_picture_and_then_averages():
    assert clip_score(np.array([0.3, -0.5, 0.1])) == pytest.approx(100 * 0.4 / 3)


def test_variant_is_stated():
    assert variant(PUBLISHED_VISION) == PUBLISHED
    other = variant(VisionConfig(patch_size=16))
    assert "patches of 16 pixels" in other and "not comparable" in other


@pytest.mark.parametrize(
    "name, message",
    [
        ("config.json", r"config.json: no such file"),
        ("vocab.json", r"holds neither vocab.json"),
        ("model.safetensors", r"has no model.safetensors"),
    ],
)
def test_a_missing_file_is_named(clip_folder, tmp_path, name, message):
    folder = shutil.copytree(clip_folder, tmp_path / "clip")
    (folder / name).unlink()
    with pytest.raises(InputError, match=message):
        load_clip(folder)


def test_a_tokenizer_of_another_model_is_refused(clip_folder, tmp_path):
    folder = shutil.copytree(clip_folder, tmp_path / "clip")
    values = json.loads((folder / "config.json").read_text())
    values["text_config"]["vocab_size"] = 500
    (folder / "config.json").write_text(json.dumps(values))
    with pytest.raises(InputError, match="vocab_size: 500 is below the 814 word pieces"):
        load_clip(folder)
