"""Numbers as whole ones of 16 bits or fewer, with known bounds of what rounding costs."""

import numpy as np

from jaxphys.core.ellipsoid_axes import unit

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
    q = unit(np.asarray(quaternions, np.float64))
    largest = np.argmax(np.abs(q), axis=-1)
    q = q * np.where(np.take_along_axis(q, largest[..., None], -1) < 0, -1, 1)
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])[largest]
    kept = np.take_along_axis(q, others, -1)
    words = np.round((kept * np.sqrt(0.5) + 0.5) * SHAPE_LEVELS)
    words = np.clip(words, 0, SHAPE_LEVELS).astype(np.uint16)
    words[..., 0] |= (largest & 1).astype(np.uint16) << 11
    words[..., 1] |= (largest >> 1).astype(np.uint16) << 11
    return words
