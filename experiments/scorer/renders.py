"""Pictures for the scorer: other objects, renderer, cameras and light than the priors' pictures.

    python -m experiments.scorer.renders DATA

writes DATA/train.npz and DATA/held_out.npz with the objects listed in json files beside them:
random variants of the parametric models with seeds that no prior saw, drawn as points back to front
(the priors' pictures are drawn with `jaxphys.render` from one distance under one light).
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from experiments.priors.data.splat import camera_frame, pinholes
from jaxphys.core.files import atomic_path, write_json
from jaxphys.library import KINDS, PRINCIPAL, build, captions, usual

RESOLUTION, SUPERSAMPLING = 64, 2
SAMPLES = 24_000  # surface points of an object
FIRST_SEED, HELD_OUT_SEED = 1000, 2000  # the priors saw seeds 0 to 39
SEEDS = {
    "train": (FIRST_SEED, 24, 8),
    "held_out": (HELD_OUT_SEED, 8, 0),
}  # first, principal, others
VIEWS = 8


class Shot(NamedTuple):
    """How one picture is taken; angles in rad, lengths in object lengths.

    Attributes:
        azimuth, elevation, roll: of the camera, which looks at the object's centre.
        field_of_view: full angle.
        fill: share of the picture's side that the object's longest side takes.
        shift: (2,) of the centre, in picture sides.
        light: (3,) unit vector towards the light.
        ambient, diffuse: colour = albedo (ambient + diffuse max(n . light, 0)).
        shake: standard deviation of noise on the points: surfaces of Gaussians are not clean.
    """

    azimuth: float
    elevation: float
    roll: float
    field_of_view: float
    fill: float
    shift: np.ndarray
    light: np.ndarray
    ambient: float
    diffuse: float
    shake: float


def random_shot(rng: np.random.Generator, turn: float) -> Shot:
    """A shot from azimuth 2 pi `turn`, all else random."""
    tilt, around = np.deg2rad(70) * np.sqrt(rng.random()), 2 * np.pi * rng.random()
    return Shot(
        azimuth=2 * np.pi * turn,
        elevation=np.deg2rad(rng.uniform(-10, 50)),
        roll=np.deg2rad(rng.uniform(-10, 10)),
        field_of_view=np.deg2rad(rng.uniform(15, 50)),
        fill=rng.uniform(0.5, 0.95),
        shift=rng.uniform(-0.06, 0.06, 2),
        light=np.array(
            [np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)]
        ),
        ambient=rng.uniform(0.55, 0.85),
        diffuse=rng.uniform(0.1, 0.45),
        shake=0.012 * rng.random() ** 2,
    )


def picture(points, normals, colours, shot: Shot, rng: np.random.Generator) -> np.ndarray:
    """RGBA uint8 (64, 64, 4), straight alpha, of surface samples (N, 3).

    Points are drawn back to front, each over two by two of the finer pixels: the nearest remains.
    """
    size = RESOLUTION * SUPERSAMPLING
    direction = np.array(
        [
            np.cos(shot.elevation) * np.cos(shot.azimuth),
            np.cos(shot.elevation) * np.sin(shot.azimuth),
            np.sin(shot.elevation),
        ]
    )
    half = np.tan(0.5 * shot.field_of_view)
    position = (direction * 0.5 / (shot.fill * half)).astype(points.dtype)
    points = points + shot.shake * rng.standard_normal(points.shape, points.dtype)
    toward = position - points
    x, y, depth = camera_frame(direction) @ -toward.T
    cosine, sine = np.cos(shot.roll), np.sin(shot.roll)
    x, y = cosine * x - sine * y, sine * x + cosine * y
    scale, depth = 0.5 * size / half, np.maximum(depth, 1e-2)
    column = np.floor(scale * x / depth + size * (0.5 + shot.shift[0]) + 0.5).astype(np.int64)
    row = np.floor(scale * y / depth + size * (0.5 + shot.shift[1]) + 0.5).astype(np.int64)
    # A border of one pixel takes what falls beside the picture.
    column, row = np.clip(column, 0, size), np.clip(row, 0, size)
    order = np.argsort(-depth)
    corner = (row * (size + 2) + column)[order, None]
    nearest = np.full((size + 2) ** 2, -1)
    nearest[(corner + np.array([0, 1, size + 2, size + 3])).ravel()] = np.repeat(order, 4)
    nearest = nearest.reshape(size + 2, size + 2)[1:-1, 1:-1]

    outward = normals * np.sign((normals * toward).sum(1, keepdims=True))
    light = shot.ambient + shot.diffuse * np.maximum(outward @ shot.light, 0)
    lit = np.clip(colours * light[:, None], 0, 1)
    alpha = (nearest >= 0)[..., None]
    image = np.concatenate([lit[nearest] * alpha, alpha], -1)
    mend(image, np.where(nearest >= 0, depth[nearest], np.inf))
    blocks = image.reshape(RESOLUTION, SUPERSAMPLING, RESOLUTION, SUPERSAMPLING, 4).mean((1, 3))
    colour = blocks[..., :3] / np.maximum(blocks[..., 3:], 1e-6)
    return np.rint(255 * np.concatenate([colour, blocks[..., 3:]], -1)).astype(np.uint8)


def mend(image: np.ndarray, depth: np.ndarray) -> None:
    """Pixels of `image` (H, W, 4) that show what is behind a surface get its colour, in place."""
    hole, nearer = pinholes(depth)
    rows, columns = np.nonzero(hole)
    size = image.shape[0]
    shifts = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]).T
    around = image[
        np.clip(rows + shifts[0, :, None], 0, size - 1),
        np.clip(columns + shifts[1, :, None], 0, size - 1),
    ]
    weight = nearer[:, rows, columns, None]
    image[rows, columns] = (around * weight).sum(0) / weight.sum(0)


def shots_of(name: str, seed: int, plain: bool = False) -> tuple[np.ndarray, list[str]]:
    """Pictures (8, 64, 64, 4) uint8 of one variant from around, and its captions; a `plain` one
    has its usual colours, as whoever names none means.
    """
    rng = np.random.default_rng([seed, *name.encode()])
    built = usual(name, seed) if plain else build(name, seed)
    points, colours, normals = (
        values.astype(np.float32) for values in built.model.sample(SAMPLES, rng)
    )
    turns = (np.arange(VIEWS) + rng.random(VIEWS)) / VIEWS
    shots = [picture(points, normals, colours, random_shot(rng, t), rng) for t in turns]
    return np.stack(shots), captions(built, 4, rng)


def objects(part: str) -> list[tuple[str, int]]:
    """Names and seeds of the objects of the part "train" or "held_out"."""
    first, principal, others = SEEDS[part]
    counts = {name: principal if name in PRINCIPAL else others for name in KINDS}
    return [(name, first + k) for name, count in counts.items() for k in range(count)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    folder = parser.parse_args().data
    folder.mkdir(parents=True, exist_ok=True)
    for part in SEEDS:
        images, items = [], []
        for name, seed in tqdm(objects(part), desc=part):
            drawn, said = shots_of(name, seed, plain=part == "held_out")
            images.append(drawn)
            items.append({"name": name, "seed": seed, "captions": said})
        with atomic_path(folder / f"{part}.npz") as aside:
            np.savez(aside, images=np.stack(images))
        write_json(folder / f"{part}.json", items)


if __name__ == "__main__":
    main()
