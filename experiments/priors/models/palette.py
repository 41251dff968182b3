"""Named colours with a little chance in them, and small helpers for painting surfaces."""

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
    "light blue": (0.52, 0.78, 0.96),
    "turquoise": (0.16, 0.72, 0.70),
    "purple": (0.50, 0.24, 0.70),
    "pink": (0.97, 0.56, 0.70),
    "white": (0.96, 0.95, 0.93),
    "cream": (0.98, 0.91, 0.74),
    "grey": (0.58, 0.59, 0.61),
    "silver": (0.78, 0.79, 0.82),
    "black": (0.11, 0.11, 0.12),
    "brown": (0.48, 0.29, 0.16),
    "light brown": (0.72, 0.50, 0.30),
    "dark brown": (0.30, 0.17, 0.10),
    "golden": (0.90, 0.68, 0.22),
    "beige": (0.88, 0.79, 0.62),
}


def jitter(rng: np.random.Generator, colour, amount: float = 0.03) -> np.ndarray:
    """`colour` (3,) with a small random change of lightness and tint, clipped to [0, 1]."""
    return np.clip(np.asarray(colour) + amount * (rng.normal() + 0.5 * rng.normal(size=3)), 0, 1)


def pick(rng: np.random.Generator, *names: str) -> tuple[str, np.ndarray]:
    """One of the named colours (all bright ones if none is named) and its jittered value."""
    bright = ("red", "orange", "yellow", "green", "blue", "purple", "pink", "turquoise", "white")
    name = str(rng.choice(names or bright))
    return name, jitter(rng, COLOURS[name])


def mix(first, second, weight) -> np.ndarray:
    """(1 - weight) first + weight second, with `weight` (...,) in [0, 1] broadcast over colours
    (3,).
    """
    weight = np.clip(weight, 0, 1)[..., None]
    return (1 - weight) * np.asarray(first) + weight * np.asarray(second)


def ripples(rng: np.random.Generator, frequency: float, waves: int = 8):
    """A smooth random function of points (..., 3) with values of about unit size and one
    wavelength.
    """
    directions = rng.normal(size=(waves, 3))
    directions *= frequency / np.linalg.norm(directions, axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, waves)

    def value(points):
        return np.sin(points @ directions.T * 2 * np.pi + phases).sum(-1) * np.sqrt(2 / waves)

    return value


def golden_directions(count: int) -> np.ndarray:
    """`count` unit vectors (count, 3) spread evenly over the sphere (Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    angle = np.pi * (1 + 5**0.5) * index
    ring = np.sqrt(1 - z**2)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], -1)


def article(noun: str) -> str:
    """`noun` with its indefinite article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"
