"""Where paint goes: functions of (u, v, points) in a solid's frame, for `Solid.coat` and `shade`.

`u` runs around lathes, tubes and balls, `v` along them (from the bottom up for balls; along the
profile for lathes).
"""

import numpy as np

from jaxphys.library.palette import golden_directions

AXIS = {"x": 0, "y": 1, "z": 2}


def above(axis: str, level: float, soft: float = 0.004):
    """Beyond `level` along an axis, fading in over `soft`."""
    return lambda u, v, p: (p[:, AXIS[axis]] - level) / soft + 0.5


def below(axis: str, level: float, soft: float = 0.004):
    return lambda u, v, p: (level - p[:, AXIS[axis]]) / soft + 0.5


def between(axis: str, low: float, high: float):
    """A band across an axis."""
    return lambda u, v, p: (p[:, AXIS[axis]] > low) & (p[:, AXIS[axis]] < high)


def within(x=None, y=None, z=None):
    """In a box: each axis a pair (low, high) or None."""
    limits = [(i, *pair) for i, pair in enumerate((x, y, z)) if pair is not None]

    def where(u, v, p):
        inside = np.ones(len(p), bool)
        for i, low, high in limits:
            inside &= (p[:, i] > low) & (p[:, i] < high)
        return inside

    return where


def near(places, radius: float, squash=(1.0, 1.0, 1.0)):
    """Spots about `places` (K, 3) or (3,)."""
    places, squash = np.atleast_2d(np.asarray(places, float)), np.asarray(squash, float)

    def where(u, v, p):
        off = (p[:, None] - places) / squash
        return ((off**2).sum(-1) < radius**2).any(1)

    return where


def stripes(count: float, axis: str = "z", share: float = 0.5, phase: float = 0.0):
    """`count` stripes a unit of length across an axis, covering `share`."""
    return lambda u, v, p: (p[:, AXIS[axis]] * count + phase) % 1 < share


def sectors(count: int, share: float = 0.5):
    """Segments around, as of a beach ball."""
    return lambda u, v, p: (u * count) % 1 < share


def dots(count: int, radius: float, centre=(0, 0, 0)):
    """Round spots of an angular radius [rad], spread over all directions from `centre`."""
    directions, least = golden_directions(count), np.cos(radius)

    def where(u, v, p):
        unit = p - centre
        unit = unit / (np.sqrt((unit**2).sum(1, keepdims=True)) + 1e-9)
        return (unit @ directions.T).max(1) > least

    return where


def checks(count_u: int, count_v: int):
    """A chessboard of so many squares around and along."""
    return lambda u, v, p: (np.floor(u * count_u) + np.floor(v * count_v)) % 2


def lattice(count_u: int, count_v: int, share: float = 0.3):
    """Crossing diagonal lines, as of a waffle."""

    def where(u, v, p):
        one, two = (count_u * u + count_v * v) % 1, (count_u * u - count_v * v) % 1
        return np.minimum(np.abs(one - 0.5), np.abs(two - 0.5)) < 0.5 * share

    return where


def panes(axis_a: str, axis_b: str, count_a: float, count_b: float, share: float = 0.6):
    """Rectangles in rows, `count` a unit of length along two axes: windows, tiles."""
    a, b = AXIS[axis_a], AXIS[axis_b]

    def where(u, v, p):
        first = np.abs((p[:, a] * count_a) % 1 - 0.5) < 0.5 * share
        return first & (np.abs((p[:, b] * count_b) % 1 - 0.5) < 0.5 * share)

    return where


def either(*wheres):
    """Where any of them is."""
    return lambda u, v, p: np.any([np.asarray(w(u, v, p), float) > 0.5 for w in wheres], 0)


def also(*wheres):
    """Where all of them are."""
    return lambda u, v, p: np.all([np.asarray(w(u, v, p), float) > 0.5 for w in wheres], 0)


def mottled(wave, depth: float = 0.08):
    """Lighter and darker by a smooth random function of points, for `shade`."""
    return lambda u, v, p: 1 + depth * wave(p)


def fading(axis: str, low: float, high: float, start: float, end: float):
    """A factor from `start` at `low` to `end` at `high`, for `shade`."""

    def where(u, v, p):
        share = np.clip((p[:, AXIS[axis]] - low) / (high - low), 0, 1)
        return start + share * (end - start)

    return where


STYLES = {"striped": "stripes", "dotted": "dots", "checked": "checks"}


def patterned(solid, style: str, size: float = 1.0, axis: str = "z"):
    """A solid with a coat of the part "pattern" in one of `STYLES`; other styles leave it plain."""
    if style == "striped":
        return solid.coat("pattern", stripes(6 / size, axis, 0.45))
    if style == "dotted":
        return solid.coat("pattern", dots(48, 0.13, (0, 0, 0.4 * size)))
    if style == "checked":
        return solid.coat("pattern", checks(12, 10))
    return solid
