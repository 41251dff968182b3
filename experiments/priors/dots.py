"""Clouds as pictures of dots, to look at."""

import numpy as np


def dots(points: np.ndarray, colours: np.ndarray, azimuth: float, size: int = 96) -> np.ndarray:
    """(size, size, 3) picture of a cloud as 2x2 dots, far ones first, seen 0.3 rad from above."""
    c, s, e = np.cos(azimuth), np.sin(azimuth), 0.3
    right = points @ np.array([-s, c, 0.0])
    up = points @ np.array([-np.sin(e) * c, -np.sin(e) * s, np.cos(e)])
    near = points @ np.array([np.cos(e) * c, np.cos(e) * s, np.sin(e)])
    order = np.argsort(near)
    column = np.clip((0.5 + right[order] * 0.8) * size, 0, size - 2).astype(int)
    row = np.clip((0.5 - up[order] * 0.8) * size, 0, size - 2).astype(int)
    image = np.full((size, size, 3), 235, np.uint8)
    for i in (0, 1):
        for j in (0, 1):
            image[row + i, column + j] = (255 * colours[order]).astype(np.uint8)
    return image


def dot_rows(clouds, size: int = 96) -> np.ndarray:
    """Two rows, from the front and from the back, of clouds (points, colours)."""
    clouds = list(clouds)
    rows = [
        np.concatenate([dots(points, colours, azimuth, size) for points, colours in clouds], 1)
        for azimuth in (0.4, 2.8)
    ]
    return np.concatenate(rows)
