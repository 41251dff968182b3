"""Particles that were followed."""

from dataclasses import dataclass, field
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from jaxphys.fitting.observed.base import (
    Observed,
    refuse_not_finite,
    refuse_outside,
    refuse_unknown,
    size_of,
)
from jaxphys.mpm.loop.sorting import cell_order

SHARE = 1e-3  # of the object's size: the noise that is expected where none is given


@dataclass(frozen=True, eq=False)
class Tracks(Observed):
    """Where particles were: each row the same material point in all frames.

    Attributes:
        positions: (T, M, 3) [m].
        times: (T,) [s].
        particles: which particles, in the object's order, (M,) whole numbers; None: all of them.
        seen: (T, M) bool, whether a point was seen; None: all were. Where it was not, `positions`
            may be anything.
        noise: of each coordinate [m]; None: a thousandth of the object's size.
    """

    name: ClassVar[str] = "tracks"
    unit: ClassVar[str] = "m"
    positions: np.ndarray = field(repr=False)
    times: np.ndarray
    particles: np.ndarray | None = field(default=None, repr=False)
    seen: np.ndarray | None = field(default=None, repr=False)

    def check_own(self, simulation, look):
        positions = np.asarray(self.positions)
        count = simulation.config.particles
        if self.particles is not None:
            particles = np.asarray(self.particles)
            refuse_unknown(self, particles, count)
            count = len(particles)
        wanted = (len(self.times), count, 3)
        if positions.shape != wanted:
            raise self.fail("positions", f"has shape {positions.shape}, expected {wanted}")
        if self.seen is not None:
            seen = np.asarray(self.seen)
            if seen.shape != wanted[:2] or seen.dtype != bool:
                raise self.fail("seen", f"has shape {seen.shape}, expected {wanted[:2]} of bool")
            positions = np.where(seen[..., None], positions, 0)
        refuse_not_finite(self, "positions", positions)
        for frame, places in enumerate(positions):
            refuse_outside(self, "positions", frame, places, simulation)

    def noise_of(self, simulation):
        return self.noise or SHARE * size_of(simulation)

    def arranged(self, residuals, simulation):
        rest = np.asarray(simulation.frame(simulation.state).position)
        if self.particles is not None:
            rest = rest[np.asarray(self.particles)]
        return residuals[:, cell_order(rest, simulation.config.grid)], (0, 1)

    def data(self, simulation, look):
        noise = self.noise_of(simulation)
        certainty = np.full(np.shape(self.positions)[:2], self.weight**0.5 / noise)
        positions = np.asarray(self.positions)
        if self.seen is not None:
            certainty = np.where(self.seen, certainty, 0)
            positions = np.where(self.seen[..., None], positions, 0)
        dtype = simulation.model.mass.dtype
        return jnp.asarray(positions, dtype), jnp.asarray(certainty, dtype)

    def residuals(self, motion, look, data):
        positions, certainty = data
        moved = motion.position
        if self.particles is not None:
            moved = moved[:, np.asarray(self.particles)]
        return (moved - positions) * certainty[..., None]
