"""LAION's aesthetic heads against the same layers in torch (`experiments/parity/clip.py`)."""

import json
from pathlib import Path

import numpy as np
import pytest

from experiments.parity import clip_cases as cases
from experiments.parity.arrays import weights
from jaxphys.core.errors import InputError
from jaxphys.evaluate.aesthetic import HEADS, fold

NETWORKS = Path(__file__).parents[1] / "networks"
SHAPES = {"v1": cases.LINEAR_HEAD, "v2": cases.DEEP_HEAD}
UNIT = cases.EMBEDDINGS / np.linalg.norm(cases.EMBEDDINGS, axis=1, keepdims=True)


@pytest.mark.parametrize("version", HEADS)
def test_scores_are_those_of_the_original(version):
    expected = np.load(NETWORKS / "golden" / "laion_aesthetic.npz")[version]
    head = fold(weights(SHAPES[version]), HEADS[version][2], "test")
    np.testing.assert_allclose(head(UNIT), expected, atol=1e-6)
    # A negative control: embeddings that were not normalised.
    assert np.abs(head(cases.EMBEDDINGS) - expected).max() > 1e-2


@pytest.mark.parametrize("version", HEADS)
def test_layers_are_those_of_the_published_files(version):
    manifest = json.loads((NETWORKS / "manifests" / f"laion_aesthetic_{version}.json").read_text())
    assert {name: tuple(shape) for name, shape in manifest.items()} == SHAPES[version]
    assert fold(weights(SHAPES[version]), HEADS[version][2], "test").weight.shape == (768,)


def test_other_arrays_are_named():
    arrays, layers = weights(cases.DEEP_HEAD), HEADS["v2"][2]
    lacking = {name: array for name, array in arrays.items() if name != "layers.4.bias"}
    with pytest.raises(InputError, match=r"there: array 'layers\.4\.bias' is missing"):
        fold(lacking, layers, "there")
    with pytest.raises(InputError, match=r"array 'more' belongs to no part"):
        fold(arrays | {"more": np.zeros(3)}, layers, "there")
    with pytest.raises(InputError, match=r"'layers\.2\.weight' and .* have the wrong shapes"):
        fold(arrays | {"layers.2.weight": np.zeros((128, 9))}, layers, "there")
    with pytest.raises(InputError, match="gives 2 numbers instead of one"):
        fold({"weight": np.zeros((2, 768)), "bias": np.zeros(2)}, ("",), "there")


def test_embeddings_of_another_width_are_refused():
    head = fold(weights(cases.LINEAR_HEAD), ("",), "test")
    with pytest.raises(InputError, match=r"read 768 numbers .* this CLIP gives 512"):
        head(np.zeros((1, 512), np.float32))
