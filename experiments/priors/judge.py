"""Measures and shows what trained 3D priors draw, beside true objects of the same words.

    python -m experiments.priors.judge OUT.png [--points RUN] [--autoencoder RUN --latents RUN]
        [--prompts PROMPT ...]

For each prompt the nearest of `VARIANTS` true clouds that the words allow: mean distance of points
to their nearest ones, both ways, in the object's length, and mean difference of their colours. What
another true variant gives is the floor. Rows of the sheet: true, then each prior.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from experiments.priors.dots import dot_rows
from experiments.priors.training import trained
from jaxphys.core.errors import InputError
from jaxphys.guidance import views
from jaxphys.guidance.bundled.latent_guide import LatentGuide
from jaxphys.guidance.bundled.latent_prior import LatentPrior, LatentPriorConfig
from jaxphys.guidance.bundled.point_guide import PointGuide
from jaxphys.guidance.bundled.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, ShapeAutoencoder
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.guides import phrases_of
from jaxphys.library import usual
from jaxphys.library.asked import Asked, asked

PROMPTS = (
    "a strawberry",
    "a teddy bear",
    "a guitar",
    "a chair",
    "a car",
    "a mug",
    "a teapot",
    "a blue teapot",
    "a teapot with a long spout",
    "a green rubber duck",
    "a cake with three layers",
    "a pink car",
)
POINTS, VARIANTS, SIDE = 4096, 16, 144


class Cloud(NamedTuple):
    """Points (N, 3) and colours (N, 3) in [0, 1]."""

    points: np.ndarray
    colours: np.ndarray


class Distance(NamedTuple):
    """Mean distance of points both ways, and mean difference of the colours of nearest ones."""

    shape: float
    colour: float


def distance(one: Cloud, other: Cloud) -> Distance:
    forth, nearest = cKDTree(other.points).query(one.points)
    back, _ = cKDTree(one.points).query(other.points)
    colour = np.abs(one.colours - other.colours[nearest]).mean()
    return Distance(float(0.5 * (forth.mean() + back.mean())), float(colour))


def true_cloud(wanted: Asked, seed: int) -> Cloud:
    model = usual(wanted.kind, seed, wanted.given).model
    surface = model.sample(POINTS, np.random.default_rng(seed))
    return Cloud(surface.points, views.lit(surface.colours, surface.normals))


def nearest(cloud: Cloud, true: list[Cloud]) -> Distance:
    """The distance to the nearest in shape of the true clouds."""
    return min((distance(cloud, one) for one in true), key=lambda found: found.shape)


def drawers(options: argparse.Namespace) -> dict[str, Callable[[str], Cloud]]:
    """By the name of a prior, a function from a prompt to what it draws."""
    found: dict[str, Callable[[str], Cloud]] = {}

    def drawer(make: Callable) -> Callable[[str], Cloud]:
        def draw(prompt: str) -> Cloud:
            try:
                drawn = make(prompt).sample(jax.random.key(options.seed), POINTS)
            except InputError:  # of a field without a surface nothing is seen
                return Cloud(np.zeros((1, 3)), np.zeros((1, 3)))
            return Cloud(*(np.asarray(array[:POINTS]) for array in drawn))

        return draw

    if options.points:
        points = trained(options.points, PointPrior, PointPriorConfig)
        told = points.config.phrases
        found["points"] = drawer(lambda text: PointGuide(points, prompt_embeddings(text, told)))
    if options.latents:
        network = trained(options.autoencoder, ShapeAutoencoder, AutoencoderConfig)
        latents = trained(options.latents, LatentPrior, LatentPriorConfig)
        read = latents.config.phrases
        found["latents"] = drawer(
            lambda text: LatentGuide(network, latents, jnp.asarray(prompt_embeddings(text, read)))
        )
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--points", type=Path, help="run of train_points")
    parser.add_argument("--autoencoder", type=Path, help="run of train_autoencoder")
    parser.add_argument("--latents", type=Path, help="run of train_latents")
    parser.add_argument("--prompts", nargs="*", default=PROMPTS)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    draw = drawers(options)
    shown: dict[str, list[Cloud]] = {name: [] for name in ("true", *draw)}
    for prompt in options.prompts:
        wanted = asked(phrases_of(prompt, 32))
        if wanted is None:
            raise SystemExit(f"{prompt!r}: there are no true objects of it")
        true = [true_cloud(wanted, 1000 + seed) for seed in range(VARIANTS)]
        other = true_cloud(wanted, 2000)
        shown["true"].append(other)
        row: dict = {"prompt": prompt, "true": nearest(other, true)._asdict()}
        for name, make in draw.items():
            shown[name].append(make(prompt))
            row[name] = nearest(shown[name][-1], true)._asdict()
        print(json.dumps(row), flush=True)
    Image.fromarray(np.concatenate([dot_rows(row, SIDE) for row in shown.values()])).save(
        options.out
    )


if __name__ == "__main__":
    main()
