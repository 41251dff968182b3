"""Vegetables."""

import numpy as np

from jaxphys.library.families.common import (
    foliage,
    stalk,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions, ripples
from jaxphys.library.patterns import (
    mottled,
)
from jaxphys.library.shapes import (
    ball,
    cone,
    cylinder,
    golden,
    hull,
    lathe,
    limb,
    petal,
    sheet,
    speck,
    tube,
)

# fmt: off
# ruff: noqa: E731


@kind("carrot", "vegetables",
    colours=dict(root="orange", leaves="green|dark green", rings="!brown"),
    sizes=dict(leaves="short 0.6|1|long 1.5"))
def carrot(o, rng):
    lines = lambda u, v, p: (np.sin(62 * p[:, 2] + 4 * np.sin(2 * np.pi * u)) > 0.94) * 0.4
    root = lathe([(0, -0.6), (0.03, -0.55), (0.1, -0.2), (0.16, 0.2), (0.12, 0.28),
        (0, 0.27)]).coat("rings", lines)
    n = 12
    return dict(root=root, leaves=foliage(0.42 * o.leaves, 0.12, golden(n), rng.uniform(55, 85, n),
        (0, 0, 0.25), 0.2))


@kind("pumpkin", "vegetables", colours=dict(skin="orange", stalk="green|brown"))
def pumpkin(o, rng):
    n = int(rng.integers(9, 12))
    ribs = lathe([(0, -0.27), (0.25, -0.33), (0.46, -0.1), (0.46, 0.1), (0.25, 0.31), (0, 0.23)],
        outline=np.stack([(0.9 + 0.12
        * np.abs(np.sin(0.5 * n * (a := np.linspace(0, 2 * np.pi, 8 * n, endpoint=False))))) * f(a)
        for f in (np.cos, np.sin)], -1))
    return dict(skin=ribs.shade(lambda u, v,
        p: 0.78 + 0.25 * np.minimum(1, 1.6 * np.abs(np.sin(np.pi * n * u)))),
        stalk=tube([(0, 0, 0.2), (0, 0.02, 0.36), (0.05, 0.08, 0.46)], [0.08, 0.05, 0.05]))


@kind("corn", "vegetables", also=("corn cob", "ear of corn"),
    colours=dict(kernels="yellow|golden", husk="light green|green"))
def corn(o, rng):
    rows = 14
    z = np.repeat(np.linspace(-0.42, 0.46, 24), rows)
    r = 0.15 * np.sqrt(np.clip(1 - (np.maximum(z, 0) / 0.52) ** 2.5, 0.02, 1))
    a = np.tile(2 * np.pi * np.arange(rows) / rows, 24) + 0.2 * np.repeat(np.arange(24) % 2, rows)
    places = np.stack([r * np.cos(a), r * np.sin(a), z], -1)
    grain = speck(0.038, 0.026, 0.022).copies(places, np.stack([np.cos(a), np.sin(a), 0 * a], -1),
        spin=np.full(len(a), np.pi / 2))
    core = lathe([(0, -0.5), (0.14, -0.45), (0.15, 0), (0.12, 0.3), (0.05, 0.48), (0, 0.5)])
    husk = [petal(0.8, 0.34, 0.12, 0.3).turn("y", -68).at(0.05, 0, -0.52).turn("z", a) for a in (80,
        200, 320)]
    return dict(kernels=[core.shade(lambda u, v, p: 0.8), grain],
        husk=[*husk, cylinder(0.07, 0.12, 0.12).at(z=-0.6)])


@kind("broccoli", "vegetables", colours=dict(florets="dark green|green", stem="light green"))
def broccoli(o, rng):
    d = golden_directions(34)
    d = d[d[:, 2] > -0.35]
    rough = ripples(rng, 7)
    heads = ball(0.15).shade(mottled(rough, 0.16)).copies(d * (0.32, 0.32, 0.24) + (0, 0, 0.3))
    buds = speck(0.032).copies(golden_directions(260)[:170] * (0.47, 0.47, 0.39) + (0, 0, 0.3))
    stems = [limb((0, 0, -0.05), (0.2 * np.cos(a), 0.2 * np.sin(a), 0.2), 0.09, 0.07) for a in (0.3,
        1.9, 3.4, 5)]
    return dict(florets=[heads, buds],
        stem=[lathe([(0, -0.42), (0.13, -0.42), (0.11, -0.1), (0.16, 0.1), (0, 0.2)]), *stems])


@kind("bell pepper", "vegetables", also=("pepper",),
    colours=dict(skin="red|green|yellow|orange", stalk="green"))
def bell_pepper(o, rng):
    body = lathe([(0, -0.34), (0.15, -0.4), (0.27, -0.32), (0.37, 0.1), (0.33, 0.3), (0.15, 0.36),
        (0, 0.26)], waves=(4, 0.07))
    return dict(skin=body, stalk=[tube([(0, 0, 0.26), (0, 0.01, 0.42), (0.05, 0.04, 0.52)],
        [0.05, 0.04, 0.05]), cone(0.13, 0.06).at(z=0.28)])


@kind("chili pepper", "vegetables", also=("chilli", "hot pepper"),
    colours=dict(skin="red|green", stalk="green"))
def chili(o, rng):
    path = [(0, -0.5, -0.02), (0, -0.25, 0.06), (0, 0.05, 0.1), (0, 0.3, 0.03), (0, 0.48, -0.1)]
    return dict(skin=tube(path, [0.1, 0.115, 0.1, 0.065, 0.006], sides=10),
        stalk=[tube([(0, -0.5, -0.02), (0, -0.6, -0.03), (0, -0.7, 0.05)], [0.05, 0.028, 0.03]),
        ball(0.08, 0.05, 0.08).at(0, -0.5, -0.02)])


@kind("eggplant", "vegetables", also=("aubergine",),
    colours=dict(skin="purple|dark blue", leaves="green", stalk="=leaves"))
def eggplant(o, rng):
    body = lathe([(0, -0.5), (0.2, -0.44), (0.26, -0.2), (0.2, 0.12), (0.13, 0.33), (0, 0.4)])
    return dict(skin=body, leaves=[foliage(0.3, 0.16, 72 * np.arange(5), -42, (0, 0, 0.38), 0.1),
        cone(0.13, 0.1).at(z=0.34)], stalk=stalk(0.4, 0.18, 0.04))


@kind("onion", "vegetables", colours=dict(skin="light brown|purple|white", roots="beige"))
def onion(o, rng):
    body = lathe([(0, -0.33), (0.25, -0.28), (0.4, 0), (0.25, 0.26), (0.07, 0.38), (0.03, 0.55),
        (0, 0.56)])
    root = foliage(0.12, 0.02, golden(14), -50, (0, 0, -0.32), 0.2)
    return dict(skin=body.shade(lambda u, v,
        p: 1 - 0.14 * (np.sin(2 * np.pi * 14 * u + 2 * np.sin(5 * v)) > 0.75)), roots=root)


@kind("potato", "vegetables", colours=dict(skin="light brown|beige|brown", eyes="brown"))
def potato(o, rng):
    rough = ripples(rng, 1.3)
    body = hull([(-0.5, 0.05, -0.1, 0.1), (-0.3, 0.26, -0.22, 0.22), (0.05, 0.3, -0.26, 0.25),
        (0.35, 0.24, -0.2, 0.24), (0.5, 0.06, -0.05, 0.1)]).turn("z", 90)
    spots = golden_directions(14) * (0.28, 0.42, 0.24)
    return dict(skin=body.shade(mottled(rough, 0.06)),
        eyes=speck(0.035, 0.022, 0.02).copies(spots, spots))


@kind("peas", "vegetables", also=("pea pod", "peas in a pod"),
    colours=dict(peas="light green|green", pod="green"))
def peas(o, rng):
    y = np.linspace(-0.32, 0.32, 6)
    shell = [sheet(lambda u, v,
        s=s: np.stack([0.16 * np.sin(np.pi * v) * s * np.sin(0.5 * np.pi * u) + 0 * u, v - 0.5,
        -0.13 * np.sin(np.pi * v) * np.cos(0.5 * np.pi * u)], -1), 0.025) for s in (-1, 1)]
    return dict(peas=ball(0.095).copies(np.stack([0 * y, y, 0.0 - 0.1 * y**2], -1),
        sizes=1 - 1.1 * np.abs(y) ** 1.5),
        pod=[*shell, tube([(0, 0.48, 0), (0, 0.58, 0.02), (0, 0.62, 0.06)], 0.02)])
