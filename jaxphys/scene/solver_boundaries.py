"""A scene's boundaries as the solver's."""

from functools import singledispatch

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.mpm import boundaries as grid_boundaries
from jaxphys.mpm import particle_boundaries
from jaxphys.mpm.grid import Grid
from jaxphys.scene.boundaries import (
    Boundary,
    Box,
    Cut,
    Impulse,
    Plane,
    Release,
    Rotate,
    Translate,
    Walls,
)
from jaxphys.scene.scene import Scene

MARGIN = 1e-4  # cells by which a floor lies above the node it is meant to hold


@singledispatch
def _convert(boundary: Boundary, grid: Grid, rest: np.ndarray):
    raise TypeError(boundary)


@_convert.register
def _(boundary: Walls, grid: Grid, rest: np.ndarray):
    return grid_boundaries.walls(grid.shape, grid.spacing, boundary.surface, boundary.friction)


@_convert.register
def _(boundary: Plane, grid: Grid, rest: np.ndarray):
    # A node that lies on the plane belongs to the solid, whichever way its height is rounded.
    normal = np.asarray(boundary.normal)
    length = np.linalg.norm(normal)
    lift = MARGIN * grid.spacing * normal / length if length > 0 else 0.0
    return grid_boundaries.half_space(
        np.asarray(boundary.point) + lift,
        boundary.normal,
        boundary.surface,
        boundary.friction,
        start=boundary.start,
        end=boundary.end,
    )


@_convert.register
def _(boundary: Cut, grid: Grid, rest: np.ndarray):
    return grid_boundaries.cut(
        boundary.point,
        boundary.normal,
        boundary.lower,
        boundary.upper,
        boundary.factor,
        boundary.start,
        boundary.end,
    )


@_convert.register
def _(boundary: Box, grid: Grid, rest: np.ndarray):
    return grid_boundaries.box(
        boundary.centre,
        boundary.half_size,
        boundary.velocity,
        boundary.start,
        boundary.end,
        boundary.rest_after,
    )


@_convert.register
def _(boundary: Impulse, grid: Grid, rest: np.ndarray):
    force = np.asarray(boundary.force)
    if boundary.per_particle:
        offset = np.abs(rest - np.asarray(boundary.centre))
        force = force * np.all(offset < np.asarray(boundary.half_size), axis=1).sum()
    end = boundary.start + boundary.duration
    return particle_boundaries.impulse(
        force, boundary.centre, boundary.half_size, boundary.start, end
    )


@_convert.register
def _(boundary: Translate, grid: Grid, rest: np.ndarray):
    return particle_boundaries.translation(
        boundary.velocity, boundary.centre, boundary.half_size, boundary.start, boundary.end
    )


@_convert.register
def _(boundary: Rotate, grid: Grid, rest: np.ndarray):
    return particle_boundaries.rotation(
        boundary.point,
        boundary.axis,
        boundary.half_height,
        boundary.radius,
        boundary.angular_velocity,
        boundary.axial_velocity,
        boundary.start,
        boundary.end,
    )


@_convert.register
def _(boundary: Release, grid: Grid, rest: np.ndarray):
    # The solver's sweep goes along its normal; one that goes down is one along the reverse.
    sign = 1.0 if boundary.finish >= boundary.begin else -1.0
    return particle_boundaries.release(
        sign * np.asarray(boundary.normal),
        sign * boundary.begin,
        sign * boundary.finish,
        boundary.start,
        boundary.end,
    )


def solver_boundaries(scene: Scene, grid: Grid, rest: np.ndarray) -> tuple[tuple, bool]:
    """The solver's boundaries in the scene's order, damping first, and whether one of them needs
    the
    rest positions.

    Args:
        scene: whose boundaries and damping are meant.
        grid: of the solver.
        rest: positions of all particles at time 0 (N, 3) [m].

    Raises:
        InputError: naming the entry that cannot be used.
    """
    found = [grid_boundaries.damping(scene.damping)] if scene.damping > 0 else []
    for i, boundary in enumerate(scene.boundaries):
        try:
            found.append(_convert(boundary, grid, rest))
        except InputError as error:
            raise InputError(f"boundaries[{i}]: {error}") from None
    needs_rest = any(isinstance(b, particle_boundaries.ParticleBoundary) for b in found)
    return tuple(found), needs_rest
