"""Which view a prompt should speak of, and which views it should not show: Perp-Neg's weights.

Between two views a prompt is a mixture of both, and a camera moves away from what it must not see:
the front above all. Weights are those of Perp-Neg (Armandpour et al. 2023) as threestudio's prompt
processor has them: they vanish at the view itself and go on where the ranges meet, to three digits.
"""

import jax.numpy as jnp
from jax import Array

OVERHEAD = jnp.pi / 3  # elevation from which a view is one from above; GSGEN's rule


def away_from_front(azimuth: Array) -> Array:
    """The angle [rad] between an azimuth and the front, in [0, pi]."""
    return jnp.abs(jnp.arctan2(jnp.sin(azimuth), jnp.cos(azimuth)))


def view_mixture(azimuth: Array, elevation: Array) -> Array:
    """(4, B) shares of the front, the side, the back and the overhead view, which add up to 1."""
    turn = away_from_front(azimuth) / (0.5 * jnp.pi)
    around = jnp.stack(
        [jnp.maximum(1 - turn, 0), 1 - jnp.abs(turn - 1), jnp.maximum(turn - 1, 0), 0 * turn]
    )
    above = jnp.zeros_like(around).at[3].set(1)
    return jnp.where(elevation > OVERHEAD, above, around)


def unwanted_views(azimuth: Array, elevation: Array) -> Array:
    """(2, B) weights at least 0 with which to move away from the front and from the side view."""
    turn = away_from_front(azimuth) / (0.5 * jnp.pi)
    front = jnp.where(turn < 1, _decay(4.0, 1 - turn, -2.426), _decay(1.0, 2 - turn, 0.967))
    side = jnp.where(turn < 1, _decay(4.0, turn, -2.426), _decay(1.0, 2 - turn, -0.606))
    weights = jnp.maximum(jnp.stack([front, side]), 0)
    return jnp.where(elevation > OVERHEAD, 0, weights)


def _decay(scale: float, place: Array, shift: float) -> Array:
    return scale * jnp.exp(-0.5 * place) + shift
