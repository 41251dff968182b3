"""Motion that dies away."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp

from jaxphys.core.fields import NON_NEGATIVE, unit
from jaxphys.mpm.boundaries.base import FOREVER, TIME, Boundary, active


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Damping(Boundary):
    """Velocities on the grid decay at a rate, v exp(-rate dt), whatever the length of the steps.

    Attributes:
        rate: [1/s]. PhysGaussian's `grid_v_damping_scale` s is rate = -log(s) / dt.
        start, end: acts while start <= time < end [s].
    """

    type: ClassVar[str] = "damping"
    rate: float = field(metadata=NON_NEGATIVE | unit("1/s"))
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=FOREVER, metadata=TIME)

    def on_grid(self, velocity, coordinates, grid, time, dt):
        rate = jnp.where(active(time, self.start, self.end), self.rate, 0)
        return velocity * jnp.exp(-rate * dt).astype(velocity.dtype)
