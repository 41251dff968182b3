"""A hand that holds some matter: a spring at each particle, critically damped.

Its numbers and arrays are traced, so that grabbing, pulling and letting go never compile anything.
It is no boundary that a scene may list: what a hand does is not known before.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.fields import POSITIVE, unit
from jaxphys.mpm.boundaries.base import PER_PARTICLE, PLACE, Boundary, Setting, Vector, array_of

# In semi-implicit steps a critically damped spring is stable for dt < 2 (sqrt(2) - 1) / frequency,
# as an undamped one (1 + sqrt(2)) times as fast is.
AS_STIFF = 1 + 2**0.5


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hand(Boundary):
    """Each particle is pulled to where it was when it was grabbed, moved by what the hand moved:
    f = w m (k^2 (x0 + moved - x) - 2 k v), with k the frequency.

    Attributes:
        moved: of the hand since it grabbed [m].
        frequency: of the springs [1/s]; the same for all matter, so that it bounds no step of it.
        weight: how firmly each particle is held, (N,) in [0, 1]; zero everywhere: nothing is.
        x, y, z: where each particle was, (N,) [m].
    """

    type: ClassVar[str] = "hand"
    moved: Vector = field(default=(0.0, 0.0, 0.0), metadata=PLACE)
    frequency: float = field(default=25.0, metadata=POSITIVE | unit("1/s"))
    weight: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)
    x: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)
    y: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)
    z: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def derived(self, setting: Setting) -> Self:
        none = jnp.zeros(len(setting.rest), setting.dtype)
        return replace(self, weight=none, x=none, y=none, z=none)

    def holding(self, position: np.ndarray, particle: int, radius: float) -> Self:
        """The same around a particle, less firmly towards `radius` [m].

        position: (N, 3) [m], in the solver's order, as `particle` is.
        """
        away = np.sum((position - position[particle]) ** 2, axis=1) / radius**2
        weight = np.maximum(1 - away, 0) ** 2
        dtype = array_of(self.weight).dtype
        x, y, z = (jnp.asarray(column, dtype) for column in position.T)
        still = self.changed(moved=(0.0, 0.0, 0.0))
        return replace(still, weight=jnp.asarray(weight, dtype), x=x, y=y, z=z)

    def released(self) -> Self:
        """The same holding nothing."""
        return replace(self, weight=jnp.zeros_like(array_of(self.weight)))

    def stiffest(self, model, grid):
        holds = jnp.max(array_of(self.weight), initial=0) > 0
        return jnp.where(holds, (AS_STIFF * array_of(self.frequency)) ** 2, 0)

    def loads(self, model, grid):
        places = {name: array_of(getattr(self, name)) for name in "xyz"}
        return {"held": model.mass * array_of(self.weight)} | places

    def impulse(self, position, velocity, slip, loads, time, dt, since):
        k = array_of(self.frequency)
        start = jnp.stack([loads[name] for name in "xyz"])
        away = start + array_of(self.moved)[:, None] - position
        return dt * loads["held"] * (k**2 * away - 2 * k * velocity), None
