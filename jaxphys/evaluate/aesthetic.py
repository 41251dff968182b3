"""How much people like a picture, from 1 to 10: LAION's two heads on CLIP embeddings.

Both are affine. The first is one linear layer (Schuhmann et al. 2022). The second, of the same
author's "improved" predictor, is five of them with no activation in between, so it folds into one.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.weights.torch_zip import read_torch_zip

WIDTH = 768
DEEP = ("layers.0", "layers.2", "layers.4", "layers.6", "layers.7")
# Version: entry of the catalogue of weights, file, names of its layers.
HEADS = {
    "v1": ("laion-aesthetic-v1", "sa_0_4_vit_l_14_linear.pth", ("",)),
    "v2": ("laion-aesthetic-v2", "sac+logos+ava1-l14-linearMSE.pth", DEEP),
}


class Head(NamedTuple):
    """score = embedding . weight + bias; `weight` (768,) float64."""

    weight: np.ndarray
    bias: float

    def __call__(self, embeddings: np.ndarray) -> np.ndarray:
        """(N,) scores of (N, 768) unit embeddings of CLIP ViT-L/14."""
        if embeddings.shape[-1] != len(self.weight):
            raise InputError(
                f"aesthetic heads read {len(self.weight)} numbers of openai/clip-vit-large-patch14;"
                f" this CLIP gives {embeddings.shape[-1]}"
            )
        return embeddings.astype(np.float64) @ self.weight + self.bias


def fold(arrays: Mapping[str, np.ndarray], layers: tuple[str, ...], source: str) -> Head:
    """The affine map that linear layers, applied in order, are together.

    Raises:
        InputError: `arrays` are not exactly the weights (outputs, inputs) and biases of `layers`.
    """
    names = [(_join(layer, "weight"), _join(layer, "bias")) for layer in layers]
    wanted = {name for pair in names for name in pair}
    if set(arrays) != wanted:
        odd = sorted(set(arrays) ^ wanted)[0]
        state = "is missing" if odd in wanted else "belongs to no part of this head"
        raise InputError(f"{source}: array {odd!r} {state}")
    matrix, offset = np.eye(WIDTH), np.zeros(WIDTH)
    for weight, bias in names:
        layer, shift = (np.asarray(arrays[name], np.float64) for name in (weight, bias))
        if layer.ndim != 2 or layer.shape[1] != len(offset) or shift.shape != layer.shape[:1]:
            raise InputError(f"{source}: arrays {weight!r} and {bias!r} have the wrong shapes")
        matrix, offset = layer @ matrix, layer @ offset + shift
    if len(offset) != 1:
        raise InputError(f"{source}: the head gives {len(offset)} numbers instead of one")
    return Head(matrix[0], float(offset[0]))


def load_head(version: str, folder: str | Path) -> Head:
    """The head "v1" or "v2" from the folder with its file.

    Raises:
        InputError: the file is missing, damaged or something else.
    """
    _, name, layers = HEADS[version]
    file = Path(folder) / name
    return fold(read_torch_zip(file), layers, str(file))


def _join(layer: str, name: str) -> str:
    return f"{layer}.{name}" if layer else name
