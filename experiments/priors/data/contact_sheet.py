"""Pictures of the parametric models, several variants and views of each, to look at.

python -m experiments.priors.data.contact_sheet OUT.png [MODEL ...]
"""

import sys

import numpy as np
from PIL import Image

from experiments.priors.models import MODELS, build
from experiments.priors.models.surfaces import sample

from .pictures import pictures
from .prepare import SAMPLES, surface_points

AZIMUTHS, ELEVATIONS = (0.0, 0.9, 2.4, 4.2), (0.3, 0.3, 0.7, -0.15)  # [rad]


def model_row(name: str, seeds: int) -> np.ndarray:
    """One row of pictures (64, 64 * seeds * views, 3) on a light ground."""
    row = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        points, colours = surface_points(*sample(build(name, seed)[0], SAMPLES, rng), rng)
        for image in pictures(points, colours, AZIMUTHS, ELEVATIONS) / 255:
            row.append(image[..., :3] * image[..., 3:] + 0.93 * (1 - image[..., 3:]))
    return np.concatenate(row, 1)


def main(path: str, *names: str) -> None:
    rows = [model_row(name, 3) for name in (names or MODELS)]
    sheet = Image.fromarray((255 * np.concatenate(rows, 0)).astype(np.uint8))
    sheet.resize((sheet.width * 2, sheet.height * 2), Image.Resampling.BICUBIC).save(path)


if __name__ == "__main__":
    main(*sys.argv[1:])
