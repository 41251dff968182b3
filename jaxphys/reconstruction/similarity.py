"""How alike two pictures are: structural similarity and the peak signal-to-noise ratio."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

WINDOW, SIGMA = 11, 1.5  # pixels
C1, C2 = 0.01**2, 0.03**2


def structural_similarity(a: Array, b: Array) -> Array:
    """Mean structural similarity of two pictures (H, W, C) in [0, 1], a scalar in [-1, 1].

    Wang, Bovik, Sheikh and Simoncelli (2004), eq. 13, with their Gaussian window of 11 pixels and
    sigma 1.5; at the border the window is filled up with zeros, as Kerbl et al. (2023) do.
    """
    mean_a, mean_b = _blurred(a), _blurred(b)
    variance_a = _blurred(a * a) - mean_a**2
    variance_b = _blurred(b * b) - mean_b**2
    covariance = _blurred(a * b) - mean_a * mean_b
    above = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
    below = (mean_a**2 + mean_b**2 + C1) * (variance_a + variance_b + C2)
    return jnp.mean(above / below)


def _blurred(picture: Array) -> Array:
    x = np.arange(WINDOW) - WINDOW // 2
    bell = np.exp(-0.5 * (x / SIGMA) ** 2)
    weights = jnp.asarray(bell / bell.sum(), picture.dtype)
    planes = jnp.moveaxis(picture, -1, 0)[:, None]  # channels as a batch
    for kernel in (weights[None, None, :, None], weights[None, None, None, :]):
        planes = jax.lax.conv(planes, kernel, (1, 1), "SAME")
    return jnp.moveaxis(planes[:, 0], 0, -1)


def peak_signal_to_noise(a: Array, b: Array) -> Array:
    """-10 log10 of the mean square difference of two pictures in [0, 1] [dB]."""
    return -10 * jnp.log10(jnp.mean((a - b) ** 2))


def photometric(drawn: Array, seen: Array, similarity: float) -> Array:
    """(1 - s) L1 + s (1 - SSIM), Kerbl et al. (2023), eq. 7, with s = `similarity` in [0, 1]."""
    difference = jnp.mean(jnp.abs(drawn - seen))
    return (1 - similarity) * difference + similarity * (1 - structural_similarity(drawn, seen))
