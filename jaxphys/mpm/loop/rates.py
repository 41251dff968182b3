"""How fast particles move and deform, told by a pass so that the next steps can follow it."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.mpm.loop.status import least
from jaxphys.mpm.state import Config


def slowest(config: Config, velocity: Array, C: Array) -> Array | None:
    """(2,) int32 of velocities (3, N) [m/s] and C (3, 3, N) [1/s], or None where nobody asks.

    The least of it over any particles tells the largest |v|^2 and |C|^2: minus their bits as
    float32, which are in the order of the numbers, so that devices have one kind of number to
    compare (`Seen`).
    """
    if not config.tells_rates:
        return None
    squares = [algebra.total(x * x for x in algebra.numbers(of)) for of in (velocity, C)]
    largest = -jnp.stack([least(-square) for square in squares])
    return -jax.lax.bitcast_convert_type(largest.astype(jnp.float32), jnp.int32)


def fastest(slowest: Array, dtype) -> tuple[Array, Array]:
    """Largest |v| [m/s] and |C| [1/s], () each, that `slowest` tells."""
    squares = jax.lax.bitcast_convert_type(-slowest, jnp.float32)
    speed, gradient = jnp.sqrt(squares.astype(dtype))
    return speed, gradient
