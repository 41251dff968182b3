"""Draws the parametric models: many variants of the principal ones, some of the others.

    python -m experiments.priors.data.parametric OBJECTS_FOLDER
        [--principal 40] [--others 8] [--workers 2]

Objects that are already there are kept, so that a larger set extends a smaller one.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from experiments.priors.models.surfaces import sample
from tqdm import tqdm

from experiments.priors.models import MODELS, PRINCIPAL, build

from .prepare import SAMPLES, prepare, save, stable_hash


def draw(folder: Path, item: tuple[str, int]) -> None:
    """Builds, samples and renders one variant into `folder` unless it is there."""
    name, seed = item
    path = folder / f"parametric-{name.replace(' ', '_')}-{seed:03d}.npz"
    if path.exists():
        return
    mesh, captions = build(name, seed)
    key = stable_hash(path.name)
    save(path, prepare(*sample(mesh, SAMPLES, np.random.default_rng(key)), key), captions)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("objects", type=Path)
    parser.add_argument("--principal", type=int, default=40)
    parser.add_argument("--others", type=int, default=8)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    items = [(name, seed) for seed in range(options.principal) for name in PRINCIPAL]
    items += [(n, s) for s in range(options.others) for n in MODELS if n not in PRINCIPAL]
    # Spawned, not forked: each worker starts its own jax.
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        list(tqdm(pool.map(partial(draw, options.objects), items), total=len(items)))


if __name__ == "__main__":
    main()
