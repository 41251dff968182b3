"""Pictures as CLIP was shown them (Radford et al. 2021): a square from the middle, in its units."""

import numpy as np
from PIL import Image

MEAN = (0.48145466, 0.4578275, 0.40821073)
DEVIATION = (0.26862954, 0.26130258, 0.27577711)


def middle_square(picture: np.ndarray, size: int = 224) -> np.ndarray:
    """(H, W, 3) uint8 -> (size, size, 3) uint8: the short side is resized to `size` (bicubic,
    antialiased), what the long one has beyond that is cut off at both ends.
    """
    height, width, _ = picture.shape
    short = min(height, width)
    new_height, new_width = size * height // short, size * width // short
    resized = Image.fromarray(picture).resize((new_width, new_height), Image.Resampling.BICUBIC)
    top, left = (new_height - size) // 2, (new_width - size) // 2
    return np.asarray(resized)[top : top + size, left : left + size]


def as_pixels(pictures: np.ndarray) -> np.ndarray:
    """(..., 3) uint8 RGB -> float32, with the mean and spread that CLIP was trained on."""
    unit = pictures.astype(np.float32) / np.float32(255)
    return (unit - np.asarray(MEAN, np.float32)) / np.asarray(DEVIATION, np.float32)
