"""Implicit steps: velocities of the grid are solved for, so that stiffness bounds no step.

A step of the theta scheme finds velocities u a share theta of it ahead,

    u = v + theta dt (g + f((I + theta dt C(u)) F) / m),

then x <- x + dt u, F <- (I + dt C(u)) F and v <- v + (u - v) / theta. theta = 1 is backward Euler,
which damps; theta = 1/2 the midpoint rule, which keeps the energy of small motion. Laws map back
once a step and are elastic within it.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from jaxphys.core.fields import DURATION, Checked, between

ADVECTION = 0.6  # cells that a particle may cross in a step (Wang et al. 2020)
GRADIENT = 0.5  # by which it may be deformed
GROWTH = 1.5  # of a step after one that was solved
MOST_STEPS = 1000  # of a frame, where nobody says how many
SHARE = {"above": 0} | between(1e-15, 1.0)


@dataclass(frozen=True)
class Implicit(Checked):
    """Steps as long as speed and deformation allow, each a solve for the velocities of the grid.

    Attributes:
        theta: from 1/2, the midpoint rule, to 1, backward Euler.
        tolerance: of the equations, as a strain: root mean square over nodes of what forces are not
            balanced by, over the stiffness there. float32 ends at 1e-7.
        reduction: of what that was in the beginning, to which it must fall besides, unless rounding
            ends it.
        newton: most iterations of Newton's method in a step.
        products: most products with the second derivative in one of them.
        dt: largest step [s]; null: what speeds allow, and the frame.
        most_steps: that a frame may take; null: a thousand, and 32 where a gradient is wanted,
            whose memory grows with it.
        adjoint_tolerance: relative, of the linear system of a derivative; null: 1e-10 in float64
            and 1e-5 in float32.
    """

    type: ClassVar[str] = "implicit"
    theta: float = field(default=1.0, metadata=between(0.5, 1.0))
    tolerance: float = field(default=1e-6, metadata=SHARE)
    reduction: float = field(default=1e-3, metadata=SHARE)
    newton: int = field(default=20, metadata=between(1, 10_000))
    products: int = field(default=2000, metadata=between(1, 1_000_000))
    dt: float | None = field(default=None, metadata=DURATION)
    most_steps: int | None = field(default=None, metadata=between(1, 1_000_000))
    adjoint_tolerance: float | None = field(default=None, metadata=SHARE)


def crossing_time(spacing: float, speed: Array, gravity: Array | None) -> Array:
    """How long a step may be [s], (), so that what moves at `speed` [m/s], (), and falls by
    `gravity` [m/s^2], (3,), crosses ADVECTION cells of `spacing` [m].
    """
    # dt (speed + g dt) = ADVECTION dx
    g = 0.0 if gravity is None else jnp.sqrt(jnp.sum(gravity**2))
    room = ADVECTION * spacing
    tiny = jnp.finfo(speed.dtype).tiny ** 0.5
    return 2 * room / (speed + jnp.sqrt(speed**2 + 4 * g * room) + tiny)
