"""Draws the parametric kinds: many variants of the principal ones, some of the others.

    python -m experiments.priors.data.parametric OBJECTS_FOLDER
        [--principal 64] [--others 24] [--views 8] [--workers 2]

Objects that are already there are kept, so that a larger set extends a smaller one.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tqdm import tqdm

from experiments.priors.data.prepare import (
    POINTS,
    Prepared,
    lit_points,
    save,
    stable_hash,
    with_pictures,
)
from jaxphys.library import KINDS, PRINCIPAL, build, captions

CAPTIONS = 8  # drawn for each object; repetitions are dropped


def item_name(kind: str, seed: int) -> str:
    """The object's file-system-safe name."""
    return f"parametric-{kind.replace(' ', '_')}-{seed:03d}"


def prepared(kind: str, seed: int, views: int) -> tuple[Prepared, list[str]]:
    """One variant with pictures from around, and its captions."""
    rng = np.random.default_rng(stable_hash(item_name(kind, seed)))
    built = build(kind, seed)
    surface = built.model.sample(POINTS + POINTS // 2, rng)
    kept = lit_points(surface.points, surface.normals, surface.colours, rng)
    return with_pictures(kept, rng, views), captions(built, CAPTIONS, rng)


def draw(folder: Path, views: int, item: tuple[str, int]) -> None:
    """Builds, samples and renders one variant into `folder` unless it is there."""
    path = folder / f"{item_name(*item)}.npz"
    if not path.exists():
        save(path, *prepared(*item, views))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("objects", type=Path)
    parser.add_argument("--principal", type=int, default=64)
    parser.add_argument("--others", type=int, default=24)
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.objects.mkdir(parents=True, exist_ok=True)
    count = {kind: options.principal if kind in PRINCIPAL else options.others for kind in KINDS}
    items = [(k, s) for s in range(max(count.values())) for k in KINDS if s < count[k]]
    work = partial(draw, options.objects, options.views)
    # Spawned, not forked: each worker starts its own jax.
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        list(tqdm(pool.map(work, items, chunksize=8), total=len(items)))


if __name__ == "__main__":
    main()
