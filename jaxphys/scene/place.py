"""Objects put where a scene wants them: chosen, turned, scaled, moved, filled."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import axis_angle_to_matrix
from jaxphys.gaussians.filling import FillingConfig, fill_interior
from jaxphys.gaussians.gaussians import (
    Gaussians,
    concatenate,
    from_points,
    opacities,
    select,
    transform,
)
from jaxphys.gaussians.harmonics import dc_to_rgb
from jaxphys.gaussians.relax import blue_noise
from jaxphys.mpm.grid import Grid
from jaxphys.scene.scene import Object

RELAX_STEPS = 40
SIZE_OVER_SPACING = 0.4


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


def place(gaussians: Gaussians, thing: Object, grid: Grid, where: str, seed: int) -> Placed:
    """The Gaussians of an object in the domain, and its filling; `seed` is for the latter.

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
    still = select(placed, np.flatnonzero(~chosen))
    filling = _fill(moving, thing, grid, seed, where)
    if thing.filling is not None and thing.filling.show and len(filling):
        moving, filling = concatenate([moving, _shown(filling, moving, thing, grid)]), filling[:0]
    return Placed(moving, still, filling)


def _shown(points: np.ndarray, moving: Gaussians, thing: Object, grid: Grid) -> Gaussians:
    """Round Gaussians at the filling's points, in the colours of those nearest to them."""
    _, nearest = cKDTree(np.asarray(moving.means)).query(points)
    colours = np.asarray(dc_to_rgb(moving.harmonics[:, 0]))[nearest]
    spacing = (thing.filling.spacing or grid.spacing / 2) / thing.filling.per_cell ** (1 / 3)
    return from_points(points, colours, SIZE_OVER_SPACING * spacing)


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


def _fill(moving: Gaussians, thing: Object, grid: Grid, seed: int, where: str) -> np.ndarray:
    """Further particles inside an object (M, 3) [m], none where it stays hollow."""
    filling = thing.filling
    if filling is None:
        return np.zeros((0, 3), np.float32)
    config = FillingConfig(
        spacing=filling.spacing or grid.spacing / 2,
        density_threshold=filling.density_threshold,
        search_threshold=filling.search_threshold,
        search_count=filling.search_count,
        exclude_direction=filling.exclude_direction,
        ray_direction=filling.ray_direction,
        per_cell=filling.per_cell,
        maximum=filling.maximum,
        area=filling.area,
        smooth=filling.smooth,
    )
    try:
        points = fill_interior(moving, config, seed)
    except InputError as error:
        raise InputError(f"{where}.filling: {error}") from None
    if filling.relax and len(points):
        diameter = config.spacing / filling.per_cell ** (1 / 3)
        points = blue_noise(points, diameter, fixed=np.asarray(moving.means), steps=RELAX_STEPS)
    low, high = grid.lower, np.array(grid.upper)
    return points[np.all((points > low) & (points < high), axis=1)]
