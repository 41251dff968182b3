"""Objects put where a scene wants them: chosen, turned, scaled, moved, filled."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import axis_angle_to_matrix
from jaxphys.gaussians.gaussians import Gaussians, opacities, select, transform
from jaxphys.mpm.grid import Grid
from jaxphys.scene.scene import Object


class Placed(NamedTuple):
    """An object in the domain.

    Attributes:
        moving: Gaussians that follow particles.
        still: Gaussians outside the object's `area`, drawn where they are.
        filling: further particles inside, (M, 3) [m].
    """

    moving: Gaussians
    still: Gaussians
    filling: np.ndarray


def rotation_matrix(thing: Object, where: str) -> np.ndarray:
    """All turns of an object as one matrix (3, 3)."""
    total = np.eye(3)
    for i, turn in enumerate(thing.rotation):
        axis = np.asarray(turn.axis, np.float64)
        if not np.any(axis):
            raise InputError(f"{where}.rotation[{i}].axis: is zero; name a direction")
        matrix = axis_angle_to_matrix(jnp.asarray(axis), jnp.asarray(math.radians(turn.degrees)))
        total = np.asarray(matrix, np.float64) @ total
    return total


def place(gaussians: Gaussians, thing: Object, grid: Grid, where: str) -> Placed:
    """The Gaussians of an object in the domain, without filling.

    Raises:
        InputError: nothing is opaque enough or inside `area`, or the object sticks out of the
        grid.
    """
    visible = np.asarray(opacities(gaussians)) >= thing.opacity_threshold
    if not visible.any():
        raise InputError(
            f"{where}.opacity_threshold: none of {gaussians.count} Gaussians has an opacity of "
            f"{thing.opacity_threshold} or more; lower it"
        )
    gaussians = transform(select(gaussians, np.flatnonzero(visible)), rotation_matrix(thing, where))
    means = np.asarray(gaussians.means, np.float64)
    chosen = np.ones(len(means), bool)
    if thing.area is not None:
        low, high = np.array(thing.area[0::2]), np.array(thing.area[1::2])
        chosen = np.all((means > low) & (means < high), axis=1)
        if not chosen.any():
            raise InputError(
                f"{where}.area: holds none of the {len(means)} Gaussians, which lie between "
                f"{_numbers(means.min(0))} and {_numbers(means.max(0))}"
            )
    low, high = means[chosen].min(0), means[chosen].max(0)
    extent = (high - low).max()
    scale = thing.size / extent if extent > 0 else 1.0
    shift = np.array(thing.centre) - scale * (low + high) / 2
    placed = transform(gaussians, scale=scale, translation=shift)
    moving = select(placed, np.flatnonzero(chosen))
    _require_inside(np.asarray(moving.means), grid, where)
    return Placed(moving, select(placed, np.flatnonzero(~chosen)), np.zeros((0, 3), np.float32))


def _numbers(values) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"


def _require_inside(points: np.ndarray, grid: Grid, where: str) -> None:
    low, high = points.min(0), points.max(0)
    # One cell more than the solver needs, so that the first steps have somewhere to go.
    first, last = grid.lower + grid.spacing, np.array(grid.upper) - grid.spacing
    if np.any(low < first) or np.any(high > last):
        raise InputError(
            f"{where}: reaches from {_numbers(low)} to {_numbers(high)} m, but the domain holds "
            f"{_numbers(np.full(3, first))} to {_numbers(last)}; change its size or centre, or the "
            "domain"
        )


def particle_volumes(points: np.ndarray, grid: Grid, per_cell: int) -> np.ndarray:
    """Rest volume of each particle [m^3], shape (N,).

    The particles of a grid cell share it, as in PhysGaussian. A cell with fewer particles than
    `per_cell`, the number where an object is filled, counts as partly empty: it lies on the
    surface.
    """
    cells = np.floor(points / grid.spacing).astype(np.int64)
    keys = (cells[:, 0] * grid.shape[1] + cells[:, 1]) * grid.shape[2] + cells[:, 2]
    _, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return grid.spacing**3 / np.maximum(counts[inverse], per_cell)
