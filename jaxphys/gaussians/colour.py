"""Colour regularisation: normalise the colours of an object to [0, 1], then clamp.

With s the RGB values that spherical harmonics evaluate to and s_min, s_max the least and the
greatest of them, over all Gaussians and channels,

    s_norm = (s - s_min) / (s_max - s_min),    s_clamp = min(max(s_norm, 0), 1)

(the paper's section on colour regularisation). Two things it leaves open are decided here. The
range is taken once for an object, at rest, over directions all around it: taken anew for each frame
and camera it would make the colours flicker. And where all colours are equal, so that the formula
divides zero by zero, they are only clamped.

As written, the formula also stretches colours that were right: an object in greys from 0.4 to 0.6
becomes black and white. `to_unit_interval` widens a range to hold [0, 1]; then valid colours stay
as they are where no others are, and the rest is brought in.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.gaussians import harmonics as sh
from jaxphys.gaussians.gaussians import Gaussians

_DIRECTIONS = 24


class ColourRange(NamedTuple):
    """The colours of an object.

    Attributes:
        minimum: least value of any channel, a scalar.
        maximum: greatest value of any channel, a scalar.
    """

    minimum: Array
    maximum: Array


def _directions() -> np.ndarray:
    index = np.arange(_DIRECTIONS) + 0.5
    z, turn = 1 - 2 * index / _DIRECTIONS, np.pi * (1 + np.sqrt(5)) * index
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1)


@jax.jit
def colour_range(gaussians: Gaussians) -> ColourRange:
    """The range of max(harmonics + 0.5, 0) over Gaussians, channels and 24 directions.

    For degree 0 the directions do not matter. No Gaussians have the range [0, 1].
    """
    coefficients = gaussians.harmonics
    dtype = coefficients.dtype
    if coefficients.shape[0] == 0:
        return ColourRange(jnp.zeros((), dtype), jnp.ones((), dtype))
    if coefficients.shape[1] == 1:
        colours = jnp.maximum(sh.dc_to_rgb(coefficients), 0)
        return ColourRange(jnp.min(colours), jnp.max(colours))
    lows, highs = [], []
    for direction in _directions():
        directions = jnp.broadcast_to(jnp.asarray(direction, dtype), (gaussians.count, 3))
        colours = jnp.maximum(sh.evaluate(coefficients, directions) + 0.5, 0)
        lows.append(jnp.min(colours))
        highs.append(jnp.max(colours))
    return ColourRange(jnp.min(jnp.stack(lows)), jnp.max(jnp.stack(highs)))


@jax.jit
def to_unit_interval(colours: ColourRange) -> ColourRange:
    """The range widened to hold [0, 1]: regularising by it leaves valid colours alone."""
    return ColourRange(jnp.minimum(colours.minimum, 0), jnp.maximum(colours.maximum, 1))


def regularise(colours: Array, bounds: ColourRange) -> Array:
    """Colours (N, C) normalised by the range `bounds` and clamped to [0, 1].

    A range of no width only clamps. The gradient of clamped values is zero.
    """
    width = bounds.maximum - bounds.minimum
    proper = width > 0
    normalised = (colours - bounds.minimum) / jnp.where(proper, width, 1)
    return jnp.clip(jnp.where(proper, normalised, colours), 0, 1)
