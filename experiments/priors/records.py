"""Reads the prepared data (see the README.md of its folder) and says what is drawn how often."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.priors.models import PRINCIPAL

PRINCIPAL_SHARE = 0.4  # of all draws, however many variants of the principal models there are
SHARES = {"parametric": 2.0, "furniture": 1.0, "emoji": 1.0}  # among the others, for each item


@dataclass(frozen=True)
class Records:
    """Items (objects or emoji) with captions, points of the first ones and pictures of all.

    name (I,), held_out (I,) bool, caption_start (I + 1,) into caption, embeddings (C, D);
    points (P, 4096, 3) in [-0.5, 0.5] and colours (P, 4096, 3) uint8 of the first P items;
    images (V, 64, 64, 4) uint8 straight alpha, with item, azimuth, elevation, known (V,).
    """

    name: np.ndarray
    held_out: np.ndarray
    caption_start: np.ndarray
    caption: np.ndarray
    embeddings: np.ndarray
    points: np.ndarray
    colours: np.ndarray
    images: np.ndarray
    item: np.ndarray
    azimuth: np.ndarray
    elevation: np.ndarray
    known: np.ndarray

    def weights(self) -> np.ndarray:
        """(I,) how often each item is to be drawn, relative; zero for held-out ones."""
        principal = {model.replace(" ", "_") for model in PRINCIPAL}
        kind = np.array([name.partition("-")[0] for name in self.name])
        model = np.array([name.partition("-")[2].rpartition("-")[0] for name in self.name])
        chosen = (kind == "parametric") & np.isin(model, list(principal))
        weight = np.array([SHARES.get(k, 1.0) for k in kind])
        counts = {m: np.sum(chosen & (model == m) & ~self.held_out) for m in principal}
        weight[chosen] = [1.0 / max(counts[m], 1) for m in model[chosen]]
        weight[self.held_out] = 0.0
        if weight[~chosen].sum() > 0 and weight[chosen].sum() > 0:
            weight[chosen] *= PRINCIPAL_SHARE / weight[chosen].sum()
            weight[~chosen] *= (1.0 - PRINCIPAL_SHARE) / weight[~chosen].sum()
        return weight

    def text(self, items: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(B, D) embedding of one random caption of each item."""
        start, end = self.caption_start[items], self.caption_start[items + 1]
        return self.embeddings[self.caption[start + rng.integers(0, end - start)]]


def load(folder: Path) -> Records:
    """Reads what `assemble` wrote; pictures stay on disk until they are drawn."""
    points = np.load(folder / "points.npz")
    with np.load(folder / "items.npz") as items, np.load(folder / "views.npz") as views:
        return Records(
            **{key: items[key] for key in ("name", "held_out", "caption_start", "caption")},
            **{key: views[key] for key in ("item", "azimuth", "elevation", "known")},
            embeddings=np.load(folder / "text_embeddings.npy"),
            points=points["points"],
            colours=points["colours"],
            images=np.load(folder / "images.npy", mmap_mode="r"),
        )


def sampler(weight: np.ndarray):
    """A function (generator, count) -> indices drawn with the given relative weights."""
    edges = np.cumsum(weight / weight.sum())

    def draw(rng: np.random.Generator, count: int) -> np.ndarray:
        # Stratified: a batch holds each part of the data in nearly its due number.
        at = (np.arange(count) + rng.random(count)) / count
        return rng.permutation(
            np.minimum(np.searchsorted(edges, at, side="right"), len(weight) - 1)
        )

    return draw
