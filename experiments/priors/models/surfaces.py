"""Coloured triangle meshes from parametric surfaces, in plain numpy.

World frame: right-handed, z up, an object's front faces +x. Lengths are free: `normalise` brings
the longest side of the bounding box to 1. Colours are linear numbers in [0, 1] per vertex; surfaces
are tessellated finely enough that painted detail survives the interpolation.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

Colour = Sequence[float] | np.ndarray | Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class Mesh(NamedTuple):
    """Vertices (V, 3), triangles (T, 3) of vertex indices, and a colour (V, 3) in [0, 1] per
    vertex.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    colours: np.ndarray


def patch(surface: Callable, colour: Colour, columns: int = 48, rows: int = 32) -> Mesh:
    """The image of the unit square under `surface(u, v) -> (..., 3)`.

    `colour` is one (3,) colour or a function `(u, v, points) -> (..., 3)` painted on the vertices.
    """
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows), indexing="ij")
    points = np.stack(np.broadcast_arrays(*surface(u, v)), -1)
    paint = colour(u, v, points) if callable(colour) else np.broadcast_to(colour, points.shape)
    corner = (np.arange(columns - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    right, up, both = corner + rows, corner + 1, corner + rows + 1
    triangles = np.concatenate(
        [np.stack([corner, right, both], -1), np.stack([corner, both, up], -1)]
    )
    return Mesh(points.reshape(-1, 3), triangles, np.clip(paint, 0, 1).reshape(-1, 3))


def ellipsoid(centre, radii, colour: Colour, columns: int = 32, rows: int = 20) -> Mesh:
    """An ellipsoid of half-axes `radii` (a number or (3,)); v runs from the south pole (0) to the
    north (1).
    """
    return rounded_box(centre, radii, 1.0, colour, columns, rows)


def rounded_box(centre, half, roundness, colour: Colour, columns: int = 48, rows: int = 32) -> Mesh:
    """A superellipsoid: `roundness` 1 is an ellipsoid, towards 0 a box of half-sides `half`.

    A pair of roundnesses sets (around z, along z) apart: (1, 0.2) is a cylinder with a rounded
    edge.
    """
    half = np.broadcast_to(np.asarray(half, float), (3,))
    around, along = np.broadcast_to(roundness, (2,))

    def power(value, exponent):
        return np.sign(value) * np.abs(value) ** exponent

    def surface(u, v):
        longitude, latitude = 2 * np.pi * u, np.pi * (v - 0.5)
        ring = power(np.cos(latitude), along)
        return (
            centre[0] + half[0] * ring * power(np.cos(longitude), around),
            centre[1] + half[1] * ring * power(np.sin(longitude), around),
            centre[2] + half[2] * power(np.sin(latitude), along),
        )

    return patch(surface, colour, columns, rows)


def smooth(points, count: int) -> np.ndarray:
    """`count` points along a monotone cubic through `points` (K, D), by chord length."""
    points = np.asarray(points, float)
    chord = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return PchipInterpolator(chord, points)(np.linspace(0, chord[-1], count))


def lathe(
    profile, colour: Colour, *, sharp=False, columns: int = 64, rows: int = 64, wave=None
) -> Mesh:
    """The profile (K, 2) of (radius, height) turned about z; `wave(angle, v)` scales the radius.

    `sharp` keeps the corners of the profile, else a smooth curve goes through its points.
    """
    profile = np.asarray(profile, float)
    if sharp:
        chord = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
        at = np.linspace(0, chord[-1], rows)
        curve = np.stack([np.interp(at, chord, profile[:, i]) for i in range(2)], -1)
    else:
        curve = smooth(profile, rows)
    curve[:, 0] = np.maximum(curve[:, 0], 0)

    def surface(u, v):
        angle, row = 2 * np.pi * u, np.rint(v * (rows - 1)).astype(int)
        radius = curve[row, 0] * (1 if wave is None else wave(angle, v))
        return radius * np.cos(angle), radius * np.sin(angle), curve[row, 1]

    return patch(surface, colour, columns, rows)


def tube(path, radius, colour: Colour, *, sides: int = 14, rows: int = 40) -> Mesh:
    """A closed tube about a smooth curve through `path` (K, 3); `radius` a number or one per path
    point.
    """
    path = np.asarray(path, float)
    radii = np.broadcast_to(radius, (len(path),)).astype(float)
    curve = smooth(np.concatenate([path, radii[:, None]], 1), rows)
    centre, width = curve[:, :3], np.maximum(curve[:, 3], 0)
    centre = np.concatenate([centre[:1], centre, centre[-1:]])
    width = np.concatenate([[0], width, [0]])
    tangent = np.gradient(curve[:, :3], axis=0)
    tangent = np.concatenate([tangent[:1], tangent, tangent[-1:]])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-12
    # One fixed reference direction, the axis least along the curve, avoids a twisting frame.
    reference = np.eye(3)[np.argmin(np.abs(tangent).mean(0))]
    first = np.cross(tangent, reference)
    first /= np.linalg.norm(first, axis=1, keepdims=True) + 1e-12
    second = np.cross(tangent, first)

    def surface(u, v):
        angle, row = 2 * np.pi * u, np.rint(v * (rows + 1)).astype(int)
        offset = np.cos(angle)[..., None] * first[row] + np.sin(angle)[..., None] * second[row]
        return tuple(np.moveaxis(centre[row] + width[row][..., None] * offset, -1, 0))

    return patch(surface, colour, sides, rows + 2)


def torus(centre, ring: float, thickness: float, colour: Colour, *, squash: float = 1.0) -> Mesh:
    """A ring of radius `ring` about z; v = 0.25 is its top."""

    def surface(u, v):
        angle, around = 2 * np.pi * u, 2 * np.pi * v
        radius = ring + thickness * np.cos(around)
        height = squash * thickness * np.sin(around)
        return (
            centre[0] + radius * np.cos(angle),
            centre[1] + radius * np.sin(angle),
            centre[2] + height,
        )

    return patch(surface, colour, 72, 32)


def box(centre, half, colour: Colour, *, divisions: int = 2) -> Mesh:
    """A box of half-sides `half` with flat faces, each of `divisions` x `divisions` vertices."""
    half, parts = np.asarray(half, float), []
    for axis in range(3):
        for sign in (-1, 1):

            def surface(u, v, axis=axis, sign=sign):
                coordinates = [None] * 3
                coordinates[axis] = centre[axis] + sign * half[axis] + 0 * u
                for other, value in zip(((axis + 1) % 3, (axis + 2) % 3), (u, v), strict=True):
                    coordinates[other] = centre[other] + half[other] * (2 * value - 1)
                return tuple(coordinates)

            parts.append(patch(surface, colour, divisions, divisions))
    return join(*parts)


def extrude(
    outline, thickness: float, colour: Colour, *, puff: float = 0.0, rows: int = 12
) -> Mesh:
    """A flat solid facing +x: `outline` (K, 2) of (y, z), star-shaped about the origin.

    `thickness` is the full depth along x; `puff` in [0, 1] rounds it towards the rim. v = 0 is the
    centre of a face, 1 the rim; `points[..., 0]` tells the faces apart.
    """
    outline = np.asarray(outline, float)
    outline = np.concatenate([outline, outline[:1]])
    count = len(outline)
    faces = []
    for sign in (1, -1):

        def surface(u, v, sign=sign):
            at = np.rint(u * (count - 1)).astype(int)
            depth = 0.5 * thickness * ((1 - puff) + puff * np.sqrt(np.maximum(1 - v**2.5, 0)))
            return sign * depth, v * outline[at, 0], v * outline[at, 1]

        faces.append(patch(surface, colour, count, rows))

    def rim(u, v):
        at = np.rint(u * (count - 1)).astype(int)
        return (1 - puff) * thickness * (v - 0.5), outline[at, 0], outline[at, 1]

    def rim_colour(u, v, points):
        return (
            colour(u, np.ones_like(v), points)
            if callable(colour)
            else np.broadcast_to(colour, points.shape)
        )

    return join(*faces, patch(rim, rim_colour, count, 4))


def leaf(
    base, direction, length: float, width: float, colour: Colour, *, droop=0.3, up=(0, 0, 1)
) -> Mesh:
    """A pointed leaf from `base` along `direction`, bending away from `up` by `droop` times its
    length.
    """
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    side = np.cross(up, direction)
    side = side / (np.linalg.norm(side) + 1e-9)
    normal = np.cross(direction, side)

    def surface(u, v):
        across, along = 2 * u - 1, v
        spread = 0.5 * width * np.sin(np.pi * along**0.8) * across
        lift = -droop * length * along**2 + 0.25 * width * across**2 * np.sin(np.pi * along)
        points = (
            np.asarray(base)
            + (length * along)[..., None] * direction
            + spread[..., None] * side
            + lift[..., None] * normal
        )
        return tuple(np.moveaxis(points, -1, 0))

    return patch(surface, colour, 9, 16)


def join(*parts: Mesh) -> Mesh:
    """All parts as one mesh."""
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    return Mesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate(
            [part.triangles + start for part, start in zip(parts, offsets, strict=True)]
        ),
        np.concatenate([part.colours for part in parts]),
    )


def rotation(axis, angle: float) -> np.ndarray:
    """The (3, 3) rotation by `angle` [rad] about `axis` (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def turn(mesh: Mesh, axis, angle: float) -> Mesh:
    """The mesh turned by `angle` [rad] about `axis` through the origin."""
    return mesh._replace(vertices=mesh.vertices @ rotation(axis, angle).T)


def move(mesh: Mesh, offset) -> Mesh:
    """The mesh shifted by `offset` (3,)."""
    return mesh._replace(vertices=mesh.vertices + np.asarray(offset, float))


def stretch(mesh: Mesh, factors) -> Mesh:
    """The mesh scaled by `factors`, a number or (3,)."""
    return mesh._replace(vertices=mesh.vertices * np.asarray(factors, float))


def normalise(mesh: Mesh) -> Mesh:
    """The mesh with its bounding box centred at the origin and the longest side 1."""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    return mesh._replace(vertices=(mesh.vertices - 0.5 * (low + high)) / (high - low).max())


def sample(
    mesh: Mesh, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`count` points spread evenly over the surface: points, unit normals and colours, each (count,
    3).
    """
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    # Stratified along the cumulative area: evener than independent draws, at the same cost.
    at = (np.arange(count) + rng.random(count)) / count * area.sum()
    chosen = np.minimum(np.searchsorted(np.cumsum(area), at), len(area) - 1)
    u, v = rng.random((2, count, 1))
    flip = u + v > 1
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    weights = np.concatenate([1 - u - v, u, v], 1)[..., None]
    points = (corners[chosen] * weights).sum(1)
    colours = (mesh.colours[mesh.triangles[chosen]] * weights).sum(1)
    return points, normals[chosen] / area[chosen, None], colours
