"""Stand-ins for the captures of PhysGaussian's examples: simple solids as clouds of Gaussians, in
the folders that training of 3D Gaussian splatting leaves.

They are built as they shall stand in the solver's box, about (1, 1, 1), and turned back by the
rotation that their configuration applies.
"""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from jaxphys.core.rotations import axis_angle_to_matrix
from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.gaussians.ply import write_ply

SPACING = 0.03  # between Gaussians
WIDTH, HEIGHT, FOCAL = 320, 180, 480.0

Cloud = tuple[np.ndarray, np.ndarray]
Inside = Callable[[np.ndarray], np.ndarray]


def ellipsoid(centre, radii) -> tuple[np.ndarray, np.ndarray, Inside]:
    """Bounds, and which of points (N, 3) are inside. So the others."""
    c, r = np.array(centre), np.array(radii)
    return c - r, c + r, lambda x: np.sum(((x - c) / r) ** 2, axis=1) < 1


def cuboid(centre, half) -> tuple[np.ndarray, np.ndarray, Inside]:
    c, h = np.array(centre), np.array(half)
    return c - h, c + h, lambda x: np.all(np.abs(x - c) < h, axis=1)


def cone(start, end, first: float, last: float) -> tuple[np.ndarray, np.ndarray, Inside]:
    """A frustum from `start` to `end` with these radii."""
    a, b = np.array(start), np.array(end)
    length = np.linalg.norm(b - a)
    axis, reach = (b - a) / length, max(first, last)

    def inside(x: np.ndarray) -> np.ndarray:
        along = (x - a) @ axis
        across = np.linalg.norm(x - a - along[:, None] * axis, axis=1)
        radius = first + (last - first) * along / length
        return (along > 0) & (along < length) & (across < radius)

    return np.minimum(a, b) - reach, np.maximum(a, b) + reach, inside


def cloud(shape, colour, *, hollow: bool = False, rng: np.random.Generator) -> Cloud:
    """Points of a lattice inside a shape, with a little noise, or only those near its surface."""
    low, high, inside = shape
    axes = [np.arange(a + SPACING / 2, b, SPACING) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    points = points[inside(points)]
    if hollow:
        steps = SPACING * np.concatenate([np.eye(3), -np.eye(3)])
        points = points[~np.all([inside(points + step) for step in steps], axis=0)]
    points = points + rng.uniform(-0.2, 0.2, points.shape) * SPACING
    shades = np.asarray(colour) * rng.uniform(0.85, 1.1, (len(points), 1))
    return points, np.clip(shades, 0, 1)


def _striped(part: Cloud, axis: int, colour, width: float) -> Cloud:
    points, colours = part
    striped = np.floor(points[:, axis] / width) % 2 == 0
    return points, np.where(striped[:, None], np.asarray(colour), colours)


def _ficus(rng) -> list[Cloud]:
    parts = [
        cloud(cone((1, 1, 0.5), (1, 1, 0.75), 0.13, 0.2), (0.7, 0.36, 0.22), rng=rng),
        cloud(cone((1, 1, 0.75), (1, 1, 1.2), 0.045, 0.035), (0.45, 0.3, 0.18), rng=rng),
    ]
    for x, y, z, radius in [
        (1.0, 1.0, 1.36, 0.14), (0.82, 1.0, 1.18, 0.12), (1.18, 1.03, 1.2, 0.12),
        (1.0, 0.83, 1.24, 0.12), (1.0, 1.17, 1.22, 0.12),
    ]:  # fmt: skip
        branch = cone((1, 1, 1.0), (x, y, z), 0.035, 0.03)
        parts.append(cloud(branch, (0.45, 0.3, 0.18), rng=rng))
        leaves = ellipsoid((x, y, z), (radius, radius, 0.8 * radius))
        parts.append(cloud(leaves, (0.2, 0.5, 0.2), rng=rng))
    return parts


def _pillow(rng) -> list[Cloud]:
    sofa = [
        (cuboid((1, 1, 0.62), (0.5, 0.4, 0.12)), (0.35, 0.42, 0.55)),
        (cuboid((1, 1.33, 0.82), (0.5, 0.07, 0.08)), (0.22, 0.27, 0.38)),
        (cuboid((0.56, 0.93, 0.79), (0.06, 0.33, 0.05)), (0.27, 0.33, 0.45)),
        (cuboid((1.44, 0.93, 0.79), (0.06, 0.33, 0.05)), (0.27, 0.33, 0.45)),
    ]
    pillow = ellipsoid((1, 0.95, 1.31), (0.27, 0.27, 0.19))
    return [
        *(cloud(part, colour, hollow=True, rng=rng) for part, colour in sofa),
        _striped(cloud(pillow, (0.9, 0.75, 0.3), hollow=True, rng=rng), 0, (0.85, 0.35, 0.3), 0.12),
    ]


def _plane(rng) -> list[Cloud]:
    metal, red = (0.62, 0.66, 0.72), (0.75, 0.2, 0.18)
    wings = cloud(cuboid((0.78, 1.03, 0.98), (0.12, 0.5, 0.035)), metal, rng=rng)
    return [
        cloud(cone((0.5, 1.03, 0.98), (1.5, 1.03, 0.98), 0.1, 0.06), metal, rng=rng),
        _striped(wings, 1, red, 0.2),
        cloud(cuboid((1.42, 1.03, 0.99), (0.06, 0.2, 0.03)), red, rng=rng),
        cloud(cuboid((1.42, 1.03, 1.1), (0.06, 0.03, 0.12)), red, rng=rng),
    ]


def _bread(rng) -> list[Cloud]:
    # Scored across the middle, where it will tear.
    loaf = [
        cone((1, 0.7, 1), (1, 0.8, 1), 0.1, 0.15),
        cone((1, 0.8, 1), (1, 1.0, 1), 0.15, 0.11),
        cone((1, 1.0, 1), (1, 1.2, 1), 0.11, 0.15),
        cone((1, 1.2, 1), (1, 1.3, 1), 0.15, 0.1),
    ]
    parts = [cloud(part, (0.8, 0.55, 0.28), rng=rng) for part in loaf]
    return [_striped(part, 1, (0.6, 0.36, 0.15), 0.075) for part in parts]


def _vase(rng) -> list[Cloud]:
    blue = (0.3, 0.45, 0.7)
    body = [
        cloud(cone((1, 1, 0.5), (1, 1, 0.8), 0.12, 0.24), blue, rng=rng),
        cloud(cone((1, 1, 0.8), (1, 1, 1.15), 0.24, 0.1), blue, rng=rng),
        cloud(cone((1, 1, 1.15), (1, 1, 1.5), 0.1, 0.17), blue, rng=rng),
    ]
    # Upright marks, so that turning can be seen.
    marked = []
    for points, colours in body:
        angle = np.arctan2(points[:, 1] - 1, points[:, 0] - 1)
        mark = np.floor(angle / (math.pi / 4)) % 2 == 0
        marked.append((points, np.where(mark[:, None], (0.92, 0.9, 0.85), colours)))
    handles = [
        cloud(cuboid((1 + side * 0.27, 1, 0.78), (0.07, 0.04, 0.05)), (0.8, 0.3, 0.2), rng=rng)
        for side in (-1, 1)
    ]
    deck = cloud(cuboid((1, 1, 0.42), (0.7, 0.7, 0.04)), (0.55, 0.4, 0.27), rng=rng)
    return [*marked, *handles, _striped(deck, 0, (0.48, 0.34, 0.22), 0.14)]


def _wolf(rng) -> list[Cloud]:
    grey, dark = (0.55, 0.52, 0.48), (0.35, 0.32, 0.3)
    legs = [(0.72, 0.9), (0.72, 1.1), (1.22, 0.9), (1.22, 1.1)]
    shapes = [
        (ellipsoid((0.97, 1, 1.0), (0.36, 0.17, 0.19)), grey),
        (cone((1.2, 1, 1.02), (1.3, 1, 1.32), 0.13, 0.1), grey),
        (ellipsoid((1.32, 1, 1.35), (0.13, 0.11, 0.11)), grey),
        (cone((1.38, 1, 1.34), (1.5, 1, 1.32), 0.08, 0.05), dark),
        (cone((1.27, 0.94, 1.4), (1.26, 0.93, 1.5), 0.045, 0.02), dark),
        (cone((1.27, 1.06, 1.4), (1.26, 1.07, 1.5), 0.045, 0.02), dark),
        (cone((0.64, 1, 1.05), (0.5, 1, 0.85), 0.06, 0.05), dark),
        *((cone((x, y, 0.5), (x, y, 1.0), 0.065, 0.09), grey) for x, y in legs),
    ]
    return [cloud(shape, colour, rng=rng) for shape, colour in shapes]


MODELS = {
    "ficus": _ficus,
    "pillow2sofa": _pillow,
    "plane": _plane,
    "tear_bread": _bread,
    "vasedeck": _vase,
    "wolf": _wolf,
}


def stand_in(name: str, config: dict, seed: int = 0) -> Gaussians:
    """The Gaussians that the example called `name` moves, as its file would hold them."""
    points, colours = (
        np.concatenate(part)
        for part in zip(*MODELS[name](np.random.default_rng(seed)), strict=True)
    )
    points = points - 1.0
    turns = zip(config.get("rotation_axis", ()), config.get("rotation_degree", ()), strict=True)
    for axis, degrees in reversed(list(turns)):
        turn = axis_angle_to_matrix(np.eye(3)[axis], np.radians(degrees))
        points = points @ np.asarray(turn, np.float64)
    return from_points(points.astype(np.float32), colours.astype(np.float32), 0.55 * SPACING)


def write_model(folder: Path, gaussians: Gaussians) -> Path:
    """A folder as training leaves it, with one camera that sees the object from the side."""
    path = folder / "point_cloud" / "iteration_30000" / "point_cloud.ply"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_ply(path, gaussians)
    # From 60 degrees to the left of y and a little above; x right, y down, z forward as columns.
    away = np.array([0.5, -0.85, 0.25])
    forward = -away / np.linalg.norm(away)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    camera = {
        "id": 0, "img_name": "00000", "width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL,
        "position": (-3.6 * forward - [0, 0, 0.15]).tolist(), "rotation": rotation.tolist(),
    }  # fmt: skip
    (folder / "cameras.json").write_text(json.dumps([camera]))
    return folder
