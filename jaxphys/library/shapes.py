"""The vocabulary of shapes: every kind of object is built of these.

Shapes stand in their own frame, mostly about the origin; `Solid.at`, `turn`, `scale` and the like
place them. Sizes that are called length, width and height are full ones along x, y and z; radii are
radii. Every shape is closed; `sharp` keeps the corners of a curve that is else smooth.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from jaxphys.library.solids import Solid

TURN = 2 * np.pi


def even(count: int) -> np.ndarray:
    """Knots at equal distances, (count + 1,)."""
    return np.linspace(0, 1, count + 1)


def columns(*coordinates) -> np.ndarray:
    """Points (n, 3) of their coordinates."""
    return np.stack(np.broadcast_arrays(*coordinates), -1)


def smooth(points, count: int) -> np.ndarray:
    """`count` points along a cubic through `points` (K, D) that does not overshoot (Fritsch &
    Carlson 1980), by chord length.
    """
    points = np.asarray(points, float)
    if len(points) < 3:
        return points[0] + np.linspace(0, 1, count)[:, None] * (points[-1] - points[0])
    step = np.maximum(np.sqrt((np.diff(points, axis=0) ** 2).sum(1)), 1e-9)
    chord = np.concatenate([[0], np.cumsum(step)])
    slope = np.diff(points, axis=0) / step[:, None]
    before, after = slope[:-1], slope[1:]
    # The harmonic mean of the neighbouring slopes, zero where they differ in sign.
    inner = np.where(before * after > 0, 2 * before * after / (before + after + 1e-30), 0)
    tangent = np.concatenate([slope[:1], inner, slope[-1:]])
    at = np.linspace(0, chord[-1], count)
    k = np.clip(np.searchsorted(chord, at, side="right") - 1, 0, len(step) - 1)
    t, h = ((at - chord[k]) / step[k])[:, None], step[k][:, None]
    return (
        (1 + 2 * t) * (1 - t) ** 2 * points[k]
        + t * (1 - t) ** 2 * h * tangent[k]
        + t**2 * (3 - 2 * t) * points[k + 1]
        + t**2 * (t - 1) * h * tangent[k + 1]
    )


def curve(points, sharp: bool, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """A polyline (M, D) through `points` and its parameter (M,) from 0 to 1 by chord length."""
    points = np.asarray(points, float) if sharp else smooth(points, count)
    step = np.maximum(np.sqrt((np.diff(points, axis=0) ** 2).sum(1)), 1e-9)
    at = np.concatenate([[0], np.cumsum(step)])
    return points, at / at[-1]


def knots_of(at: np.ndarray, sharp: bool, count: int = 16) -> np.ndarray:
    """Knots for a curve of parameters `at`: its corners and thirds between them if it is sharp."""
    if not sharp:
        return even(count)
    thirds = at[:-1, None] + np.diff(at)[:, None] * np.array([0, 1 / 3, 2 / 3])
    return np.append(thirds.ravel(), 1.0)


def along(at: np.ndarray, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The polyline's values (M, D) at parameters `at` (n,), (n, D)."""
    return np.stack([np.interp(at, t, values[:, i]) for i in range(values.shape[1])], -1)


def in_polygon(x: np.ndarray, y: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Which points (n,) lie in a closed polygon (K, 2): an odd number of edges to their right."""
    x0, y0 = corners.T
    x1, y1 = np.roll(corners, -1, 0).T
    slope = (x1 - x0) / np.where(y1 == y0, 1e-12, y1 - y0)
    crosses = (y0 > y[:, None]) != (y1 > y[:, None])
    return ((x[:, None] < x0 + (y[:, None] - y0) * slope) & crosses).sum(1) % 2 == 1


def ball(x: float, y: float | None = None, z: float | None = None, fine: int = 8) -> Solid:
    """An ellipsoid of half-axes x, y, z (all x if only that is given) about the origin."""
    radii = np.array([x, x if y is None else y, x if z is None else z], float)

    def surface(u, v):
        level = np.sin(np.pi * v)
        unit = columns(level * np.cos(TURN * u), level * np.sin(TURN * u), -np.cos(np.pi * v))
        return radii * unit

    return Solid(surface, even(fine), even(fine), lambda p: ((p / radii) ** 2).sum(1) < 1)


def speck(x: float, y: float | None = None, z: float | None = None) -> Solid:
    """A small ellipsoid of which there are many: a seed, a grain, an eye."""
    return ball(x, y, z, fine=4)


def cushion(length: float, width: float, height: float, square: float = 4.0) -> Solid:
    """A rounded box about the origin whose sides bulge; `square` 2 is an ellipsoid, 6 nearly a
    box.
    """
    half = 0.5 * np.array([length, width, height])

    def surface(u, v):
        level = np.sin(np.pi * v)
        unit = columns(level * np.cos(TURN * u), level * np.sin(TURN * u), -np.cos(np.pi * v))
        return half * unit / ((np.abs(unit) ** square).sum(1, keepdims=True)) ** (1 / square)

    return Solid(surface, even(24), even(16), lambda p: (np.abs(p / half) ** square).sum(1) < 1)


def lathe(profile, *, sharp: bool = False, waves=None, outline=None) -> Solid:
    """The profile (K, 2) of (radius, height) turned about z.

    It is closed along the axis unless its last point is its first (a ring). `waves` (count, depth)
    makes the radius wavy around; `outline` (K, 2), star-shaped about the origin, takes the circle's
    place: radii are then shares of it.
    """
    profile = np.asarray(profile, float)
    if not np.array_equal(profile[0], profile[-1]):
        ends = [(0, profile[0, 1])] if profile[0, 0] > 0 else []
        profile = np.concatenate([np.reshape(ends, (-1, 2)), profile])
        ends = [(0, profile[-1, 1])] if profile[-1, 0] > 0 else []
        profile = np.concatenate([profile, np.reshape(ends, (-1, 2))])
    line, t = curve(profile, sharp)
    polygon = line if sharp else line[::2]
    if outline is None:
        count, depth = waves or (0, 0.0)
        around, u_knots = (
            (lambda angle: 1 + depth * np.cos(count * angle)),
            even(max(12, 2 * count)),
        )

        def rim(u):
            return around(TURN * u) * np.stack([np.cos(TURN * u), np.sin(TURN * u)])
    else:
        corners = np.concatenate([outline, outline[:1]]).astype(float)
        closed, s = curve(corners, True)
        u_knots = s if len(s) > 12 else knots_of(s, True)
        angles = np.arctan2(closed[:-1, 1], closed[:-1, 0])
        order = np.argsort(angles)
        first = closed[:-1][order]
        second = np.roll(first, -1, 0)
        angles, edge = angles[order], second - first
        area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]

        def around(angle):
            # Where the ray at this angle meets its edge.
            k = np.searchsorted(angles, angle, side="right") - 1
            return area[k] / (np.cos(angle) * edge[k, 1] - np.sin(angle) * edge[k, 0])

        def rim(u):
            return along(u, s, closed).T

    def surface(u, v):
        radius, height = along(v, t, line).T
        x, y = rim(u)
        return columns(radius * x, radius * y, height)

    def inside(p):
        share = np.hypot(p[:, 0], p[:, 1]) / around(np.arctan2(p[:, 1], p[:, 0]))
        return in_polygon(share, p[:, 2], polygon)

    extremes = t[[line[:, 0].argmax(), line[:, 1].argmin(), line[:, 1].argmax()]]
    return Solid(surface, u_knots, np.union1d(knots_of(t, sharp), extremes), inside)


def cylinder(radius: float, height: float, top: float | None = None, bevel: float = 0.0) -> Solid:
    """Upright from z = 0, its radius at the top `top` if that is given, edges cut by `bevel`."""
    top = radius if top is None else top
    if not bevel:
        return lathe([(0, 0), (radius, 0), (top, height), (0, height)], sharp=True)
    b = bevel
    return lathe(
        [(0, 0), (radius - b, 0), (radius, b), (top, height - b), (top - b, height), (0, height)],
        sharp=True,
    )


def cone(radius: float, height: float) -> Solid:
    """Upright on z = 0."""
    return lathe([(0, 0), (radius, 0), (0, height)], sharp=True)


def ring(radius: float, thickness: float, flat: float = 1.0) -> Solid:
    """A torus about z: the circle of `radius` thickened by the radius `thickness`, its height times
    `flat`.
    """

    def surface(u, v):
        out = radius + thickness * np.cos(TURN * v)
        return columns(
            out * np.cos(TURN * u), out * np.sin(TURN * u), flat * thickness * np.sin(TURN * v)
        )

    def inside(p):
        off = np.hypot(p[:, 0], p[:, 1]) - radius
        return off**2 + (p[:, 2] / flat) ** 2 < thickness**2

    return Solid(surface, even(20), even(8), inside)


def oblong(length: float, width: float, corner: float = 0.0) -> np.ndarray:
    """The outline of a rectangle about the origin, its corners rounded by the radius `corner`."""
    x, y, r = 0.5 * length, 0.5 * width, min(corner, 0.49 * length, 0.49 * width)
    if r <= 0:
        line = [(x, -y), (x, y), (-x, y), (-x, -y), (x, -y)]
        count = 8
        return np.concatenate(
            [np.linspace(line[k], line[k + 1], count, endpoint=False) for k in range(4)]
        )
    bends = [
        np.stack([sx * (x - r) + r * np.cos(a), sy * (y - r) + r * np.sin(a)], -1)
        for sx, sy, start in ((1, 1, 0), (-1, 1, 1), (-1, -1, 2), (1, -1, 3))
        for a in [0.5 * np.pi * (start + np.linspace(0, 1, 6))]
    ]
    following = [*bends[1:], bends[0]]
    fill = [np.linspace(p[-1], q[0], 6)[1:-1] for p, q in zip(bends, following, strict=True)]
    return np.concatenate([piece for pair in zip(bends, fill, strict=True) for piece in pair])


def polygon(sides: int, radius: float = 1.0, inner: float | None = None, start=0.0) -> np.ndarray:
    """A regular outline of so many corners, or a star with its notches at radius `inner`."""
    count = sides if inner is None else 2 * sides
    angle = start + TURN * np.arange(count) / count
    radii = np.where(np.arange(count) % 2 == 0, radius, radius if inner is None else inner)
    corners = np.stack([radii * np.cos(angle), radii * np.sin(angle)], -1)
    return refined(corners)


def refined(corners, pieces: int = 4) -> np.ndarray:
    """A closed outline with each side cut into so many."""
    corners = np.asarray(corners, float)
    following = np.roll(corners, -1, 0)
    share = np.arange(pieces)[:, None] / pieces
    return np.concatenate([a + share * (b - a) for a, b in zip(corners, following, strict=True)])


def rounded(corners, count: int = 48) -> np.ndarray:
    """A smooth closed outline through `corners` (K, 2)."""
    corners = np.asarray(corners, float)
    several = np.concatenate([corners[-2:], corners, corners[:3]])
    fine = smooth(several, 12 * len(several))
    step = np.sqrt((np.diff(several, axis=0) ** 2).sum(1))
    chord = np.concatenate([[0], np.cumsum(step)])
    at = np.linspace(chord[2], chord[2 + len(corners)], count, endpoint=False)
    return along(at, np.linspace(0, chord[-1], len(fine)), fine)


def slab(
    outline, height: float, *, puff: float = 0.0, edge: float = 0.0, top: float = 1.0
) -> Solid:
    """The `outline` (K, 2), star-shaped about the origin, lying in x and y, from z = -height / 2 to
    height / 2.

    `puff` in [0, 1] rounds it towards the rim like a cushion, `edge` cuts the rim's edges, `top`
    scales its upper face.
    """
    h = 0.5 * height
    if puff:
        a = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17)
        profile = np.stack([np.cos(a) ** (1 - 0.5 * puff), h * np.sin(a)], -1)
        flat = np.abs(np.sin(a)) < 0.2
        profile[flat, 0] = np.maximum(profile[flat, 0], 0.995)
        return lathe(profile, outline=outline)
    e = edge / max(np.abs(outline).max(), 1e-9)
    corners = [(0, -h), (1 - e, -h), (1, edge - h), (top, h - edge), (top * (1 - e), h), (0, h)]
    if not edge:
        corners = [(0, -h), (1, -h), (top, h), (0, h)]
    return lathe(corners, sharp=True, outline=outline)


def plate(outline, thickness: float, **rest) -> Solid:
    """A slab standing up to face +x: its outline (K, 2) is of (y, z)."""
    upright = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    return slab(outline, thickness, **rest).mapped(upright)


def side_plate(outline, thickness: float, **rest) -> Solid:
    """A slab standing up to face +y: its outline (K, 2) is of (x, z), the object's side view."""
    upright = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    return slab(outline, thickness, **rest).mapped(upright)


def block(length: float, width: float, height: float, edge: float = 0.0, taper: float = 1.0):
    """A box about the origin, edges rounded by `edge`, its upper face scaled by `taper`."""
    return slab(oblong(length, width, edge), height, edge=0.7 * edge, top=taper)


def frames_along(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit normals (M, 3) to a polyline that turn as little as the line lets them; the second
    starts as upright as it can.
    """
    tangent = np.gradient(line, axis=0)
    tangent /= np.sqrt((tangent**2).sum(1, keepdims=True)) + 1e-12
    start = np.array([0, 0, 1.0]) if abs(tangent[0, 2]) < 0.9 else np.array([1.0, 0, 0])
    first = np.empty_like(line)
    side = np.cross(start, tangent[0])
    for k, direction in enumerate(tangent):
        side = side - (side @ direction) * direction
        side = side / (np.sqrt(side @ side) + 1e-12)
        first[k] = side
    return first, np.cross(tangent, first)


def tube(
    path, radius, *, flat: float = 1.0, sharp: bool = False, sides: int = 8, winds: bool = False
) -> Solid:
    """About a curve through `path` (K, 3); `radius` a number or one per point of the path.

    `flat` scales its upright extent (the one across the first normal): a strap is a flat tube;
    `winds` says that it may touch itself.
    """
    path = np.asarray(path, float)
    radii = np.broadcast_to(np.asarray(radius, float), (len(path),))
    count = min(40, 6 * len(path))
    line, t = curve(np.concatenate([path, radii[:, None]], 1), sharp, count)
    centre, width = line[:, :3], np.maximum(line[:, 3], 0)
    first, second = frames_along(centre)
    # Flat caps: the first and the last circle shrink to their centres.
    t = np.concatenate([[0], 0.02 + 0.96 * t, [1]])
    doubled = np.concatenate([[0], np.arange(len(centre)), [len(centre) - 1]]).astype(int)
    table = np.concatenate(
        [
            centre[doubled],
            (width[:, None] * first)[doubled],
            (flat * width[:, None] * second)[doubled],
        ],
        1,
    )
    table[[0, -1], 3:] = 0
    stride = 1 if len(t) < 16 else 2
    knots = np.concatenate([[0], t[1:-1:stride], t[-2:]]) if stride > 1 else t
    knots = np.unique(knots)

    def surface(u, v):
        values = along(v, t, table)
        cosine, sine = np.cos(TURN * u)[:, None], np.sin(TURN * u)[:, None]
        return values[:, :3] + cosine * values[:, 3:6] + sine * values[:, 6:]

    def inside(p):
        if len(centre) == 2:
            axis = centre[1] - centre[0]
            s = (p - centre[0]) @ axis / (axis @ axis)
            off = p - centre[0] - s[:, None] * axis
            r = np.maximum(width[0] + s * (width[1] - width[0]), 1e-9)
            a, b = (off @ first[0]) / r, (off @ second[0]) / (flat * r)
            return (s > 0) & (s < 1) & (a**2 + b**2 < 1)
        middle = 0.5 * (centre[1:] + centre[:-1])
        axis = np.diff(centre, axis=0)
        squared = (axis**2).sum(1) + 1e-18
        off = p[:, None] - middle
        s = (off * axis).sum(-1) / squared
        near = np.abs(s) <= 0.55
        r = 0.5 * (width[1:] + width[:-1]) + s * np.diff(width)
        a, b = (off * first[:-1]).sum(-1), (off * second[:-1]).sum(-1) / flat
        return (near & (a**2 + b**2 < r**2)).any(1)

    return Solid(surface, even(sides), knots, inside, winds=winds)


def limb(start, end, radius: float, tip: float | None = None) -> Solid:
    """A straight limb from `start` to `end` with round ends, its radius at the end `tip`."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    tip = radius if tip is None else tip
    axis = end - start
    length = np.sqrt(axis @ axis)
    a = np.linspace(0, 0.5 * np.pi, 6)
    profile = np.concatenate(
        [
            np.stack([radius * np.sin(a), -radius * np.cos(a)], -1),
            np.stack([tip * np.cos(a), length + tip * np.sin(a)], -1),
        ]
    )
    return lathe(profile, sharp=True).copies(start[None], axis[None])


def rod(start, end, radius: float, tip: float | None = None) -> Solid:
    """A straight rod from `start` to `end` with flat ends, its radius at the end `tip`."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    axis = end - start
    return cylinder(radius, np.sqrt(axis @ axis), tip).copies(start[None], axis[None])


def bend(start, middle, end, count: int = 7) -> np.ndarray:
    """The path (count, 3) of a quadratic Bézier arc: leaves `start` and enters `end` as if towards
    `middle`.
    """
    t = np.linspace(0, 1, count)[:, None]
    start, middle, end = (np.asarray(p, float) for p in (start, middle, end))
    return (1 - t) ** 2 * start + 2 * t * (1 - t) * middle + t**2 * end


def handle(top, bottom, reach: float, radius: float, **rest) -> Solid:
    """A handle from `top` to `bottom` (3,), bulging away from the z axis (if both lie on it, to +y)
    by `reach`.
    """
    top, bottom = np.asarray(top, float), np.asarray(bottom, float)
    out = np.array([*(0.5 * (top + bottom))[:2], 0.0])
    out = out / np.linalg.norm(out) if np.linalg.norm(out) > 1e-6 else np.array([0.0, 1, 0])
    t = np.linspace(0, np.pi, 9)[:, None]
    middle, half = 0.5 * (top + bottom), 0.5 * (top - bottom)
    path = middle + half * np.cos(t) + reach * out * np.sin(t) ** 0.8
    return tube(path, radius, **rest)


def helix(radius: float, height: float, turns: float, thickness: float) -> Solid:
    """A coil about z from z = 0."""
    t = np.linspace(0, 1, max(12, int(12 * turns)))
    path = columns(radius * np.cos(TURN * turns * t), radius * np.sin(TURN * turns * t), height * t)
    return tube(path, thickness, sharp=True, sides=6, winds=True)


def hull(stations, *, square: float = 2.0, sharp: bool = False) -> Solid:
    """A body along x: `stations` (K, 4) of (x, half width, lowest z, highest z).

    Cross-sections are superellipses of exponent `square` (2 an ellipse, 4 and more boxy); ends that
    are not points are closed flat.
    """
    stations = np.asarray(stations, float)
    order = np.argsort(stations[:, 0], kind="stable")
    line, t = curve(stations[order], sharp)
    t = np.concatenate([[0], 0.02 + 0.96 * t, [1]])
    table = np.concatenate([line[:1], line, line[-1:]])
    table[[0, -1], 1] = 0
    table[[0, -1], 2:] = table[[0, -1], 2:].mean(1, keepdims=True)

    def surface(u, v):
        x, half, low, high = along(v, t, table).T
        c, s = np.cos(TURN * u), np.sin(TURN * u)
        reach = (np.abs(c) ** square + np.abs(s) ** square) ** (-1 / square)
        c, s = reach * c, reach * s
        return columns(x, half * c, 0.5 * (low + high) + 0.5 * (high - low) * s)

    xs = np.maximum.accumulate(line[:, 0]) + 1e-9 * np.arange(len(line))

    def inside(p):
        half, low, high = along(p[:, 0], xs, line[:, 1:]).T
        a = np.abs(p[:, 1]) / np.maximum(half, 1e-9)
        b = np.abs(2 * p[:, 2] - low - high) / np.maximum(high - low, 1e-9)
        return (p[:, 0] > xs[0]) & (p[:, 0] < xs[-1]) & (a**square + b**square < 1)

    inner = knots_of((t[1:-1] - 0.02) / 0.96, sharp)
    knots = np.concatenate([[0], 0.02 + 0.96 * inner, [1]])
    return Solid(surface, even(16 if square > 2.5 else 10), knots, inside)


def sheet(surface: Callable, thickness: float = 0.012, fine: tuple[int, int] = (6, 8)) -> Solid:
    """A thin closed skin around a surface `(u, v) -> (n, 3)`: cloth, a leaf, a petal."""

    def both_sides(u, v):
        flat, side = 1 - np.abs(2 * u - 1), np.where(u < 0.5, 1.0, -1.0)
        e = 1e-4
        du, dv = np.where(flat < 0.5, e, -e), np.where(v < 0.5, e, -e)
        p = surface(flat, v)
        a = (surface(flat + du, v) - p) / du[:, None]
        b = (surface(flat, v + dv) - p) / dv[:, None]
        normal = np.cross(a, b)
        normal /= np.sqrt((normal**2).sum(1, keepdims=True)) + 1e-12
        # Thins out towards its edges, so that the two sides meet.
        rise = 0.5 * thickness * np.minimum(1, 8 * flat * (1 - flat) * 2) ** 0.5
        rise = rise * np.minimum(1, 16 * v * (1 - v)) ** 0.5
        return p + (side * rise)[:, None] * normal

    return Solid(both_sides, even(2 * fine[0]), even(fine[1]), None)


def leaf(length: float, width: float, droop: float = 0.3, cup: float = 0.25) -> Solid:
    """A pointed leaf from the origin along +x, bending down by `droop` times its length, its sides
    raised by `cup` times its width.
    """

    def surface(u, v):
        across, body = 2 * u - 1, np.sin(np.pi * np.clip(v, 0, 1) ** 0.8)
        return columns(
            length * v,
            0.5 * width * body * across,
            -droop * length * v**2 + cup * width * across**2 * body,
        )

    return sheet(surface, 0.05 * width)


def petal(length: float, width: float, rise: float = 0.2, curl: float = 0.2) -> Solid:
    """A blunt petal from the origin along +x: first rising, its tip curling down."""

    def surface(u, v):
        across = 2 * u - 1
        spread = np.clip(v, 0, 1) ** 0.6 * np.sqrt(np.clip(1 - v**4, 0, 1)) + 0.12
        return columns(
            length * v,
            0.5 * width * spread * across,
            length * (rise * v - curl * v**3) + 0.12 * width * across**2,
        )

    return sheet(surface, 0.04 * width)


def spray(solid: Solid, angles, rises, *, place=(0, 0, 0), sizes=1.0) -> Solid:
    """Copies of a shape that points along +x (a leaf, a petal), each turned to the heading of
    `angles` (K,) and raised by `rises` (K,) [degrees], standing at `place`, (3,) or (K, 3).
    """
    angles = np.deg2rad(np.asarray(angles, float))
    rises = np.deg2rad(np.broadcast_to(rises, angles.shape).astype(float))
    ca, sa, cr, sr, zero = (
        np.cos(angles), np.sin(angles), np.cos(rises), np.sin(rises), np.zeros(len(angles)),
    )  # fmt: skip
    rows = [[ca * cr, -sa, -ca * sr], [sa * cr, ca, -sa * sr], [sr, zero, cr]]
    frames = np.moveaxis(np.array(rows), -1, 0)
    frames = frames * np.broadcast_to(sizes, angles.shape)[:, None, None]
    place = np.broadcast_to(np.asarray(place, float), (len(angles), 3))
    linear = frames[:, None] @ solid.linear[None]
    offset = (frames[:, None] @ solid.offset[None, :, :, None])[..., 0] + place[:, None]
    return replace(solid, linear=linear.reshape(-1, 3, 3), offset=offset.reshape(-1, 3))


GOLDEN = 137.508  # degrees from one leaf to the next


def golden(count: int) -> np.ndarray:
    """Headings [degrees] of `count` leaves or petals, none above another."""
    return GOLDEN * np.arange(count)
