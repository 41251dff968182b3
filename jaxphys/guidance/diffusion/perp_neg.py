"""Perp-Neg: away from unwanted prompts, never against the wanted one.

Armandpour et al. 2023: of what a negative prompt asks for, only the part perpendicular
to what the prompt asks for is taken away. A back view may so lose a face without losing its object.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.guidance.diffusion.schedule import expand


class Negatives(NamedTuple):
    """What to move away from.

    conditions: K of them, each as the condition of the batch; weights: (K, B) of each, 0 for not at
    all. (The papers' weights are the negatives of these.)
    """

    conditions: tuple[Any, ...]
    weights: Array


def perpendicular(direction: Array, reference: Array) -> Array:
    """The part of each sample's direction (B, ...) perpendicular to its reference (B, ...); all of
    it where that is zero."""
    axes = tuple(range(1, direction.ndim))
    along = jnp.sum(direction * reference, axes, keepdims=True)
    length = jnp.sum(reference**2, axes, keepdims=True)
    return direction - along / jnp.maximum(length, jnp.finfo(length.dtype).tiny) * reference


def steered(
    told: Array, untold: Array, others: tuple[Array, ...], weights: Array, scale: float | Array
) -> Array:
    """`u + s (d - sum_k w_k perp(e_k - u, d))` with `d = c - u`: guidance that steers clear of the
    predictions e_k (B, ...) for negative prompts, weights (K, B).

    Linear in predictions at one noisy sample but for the projection, which does not change with
    their scale: the same for clean, noise and velocity. Its part along d is s, whatever the
    weights.
    """
    wanted = told - untold
    direction = wanted
    for other, weight in zip(others, weights, strict=True):
        direction = direction - expand(weight, told) * perpendicular(other - untold, wanted)
    return untold + scale * direction
