"""Reads the prepared data (see the README.md of its folder) and says what is drawn how often."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxphys.library import PRINCIPAL

SHARES = {"parametric": 0.75, "furniture": 0.15, "emoji": 0.1}  # of all draws, of what there is
PRINCIPAL_WEIGHT = 4.0  # how much more often a principal kind is drawn than another


@dataclass(frozen=True)
class Records:
    """Items (objects or emoji) with captions, points of the first ones and pictures of all.

    name (I,), held_out (I,) bool, caption_start (I + 1,) into caption, which points into
    caption_phrases (C, 1 + PHRASES), which points into embeddings (E, D), the last one zeros;
    captions, C texts;
    points (P, 4096, 3) in [-0.5, 0.5], normals (P, 4096, 3) int8 times 127 and colours
    (P, 4096, 3) uint8 of the first P items;
    images (V, 64, 64, 4) uint8 straight alpha, with item, azimuth, elevation, known (V,).
    """

    name: np.ndarray
    held_out: np.ndarray
    caption_start: np.ndarray
    caption: np.ndarray
    caption_phrases: np.ndarray
    embeddings: np.ndarray
    captions: list[str]
    points: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    images: np.ndarray
    item: np.ndarray
    azimuth: np.ndarray
    elevation: np.ndarray
    known: np.ndarray

    def weights(self) -> np.ndarray:
        """(I,) how often each item is to be drawn, relative; zero for held-out ones.

        Sources have their `SHARES` and kinds count alike, however many variants there are of each.
        """
        source = np.array([name.partition("-")[0] for name in self.name])
        kind = np.array([name.rpartition("-")[0] for name in self.name])
        # Only of the parametric kinds are there variants; everything else is one of its kind.
        group = np.where(source == "parametric", kind, self.name)
        _, index, count = np.unique(group[~self.held_out], return_inverse=True, return_counts=True)
        weight = np.zeros(len(self.name))
        weight[~self.held_out] = 1.0 / count[index]
        principal = [f"parametric-{kind.replace(' ', '_')}" for kind in PRINCIPAL]
        weight[np.isin(kind, principal)] *= PRINCIPAL_WEIGHT
        for name, share in SHARES.items():
            if (total := weight[source == name].sum()) > 0:
                weight[source == name] *= share / total
        return weight

    def text(self, items: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(B, 1 + PHRASES, D) embeddings of one random caption of each item."""
        start, end = self.caption_start[items], self.caption_start[items + 1]
        captions = self.caption[start + rng.integers(0, end - start)]
        return self.embeddings[self.caption_phrases[captions]]


def load(folder: Path) -> Records:
    """Reads what `assemble` wrote; pictures stay on disk until they are drawn."""
    points = np.load(folder / "points.npz")
    embeddings = np.load(folder / "text_embeddings.npy")
    with np.load(folder / "items.npz") as items, np.load(folder / "views.npz") as views:
        return Records(
            **{key: items[key] for key in ("name", "held_out", "caption_start", "caption")},
            **{key: views[key] for key in ("item", "azimuth", "elevation", "known")},
            caption_phrases=np.load(folder / "caption_phrases.npy"),
            embeddings=np.concatenate([embeddings, np.zeros_like(embeddings[:1])]),
            captions=json.loads((folder / "captions.json").read_text()),
            points=points["points"],
            normals=points["normals"],
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
