"""A block on a slab, tilted: it slides on it as Coulomb's law says, or stays.

As `incline`, with matter in place of the plane: the slab is an object, held from below, and what
is between the two is contact between objects (`mpm.meeting`).
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.problems.discrete import Discretisation, discretise, node_wall, steps_for
from jaxphys.problems.incline import SOURCE, Incline, sliding_error, sticking_error
from jaxphys.problems.problem import Problem

FREE, HELD = 2, 1  # cells of the slab's thickness
BESIDE = 1.0  # of the slab in front of the block [m]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Stack(Incline):
    """A cube of 1 m on a slab."""

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] at the start: the slab is pressed and sheared under the block as
        the block's foot is.
        """
        under = (X[0] > 0) & (X[0] < 1) & (X[1] > 0) & (X[1] < 1)
        foot = super().motion(jnp.stack([X[0], X[1], 0 * X[2]]), t)
        slope = super().motion(jnp.stack([X[0], X[1], 0 * X[2] + 1e-6]), t) - foot
        slab = foot + jnp.where(under, slope / 1e-6, jnp.stack([0.0, 0.0, 1.0])) * X[2]
        return jnp.where(X[2] > 0, super().motion(X, t), slab)


def stacked(truth: Stack, cells: int, dtype=jnp.float64, *, contact: bool = True) -> Discretisation:
    """The block on `cells` cells a side, eight particles each, and after it the slab, `FREE` cells
    thick above the nodes that hold it. contact: with a velocity field each.
    """
    spacing = 1.0 / cells
    front = int(np.ceil(BESIDE / spacing))
    block = _lattice(spacing, (0, cells), (0, cells), (0, cells))
    slab = _lattice(spacing, (-2, cells + front), (-2, cells + 2), (-FREE - HELD, 0))
    wave = (truth.youngs / truth.density) ** 0.5
    dt, steps = steps_for(truth.duration, 0.3, spacing, wave)
    origin = (5.2, 5.3, FREE + HELD + 2.4)
    return discretise(
        truth,
        np.concatenate([block, slab]),
        spacing**3 / 8,
        law=HENCKY,
        poisson=0.0,
        nodes=(cells + front + 9, cells + 11, cells + FREE + HELD + 6),
        origin=origin,
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=1.0,
        gravity=(truth.pull, 0.0, -truth.gravity * float(np.cos(truth.angle))),
        boundaries=(node_wall(2, origin[2] - FREE, 1, "sticky", dtype),),
        objects=np.repeat([0, 1], [len(block), len(slab)]) if contact else None,
        friction=truth.friction,
        dtype=dtype,
    )


def _lattice(spacing: float, *cells: tuple[int, int]) -> np.ndarray:
    """Points (N, 3) [m], two to a cell and axis, of the cells from and up to these on each axis."""
    lines = [spacing / 2 * (np.arange(2 * first, 2 * last) + 0.5) for first, last in cells]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


SLIDING_ON_SLAB = Problem(
    name="sliding-on-slab",
    source=SOURCE,
    build=partial(stacked, Stack()),
    ladder=(2, 4, 8),
    order=None,
    norm=sliding_error,
)
STICKING_ON_SLAB = Problem(
    name="sticking-on-slab",
    source=SOURCE,
    build=partial(stacked, Stack(friction=0.8)),
    ladder=(2, 4, 8),
    order=None,
    norm=sticking_error,
)
