"""The twelve-prompt test: does `generate` make what was asked?

    python -m experiments.scorer.twelve FOLDER [FOLDER ...]          # Gaussians that are there
    python -m experiments.scorer.twelve --generate FOLDER [--steps N] [--seed S]

FOLDER holds strawberry/gaussians.ply, ice_cream/gaussians.ply and so on; with --generate what is
missing is made from its sentence (experiments/scorer/sentences.py) and written there. Eight views
of each object are drawn with `jaxphys.render` and each is scored against the twelve sentences.
Prints the table, writes it to FOLDER/twelve.json, the pictures to FOLDER/twelve.png (red edges: not
ranked first) and half of them, unmarked, to FOLDER/overview.png. Ends with status 0 whatever the
table says, 2 where there is none.
"""

import argparse
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from PIL import Image

from experiments.scorer.model import RESOLUTION, WEIGHTS, Scorer, embed, load
from experiments.scorer.ranking import BAR, Row, ranked_first, report, similarities, table
from experiments.scorer.sentences import SENTENCES
from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path, write_json
from jaxphys.gaussians.gaussians import Gaussians, opacities, to_splats
from jaxphys.gaussians.ply import read_ply, write_ply
from jaxphys.guidance.bundled.text_encoder import load_text_encoder
from jaxphys.guidance.prompts.refine import refine
from jaxphys.render import look_at, render

VIEWS = 8
ELEVATION = np.deg2rad(17.0)
FIELD_OF_VIEW, FILL = np.deg2rad(30.0), 0.72  # FILL: of the picture's side, by the longest side
GROUNDS = (0.93, 0.85)  # in turn
FINER = 2  # drawn at so many times the scorer's resolution, then averaged


def path_of(folder: Path, prompt: str) -> Path:
    """Where the Gaussians of a prompt lie."""
    return folder / prompt.replace(" ", "_") / "gaussians.ply"


def frame(gaussians: Gaussians) -> tuple[np.ndarray, float]:
    """Centre (3,) and longest side of what can be seen, a few strays left aside."""
    means = np.asarray(gaussians.means)[np.asarray(opacities(gaussians)) > 0.05]
    if not len(means):
        return np.zeros(3, np.float32), 1.0
    low, high = np.quantile(means, (0.005, 0.995), axis=0)
    return 0.5 * (low + high), max(float((high - low).max()), 1e-6)


def eight_views(gaussians: Gaussians) -> np.ndarray:
    """(8, 128, 128, 3) float32 in [0, 1]: from around, a little from above, on light grounds."""
    centre, side = frame(gaussians)
    distance = 0.5 * side / (FILL * np.tan(0.5 * FIELD_OF_VIEW))
    dtype = gaussians.means.dtype
    pictures = []
    for view in range(VIEWS):
        azimuth = 2 * np.pi * view / VIEWS
        level = np.cos(ELEVATION)
        direction = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(ELEVATION)]
        eye = jnp.asarray(centre + distance * np.array(direction), dtype)
        camera = look_at(
            eye,
            jnp.asarray(centre, dtype),
            field_of_view=float(FIELD_OF_VIEW),
            width=FINER * RESOLUTION,
            height=FINER * RESOLUTION,
        )
        ground = GROUNDS[view % len(GROUNDS)]
        image = render(to_splats(gaussians, eye), camera, background=ground)
        pictures.append(np.clip(np.asarray(image.colour, np.float32), 0, 1))
    return np.stack(pictures)


def coarser(pictures: np.ndarray) -> np.ndarray:
    """(..., 128, 128, 3) -> (..., 64, 64, 3), averaged."""
    shape = (*pictures.shape[:-3], RESOLUTION, FINER, RESOLUTION, FINER, 3)
    return pictures.reshape(shape).mean((-4, -2))


def make(folder: Path, steps: int | None, seed: int) -> None:
    """Generates what is missing in `folder`, each from its refined sentence."""
    from jaxphys.guidance.choice import BUNDLED, require
    from jaxphys.guidance.optimise import OptimiseConfig, text_to_gaussians

    require(BUNDLED, BUNDLED)
    config = OptimiseConfig() if steps is None else OptimiseConfig(steps=steps)
    for prompt, sentence in SENTENCES.items():
        path = path_of(folder, prompt)
        if not path.exists():
            refined = refine(sentence, how="rules").refined
            print(f"{prompt}: {refined}", flush=True)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_ply(path, text_to_gaussians(refined, seed=seed, config=config, progress=True))


def contact_sheet(pictures: np.ndarray, first: np.ndarray) -> np.ndarray:
    """(12, 8, H, W, 3) in [0, 1] as one uint8 picture; what is not ranked first has a red edge."""
    count, views, height, width, _ = pictures.shape
    inside = np.zeros((height, width, 1), bool)
    inside[2:-2, 2:-2] = True
    keep = inside | first[..., None, None, None]
    framed = np.where(keep, pictures, (0.85, 0.1, 0.1))
    sheet = framed.transpose(0, 2, 1, 3, 4).reshape(count * height, views * width, 3)
    return np.rint(255 * sheet).astype(np.uint8)


def overview(pictures: np.ndarray) -> np.ndarray:
    """Every other view of (12, 8, H, W, 3) in two columns of six prompts, one uint8 picture."""
    left, right = np.split(pictures[:, ::2], 2)
    both = np.concatenate([left, right], axis=1)
    return contact_sheet(both, np.ones(both.shape[:2], bool))


def run(folder: Path, scorer: Scorer) -> list[Row]:
    """Draws and ranks what lies in `folder`, and writes twelve.json and twelve.png there."""
    missing = [str(path_of(folder, p)) for p in SENTENCES if not path_of(folder, p).exists()]
    if missing:
        raise InputError(f"{missing[0]}: is missing; make it, or run with --generate {folder}")
    pictures = np.stack([eight_views(read_ply(path_of(folder, prompt))) for prompt in SENTENCES])
    seen = coarser(pictures)
    vectors = embed(scorer, seen.reshape(-1, *seen.shape[2:])).reshape(*seen.shape[:2], -1)
    scores = similarities(vectors, load_text_encoder()(list(SENTENCES.values())))
    rows = table(scores, list(SENTENCES))
    write_json(
        folder / "twelve.json",
        {
            "bar": BAR,
            "sentences": SENTENCES,
            "views": VIEWS,
            "total": float(np.mean([row.first for row in rows])),
            "reach_the_bar": sum(row.first >= BAR for row in rows),
            "prompts": {row.prompt: {"first": row.first, "mistaken": row.mistaken} for row in rows},
            "similarities": np.round(scores, 4).tolist(),
        },
    )
    sheets = {
        "twelve": contact_sheet(pictures, ranked_first(scores)),
        "overview": overview(pictures),
    }
    for name, sheet in sheets.items():
        with atomic_path(folder / f"{name}.png") as aside:
            Image.fromarray(sheet).save(aside, optimize=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", type=Path, nargs="*")
    parser.add_argument("--generate", type=Path, metavar="FOLDER")
    parser.add_argument("--steps", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--weights", type=Path, default=WEIGHTS)
    options = parser.parse_args()
    folders = options.folders + ([options.generate] if options.generate else [])
    if not folders:
        parser.error("give a folder of Gaussians, or --generate FOLDER")
    try:
        scorer = load(options.weights)
        if options.generate:
            make(options.generate, options.steps, options.seed)
        for folder in folders:
            print(f"{folder}\n{report(run(folder, scorer))}", flush=True)
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
