"""Objects put where a scene wants them: chosen, turned, scaled, moved, filled."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from jaxphys.core.errors import InputError
from jaxphys.gaussians.cropping import object_of
from jaxphys.gaussians.filling import Filled, FillingConfig, fill
from jaxphys.gaussians.gaussians import (
    Gaussians,
    concatenate,
    from_points,
    opacities,
    scales,
    select,
    transform,
)
from jaxphys.gaussians.harmonics import dc_to_rgb, rgb_to_dc
from jaxphys.gaussians.hull import GAP, surface_spacing
from jaxphys.gaussians.lone import lone_points
from jaxphys.gaussians.relax import blue_noise
from jaxphys.gaussians.thinning import fewer
from jaxphys.gaussians.volumes import cell_volumes
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.transfer.kernels import Kernel
from jaxphys.scene.placement import Placement
from jaxphys.scene.scene import Object

RELAX_STEPS = 40
# Of drawn filling: standard deviation over spacing, its least part near the skin, and opacity.
SIZE_OVER_SPACING = 0.4
SMALLEST = 0.25
OPACITY = 0.95
# Of grains: as wide as this times what they are drawn of, so that they are told from each other.
GRAIN_SIZE = 0.5
# A splat of opacity 0.95 is fainter than 1/255 from so many of its standard deviations on.
VISIBLE = 3.3
# Splats farther apart than this many times the usual distance, and than a cell of the grid, do not
# hold together: the solver lets go of them at the first knock.
LINK = 2.0


class Placed(NamedTuple):
    """An object in the domain.

    Attributes:
        moving: K Gaussians that follow particles.
        still: Gaussians outside the object's `area`, drawn where they are.
        filling: further particles inside, (M, 3) [m].
        volumes: of the particles [m^3], (K + M,), those of Gaussians first.
        lone: number of splats beside the object that were left out, cropped ones among them.
        placement: where the contents of the object's file are in the domain.
    """

    moving: Gaussians
    still: Gaussians
    filling: np.ndarray
    volumes: np.ndarray
    lone: int
    placement: Placement


def rotation_matrix(thing: Object, where: str) -> np.ndarray:
    """All turns of an object as one matrix (3, 3), that which makes it upright first."""
    total = _upright(thing.up)
    for i, turn in enumerate(thing.rotation):
        axis = np.asarray(turn.axis, np.float64)
        if not np.any(axis):
            raise InputError(f"{where}.rotation[{i}].axis: is zero; name a direction")
        vector = math.radians(turn.degrees) * axis / np.linalg.norm(axis)
        total = Rotation.from_rotvec(vector).as_matrix() @ total
    return total


def _upright(up: str) -> np.ndarray:
    """The rotation that brings an axis of the source to z, another one staying horizontal."""
    axis, sign = "xyz".index(up[-1]), -1.0 if up[0] == "-" else 1.0
    z = sign * np.eye(3)[axis]
    x = np.eye(3)[0 if axis else 1]
    return np.stack([x, np.cross(z, x), z])


def place(
    gaussians: Gaussians,
    thing: Object,
    grid: Grid,
    kernel: Kernel,
    where: str,
    seed: int,
    most: int | None = None,
) -> Placed:
    """The Gaussians of an object in the domain, its filling and its volumes.

    All but the last shift happens about the object's own middle, so that it is filled and weighs
    the same at every place.

    Args:
        gaussians: in the units of their file.
        thing: what is asked for.
        grid, kernel: of the solver.
        where: the object's name in messages.
        seed: of the filling.
        most: of what moves, and of what does not, at most so many Gaussians, chosen once all of
            them have said where the object is and how large; None: all.

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
    rotation = rotation_matrix(thing, where)
    gaussians = transform(select(gaussians, np.flatnonzero(visible)), rotation)
    means = np.asarray(gaussians.means, np.float64)
    cropped = 0
    if thing.crop:
        own = object_of(means, np.asarray(scales(gaussians), np.float64).max(axis=1))
        gaussians, means, cropped = select(gaussians, np.flatnonzero(own)), means[own], sum(~own)
    chosen = np.ones(len(means), bool)
    if thing.area is not None:
        low, high = np.array(thing.area[0::2]), np.array(thing.area[1::2])
        chosen = np.all((means > low) & (means < high), axis=1)
        if not chosen.any():
            raise InputError(
                f"{where}.area: holds none of the {len(means)} Gaussians, which lie between "
                f"{_numbers(means.min(0))} and {_numbers(means.max(0))}"
            )
    kept = chosen.copy()
    kept[chosen] = ~_lone(means[chosen], thing.size, grid)
    middle, scale = _frame(means[kept], thing.size)
    own = transform(gaussians, scale=scale, translation=-scale * middle)
    moving, still = (select(own, np.flatnonzero(which)) for which in (kept, ~chosen))
    if most is not None:
        moving, still = fewer(moving, most), fewer(still, most)
    centre = np.array(thing.centre)
    _require_inside(np.asarray(moving.means) + centre, grid, kernel, where)
    filled = _fill(moving, thing, grid, seed, where)
    filling, volumes = filled.points, filled.volumes
    if thing.grain > 0:
        moving, still = _round(moving), _round(still)
    if thing.filling is not None and thing.filling.show and len(filling):
        moving, filling = concatenate([moving, _shown(filling, moving, thing, grid)]), filling[:0]
    if thing.grain > 0:
        moving, still = (_shaded(part, thing.grain, seed) for part in (moving, still))
    moving, still = (transform(part, translation=centre) for part in (moving, still))
    filling = (filling + centre).astype(moving.means.dtype)
    placement = Placement.of(rotation, scale, middle, centre)
    left_out = int(cropped + np.sum(chosen & ~kept))
    return Placed(moving, still, filling, volumes, left_out, placement)


def _frame(means: np.ndarray, size: float) -> tuple[np.ndarray, float]:
    """Middle of the bounding box of `means`, and the factor that makes its longest side `size`."""
    low, high = means.min(0), means.max(0)
    extent = (high - low).max()
    return (low + high) / 2, size / extent if extent > 0 else 1.0


def _lone(means: np.ndarray, size: float, grid: Grid) -> np.ndarray:
    """Which of `means` (N, 3) hang beside the object and would come off, a mask (N,)."""
    _, scale = _frame(means, size)
    return lone_points(
        means, max(LINK * float(np.median(surface_spacing(means))), grid.spacing / scale)
    )


def _config(thing: Object, grid: Grid) -> FillingConfig:
    """How an object is filled, in a frame about its middle."""
    filling = thing.filling
    assert filling is not None  # a hollow object is not asked
    area: Any = filling.area
    if area is not None:
        area = tuple(np.asarray(area) - np.repeat(thing.centre, 2))
    return FillingConfig(
        spacing=filling.spacing or grid.spacing / 2,
        density_threshold=filling.density_threshold,
        search_threshold=filling.search_threshold,
        search_count=filling.search_count,
        exclude_direction=filling.exclude_direction,
        ray_direction=filling.ray_direction,
        per_cell=filling.per_cell,
        maximum=filling.maximum,
        area=area,
        smooth=filling.smooth,
    )


def _shown(points: np.ndarray, moving: Gaussians, thing: Object, grid: Grid) -> Gaussians:
    """Round Gaussians at the filling's points, in the colours of those nearest to them.

    None reaches through the skin, so that the object looks the same until it comes apart.
    """
    skin = np.asarray(moving.means, np.float64)
    distance, nearest = cKDTree(skin).query(points, workers=-1)
    # Between the splats the skin is nearer than they are.
    gap = GAP * surface_spacing(skin)[nearest]
    depth = np.sqrt(np.maximum(distance**2 - gap**2, 0))
    colours = dc_to_rgb(np.asarray(moving.harmonics)[:, 0])[nearest]
    usual = SIZE_OVER_SPACING * _config(thing, grid).pitch
    fits = depth / VISIBLE
    sizes = np.clip(fits, SMALLEST * usual, usual)
    # What does not fit even so is faint: the renderer draws no splat smaller than a pixel.
    opacity = OPACITY * np.minimum(fits / sizes, 1) ** 2
    return from_points(points.astype(moving.means.dtype), colours, sizes, opacity=opacity)


def _round(gaussians: Gaussians) -> Gaussians:
    """Grains in place of Gaussians: round ones, of their middle axis."""
    middle = jnp.median(gaussians.log_scales, axis=1, keepdims=True) + math.log(GRAIN_SIZE)
    return replace(gaussians, log_scales=jnp.broadcast_to(middle, gaussians.log_scales.shape))


def _shaded(gaussians: Gaussians, grain: float, seed: int) -> Gaussians:
    """The Gaussians, each darker by a share of its own, up to `grain`. None gets lighter, so that
    no colour leaves [0, 1].
    """
    # A stream of its own: the filling's places come from the seed alone.
    darker = grain * np.random.default_rng([seed, 1]).random(gaussians.count)
    kept = jnp.asarray(1 - darker, gaussians.harmonics.dtype)[:, None]
    base = rgb_to_dc(kept * dc_to_rgb(gaussians.harmonics[:, 0]))
    rest = kept[:, None] * gaussians.harmonics[:, 1:]
    return replace(gaussians, harmonics=jnp.concatenate([base[:, None], rest], axis=1))


def _numbers(values) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"


def _require_inside(points: np.ndarray, grid: Grid, kernel: Kernel, where: str) -> None:
    low, high = points.min(0), points.max(0)
    # One cell more than the solver needs, so that the first steps have somewhere to go.
    first, last = grid.lower(kernel) + grid.spacing, np.array(grid.upper(kernel)) - grid.spacing
    if np.any(low < first) or np.any(high > last):
        raise InputError(
            f"{where}: reaches from {_numbers(low)} to {_numbers(high)} m, but the domain holds "
            f"{_numbers(np.full(3, first))} to {_numbers(last)}; change its size or centre, or the "
            "domain"
        )


def _fill(moving: Gaussians, thing: Object, grid: Grid, seed: int, where: str) -> Filled:
    """What is inside an object, nothing where it stays hollow, and all volumes."""
    if thing.filling is None:
        points = np.asarray(moving.means, np.float64)
        return Filled(np.zeros((0, 3)), cell_volumes(points, grid.spacing / 2))
    config = _config(thing, grid)
    spread = None
    if thing.filling.relax:

        def spread(points: np.ndarray) -> np.ndarray:
            return blue_noise(
                points, config.pitch, fixed=np.asarray(moving.means), steps=RELAX_STEPS
            )

    try:
        return fill(moving, config, seed, spread=spread)
    except InputError as error:
        raise InputError(f"{where}.filling: {error}") from None
