"""How often the scorer ranks the right one of the twelve sentences first, on held-out objects.

    python -m experiments.scorer.evaluate DATA [--weights WEIGHTS] [--rendered]

DATA is what `experiments.scorer.renders` wrote. With --rendered the same objects are also drawn
with `jaxphys.render`, as Gaussians at their points: that is what the scorer is used on.
"""

import argparse
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
from flax import nnx

from experiments.priors.data.pictures import pictures
from experiments.priors.data.prepare import POINTS, lit_points, random_views
from experiments.scorer.model import WEIGHTS, Scorer, embed, load
from experiments.scorer.ranking import report, similarities, table
from experiments.scorer.sentences import MODEL_NAMES, SENTENCES
from jaxphys.guidance.bundled.text_encoder import load_text_encoder
from jaxphys.library import usual

GROUND = 0.93  # plain and light


class Report(NamedTuple):
    """The share of pictures ranked first, by prompt and over all, and a text to print."""

    by_prompt: dict[str, float]
    total: float
    text: str


def on_ground(rgba: np.ndarray, ground: float = GROUND) -> np.ndarray:
    """uint8 straight RGBA (..., 4) over a plain ground: float32 RGB in [0, 1]."""
    rgba = np.asarray(rgba, np.float32) / 255
    return rgba[..., :3] * rgba[..., 3:] + np.float32(ground) * (1 - rgba[..., 3:])


def judge(scorer: Scorer, views: np.ndarray, sentences: list[str]) -> Report:
    """Ranks `sentences` on pictures (P, V, 64, 64, 3) of the prompts in their order."""
    vectors = embed(scorer, views.reshape(-1, *views.shape[2:])).reshape(*views.shape[:2], -1)
    rows = table(similarities(vectors, load_text_encoder()(sentences)), list(SENTENCES))
    by_prompt = {row.prompt: row.first for row in rows}
    return Report(by_prompt, float(np.mean(list(by_prompt.values()))), report(rows))


def held_out_pictures(data: Path) -> np.ndarray:
    """(12, V, 64, 64, 4) uint8 RGBA of the held-out objects, by prompt."""
    images = np.load(data / "held_out.npz")["images"]
    names = np.array([item["name"] for item in json.loads((data / "held_out.json").read_text())])
    return np.stack(
        [images[names == MODEL_NAMES[p]].reshape(-1, *images.shape[2:]) for p in SENTENCES]
    )


def rendered_pictures(seeds: list[int], views: int = 8) -> np.ndarray:
    """(12, seeds * views, 64, 64, 4) uint8 RGBA: Gaussians of the models, by `jaxphys.render`."""
    rows = []
    for prompt in SENTENCES:
        row = []
        for seed in seeds:
            rng = np.random.default_rng(seed)
            surface = usual(MODEL_NAMES[prompt], seed).model.sample(POINTS + POINTS // 2, rng)
            points, _, colours = lit_points(surface.points, surface.normals, surface.colours, rng)
            row.append(pictures(points, colours, *random_views(rng, views)))
        rows.append(np.concatenate(row))
    return np.stack(rows)


def held_out_report(weights: Path, data: Path) -> Report:
    """Of the pictures in DATA/held_out.npz, on a plain ground."""
    return judge(load(weights), on_ground(held_out_pictures(data)), list(SENTENCES.values()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--weights", type=Path, default=WEIGHTS)
    parser.add_argument("--rendered", action="store_true")
    options = parser.parse_args()
    scorer, sentences = load(options.weights), list(SENTENCES.values())
    sets = {"held-out renders": held_out_pictures(options.data)}
    if options.rendered:
        items = json.loads((options.data / "held_out.json").read_text())
        sets["jaxphys.render"] = rendered_pictures(sorted({item["seed"] for item in items}))
    for name, images in sets.items():
        views = on_ground(images)
        print(f"{name}: {views.shape[1]} pictures a prompt")
        print(judge(scorer, views, sentences).text)
        permuted = judge(scorer, views, sentences[1:] + sentences[:1])
        untrained = judge(Scorer(scorer.config, rngs=nnx.Rngs(0)), views, sentences)
        print(f"controls: sentences permuted {permuted.total:.1%}, ", end="")
        print(f"weights at random {untrained.total:.1%}\n", flush=True)


if __name__ == "__main__":
    main()
