"""One object to what the priors learn from: evenly spread lit surface points, and pictures from
around.
"""

import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from experiments.priors.data.pictures import pictures
from experiments.priors.data.splat import even_subset, visible_surface
from jaxphys.core.files import atomic_path
from jaxphys.guidance import views

SAMPLES = 60_000  # dense surface samples to find what can be seen
POINTS = 4096  # of them kept, for the point prior and to draw pictures from
VIEWS = 16


class Prepared(NamedTuple):
    """Points (4096, 3) float16 in [-0.5, 0.5], their outward normals times 127 (4096, 3) int8,
    colours (4096, 3) uint8, images (V, 64, 64, 4) uint8, views (V,).
    """

    points: np.ndarray
    normals: np.ndarray
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


def lit_points(points, normals, colours, rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (4096, 3) float16, normals times 127 (4096, 3) int8 and lit colours (4096, 3) uint8 of
    samples (N, 3) of the outer surface with outward normals and albedo in [0, 1].
    """
    points, normals, colours = (np.asarray(a, np.float32) for a in (points, normals, colours))
    chosen = even_subset(points, POINTS, rng)
    lit = views.lit(colours[chosen], normals[chosen])
    return (
        points[chosen].astype(np.float16),
        np.rint(127 * normals[chosen]).astype(np.int8),
        np.rint(255 * lit).astype(np.uint8),
    )


def surface_points(points, normals, colours, rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`lit_points` of what can be seen of dense samples whose inner surfaces and wrong normals are
    not known.
    """
    points, normals, colours = (np.asarray(a, np.float32) for a in (points, normals, colours))
    mask, outward = visible_surface(points, normals)
    return lit_points(points[mask], outward[mask], colours[mask], rng)


def with_pictures(kept: tuple[np.ndarray, np.ndarray, np.ndarray], rng, views: int) -> Prepared:
    """The points of `lit_points` with pictures from around."""
    azimuth, elevation = (a.astype(np.float32) for a in random_views(rng, views))
    points, _, colours = kept
    return Prepared(*kept, pictures(points, colours, azimuth, elevation), azimuth, elevation)


def prepare(points, normals, colours, seed: int) -> Prepared:
    """Points and pictures of dense samples, see `surface_points`."""
    rng = np.random.default_rng(seed)
    return with_pictures(surface_points(points, normals, colours, rng), rng, VIEWS)


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
