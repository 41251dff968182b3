"""One object to what the priors learn from: evenly spread lit surface points, and pictures from
around.
"""

import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jaxphys.core.files import atomic_path
from jaxphys.guidance import views

from .pictures import pictures
from .splat import bake_light, even_subset, visible_surface

SAMPLES = 60_000  # dense surface samples to find what can be seen
POINTS = 4096  # of them kept, for the point prior and to draw pictures from
VIEWS = 16


class Prepared(NamedTuple):
    """Points (4096, 3) float16 in [-0.5, 0.5], colours (4096, 3) uint8, images (V, 64, 64, 4)
    uint8, views (V,).
    """

    points: np.ndarray
    colours: np.ndarray
    images: np.ndarray
    azimuth: np.ndarray
    elevation: np.ndarray


def random_views(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths spread evenly with jitter, elevations uniform over the sphere's band: each (count,)
    [rad].
    """
    azimuth = 2 * np.pi * (rng.permutation(count) + rng.random(count)) / count
    low, high = np.sin(views.ELEVATIONS)
    return azimuth, np.arcsin(rng.uniform(low, high, count))


def surface_points(points, normals, colours, rng) -> tuple[np.ndarray, np.ndarray]:
    """The lit points (4096, 3) float16 and colours (4096, 3) uint8 of what can be seen of dense
    samples (N, 3) with normals and albedo in [0, 1], in the common frame.
    """
    points, normals, colours = (np.asarray(a, np.float32) for a in (points, normals, colours))
    mask, outward = visible_surface(points, normals)
    points, colours = points[mask], bake_light(colours, outward)[mask]
    chosen = even_subset(points, POINTS, rng)
    return points[chosen].astype(np.float16), np.rint(255 * colours[chosen]).astype(np.uint8)


def prepare(points, normals, colours, seed: int) -> Prepared:
    """Points and pictures of dense samples, see `surface_points`."""
    rng = np.random.default_rng(seed)
    azimuth, elevation = (a.astype(np.float32) for a in random_views(rng, VIEWS))
    kept = surface_points(points, normals, colours, rng)
    return Prepared(*kept, pictures(*kept, azimuth, elevation), azimuth, elevation)


def stable_hash(text: str) -> int:
    """A hash of `text` that is the same in every process."""
    return zlib.crc32(text.encode())


def held_out(item: str) -> bool:
    """Whether this object belongs to the 5% that no prior is trained on."""
    return stable_hash(f"held out {item}") % 20 == 0


def save(path: Path, prepared: Prepared, captions: list[str]) -> None:
    """Writes one object's arrays and captions as an npz, whole or not at all."""
    with atomic_path(path) as aside:
        np.savez(aside, captions=np.array(captions), **prepared._asdict())
