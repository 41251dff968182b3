"""Pictures of the parametric models, several variants and views of each, to look at.

python -m experiments.priors.data.contact_sheet OUT.png [MODEL ...]
"""

import sys

import numpy as np
from PIL import Image

from experiments.priors.models import MODELS, build
from experiments.priors.models.surfaces import sample

from .splat import bake_light, picture, visible_surface

VIEWS = ((0.0, 0.3), (0.9, 0.3), (2.4, 0.7), (4.2, -0.15))  # azimuth, elevation [rad]


def model_row(name: str, seeds: int) -> np.ndarray:
    """One row of pictures (64, 64 * seeds * views, 3) on a light ground."""
    row = []
    for seed in range(seeds):
        mesh, _ = build(name, seed)
        points, normals, colours = (
            a.astype(np.float32) for a in sample(mesh, 60_000, np.random.default_rng(seed))
        )
        mask, normals = visible_surface(points, normals)
        shaded = bake_light(colours, normals)[mask]
        for azimuth, elevation in VIEWS:
            image = picture(points[mask], shaded, azimuth, elevation) / 255
            row.append(image[..., :3] * image[..., 3:] + 0.93 * (1 - image[..., 3:]))
    return np.concatenate(row, 1)


def main(path: str, *names: str) -> None:
    rows = [model_row(name, 3) for name in (names or MODELS)]
    sheet = Image.fromarray((255 * np.concatenate(rows, 0)).astype(np.uint8))
    sheet.resize((sheet.width * 2, sheet.height * 2), Image.Resampling.BICUBIC).save(path)


if __name__ == "__main__":
    main(*sys.argv[1:])
