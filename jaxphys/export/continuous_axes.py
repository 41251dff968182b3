"""Axes of Gaussians that go on from frame to frame, for players that interpolate between them.

A covariance has no first axis and no direction along one: of 24 rotations with permuted scales,
each with either sign of its quaternion, all draw the same. What an eigen-decomposition happens to
choose jumps between frames, and a player that goes from one to the next would let the Gaussian
tumble.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import jax.numpy as jnp
import numpy as np

from jaxphys.export.frames import Frames, NumberedGaussians, unit
from jaxphys.gaussians.gaussians import Gaussians

# Scales that differ by less than this part count as equal: any axes between them draw the same.
ROUND = 1e-4


def _cube() -> tuple[np.ndarray, np.ndarray]:
    """The 24 rotations that map the axes onto each other: matrices (24, 3, 3) and quaternions."""
    half = 0.5**0.5
    units = [np.eye(4)[i] for i in range(4)]
    edges = [half * (units[i] + s * units[j]) for i in range(4) for j in range(i) for s in (1, -1)]
    corners = [0.5 * np.array([1, *signs]) for signs in product((1, -1), repeat=3)]
    quaternions = np.stack([*units, *edges, *corners])
    return np.rint(matrix(quaternions)), quaternions


def matrix(quaternions: np.ndarray) -> np.ndarray:
    """Rotation matrices (N, 3, 3) of unit quaternions w, x, y, z (N, 4)."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _times(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Quaternions (N, 4) that turn by q first and by p then."""
    real = p[:, :1] * q[:, :1] - np.sum(p[:, 1:] * q[:, 1:], axis=1, keepdims=True)
    rest = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.concatenate([real, rest], axis=1)


_CUBE, _CUBE_QUATERNIONS = _cube()


def nearest_axes(
    previous: np.ndarray, quaternions: np.ndarray, log_scales: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The same covariances with the axes that are nearest to `previous`.

    Of the 24 choices the one that a smallest turn leads to from the previous one; where two or
    three scales are equal (to `ROUND`) the axes between them are turned back as well.

    Args:
        previous: unit quaternions w, x, y, z of the frame before, (N, 4).
        quaternions: of this one, (N, 4).
        log_scales: of this one, (N, 3).

    Returns:
        quaternions and log_scales.
    """
    before = matrix(previous)
    overlap = np.swapaxes(before, 1, 2) @ matrix(quaternions)
    # The trace of a rotation falls with its angle.
    best = np.argmax(np.einsum("nij,gji->ng", overlap, _CUBE), axis=1)
    quaternions = _times(quaternions, _CUBE_QUATERNIONS[best])
    log_scales = np.einsum("njk,nj->nk", np.abs(_CUBE[best]), log_scales)
    for k in range(3):
        overlap = np.swapaxes(before, 1, 2) @ matrix(quaternions)
        i, j = (k + 1) % 3, (k + 2) % 3
        equal = np.abs(log_scales[:, i] - log_scales[:, j]) < ROUND
        angle = np.arctan2(overlap[:, i, j] - overlap[:, j, i], overlap[:, i, i] + overlap[:, j, j])
        turn = np.zeros_like(quaternions)
        turn[:, 0], turn[:, k + 1] = np.cos(angle / 2), np.sin(angle / 2)
        quaternions = np.where(equal[:, None], _times(quaternions, turn), quaternions)
    ball = np.ptp(log_scales, axis=1) < ROUND
    quaternions = np.where(ball[:, None], previous, quaternions)
    same = np.sum(quaternions * previous, axis=1, keepdims=True) >= 0
    return unit(np.where(same, quaternions, -quaternions)), log_scales


def continuous_axes(frames: Frames) -> Iterator[NumberedGaussians]:
    """The frames with axes that go on from one to the next; what is drawn stays the same.

    Turns of more than about 45 degrees between two frames may go the other way round.
    """
    previous: np.ndarray | None = None
    for frame in frames:
        gaussians = frame.gaussians
        quaternions = unit(np.asarray(gaussians.quaternions, np.float64))
        if previous is not None and previous.shape == quaternions.shape:
            scales = np.asarray(gaussians.log_scales, np.float64)
            quaternions, scales = nearest_axes(previous, quaternions, scales)
            gaussians = _with_axes(gaussians, quaternions, scales)
        previous = quaternions
        yield frame._replace(gaussians=gaussians)


def _with_axes(gaussians: Gaussians, quaternions: np.ndarray, log_scales: np.ndarray) -> Gaussians:
    dtype = gaussians.means.dtype
    return replace(
        gaussians,
        quaternions=jnp.asarray(quaternions, dtype),
        log_scales=jnp.asarray(log_scales, dtype),
    )
