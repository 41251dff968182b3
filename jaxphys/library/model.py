"""A finished model: solids with their colours in the common frame, sampled as points of its surface
and asked whether a place lies inside it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from jaxphys.library.solids import Parts, Solid, listed

SMALL = 0.08  # of the longest side: what is smaller hides nothing
TOUCH = 0.003  # of the longest side: a surface nearer than this to another solid is covered by it
DEEP = 0.012  # of the longest side: how deep a winding surface must lie in itself to be hidden
EPSILON = 1e-4  # of a parameter, for the tangents
SPARE = 1.3  # samples drawn for each one wanted, as some turn out to be hidden


class Surface(NamedTuple):
    """Points (N, 3) in [-0.5, 0.5], albedo (N, 3) in [0, 1] and outward unit normals (N, 3)."""

    points: np.ndarray
    colours: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True)
class Model:
    """Solids by part, in their builder's units, and the map to the common frame.

    labels: (S,) the part or plain colour of each solid; colours: (3,) of each; textures: of each
    part whose material has one, points (n, 3) in the solid's frame -> factors (n,).
    """

    labels: tuple[str, ...]
    solids: tuple[Solid, ...]
    colours: Mapping[str, np.ndarray]
    textures: Mapping[str, Callable[[np.ndarray], np.ndarray]]
    areas: tuple[np.ndarray, ...]  # of each solid's cells, (copies, cells)
    signs: tuple[float, ...]  # 1 where du x dv points outward
    bounds: tuple[tuple[np.ndarray, np.ndarray], ...]  # of each solid's copies, (K, 3) twice
    centre: np.ndarray
    scale: float

    def sample(self, count: int, rng: np.random.Generator) -> Surface:
        """`count` points spread evenly over what can be reached from outside."""
        found, kept, wanted = [], 0, int(SPARE * count) + 16
        while kept < count:
            points, colours, normals, owner = self._draw(wanted, rng)
            seen = ~self._hidden(points, owner, normals)
            found.append([values[seen] for values in (points, colours, normals)])
            kept += int(seen.sum())
            wanted = int(1.2 * (count - kept) * len(seen) / max(seen.sum(), 1)) + 16
            wanted = min(wanted, 20 * count)
        points, colours, normals = (np.concatenate(values) for values in zip(*found, strict=True))
        # Samples come solid by solid: every k-th keeps their evenness.
        chosen = np.linspace(0, kept - 1, count).round().astype(int)
        points = (points[chosen] - self.centre) * self.scale
        return Surface(points, colours[chosen], normals[chosen])

    def inside(self, places: np.ndarray) -> np.ndarray:
        """Which places (N, 3) of the common frame lie inside some solid, (N,)."""
        places = np.asarray(places, float) / self.scale + self.centre
        nowhere = np.full(len(places), -1)
        return self._hidden(places, nowhere, np.zeros_like(places), smallest=0.0)

    def triangles(self, pieces: int = 4) -> tuple[np.ndarray, np.ndarray]:
        """Corners (T, 3, 3) in the common frame and their albedo (T, 3, 3): every surface with its
        cells cut into `pieces` squared, hidden parts included.
        """
        corners, paints = [], []
        for index, solid in enumerate(self.solids):
            u, v = (np.interp(*fine(knots, pieces)) for knots in (solid.u, solid.v))
            along, across = (values.ravel() for values in np.meshgrid(u, v, indexing="ij"))
            own = solid.surface(along, across)
            colours = self._paint(index, along, across, own)
            first = (np.arange(len(u) - 1)[:, None] * len(v) + np.arange(len(v) - 1)).ravel()
            right, up, both = first + len(v), first + 1, first + len(v) + 1
            faces = np.stack([[first, right, both], [first, both, up]]).transpose(0, 2, 1)
            faces = faces.reshape(-1, 3)
            for linear, offset in zip(solid.linear, solid.offset, strict=True):
                flips = self.signs[index] * np.linalg.det(linear) < 0
                around = faces[:, ::-1] if flips else faces
                placed = (own @ linear.T + offset - self.centre) * self.scale
                corners.append(placed[around])
                paints.append(colours[around])
        return np.concatenate(corners), np.concatenate(paints)

    def _draw(self, count: int, rng: np.random.Generator):
        """Points, colours, normals of all surfaces, hidden or not, and the copy they lie on."""
        sizes = [area.size for area in self.areas]
        edges = np.cumsum(np.concatenate([area.ravel() for area in self.areas]))
        # Stratified along the cumulative area: evener than independent draws, at the same cost.
        at = (np.arange(count) + rng.random(count)) / count * edges[-1]
        cell = np.minimum(np.searchsorted(edges, at), len(edges) - 1)
        first = np.cumsum([0, *sizes])
        split = np.searchsorted(cell, first)
        places = rng.random((2, count))
        points, normals = np.empty((count, 3)), np.empty((count, 3))
        colours, owner, copies = np.empty((count, 3)), np.empty(count, int), 0
        for index, solid in enumerate(self.solids):
            mine = slice(split[index], split[index + 1])
            if mine.start < mine.stop:
                local = cell[mine] - first[index]
                points[mine], normals[mine], colours[mine], copy = self._on(
                    index, local, *places[:, mine]
                )
                owner[mine] = copies + copy
            copies += len(solid.linear)
        return points, colours, normals, owner

    def _on(self, index: int, cell: np.ndarray, a: np.ndarray, b: np.ndarray):
        """Points, normals, colours and copies for cells of one solid, at (a, b) within them."""
        solid = self.solids[index]
        rows = len(solid.v) - 1
        copy, cell = np.divmod(cell, (len(solid.u) - 1) * rows)
        i, j = np.divmod(cell, rows)
        u = solid.u[i] + a * (solid.u[i + 1] - solid.u[i])
        v = solid.v[j] + b * (solid.v[j + 1] - solid.v[j])
        du, dv = np.where(u < 0.5, EPSILON, -EPSILON), np.where(v < 0.5, EPSILON, -EPSILON)
        every = solid.surface(np.concatenate([u, u + du, u]), np.concatenate([v, v, v + dv]))
        own, right, up = every.reshape(3, len(u), 3)
        normal = cross(right - own, up - own) * (self.signs[index] * np.sign(du * dv))[:, None]
        colours = self._paint(index, u, v, own)
        if len(solid.linear) == 1:
            points = own @ solid.linear[0].T + solid.offset[0]
            normal = normal @ normal_maps(solid.linear)[0].T
        else:
            points = (solid.linear[copy] @ own[..., None])[..., 0] + solid.offset[copy]
            normal = (normal_maps(solid.linear)[copy] @ normal[..., None])[..., 0]
        length = np.sqrt((normal**2).sum(1, keepdims=True))
        normal = np.where(length > 1e-14, normal / np.maximum(length, 1e-14), (0.0, 0, 1))
        return points, normal, colours, copy

    def _paint(self, index: int, u, v, points) -> np.ndarray:
        solid, label = self.solids[index], self.labels[index]
        colours = np.broadcast_to(self.colours[label], points.shape)
        if label in self.textures:
            colours = colours * self.textures[label](points)[:, None]
        for name, where in solid.coats:
            weight = np.asarray(where(u, v, points), float)
            weight = np.broadcast_to(weight, u.shape)[:, None]
            if name is None:
                colours = colours * weight
            else:
                paint = self.colours[name]
                if name in self.textures:
                    paint = paint * self.textures[name](points)[:, None]
                weight = np.clip(weight, 0, 1)
                colours = colours + weight * (paint - colours)
        return np.clip(colours, 0, 1)

    def _hidden(self, points, owner, normals, smallest: float = SMALL) -> np.ndarray:
        """Which points are inside a copy that is not their own, or touch one, or are deep inside
        their own winding one: places just outside of them are asked for.
        """
        hidden, number = np.zeros(len(points), bool), 0
        size = smallest / self.scale
        outside = points + TOUCH / self.scale * normals
        for solid, (low, high) in zip(self.solids, self.bounds, strict=True):
            copies = len(solid.linear)
            if solid.inside is not None:
                for k in np.flatnonzero((high - low).max(1) > size):
                    near = (outside > low[k]) & (outside < high[k])
                    near = np.flatnonzero(near[:, 0] & near[:, 1] & near[:, 2] & ~hidden)
                    own = owner[near] == number + k
                    if not solid.winds:
                        near = near[~own]
                    if len(near):
                        places = outside[near]
                        if solid.winds:
                            places = places + own[:, None] * (DEEP / self.scale * normals[near])
                        back = np.linalg.inv(solid.linear[k])
                        hidden[near] = solid.inside((places - solid.offset[k]) @ back.T)
            number += copies
        return hidden


def fine(knots: np.ndarray, pieces: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `np.interp` wants to cut each interval of `knots` into so many."""
    at = np.arange(pieces * (len(knots) - 1) + 1) / pieces
    return at, np.arange(len(knots)), knots


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Row-wise cross product (n, 3); numpy's own takes several times as long."""
    ax, ay, az = a.T
    bx, by, bz = b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def normal_maps(linear: np.ndarray) -> np.ndarray:
    """The maps (K, 3, 3) of outward area vectors that belong to those of points: their rows are
    cross products of the other two, turned back where the map mirrors.
    """
    a, b, c = linear[:, 0], linear[:, 1], linear[:, 2]
    rows = np.stack([cross(b, c), cross(c, a), cross(a, b)], 1)
    return rows * np.sign((a * rows[:, 0]).sum(1))[:, None, None]


def finish(parts: Parts, colours: Mapping, textures: Mapping) -> Model:
    """The model of an assembly: measured, so that it can be brought into the common frame."""
    pairs = [(name, solid) for name, solids in parts.items() for solid in listed(solids)]
    areas, signs, bounds = [], [], []
    for _, solid in pairs:
        u, v = (grid.ravel() for grid in np.meshgrid(solid.u, solid.v, indexing="ij"))
        corners = solid.surface(u, v)
        grid = corners.reshape(len(solid.u), len(solid.v), 3)
        p00, p10, p01, p11 = grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:]
        vectors = 0.5 * cross((p11 - p00).reshape(-1, 3), (p01 - p10).reshape(-1, 3))
        middles = 0.25 * (p00 + p10 + p01 + p11).reshape(-1, 3)
        # Of a closed surface this sum is three times the volume if the vectors point outward.
        signs.append(1.0 if (middles * vectors).sum() >= 0 else -1.0)
        maps = normal_maps(solid.linear)
        areas.append(np.sqrt(((vectors @ maps.transpose(0, 2, 1)) ** 2).sum(-1)))
        placed = corners @ solid.linear.transpose(0, 2, 1) + solid.offset[:, None]
        bounds.append((placed.min(1), placed.max(1)))
    low = np.min([b[0].min(0) for b in bounds], 0)
    high = np.max([b[1].max(0) for b in bounds], 0)
    return Model(
        tuple(name for name, _ in pairs),
        tuple(solid for _, solid in pairs),
        colours,
        textures,
        tuple(areas),
        tuple(signs),
        tuple(bounds),
        0.5 * (low + high),
        float(1.0 / (high - low).max()),
    )
