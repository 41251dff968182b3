"""What is measured of objects and films without published weights.

None compares with the paper's numbers: the scorer (`experiments/scorer`) is small, has only seen
our own renders of 52 kinds of object, and stands where CLIP does in the paper; there is nothing
here in LAION's place.
"""

import dataclasses
import functools
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from experiments.scorer.model import RESOLUTION, Scorer, embed, load
from experiments.scorer.ranking import ranked_first, similarities
from experiments.scorer.sentences import MODEL_NAMES, SENTENCES
from experiments.scorer.twelve import coarser, eight_views, frame
from jaxphys.core.errors import InputError
from jaxphys.evaluate.frames import read_frames
from jaxphys.evaluate.report import VIDEO, evaluate
from jaxphys.gaussians.colour import colour_range, regularise, to_unit_interval
from jaxphys.gaussians.gaussians import Gaussians, opacities
from jaxphys.gaussians.harmonics import dc_to_rgb, rgb_to_dc
from jaxphys.guidance.bundled.text_encoder import load_text_encoder
from jaxphys.library import usual

COLOURFUL = 0.1  # saturation above which a pixel counts as the object's: ground and sky are grey
MODELS, POINTS = 8, 2000  # of a kind that a shape is compared with, and on each


@functools.cache
def _scorer() -> tuple[Scorer, np.ndarray]:
    """The scorer and the embeddings (12, D) of all sentences."""
    return load(), load_text_encoder()(list(SENTENCES.values()))


def saturation(pictures: np.ndarray) -> float:
    """Mean of (max - min) / max of red, green and blue over the colourful pixels of pictures
    (..., 3) in [0, 1]; 0 where there are none.
    """
    high, low = pictures.max(-1), pictures.min(-1)
    found = (high - low) / np.maximum(high, 1e-6)
    return float(found[found > COLOURFUL].mean()) if (found > COLOURFUL).any() else 0.0


def of_film(directory: Path, name: str) -> dict[str, Any]:
    """Of the middle square of every picture of a run's film.

    Returns:
        `cosine`, mean of the scorer's with the object's sentence; `saturation` of the first
        picture; `change`, mean over the later pictures of the mean absolute difference to the first
        one [of 255]; `clip` and `laion` (v2) as `jaxphys evaluate` finds them, or `unscored`, why
        not.
    """
    pictures = read_frames(directory / VIDEO, RESOLUTION).astype(np.float32)
    scorer, sentences = _scorer()
    cosines = embed(scorer, pictures / 255) @ sentences[list(SENTENCES).index(name)]
    found: dict[str, Any] = {
        "cosine": round(float(cosines.mean()), 4),
        "saturation": round(saturation(pictures[0] / 255), 4),
        "change": round(float(np.abs(pictures[1:] - pictures[0]).mean()), 3),
    }
    try:
        published = evaluate(directory, overwrite=True)
    except InputError as error:
        # What is missing; where it was looked for is told in parentheses.
        return found | {"unscored": str(error).split(" (")[0]}
    found["clip"] = published["clip"]["cosine"]
    if "v2" in published["aesthetic"]:
        found["laion"] = published["aesthetic"]["v2"]["score"]
    return found


def regular(gaussians: Gaussians) -> Gaussians:
    """The Gaussians with regularised colours, as a film draws them; of harmonics of degree 0."""
    if gaussians.harmonics.shape[1] != 1:
        raise InputError("regular: colours depend on the view; give harmonics of degree 0")
    bounds = to_unit_interval(colour_range(gaussians))
    colours = regularise(dc_to_rgb(gaussians.harmonics[:, 0]).clip(0), bounds)
    return dataclasses.replace(gaussians, harmonics=rgb_to_dc(colours)[:, None])


def of_object(gaussians: Gaussians, name: str) -> dict[str, float]:
    """Of eight views of an object at rest, drawn with the colours that it has.

    Returns:
        `cosine` and `first`, the scorer's with the object's sentence and the share of views that
        rank it first of the twelve; `saturation`; `distance`, see `shape_distance`.
    """
    views = coarser(eight_views(gaussians))
    scorer, sentences = _scorer()
    own = list(SENTENCES).index(name)
    # Ranked against all, the object's own sentence first, as `ranked_first` has it.
    order = [own, *(i for i in range(len(sentences)) if i != own)]
    scores = similarities(embed(scorer, views)[None], sentences[order])
    return {
        "cosine": round(float(scores[0, :, 0].mean()), 4),
        "first": float(ranked_first(scores).mean()),
        "saturation": round(saturation(views), 4),
        "distance": round(shape_distance(gaussians, name), 4),
    }


def shape_distance(gaussians: Gaussians, name: str) -> float:
    """How far an object is from the nearest of eight parametric models of its kind: the mean of the
    distances of either's points to the nearest of the other's, both centred, longest side 1.
    """
    means = np.asarray(gaussians.means)[np.asarray(opacities(gaussians)) > 0.05]
    middle, side = frame(gaussians)
    return min(
        (chamfer((means - middle) / side, model) for model in _models(name)), default=float("inf")
    )


def chamfer(one: np.ndarray, other: np.ndarray) -> float:
    """Mean distance to the nearest point of the other set, averaged over both directions; (N, 3)
    and (M, 3). Infinite where either is empty.
    """
    if not len(one) or not len(other):
        return float("inf")
    there, back = cKDTree(other).query(one)[0], cKDTree(one).query(other)[0]
    return float((there.mean() + back.mean()) / 2)


@functools.cache
def _models(name: str) -> list[np.ndarray]:
    """Points on parametric models of a kind, seeds that neither priors nor scorer saw."""
    found = []
    for seed in range(3000, 3000 + MODELS):
        rng = np.random.default_rng(seed)
        points = usual(MODEL_NAMES[name], seed).model.sample(POINTS, rng).points
        low, high = points.min(0), points.max(0)
        found.append((points - (low + high) / 2) / (high - low).max())
    return found
