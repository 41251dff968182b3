"""Weights in a few bits: symmetric integers packed densely, with one scale for each group of a
row.
"""

from typing import NamedTuple

import numpy as np


class Packed(NamedTuple):
    """`bits` (R, C * width / 8) uint8 and `scales` (R, C / group) float16 of a matrix (R, C)."""

    bits: np.ndarray
    scales: np.ndarray


def pack(matrix: np.ndarray, width: int, group: int) -> Packed:
    """Rounds `matrix` (R, C) to integers of `width` bits (2 to 8) times a scale per `group`
    columns.

    C must be a multiple of `group`, and C * width of 8. The error is at most half a scale, that is
    the group's largest magnitude over 2^width - 2.
    """
    rows, columns = matrix.shape
    largest = 2 ** (width - 1) - 1
    grouped = matrix.reshape(rows, columns // group, group)
    scales = (np.abs(grouped).max(-1) / largest).astype(np.float16)
    divisor = np.where(scales > 0, scales, 1).astype(np.float64)[..., None]
    levels = np.clip(np.rint(grouped / divisor), -largest, largest) + largest
    digits = np.unpackbits(levels.astype(np.uint8)[..., None], axis=-1)[..., 8 - width :]
    return Packed(np.packbits(digits.reshape(rows, -1), axis=1), scales)


def unpack(packed: Packed, width: int, group: int) -> np.ndarray:
    """The matrix (R, C) float32 that `packed` stands for."""
    rows, groups = packed.scales.shape
    digits = np.unpackbits(packed.bits, axis=1).reshape(rows, groups, group, width)
    levels = np.packbits(digits, axis=-1)[..., 0] >> (8 - width)
    values = levels.astype(np.float32) - (2 ** (width - 1) - 1)
    return (values * packed.scales.astype(np.float32)[..., None]).reshape(rows, groups * group)
