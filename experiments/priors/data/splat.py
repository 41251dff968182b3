"""Dense coloured surface points: which can be seen, how they are lit, which to keep."""

import numpy as np

from jaxphys.guidance import views
from jaxphys.library.palette import golden_directions


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

    A camera at `position` (3,) looking at the origin with the field of view of `views`. Each point
    covers the two by two pixels whose centres are nearest, so that samples leave no gaps.
    """
    frame = camera_frame(position)
    x, y, depth = ((points - position) @ frame.T.astype(points.dtype)).T
    focal = 0.5 * resolution / np.tan(0.5 * views.FIELD_OF_VIEW)
    u, v = focal * x / depth + 0.5 * resolution, focal * y / depth + 0.5 * resolution
    # Depth in the high bits and the index in the low ones: one minimum finds both.
    key = (depth * 2**24).astype(np.int64) << 32 | np.arange(len(points))
    empty = np.iinfo(np.int64).max
    buffer = np.full((resolution + 2) ** 2, empty)
    # A border of one pixel takes what falls beside the picture.
    left = np.clip(np.floor(u + 0.5).astype(np.int64), 0, resolution)
    top = np.clip(np.floor(v + 0.5).astype(np.int64), 0, resolution)
    for row in (0, 1):
        for column in (0, 1):
            np.minimum.at(buffer, (top + row) * (resolution + 2) + left + column, key)
    buffer = buffer.reshape(resolution + 2, resolution + 2)[1:-1, 1:-1].ravel()
    inside = (u >= 0) & (u < resolution) & (v >= 0) & (v < resolution)
    pixel = np.floor(v).astype(np.int64) * resolution + np.floor(u).astype(np.int64)
    return np.where(buffer == empty, -1, buffer & 0xFFFFFFFF), np.where(inside, pixel, -1), depth


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
        front = np.where(index >= 0, depth[index], np.inf).reshape(resolution, resolution)
        hole, nearer = pinholes(front)
        around = np.where(nearer, neighbours(front), 0).sum(0)
        front = np.where(hole, around / np.maximum(nearer.sum(0), 1), front).ravel()
        near = (pixel >= 0) & (depth < front[pixel] + 0.02)
        seen += near
        offset = position - points[near]
        # Seen edge on, a sample says nothing about its side: weigh by the cosine.
        cosine = np.abs((offset * normals[near]).sum(-1, keepdims=True))
        toward[near] += offset * cosine
    side = np.sign((toward * normals).sum(-1, keepdims=True))
    return seen > 0, normals * np.where(side == 0, 1, side)


def neighbours(image: np.ndarray) -> np.ndarray:
    """The eight neighbours (8, H, W, ...) of every pixel; those past the border repeat the edge."""
    height, width = image.shape[:2]
    padded = np.pad(image, ((1, 1), (1, 1), *[(0, 0)] * (image.ndim - 2)), mode="edge")
    shifts = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    return np.stack([padded[i : i + height, j : j + width] for i, j in shifts])


def pinholes(depth: np.ndarray, step: float = 0.04) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of `depth` (H, W) where the samples let something behind show through.

    Those with most of their neighbours nearer by `step` object lengths (infinite depth: nothing).
    Returns the mask (H, W) and which neighbours (8, H, W) are the nearer ones.
    """
    nearer = neighbours(depth) < depth - step
    return nearer.sum(0) >= 5, nearer


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
