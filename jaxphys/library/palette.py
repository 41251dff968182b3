"""Named colours and materials, each with a little chance in it."""

from collections.abc import Callable

import numpy as np

COLOURS = {
    "red": (0.84, 0.10, 0.12),
    "dark red": (0.58, 0.05, 0.09),
    "orange": (0.96, 0.52, 0.10),
    "yellow": (0.98, 0.82, 0.16),
    "green": (0.24, 0.62, 0.22),
    "dark green": (0.12, 0.40, 0.16),
    "light green": (0.60, 0.82, 0.36),
    "blue": (0.16, 0.38, 0.84),
    "dark blue": (0.10, 0.17, 0.44),
    "light blue": (0.52, 0.78, 0.96),
    "turquoise": (0.16, 0.72, 0.70),
    "purple": (0.50, 0.24, 0.70),
    "pink": (0.97, 0.56, 0.70),
    "white": (0.96, 0.95, 0.93),
    "cream": (0.98, 0.91, 0.74),
    "light grey": (0.76, 0.77, 0.78),
    "grey": (0.58, 0.59, 0.61),
    "dark grey": (0.30, 0.31, 0.33),
    "black": (0.11, 0.11, 0.12),
    "brown": (0.48, 0.29, 0.16),
    "light brown": (0.72, 0.50, 0.30),
    "dark brown": (0.30, 0.17, 0.10),
    "beige": (0.88, 0.79, 0.62),
    # Materials: a colour that is not in the list above by that word, and for some a texture.
    "silver": (0.78, 0.79, 0.82),
    "metal": (0.66, 0.68, 0.71),
    "golden": (0.90, 0.68, 0.22),
    "copper": (0.76, 0.44, 0.28),
    "wooden": (0.66, 0.44, 0.25),
    "stone": (0.62, 0.60, 0.57),
    "brick": (0.68, 0.32, 0.24),
    "straw": (0.90, 0.76, 0.42),
    "leather": (0.50, 0.28, 0.15),
    "glass": (0.74, 0.88, 0.92),
    "skin": (0.94, 0.76, 0.63),
    "flesh": (0.90, 0.55, 0.50),
}

# What may be asked for of anything, and so what unusual colours are drawn from.
BRIGHT = (
    "red", "orange", "yellow", "green", "blue", "purple", "pink", "turquoise", "white", "black",
    "brown", "grey", "light blue", "dark blue", "light green", "dark green",
)  # fmt: skip
MATERIALS = ("golden", "silver", "wooden", "copper", "stone")


def jitter(rng: np.random.Generator, colour, amount: float = 0.025) -> np.ndarray:
    """`colour` (3,) with a small random change of lightness and tint, clipped to [0, 1]."""
    return np.clip(np.asarray(colour) + amount * (rng.normal() + 0.5 * rng.normal(size=3)), 0, 1)


def ripples(rng: np.random.Generator, frequency: float, waves: int = 8):
    """A smooth random function of points (..., 3) with values of about unit size and `frequency`
    waves a unit of length.
    """
    directions = rng.normal(size=(waves, 3))
    directions *= 2 * np.pi * frequency / np.linalg.norm(directions, axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, waves)
    height = np.sqrt(2 / waves)

    def value(points):
        return np.sin(points @ directions.T + phases).sum(-1) * height

    return value


def texture(material: str, rng: np.random.Generator, size: float) -> Callable | None:
    """What a material does to its colour: points (n, 3) of an object about `size` long -> factors
    (n,); None for an even one.
    """
    if material == "wooden":
        along, wave = rng.integers(0, 3), ripples(rng, 1.5 / size, 4)
        bands = rng.uniform(14, 22) / size
        keep = np.arange(3) != along

        def grain(points):
            across = points[:, keep].sum(1) + 0.06 * size * wave(points)
            return 1 + 0.09 * np.sin(2 * np.pi * bands * across)

        return grain
    if material in ("stone", "brick"):
        coarse, fine = ripples(rng, 6 / size), ripples(rng, 16 / size)
        return lambda points: 1 + 0.06 * coarse(points) + 0.06 * fine(points)
    if material in ("straw", "leather"):
        speckle = ripples(rng, 22 / size)
        return lambda points: 1 + 0.07 * speckle(points)
    return None


def golden_directions(count: int) -> np.ndarray:
    """`count` unit vectors (count, 3) spread evenly over the sphere (Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    angle = np.pi * (1 + 5**0.5) * index
    level = np.sqrt(1 - z**2)
    return np.stack([level * np.cos(angle), level * np.sin(angle), z], -1)


def article(noun: str) -> str:
    """`noun` with its indefinite article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"
