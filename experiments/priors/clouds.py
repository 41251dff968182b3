"""The coloured surfaces that a training batch is made of: new variants of the parametric kinds at
every step, and subsets of the stored objects that are no variants of anything.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from experiments.priors.records import Records, sampler
from jaxphys.guidance import views
from jaxphys.library import KINDS, captions, make
from jaxphys.library.variation import Given

NEIGHBOURS = 8  # whose distance gives the area that a stored point stands for


class Cloud(NamedTuple):
    """Points (N, 3) in [-0.5, 0.5], outward normals (N, 3) and lit colours (N, 3) in [0, 1], one
    caption, and which places (Q, 3) lie inside.
    """

    points: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    caption: str
    inside: Callable[[np.ndarray], np.ndarray]


def kind_of(item: str) -> str | None:
    """The kind of an item by its name, None of what is not parametric."""
    source, _, rest = item.partition("-")
    kind = rest.rpartition("-")[0].replace("_", " ")
    return kind if source == "parametric" and kind in KINDS else None


def fresh_cloud(
    kind: str, points: int, rng: np.random.Generator, given: Given | None = None
) -> Cloud:
    """A new variant of `kind`; `given` as in `models.make`."""
    built = make(KINDS[kind], rng, given)
    surface = built.model.sample(points, rng)
    lit = views.lit(surface.colours, surface.normals)
    caption = captions(built, 1, rng)[0]
    return Cloud(surface.points, surface.normals, lit, caption, built.model.inside)


def winding_inside(points: np.ndarray, normals: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Which places (Q, 3) the oriented points (N, 3) wind around more than half (Barill et al.
    2018), (Q,): of a surface with holes what one would call inside, of a sheet nothing.
    """
    spacing = cKDTree(points).query(points, k=NEIGHBOURS + 1)[0][:, -1]
    area = np.pi * spacing**2 / NEIGHBOURS
    squared = (places**2).sum(1)[:, None] + (points**2).sum(1) - 2 * places @ points.T
    length = np.sqrt(np.maximum(squared, spacing**2 / NEIGHBOURS))
    flux = (points * normals).sum(1) - places @ normals.T
    return (area * flux / length**3).sum(1) > 2 * np.pi


def stored_cloud(data: Records, item: int, points: int, rng: np.random.Generator) -> Cloud:
    """A stored object by `points` of its 4096, which lie along a space-filling curve: one of every
    few of them is an even subset.
    """
    stored = data.points.shape[1]
    at = ((np.arange(points) + rng.random(points)) * (stored / points)).astype(int) % stored
    whole = data.points[item].astype(np.float32), data.normals[item].astype(np.float32) / 127
    captions = data.caption[data.caption_start[item] : data.caption_start[item + 1]]
    return Cloud(
        whole[0][at],
        whole[1][at],
        data.colours[item][at].astype(np.float32) / 255,
        data.captions[rng.choice(captions)],
        lambda places: winding_inside(*whole, places.astype(np.float32)),
    )


def held_out_clouds(
    data: Records | None, kinds: Sequence[str] | None, points: int, count: int = 96
) -> list[Cloud]:
    """Always the same clouds that no batch holds: variants that are asked for nowhere else, and
    the stored objects that are held out. With `kinds` variants of these alone.
    """
    rng = np.random.default_rng(2**31)
    if kinds is not None or data is None:
        kinds = list(KINDS) if kinds is None else kinds
        every = [kinds[i % len(kinds)] for i in range(count)]
        return [fresh_cloud(kind, points, rng) for kind in every]
    kept_out = np.flatnonzero(data.held_out[: len(data.points)])
    kept_out = rng.choice(kept_out, min(count, len(kept_out)), replace=False)
    return [stored_cloud(data, item, points, rng) for item in np.sort(kept_out)]


def cloud_source(
    data: Records | None, kinds: Sequence[str] | None, points: int
) -> Callable[[np.random.Generator, int], list[Cloud]]:
    """A function (generator, count) -> clouds of so many points, drawn as `data` weighs its items,
    or, where there are no data or `kinds` are given, of parametric kinds alone, each alike.
    """
    if kinds is not None or data is None:
        kinds = list(KINDS) if kinds is None else kinds
        choose = sampler(np.ones(len(kinds)))
        return lambda rng, count: [
            fresh_cloud(kinds[kind], points, rng) for kind in choose(rng, count)
        ]
    clouds = len(data.points)
    choose = sampler(data.weights()[:clouds])
    names = [kind_of(name) for name in data.name[:clouds]]

    def draw(rng: np.random.Generator, count: int) -> list[Cloud]:
        return [
            stored_cloud(data, item, points, rng)
            if (kind := names[item]) is None
            else fresh_cloud(kind, points, rng)
            for item in choose(rng, count)
        ]

    return draw
