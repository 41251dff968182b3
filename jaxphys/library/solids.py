"""Solids: closed surfaces that know their inside, where their paint is and where copies of them
stand.

World frame: right-handed, z up, an object's front faces +x. Lengths are free while a model is
built; `Model` brings the longest side of the bounding box to 1. A solid is never moved point by
point: it keeps one shape in its own frame and a list of affine maps, one for each copy.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

AXES = {"x": np.array([1.0, 0, 0]), "y": np.array([0, 1.0, 0]), "z": np.array([0, 0, 1.0])}
Where = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Solid:
    """One closed surface and its copies.

    surface: (u (n,), v (n,)) in [0, 1]^2 -> points (n, 3) in the solid's own frame.
    u, v: knots, ascending from 0 to 1, between which the surface is nearly flat.
    inside: points (n, 3) in its own frame -> (n,) bool; None: too thin to have an inside.
    coats: what is painted over the part's own colour, in order: (name of a part or colour, where),
        `where(u, v, points in the own frame)` the opacity (n,); the name None multiplies instead.
    winds: whether it may run through itself, so that parts of it hide others.
    linear, offset: (K, 3, 3), (K, 3): the maps p -> linear p + offset of the K copies.
    """

    surface: Callable[[np.ndarray, np.ndarray], np.ndarray]
    u: np.ndarray
    v: np.ndarray
    inside: Callable[[np.ndarray], np.ndarray] | None
    coats: tuple[tuple[str | None, Where], ...] = ()
    winds: bool = False
    linear: np.ndarray = field(default_factory=lambda: np.eye(3)[None])
    offset: np.ndarray = field(default_factory=lambda: np.zeros((1, 3)))

    def at(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> "Solid":
        """Shifted."""
        return replace(self, offset=self.offset + np.array([x, y, z]))

    def mapped(self, matrix: np.ndarray) -> "Solid":
        """Under the linear map `matrix` (3, 3) about the origin."""
        return replace(self, linear=matrix @ self.linear, offset=self.offset @ matrix.T)

    def turn(self, axis: str | tuple, degrees: float) -> "Solid":
        """Turned about an axis through the origin: "x", "y", "z" or a direction."""
        return self.mapped(rotation(axis, np.deg2rad(degrees)))

    def scale(self, x: float, y: float | None = None, z: float | None = None) -> "Solid":
        """Scaled, by one number or along each axis."""
        return self.mapped(np.diag([x, x if y is None else y, x if z is None else z]))

    def both(self, axis: str = "y") -> "Solid":
        """With its mirror images: left and right for "y"."""
        matrix = np.diag(1.0 - 2.0 * AXES[axis])
        return self.joined(self.mapped(matrix))

    def around(self, count: int, axis: str = "z") -> "Solid":
        """`count` copies, turned about an axis through the origin by equal steps."""
        turned = [self.turn(axis, 360.0 * k / count) for k in range(count)]
        return turned[0].joined(*turned[1:])

    def joined(self, *others: "Solid") -> "Solid":
        """Its own copies and those of other placements of the same solid."""
        every = (self, *others)
        return replace(
            self,
            linear=np.concatenate([one.linear for one in every]),
            offset=np.concatenate([one.offset for one in every]),
        )

    def copies(self, places, up=None, sizes=1.0, spin=None) -> "Solid":
        """A copy at each of `places` (K, 3), its own z axis along `up` (K, 3), scaled by `sizes`
        (K,) and first turned about z by `spin` (K,) [rad].
        """
        places = np.asarray(places, float)
        frames = np.broadcast_to(np.eye(3), (len(places), 3, 3))
        if up is not None:
            frames = upright(np.broadcast_to(np.asarray(up, float), places.shape))
        if spin is not None:
            c, s, zero = np.cos(spin), np.sin(spin), np.zeros(len(places))
            rows = [[c, -s, zero], [s, c, zero], [zero, zero, zero + 1]]
            frames = frames @ np.moveaxis(np.array(rows), -1, 0)
        frames = frames * np.broadcast_to(sizes, (len(places),))[:, None, None]
        linear = frames[:, None] @ self.linear[None]
        offset = (frames[:, None] @ self.offset[None, :, :, None])[..., 0] + places[:, None]
        return replace(self, linear=linear.reshape(-1, 3, 3), offset=offset.reshape(-1, 3))

    def coat(self, name: str, where: Where) -> "Solid":
        """Painted over with the colour of the part (or plain colour) `name`."""
        return replace(self, coats=(*self.coats, (name, where)))

    def shade(self, where: Where) -> "Solid":
        """Its colours so far multiplied by `where(u, v, points)`."""
        return replace(self, coats=(*self.coats, (None, where)))


def rotation(axis, angle: float) -> np.ndarray:
    """The (3, 3) rotation by `angle` [rad] about `axis` (Rodrigues)."""
    x, y, z = AXES[axis] if isinstance(axis, str) else np.asarray(axis, float)
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def upright(up: np.ndarray) -> np.ndarray:
    """Rotations (K, 3, 3) that take z to the directions `up` (K, 3) and keep x level."""
    third = up / np.linalg.norm(up, axis=1, keepdims=True)
    first = np.stack([-third[:, 1], third[:, 0], np.zeros(len(third))], 1)
    length = np.linalg.norm(first, axis=1, keepdims=True)
    first = np.where(length > 1e-9, first / np.maximum(length, 1e-9), (1.0, 0, 0))
    return np.stack([first, np.cross(third, first), third], -1)


Parts = Mapping[str, Solid | list[Solid]]


def each(parts: Parts, change: Callable[[Solid], Solid]) -> Parts:
    """An assembly with every solid changed, as by `lambda s: s.turn("y", 30).at(z=1)`."""
    return {name: [change(s) for s in listed(solids)] for name, solids in parts.items()}


def together(*assemblies: Parts) -> Parts:
    """Several assemblies as one; parts of the same name are one part."""
    found: dict[str, list[Solid]] = {}
    for parts in assemblies:
        for name, solids in parts.items():
            found[name] = [*found.get(name, ()), *listed(solids)]
    return dict(found)


def listed(solids: Solid | list[Solid]) -> list[Solid]:
    """One solid or several, as a list."""
    return [solids] if isinstance(solids, Solid) else list(solids)
