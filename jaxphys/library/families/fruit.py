"""Fruit."""

import numpy as np

from jaxphys.library.families.common import (
    foliage,
    stalk,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import ripples
from jaxphys.library.patterns import (
    fading,
    lattice,
    mottled,
)
from jaxphys.library.shapes import (
    GOLDEN,
    ball,
    bend,
    cylinder,
    golden,
    lathe,
    plate,
    rounded,
    smooth,
    speck,
    tube,
)

# fmt: off
# ruff: noqa: E731


def on_lathe(profile, count: int, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and outward directions, (K, 3) each, over a smooth lathe between two heights."""
    line = smooth(profile, 200)
    widest = np.argsort(line[:, 1])
    z = low + (high - low) * (np.arange(count) + 0.5) / count
    # Evenly by area: heights follow the area below them.
    heights = np.linspace(low, high, 64)
    radius = np.interp(heights, line[widest, 1], line[widest, 0])
    below = np.cumsum(radius)
    z = np.interp((np.arange(count) + 0.5) / count, below / below[-1], heights)
    r = np.interp(z, line[widest, 1], line[widest, 0])
    slope = np.interp(z + 0.01, line[widest, 1], line[widest, 0]) - np.interp(z - 0.01,
        line[widest, 1], line[widest, 0])
    a = np.deg2rad(GOLDEN) * np.arange(count)
    places = np.stack([r * np.cos(a), r * np.sin(a), z], -1)
    return places, np.stack([np.cos(a), np.sin(a), -slope / 0.02], -1)


@kind("strawberry", "fruit", also=("ripe strawberry", "fresh strawberry"),
    colours=dict(flesh="red|dark red", seeds="cream|yellow", leaves="green|dark green",
        stalk="=leaves"),
    sizes=dict(leaves="small 0.7|1|large 1.3"),
    forms=dict(height="round 0.8|1|long 1.3"))
def strawberry(o, rng):
    wide = rng.uniform(0.37, 0.44) / o.height ** 0.4
    profile = np.array([(0, -0.5), (0.12, -0.46), (0.78 * wide, -0.2), (wide, 0.12),
        (0.82 * wide, 0.3), (0.3 * wide, 0.36), (0, 0.34)])
    profile[:, 1] *= o.height
    body = lathe(profile).shade(fading("z", 0.26 * o.height, 0.4 * o.height, 1, 1.12))
    places, up = on_lathe(profile, int(rng.integers(80, 110)), -0.46 * o.height, 0.27 * o.height)
    count = int(rng.integers(7, 10))
    angles = 360 / count * (np.arange(count) + 0.3 * rng.random(count))
    crown = foliage(0.36 * o.leaves, 0.17 * o.leaves, angles, rng.uniform(5, 22, count),
        (0, 0, 0.34 * o.height), 0.5)
    return dict(flesh=body, seeds=speck(0.014, 0.026, 0.011).copies(places, up), leaves=crown,
        stalk=stalk(0.33 * o.height))


@kind("apple", "fruit",
    colours=dict(skin="red|green|yellow", stalk="brown", leaf="green"),
    extras=dict(leaf=0.6))
def apple(o, rng):
    blush = ripples(rng, 1.2)
    body = lathe([(0, -0.33), (0.1, -0.4), (0.28, -0.35), (0.44, -0.05), (0.43, 0.18), (0.27, 0.36),
        (0.1, 0.34), (0, 0.24)])
    return dict(skin=body.shade(mottled(blush, 0.05)), stalk=stalk(0.22, 0.28),
        leaf=foliage(0.34, 0.18, [rng.uniform(0, 360)], 25, (0.02, 0, 0.38)) if o.leaf else [])


@kind("orange", "fruit", also=("orange fruit", "tangerine"),
    colours=dict(skin="orange", stalk="green", leaf="green"),
    extras=dict(leaf=0.5))
def orange(o, rng):
    fine = ripples(rng, 9)
    return dict(skin=ball(0.45, 0.45, 0.42).shade(mottled(fine, 0.035)),
        stalk=cylinder(0.05, 0.05).at(z=0.4),
        leaf=foliage(0.36, 0.18, [rng.uniform(0, 360)], 12, (0, 0, 0.43)) if o.leaf else [])


@kind("peach", "fruit", also=("apricot",),
    colours=dict(skin="orange|pink", blush="red", leaf="green", stalk="brown"))
def peach(o, rng):
    cleft = lathe([(0, -0.42), (0.22, -0.36), (0.42, -0.05), (0.4, 0.2), (0.2, 0.37), (0, 0.33)],
        outline=rounded([(np.cos(a) * (0.9 if k == 0 else 1), np.sin(a)) for k,
        a in enumerate(np.linspace(0, 2 * np.pi, 12, endpoint=False))], 64))
    wave = ripples(rng, 0.9)
    return dict(skin=cleft.coat("blush", lambda u, v, p: 0.35 + 0.4 * wave(p)),
        stalk=stalk(0.31, 0.12), leaf=foliage(0.4, 0.15, [20, 200], 15, (0, 0, 0.35)))


@kind("plum", "fruit", colours=dict(skin="purple|dark blue", stalk="brown", leaf="green"))
def plum(o, rng):
    return dict(skin=lathe([(0, -0.46), (0.2, -0.4), (0.36, 0), (0.24, 0.36), (0, 0.42)]),
        stalk=stalk(0.4, 0.2), leaf=foliage(0.34, 0.16, [30], 20, (0, 0, 0.46)))


@kind("tomato", "fruit", colours=dict(skin="red", leaves="green", stalk="green"))
def tomato(o, rng):
    body = lathe([(0, -0.34), (0.3, -0.3), (0.46, 0), (0.36, 0.28), (0.12, 0.33), (0, 0.27)],
        waves=(5, 0.03))
    return dict(skin=body, leaves=foliage(0.3, 0.08, 72 * np.arange(5) + 20, 18, (0, 0, 0.31),
        0.25), stalk=stalk(0.27, 0.2, 0.028))


@kind("cherry", "fruit", also=("pair of cherries", "cherries"),
    colours=dict(skin="red|dark red", stalk="green|brown", leaf="green"))
def cherry(o, rng):
    top = np.array([0, 0.05, 0.75])
    places = [(0.0, -0.26, 0.0), (0.05, 0.28, -0.06)]
    one = lathe([(0, -0.22), (0.15, -0.18), (0.235, 0.0), (0.17, 0.17), (0.05, 0.2), (0, 0.16)])
    stems = [tube(bend(np.add(p, (0, 0, 0.17)), (p[0], p[1] * 0.9, 0.6), top),
        0.02) for p in places]
    return dict(skin=one.copies(places), stalk=stems, leaf=foliage(0.42, 0.2, [60], 5, top, 0.3))


@kind("banana", "fruit", colours=dict(skin="yellow|light green", tips="dark brown"))
def banana(o, rng):
    a = np.linspace(-1.0, 1.0, 9)
    path = np.stack([0 * a, 0.55 * np.sin(a), 0.55 - 0.55 * np.cos(a)], -1)
    body = tube(path, [0.03, 0.055, 0.1, 0.12, 0.125, 0.12, 0.1, 0.045, 0.035], sides=10)
    return dict(skin=body.coat("tips", lambda u, v, p: np.abs(v - 0.5) > 0.465).shade(lambda u, v,
        p: 1 - 0.14 * (np.sin(2.5 * 2 * np.pi * u) ** 2 > 0.93)))


@kind("lemon", "fruit", colours=dict(skin="yellow", leaf="green"), extras=dict(leaf=0.4))
def lemon(o, rng):
    fine = ripples(rng, 9)
    body = lathe([(0, -0.5), (0.06, -0.46), (0.2, -0.34), (0.33, 0), (0.2, 0.34), (0.07, 0.45),
        (0, 0.5)]).turn("x", 90)
    return dict(skin=body.shade(mottled(fine, 0.035)),
        leaf=foliage(0.34, 0.16, [70], 30, (0, -0.46, 0.04)) if o.leaf else [])


@kind("lime", "fruit",
    colours=dict(skin="light green|green", leaf="dark green"),
    extras=dict(leaf=0.4))
def lime(o, rng):
    fine = ripples(rng, 9)
    body = lathe([(0, -0.46), (0.06, -0.43), (0.24, -0.32), (0.35, 0), (0.24, 0.32), (0.06, 0.43),
        (0, 0.46)]).turn("x", 90)
    return dict(skin=body.shade(mottled(fine, 0.035)),
        leaf=foliage(0.34, 0.16, [70], 30, (0, -0.44, 0.04)) if o.leaf else [])


@kind("pear", "fruit",
    colours=dict(skin="light green|yellow|green", stalk="brown", leaf="green"),
    extras=dict(leaf=0.7))
def pear(o, rng):
    body = lathe([(0, -0.44), (0.18, -0.45), (0.34, -0.22), (0.26, 0.08), (0.15, 0.3), (0.09, 0.42),
        (0, 0.44)])
    return dict(skin=body.shade(mottled(ripples(rng, 1.5), 0.04)), stalk=stalk(0.42, 0.18),
        leaf=foliage(0.28, 0.14, [60], 25, (0, 0, 0.48)) if o.leaf else [])


@kind("watermelon", "fruit", also=("whole watermelon",),
    colours=dict(rind="light green|green", stripes="dark green", stalk="brown"))
def watermelon(o, rng):
    wave = ripples(rng, 3.0)
    lines = lambda u, v, p: np.sin(9 * np.arctan2(p[:, 2], p[:, 0]) + 0.9 * wave(p)) > 0.1
    return dict(rind=ball(0.42, 0.5, 0.42).coat("stripes", lines),
        stalk=tube([(0, 0.48, 0.0), (0, 0.56, 0.03), (0.03, 0.6, 0.08)], 0.025))


@kind("slice of watermelon", "fruit", also=("watermelon slice",),
    colours=dict(flesh="red", rind="dark green|green", seeds="black"))
def watermelon_slice(o, rng):
    a = np.linspace(np.pi, 2 * np.pi, 40)
    outline = np.concatenate([np.stack([0.5 * np.cos(a), 0.5 * np.sin(a) + 0.2], -1),
        [(0.25, 0.2), (0, 0.2), (-0.25, 0.2)]])
    far = lambda p: np.hypot(p[:, 0], p[:, 1] - 0.2)
    spots = [(0.15 * (2 * k + 1 + j % 2) - 0.6, 0.06 - 0.13 * j,
        s * 0.1) for k in range(4) for j in range(3) for s in (-1, 1)]
    spots = [s for s in spots if np.hypot(s[0], s[1] - 0.2) < 0.4]
    body = plate(outline, 0.2).coat("cream", lambda u, v, p: far(p) > 0.435).coat("rind", lambda u,
        v, p: far(p) > 0.465)
    return dict(flesh=body, seeds=speck(0.016, 0.028,
        0.012).copies(spots).mapped(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])))


@kind("pineapple", "fruit", also=("ripe pineapple",),
    colours=dict(skin="golden|yellow", lines="brown", leaves="green"),
    sizes=dict(leaves="short 0.65|1|long 1.4"))
def pineapple(o, rng):
    body = lathe([(0, -0.5), (0.2, -0.47), (0.3, -0.15), (0.27, 0.15), (0.14, 0.3), (0, 0.3)])
    n = 24
    rises = np.linspace(20, 84, n)
    return dict(skin=body.coat("lines", lattice(7, 6, 0.25)),
        leaves=foliage(0.44 * o.leaves, 0.09, golden(n), rises, (0, 0, 0.27), 0.25,
        np.linspace(0.75, 1.05, n)))


@kind("bunch of grapes", "fruit", also=("grapes",),
    colours=dict(skin="purple|light green|dark red", stalk="brown", leaf="green"))
def grapes(o, rng):
    k = np.arange(36)
    level = k / 35
    r, a = 0.27 * (1 - level) ** 0.6 * (0.7 + 0.3 * (k % 2)), np.deg2rad(GOLDEN) * k
    places = np.stack([r * np.cos(a), r * np.sin(a), 0.3 - 0.75 * level], -1)
    return dict(skin=ball(0.1, fine=8).copies(places),
        stalk=tube([(0, 0, 0.3), (0, 0, 0.45), (0, 0.08, 0.55)], 0.022),
        leaf=foliage(0.34, 0.26, [290, 120], 8, (0, 0, 0.42)))


@kind("avocado", "fruit", also=("avocado half", "halved avocado"),
    colours=dict(flesh="light green|cream", skin="dark green|black", stone="brown|dark brown"))
def avocado(o, rng):
    outline = rounded([(0.0, -0.45), (0.3, -0.33), (0.34, -0.08), (0.2, 0.25), (0.1, 0.48),
        (-0.1, 0.48), (-0.2, 0.25), (-0.34, -0.08), (-0.3, -0.33)])
    cut = plate(0.93 * outline, 0.06).at(0.0)
    half = plate(outline, 0.5, puff=0.9)
    return dict(skin=half.scale(0.6, 1, 1).at(-0.13),
        flesh=cut.at(0.03).coat("yellow", lambda u, v,
        p: 0.6 * (np.hypot(p[:, 0], p[:, 1] + 0.12) < 0.24)),
        stone=ball(0.15, 0.165, 0.165).at(0.03, 0, -0.13))


@kind("coconut", "fruit", also=("coconut half",),
    colours=dict(shell="brown|dark brown", flesh="white"))
def coconut(o, rng):
    fine = ripples(rng, 8)
    bowl = lathe([(0, -0.42), (0.25, -0.35), (0.42, 0), (0.42, 0.02), (0.4, 0.02), (0.24, -0.3),
        (0, -0.37)]).shade(mottled(fine, 0.16))
    meat = lathe([(0, -0.39), (0.24, -0.32), (0.405, 0.0), (0.4, 0.035), (0.33, 0.035),
        (0.24, -0.2), (0, -0.28)])
    whole = ball(0.4).at(-0.5, -0.5, 0.02).shade(mottled(fine, 0.16))
    return dict(shell=[bowl.turn("y", 25).at(0.1, 0.2, 0), whole.at(0.15, -0.05, 0)],
        flesh=meat.turn("y", 25).at(0.1, 0.2, 0))
