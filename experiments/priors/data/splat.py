"""Dense coloured surface points: which can be seen, how they are lit, and their pictures by
z-buffer.
"""

import numpy as np

from experiments.priors.models.palette import golden_directions
from jaxphys.guidance import views

SUPERSAMPLING = 2


def camera_frame(direction: np.ndarray) -> np.ndarray:
    """Rows right, down, forward (3, 3) of a camera that stands along `direction` and looks at the
    origin.
    """
    forward = -direction / np.linalg.norm(direction)
    right = np.cross(forward, (0, 0, 1))
    if np.linalg.norm(right) < 1e-6:
        right = np.array([0.0, 1.0, 0.0])
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def nearest_points(points, position, resolution: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The index of the nearest point per pixel (-1: none), and every point's pixel and depth.

    A camera at `position` (3,) looking at the origin with the field of view of `views`.
    """
    frame = camera_frame(position)
    x, y, depth = ((points - position) @ frame.T.astype(points.dtype)).T
    focal = 0.5 * resolution / np.tan(0.5 * views.FIELD_OF_VIEW)
    column = np.floor(focal * x / depth + 0.5 * resolution).astype(np.int64)
    row = np.floor(focal * y / depth + 0.5 * resolution).astype(np.int64)
    pixel = row * resolution + column
    inside = (column >= 0) & (column < resolution) & (row >= 0) & (row < resolution)
    # Depth in the high bits and the index in the low ones: one minimum finds both.
    key = (depth * 2**24).astype(np.int64) << 32 | np.arange(len(points))
    buffer = np.full(resolution**2, np.iinfo(np.int64).max)
    np.minimum.at(buffer, pixel[inside], key[inside])
    index = np.where(buffer == np.iinfo(np.int64).max, -1, buffer & 0xFFFFFFFF)
    return index, np.where(inside, pixel, -1), depth


def visible_surface(points, normals, *, directions: int = 24, resolution: int = 64):
    """Which points are seen from around, and normals turned to the side they are seen from.

    Interiors, which no picture shows, would only mislead a point prior. Returns a mask (N,) and
    outward unit normals (N, 3).
    """
    seen = np.zeros(len(points), np.int32)
    toward = np.zeros_like(points)
    for direction in golden_directions(directions):
        position = (views.DISTANCE * direction).astype(points.dtype)
        index, pixel, depth = nearest_points(points, position, resolution)
        front = np.where(index >= 0, depth[index], np.inf)
        near = (pixel >= 0) & (depth < front[pixel] + 0.02)
        seen += near
        offset = position - points[near]
        # Seen edge on, a sample says nothing about its side: weigh by the cosine.
        cosine = np.abs((offset * normals[near]).sum(-1, keepdims=True))
        toward[near] += offset * cosine
    side = np.sign((toward * normals).sum(-1, keepdims=True))
    return seen > 0, normals * np.where(side == 0, 1, side)


def bake_light(colours, normals):
    """Colours (N, 3) in [0, 1] under the soft top light that all training data share."""
    return np.clip(colours * (views.AMBIENT + views.DIFFUSE * normals[:, 2:]), 0, 1)


def picture(points, colours, azimuth: float, elevation: float) -> np.ndarray:
    """The points seen from a view: RGBA uint8 (64, 64, 4), straight alpha, antialiased."""
    size = views.RESOLUTION * SUPERSAMPLING
    position = views.camera_position(azimuth, elevation).astype(points.dtype)
    index, _, _ = nearest_points(points, position, size)
    alpha = (index >= 0).astype(np.float32)[:, None]
    premultiplied = np.concatenate([colours[index] * alpha, alpha], 1).reshape(size, size, 4)
    premultiplied = close_pinholes(premultiplied)
    shape = (views.RESOLUTION, SUPERSAMPLING, views.RESOLUTION, SUPERSAMPLING, 4)
    return straight(premultiplied.reshape(shape).mean((1, 3)))


def close_pinholes(image: np.ndarray) -> np.ndarray:
    """Fills pixels that no point fell on but most of whose eight neighbours are covered by their
    mean.
    """
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)))
    height, width = image.shape[:2]
    around = sum(
        padded[i : i + height, j : j + width]
        for i in range(3)
        for j in range(3)
        if (i, j) != (1, 1)
    )
    count = around[..., 3:]
    hole = (image[..., 3:] == 0) & (count >= 5)
    return np.where(hole, around / np.maximum(count, 1), image)


def straight(premultiplied: np.ndarray) -> np.ndarray:
    """Premultiplied float RGBA in [0, 1] to straight uint8 RGBA; colour 0 where alpha is 0."""
    alpha = premultiplied[..., 3:]
    colour = premultiplied[..., :3] / np.maximum(alpha, 1e-6)
    image = np.concatenate([np.where(alpha > 0, colour, 0), alpha], -1)
    return np.rint(255 * np.clip(image, 0, 1)).astype(np.uint8)


def even_subset(points, count: int, rng: np.random.Generator) -> np.ndarray:
    """Indices of `count` points spread evenly: every k-th along a space-filling (Morton) curve."""
    cell = np.clip(((points + 0.5) * 1023).astype(np.uint64), 0, 1023)
    code = np.zeros(len(points), np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    order = np.argsort(code, kind="stable")
    at = (np.arange(count) + rng.random(count)) * (len(points) / count)
    return order[np.minimum(at.astype(int), len(points) - 1)]
