"""Names of an ellipsoid's axes that go on from frame to frame.

A covariance has no first axis and no direction along one: of 24 rotations with permuted scales,
each with either sign of its quaternion, all are the same ellipsoid. What an eigen-decomposition
happens to choose jumps between frames; a player that goes from one to the next would let it tumble,
and numbers that jump do not compress. NumPy alone.
"""

from itertools import product

import numpy as np

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


CUBE, CUBE_QUATERNIONS = _cube()


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
    best = np.argmax(np.einsum("nij,gji->ng", overlap, CUBE), axis=1)
    quaternions = _times(quaternions, CUBE_QUATERNIONS[best])
    log_scales = np.einsum("njk,nj->nk", np.abs(CUBE[best]), log_scales)
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


def unit(quaternions: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) of unit length; a zero one becomes no rotation."""
    length = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    usable = length > 1e-12
    return np.where(usable, quaternions / np.where(usable, length, 1), [1.0, 0.0, 0.0, 0.0])
