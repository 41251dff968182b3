"""Numbers as whole ones of 16 bits or fewer, with known bounds of what rounding costs."""

from itertools import product

import numpy as np

LEVELS = 65535
# Of shapes the eye sees no more, and bits that are noise do not compress.
SHAPE_LEVELS = 2047


def quantised(
    values: np.ndarray, axis=None, levels: int = LEVELS
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Words, the least value and the step of an even quantisation: values = low + step * words.

    The error is half a step at most, beside the rounding of float64.

    Args:
        values: finite.
        axis: over which the range is taken; None: all.
        levels: the largest word, at most 65535.
    """
    values = np.asarray(values, np.float64)
    low = values.min(axis=axis)
    step = (values.max(axis=axis) - low) / levels
    words = np.round((values - low) / np.where(step > 0, step, 1))
    return words.astype(np.uint16), low, step


def quantised_rotations(quaternions: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4) as three words (..., 3): the largest component is left out, since
    length and sign give it back, and the others are within +-sqrt(1/2).

    The error of each component kept is half a step at most, sqrt(1/2) / 2047. Words take 11
    bits; bit 11 of word 0 is the low bit of the number of the component left out, of word 1 its
    high bit.
    """
    q = np.asarray(quaternions, np.float64)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    q = np.where(length > 1e-12, q / np.where(length > 1e-12, length, 1), [1.0, 0.0, 0.0, 0.0])
    largest = np.argmax(np.abs(q), axis=-1)
    q = q * np.where(np.take_along_axis(q, largest[..., None], -1) < 0, -1, 1)
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])[largest]
    kept = np.take_along_axis(q, others, -1)
    words = np.round((kept * np.sqrt(0.5) + 0.5) * SHAPE_LEVELS)
    words = np.clip(words, 0, SHAPE_LEVELS).astype(np.uint16)
    words[..., 0] |= (largest & 1).astype(np.uint16) << 11
    words[..., 1] |= (largest >> 1).astype(np.uint16) << 11
    return words


def _turns_of_the_axes() -> tuple[np.ndarray, np.ndarray]:
    """The 24 quaternions (24, 4) that turn axes into axes, and (24, 3) which axis each new one
    was."""
    half = np.sqrt(0.5)
    turns = [*np.eye(4), *(0.5 * np.array([1, *signs]) for signs in product((1, -1), repeat=3))]
    for i in range(4):
        for j in range(i + 1, 4):
            for sign in (1, -1):
                turn = np.zeros(4)
                turn[i], turn[j] = half, sign * half
                turns.append(turn)
    table = np.stack(turns)
    return table, np.stack([np.argmax(np.abs(_matrix(turn)), axis=0) for turn in table])


def _matrix(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


TURNS, CAME_FROM = _turns_of_the_axes()


def _multiplied(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Products (N, 24, 4) of quaternions (N, 4) and (24, 4)."""
    pw, px, py, pz = (p[:, None, i] for i in range(4))
    qw, qx, qy, qz = (q[None, :, i] for i in range(4))
    return np.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def continued(quaternions: np.ndarray, log_scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same ellipsoids (T, N, 4) and (T, N, 3) with axes named so that each frame is as near to
    the one before as can be: an eigen-decomposition orders axes by length and chooses signs.
    Words then change little from frame to frame, and compress.
    """
    q = np.array(quaternions, np.float64)
    s = np.array(log_scales, np.float64)
    for t in range(1, len(q)):
        turned = _multiplied(q[t], TURNS)
        likeness = np.abs(np.einsum("nki,ni->nk", turned, q[t - 1]))
        best = np.argmax(likeness, axis=1)
        q[t] = np.take_along_axis(turned, best[:, None, None], 1)[:, 0]
        s[t] = np.take_along_axis(s[t], CAME_FROM[best], -1)
    return q, s
