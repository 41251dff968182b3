"""What a renderer draws."""

from typing import NamedTuple

from jax import Array


class Splats(NamedTuple):
    """Activated Gaussians, ready to draw: no logits, no logarithms, colour already decided.

    Attributes:
        means: centres [m], shape (N, 3).
        covariances: symmetric positive semi-definite [m^2], shape (N, 3, 3).
        opacities: in [0, 1], shape (N,).
        colours: any number of channels, shape (N, C).
    """

    means: Array
    covariances: Array
    opacities: Array
    colours: Array
