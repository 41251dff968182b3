"""A body that is let go bit by bit."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.fields import between, unit
from jaxphys.mpm.boundaries.base import (
    DIRECTION,
    PER_PARTICLE,
    TIME,
    Boundary,
    Setting,
    Vector,
    array_of,
    unit_vector,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Release(Boundary):
    """Particles are held and let go one after another by a plane that sweeps over them.

    The plane moves at constant speed; before `start` all that it will pass are held. PhysGaussian
    does the same in 50 steps whatever number of layers is asked for.

    Attributes:
        normal: direction in which places are measured, of any length.
        begin, finish: where the plane is at `start` and at `end`, along the normal [m].
        start, end: [s].
        places: of the particles along the normal at rest [m], (N,).
    """

    type: ClassVar[str] = "release"
    regions: ClassVar[tuple[str, ...]] = ("normal",)
    normal: Vector = field(metadata=DIRECTION)
    begin: float = field(metadata=between(-1e6, 1e6) | unit("m"))
    finish: float = field(metadata=between(-1e6, 1e6) | unit("m"))
    start: float = field(default=0.0, metadata=TIME)
    end: float = field(default=1.0, metadata=TIME)
    places: Array | None = field(default=None, kw_only=True, repr=False, metadata=PER_PARTICLE)

    def derived(self, setting: Setting) -> Self:
        places = setting.rest @ unit_vector(array_of(self.normal))
        return replace(self, places=jnp.asarray(places, setting.dtype))

    def on_particles(self, position, velocity, loads, time, dt):
        share = jnp.clip((time - self.start) / (self.end - self.start), 0, 1)
        plane = self.begin + share * (self.finish - self.begin)
        # A sweep downwards is one upwards along the reverse of the normal.
        sign = jnp.where(self.finish >= self.begin, 1, -1)
        places = loads["places"]
        ahead = sign * (places - plane)
        ahead_of_all = sign * (places - self.begin)
        beyond = sign * (places - self.finish)
        held = (ahead > 0) & (ahead_of_all >= 0) & (beyond <= 0)
        return jnp.where(held & (time < self.end), 0, velocity)
