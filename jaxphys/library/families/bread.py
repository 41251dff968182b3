"""Bread and what is made of it."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.palette import ripples
from jaxphys.library.patterns import (
    mottled,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cushion,
    hull,
    plate,
    refined,
    rounded,
    slab,
    smooth,
    speck,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731


@kind("loaf of bread", "food", also=("bread", "bread loaf"),
    colours=dict(crust="light brown|brown|golden", cuts="cream"))
def bread(o, rng):
    lines = lambda u, v, p: (np.cos(2 * np.pi * (4.2 * p[:, 1] + 0.9 * p[:, 0])) > 0.85) & (p[:,
        2] > 0.1)
    return dict(crust=cushion(0.46, 1.0, 0.38, 2.6).coat("cuts",
        lines).shade(mottled(ripples(rng, 3), 0.04)))


@kind("slice of bread", "food", also=("toast", "slice of toast", "piece of toast"),
    colours=dict(crumb="cream|beige", crust="brown|light brown", butter="yellow"),
    extras=dict(butter=0.35))
def toast(o, rng):
    outline = rounded([(0.32, -0.4), (0.34, 0.1), (0.42, 0.22), (0.36, 0.4), (0.15, 0.45),
        (-0.15, 0.45), (-0.36, 0.4), (-0.42, 0.22), (-0.34, 0.1), (-0.32, -0.4), (0, -0.42)], 72)
    rim = lambda u, v, p: np.abs(v - 0.5) < 0.17
    return dict(crumb=plate(outline, 0.14).coat("crust", rim).shade(mottled(ripples(rng, 7), 0.04)),
        butter=block(0.06, 0.22, 0.2, 0.02).turn("x", 12).at(0.09, 0, 0.02) if o.butter else [])


@kind("baguette", "food", also=("french bread",),
    colours=dict(crust="light brown|golden|brown", cuts="cream"))
def baguette(o, rng):
    lines = lambda u, v, p: (np.cos(2 * np.pi * (4.5 * p[:, 0] + 2.2 * p[:, 1])) > 0.72) & (p[:,
        2] > 0.045)
    return dict(crust=hull([(-0.6, 0.02, 0.02, 0.06), (-0.48, 0.085, -0.06, 0.1),
        (0, 0.11, -0.075, 0.12), (0.48, 0.085, -0.06, 0.1), (0.6, 0.02, 0.02, 0.06)]).coat("cuts",
        lines).turn("z", 65))


@kind("croissant", "food", colours=dict(dough="golden|light brown", ridges="brown"))
def croissant(o, rng):
    a = np.linspace(-1.25, 1.25, 11)
    path = np.stack([0.5 * np.cos(a) - 0.3, 0.46 * np.sin(a), 0.04 * np.cos(a)], -1)
    r = 0.035 + 0.16 * np.cos(a / 1.25 * np.pi / 2) ** 0.8
    steps = [tube(path[k:k + 3] , [r[k] * (0.92), r[k + 1] * 1.1, r[k + 2] * 0.92],
        sides=10) for k in range(0, 9, 1)]
    return dict(dough=[s.coat("ridges", lambda u, v, p: np.abs(v - 0.5) > 0.4) for s in steps])


@kind("pretzel", "food", colours=dict(dough="brown|light brown", salt="white"))
def pretzel(o, rng):
    points = [(0.12, -0.3), (0.02, -0.12), (-0.16, 0.12), (-0.34, 0.3), (-0.46, 0.12),
        (-0.38, -0.18), (-0.14, -0.36), (0.14, -0.36), (0.38, -0.18), (0.46, 0.12), (0.34, 0.3),
        (0.16, 0.12), (-0.02, -0.12), (-0.12, -0.3)]
    path = np.array([(0.03 * np.sin(k), y, z) for k, (y, z) in enumerate(points)])
    path[4:10, 1:] *= 1.0
    line = smooth(np.concatenate([path]), 60)
    n = 40
    at = rng.integers(4, 56, n)
    up = np.stack([np.ones(n), rng.normal(0, 0.5, n), rng.normal(0, 0.5, n)], -1)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    return dict(dough=tube(line, np.interp(np.arange(60), [0, 30, 59], [0.055, 0.085, 0.055]),
        sharp=True, sides=9), salt=speck(0.014).copies(line[at] + 0.075 * up))


@kind("piece of cheese", "food", also=("cheese", "wedge of cheese"),
    colours=dict(cheese="yellow|golden", holes="!golden"))
def cheese(o, rng):
    wedge = refined([(0.5, 0), (-0.4, 0.38), (-0.46, 0), (-0.4, -0.38)], 6)
    spots = np.concatenate([rng.uniform((-0.4, -0.3, -0.2), (0.3, 0.3, 0.2), (60, 3))])
    sizes = rng.uniform(0.03, 0.075, 60)
    holes = lambda u, v, p: (np.sqrt(((p[:, None] - spots) ** 2).sum(-1)) - sizes).min(1) < 0
    return each(dict(cheese=slab(wedge, 0.46).coat("holes", holes)), lambda s: s.turn("z", 40))


@kind("sandwich", "food",
    colours=dict(bread="cream|light brown", lettuce="green|light green", ham="pink",
        cheese="yellow", tomato="red"),
    counts=dict(slices="2|3"),
    extras=dict(tomato=0.4, cheese=0.8))
def sandwich(o, rng):
    tri = refined([(0.42, 0.42), (-0.42, 0.42), (-0.0, -0.1), (0.42, -0.42)][:2] + [(-0.42, 0.42),
        (0.42, -0.42)][1:], 8)
    tri = tri - tri.mean(0)
    parts, level = dict(bread=[], lettuce=[], ham=[], cheese=[], tomato=[], slices=[]), 0.0
    for k in range(o.slices):
        parts["bread"].append(slab(tri, 0.12, edge=0.02).coat("light brown", lambda u, v,
            p: (np.abs(v - 0.5) < 0.12) & (p[:, 0] + p[:, 1] > 0.12)).at(z=level + 0.06))
        level += 0.12
        if k == o.slices - 1:
            break
        fills = [("lettuce", 0.035, 1.1),
            ("ham", 0.04, 1.05)] + [("cheese", 0.03, 1.08)] * o.cheese + [("tomato", 0.045,
            1.0)] * o.tomato
        for name, h, wide in fills:
            line = wide * tri * (1 + 0.025
                * np.sin(np.arange(len(tri)) * (2.1 if name == "lettuce" else 0.7)))[:, None]
            parts[name].append(slab(line, h).at(z=level + 0.5 * h))
            level += h
    return each(parts, lambda s: s.turn("z", 45))


@kind("taco", "food",
    colours=dict(shell="golden|yellow", lettuce="green|light green", meat="brown", tomato="red",
        cheese="yellow"))
def taco(o, rng):
    a = np.linspace(0, np.pi, 24)
    half = np.concatenate([np.stack([0.5 * np.cos(a), 0.42 * np.sin(a)], -1),
        [(-0.25, 0), (0, 0), (0.25, 0)]]) - (0, 0.16)
    shell = plate(half * (1, -1), 0.035).at(z=-0.16)
    inner = plate(half * (0.92, -0.85), 0.16, puff=0.6).at(z=-0.13)
    y = np.linspace(-0.4, 0.4, 12)
    bits = lambda k, s: block(s, s, s, 0.01).turn((1, 1, 0.3),
        40).copies(np.stack([rng.uniform(-0.05, 0.05, k), rng.uniform(-0.36, 0.36, k),
        rng.uniform(0.02, 0.08, k)], -1))
    return dict(shell=[shell.turn("y", s * 13).at(x=s * 0.07) for s in (-1, 1)], meat=inner,
        lettuce=ball(0.05, 0.07, 0.045).copies(np.stack([0.05 * np.sin(7 * y), y,
        0.03 - 0.2 * y**2], -1)), tomato=bits(9, 0.075), cheese=bits(9, 0.05))
