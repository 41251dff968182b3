"""Numbers that look random and are the same everywhere, for weights that need no file."""

import zlib

import numpy as np


def pseudo_random(name: str, shape: tuple[int, ...], scale: float = 1.0) -> np.ndarray:
    """float32 numbers in [-scale, scale), decided by `name` and the index (SplitMix64, Steele et
    al. 2014, of a counter)."""
    count = int(np.prod(shape, dtype=np.int64))
    start = np.uint64(zlib.crc32(name.encode()) << 32)
    with np.errstate(over="ignore"):
        state = (start + np.arange(1, count + 1, dtype=np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        state = state ^ (state >> np.uint64(31))
    unit = (state >> np.uint64(40)).astype(np.float64) / 2**23 - 1.0
    return (scale * unit).astype(np.float32).reshape(shape)


def weights(shapes: dict[str, tuple[int, ...]]) -> dict[str, np.ndarray]:
    """Weights for a network with arrays of these names and (checkpoint) shapes, of a size that
    keeps activations near 1: no norm is trivial, no bias zero."""
    filled = {}
    for name, shape in shapes.items():
        if len(shape) >= 2:  # outputs first; tables of embeddings are rows of inputs too
            fan_in = int(np.prod(shape[1:]))
            filled[name] = pseudo_random(name, shape, (3.0 / fan_in) ** 0.5)
        elif name.endswith("weight"):
            filled[name] = 1.0 + pseudo_random(name, shape, 0.3)
        else:
            filled[name] = pseudo_random(name, shape, 0.2)
    return filled
