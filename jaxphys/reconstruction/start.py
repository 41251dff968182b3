"""What the optimisation starts from: points that were seen, a visual hull, or chance."""

import numpy as np
from scipy.ndimage import binary_erosion

from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.guidance.pictures import neighbour_sizes
from jaxphys.reconstruction.capture import Shot

CELLS = 96  # of the hull, along each side of the room
FACING = 0.2  # cosine of the angle under which a surface is looked at, at least
MISSED = 0.02  # share of the shots that may see nothing where matter is


def room(shots: tuple[Shot, ...]) -> tuple[np.ndarray, float]:
    """Centre (3,) and half the side of the cube that all cameras look into.

    The centre is nearest to all optical axes, the side what a camera sees there on average.
    """
    axes = np.stack([shot.rotation[2] for shot in shots])
    places = np.stack([shot.position for shot in shots])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]  # away from each axis
    # Parallel axes have no nearest point: the least change of the mean of what is before them.
    middle = places.mean(0) + axes.mean(0)
    weight = 1e-6 * np.eye(3)
    centre = np.linalg.solve(
        across.mean(0) + weight, (across @ places[:, :, None]).mean(0)[:, 0] + weight @ middle
    )
    far = np.linalg.norm(places - centre, axis=1)
    seen = [0.5 * min(s.size[0] / s.focal[0], s.size[1] / s.focal[1]) for s in shots]
    return centre, float(np.mean(far * np.asarray(seen)))


def seen_by(shot: Shot, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of points (N, 3) in a picture as shares of its width and height (N, 2), and which are
    in it.
    """
    local = points @ shot.rotation.T + shot.translation
    depth = np.maximum(local[:, 2:], 1e-9)
    places = (np.asarray(shot.focal) * local[:, :2] / depth + shot.centre) / np.asarray(shot.size)
    return places, (local[:, 2] > 0) & np.all((places >= 0) & (places < 1), axis=1)


def _values(picture: np.ndarray, places: np.ndarray) -> np.ndarray:
    height, width = picture.shape[:2]
    column = np.minimum((places[:, 0] * width).astype(int), width - 1)
    row = np.minimum((places[:, 1] * height).astype(int), height - 1)
    return picture[row, column]


def hull(
    shots: tuple[Shot, ...], pictures: list[np.ndarray], count: int, seed: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Points (N, 3) on the visual hull (Laurentini 1994) of pictures with a transparent background,
    N at most `count`, and their colours (N, 3); None where there is no hull.
    """
    centre, half = room(shots)
    line = (np.arange(CELLS) + 0.5) / CELLS * 2 - 1
    cells = centre + half * np.stack(np.meshgrid(line, line, line, indexing="ij"), -1)
    points = cells.reshape(-1, 3)
    missed = np.zeros(len(points), np.int32)
    for shot, picture in zip(shots, pictures, strict=True):
        places, inside = seen_by(shot, points)
        missed[inside] += _values(picture[..., 3], places[inside]) < 128
    solid = (missed <= MISSED * len(shots)).reshape(CELLS, CELLS, CELLS)
    shell = solid & ~binary_erosion(solid)
    if not shell.any() or solid.all():
        return None
    smooth = np.stack(np.gradient(_smoothed(solid)), axis=-1)[shell]
    normals = -smooth / np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1e-9)
    random = np.random.default_rng(seed)
    chosen = random.permutation(int(shell.sum()))[:count]
    points, normals = cells[shell][chosen], normals[chosen]
    return points, _colours(shots, pictures, points, normals)


def _smoothed(solid: np.ndarray) -> np.ndarray:
    from scipy.ndimage import gaussian_filter

    return gaussian_filter(solid.astype(np.float32), 1.5)


def _colours(shots, pictures, points, normals) -> np.ndarray:
    """The mean of what cameras see that look at a surface, (N, 3)."""
    total, weight = np.zeros((len(points), 3)), np.full((len(points), 1), 1e-9)
    for shot, picture in zip(shots, pictures, strict=True):
        towards = shot.position - points
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        places, inside = seen_by(shot, points)
        facing = np.sum(towards * normals, axis=1)
        colours = _values(picture, np.clip(places, 0, 1 - 1e-9)) / 255.0
        seen = (inside & (facing > FACING) & (colours[:, 3] > 0.5)) * facing
        total += seen[:, None] * colours[:, :3]
        weight += seen[:, None]
    return np.where(weight > 1e-6, total / weight, 0.5)


def initial_gaussians(
    shots: tuple[Shot, ...],
    pictures: list[np.ndarray],
    points: np.ndarray,
    colours: np.ndarray,
    *,
    count: int,
    degree: int,
    seed: int,
) -> tuple[Gaussians, str]:
    """At most `count` Gaussians to start from, and what they were made of: "points", "hull" or
    "chance".
    """
    random = np.random.default_rng(seed)
    source = "points"
    if len(points):
        chosen = random.permutation(len(points))[:count]
        points, colours = points[chosen], colours[chosen]
    else:
        found = None
        if all(np.any(picture[..., 3] < 128) for picture in pictures):
            found = hull(shots, pictures, count, seed)
        source = "chance" if found is None else "hull"
        if found is None:
            centre, half = room(shots)
            points = centre + half * random.uniform(-1, 1, (count, 3))
            found = points, np.full((count, 3), 0.5)
        points, colours = found
    centre, half = room(shots)
    sizes = neighbour_sizes(np.asarray(points, np.float64), 0.7, 0.1 * half)
    opacity = 0.1 if source == "chance" else 0.9
    made = from_points(points, np.clip(colours, 0.02, 0.98), sizes, opacity=opacity, degree=degree)
    return made, source
