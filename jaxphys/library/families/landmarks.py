"""Old and far buildings, and what stands beside a house."""

import numpy as np

from jaxphys.library.families.common import (
    gable,
    tiles,
)
from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cylinder,
    hull,
    lathe,
    oblong,
    plate,
    refined,
    ring,
    rod,
    side_plate,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731


@kind("tent", "buildings", also=("camping tent",),
    colours=dict(tent="orange|green|blue|yellow|red", door="dark grey|brown|beige",
        poles="brown|grey"),
    forms=dict(style="plain|striped"),
    sizes=dict(door="small 0.7|1|large 1.3"))
def tent(o, rng):
    front = refined([(0.42, -0.22), (0, 0.4), (-0.42, -0.22)])
    body = plate(front, 0.9).at(z=0.22)
    if o.style == "striped":
        body = body.coat("white", stripes(8, "z", 0.5))
    slit = plate(refined([(0.15, -0.14), (0, 0.26), (-0.15, -0.14)]) * o.door, 0.03).at(0.445, 0,
        0.14 * o.door)
    ropes = [rod((0.44, s * 0.3, 0.22), (0.62, s * 0.5, 0.0), 0.008) for s in (-1, 1)]
    return dict(tent=body, door=slit,
        poles=[rod((0.45, 0, 0.6), (0.45, 0, 0.68), 0.016),
        rod((-0.45, 0, 0.6), (-0.45, 0, 0.68), 0.016), *ropes])


@kind("igloo", "buildings", also=("snow house",),
    colours=dict(snow="white|light blue", lines="light grey|light blue", entrance="!dark blue"))
def igloo(o, rng):
    brick = lambda u, v, p: ((p[:,
        2] * 11) % 1 < 0.11) | ((u * 16 + 0.5 * (np.floor(p[:, 2] * 11) % 2)) % 1 < 0.06)
    dome = lathe([(0, 0), (0.48, 0), (0.46, 0.18), (0.34, 0.36), (0.16, 0.45),
        (0, 0.47)]).coat("lines", brick)
    arch = lathe([(0, -0.16), (0.2, -0.16), (0.2, 0.16), (0, 0.16)], sharp=True).turn("y",
        90).at(0.48, 0, 0.02)
    return dict(snow=[dome, arch.coat("lines", lambda u, v, p: (u * 14) % 1 < 0.08)],
        entrance=cylinder(0.14, 0.02).turn("y", 90).at(0.635, 0, 0.02))


@kind("pyramid", "buildings", also=("egyptian pyramid",),
    colours=dict(stones="beige|straw|golden", lines="light brown|brown", entrance="dark brown"))
def pyramid(o, rng):
    body = lathe([(0, 0), (1, 0), (0, 0.62)], sharp=True, outline=oblong(1.0, 1.0)).coat("lines",
        lambda u, v, p: 0.55 * (((p[:, 2] * 18) % 1 < 0.14)
        | ((u * 44 + 0.5 * (np.floor(p[:, 2] * 18) % 2)) % 1 < 0.07)))
    return dict(stones=body, entrance=block(0.1, 0.1, 0.13).at(0.42, 0, 0.065))


@kind("temple", "buildings", also=("greek temple",),
    colours=dict(columns="white|cream|stone", roof="=columns", base="=columns"),
    counts=dict(columns="4|6"))
def temple(o, rng):
    n = o.columns
    y = np.linspace(-0.38, 0.38, n)
    places = [(0.3, a, 0.1) for a in y] + [(-0.3, a, 0.1) for a in y] + [(x, s * 0.38,
        0.1) for x in (-0.1, 0.1) for s in (-1, 1)]
    flute = cylinder(0.05, 0.4, 0.042).shade(lambda u, v,
        p: 0.9 + 0.1 * np.cos(2 * np.pi * 14 * u)).copies(places)
    cap = block(0.12, 0.12, 0.035).copies([(a, b, 0.51) for a, b, _ in places])
    return dict(columns=[flute, cap, block(0.42, 0.56, 0.4).at(-0.06, 0, 0.3)],
        roof=[block(0.8, 0.96, 0.07).at(z=0.56), gable(0.76, 0.9, 0.22, 0.04).at(z=0.59)],
        base=[block(0.84, 1.0, 0.05).at(z=0.075), block(0.94, 1.1, 0.05).at(z=0.025)])


@kind("pagoda", "buildings", also=("japanese pagoda", "temple tower"),
    colours=dict(walls="red|white|brown", roofs="dark grey|green|blue", spire="golden"),
    counts=dict(roofs="3|4|5"))
def pagoda(o, rng):
    n = o.roofs
    parts = dict(walls=[], roofs=[], spire=[])
    for k in range(n):
        w, z = 0.46 - 0.28 * k / n, 0.2 * k
        parts["walls"].append(block(w, w, 0.17).at(z=z + 0.06).coat("cream", lambda u, v,
            p: (np.abs(p[:, 2]) < 0.04) & (np.minimum(np.abs((p[:, 0] * 9) % 1 - 0.5),
            np.abs((p[:, 1] * 9) % 1 - 0.5)) < 0.25)))
        parts["roofs"].append(lathe([(0, 0.13), (1.02, 0.12), (0.98, 0.155), (0.7, 0.165),
            (0.5, 0.2), (0, 0.24)], outline=oblong(w + 0.26, w + 0.26)).at(z=z))
    z = 0.2 * n + 0.02
    parts["spire"] = [rod((0, 0, z), (0, 0, z + 0.24), 0.018, 0.005), ball(0.035).at(z=z + 0.07),
        ring(0.035, 0.012).copies([(0, 0, z + 0.12), (0, 0, z + 0.16)])]
    return parts


@kind("bridge", "buildings", also=("stone bridge", "arch bridge"),
    colours=dict(stones="stone|grey|brick|beige", road="dark grey|light brown", railing="=stones"),
    counts=dict(arches="1|2|3"))
def bridge(o, rng):
    n = o.arches
    span = 1.0 / n
    t = np.linspace(0, np.pi, 12)
    deck = lambda x: 0.34 + 0.08 * np.cos(np.pi * x)
    parts = []
    for k in range(n):
        for s in (-1, 1):
            a = span * (k + 0.5) - 0.5
            r = 0.36 * span
            side = a + s * 0.5 * span
            arc = np.stack([a + s * r * np.sin(t / 2), np.minimum(r, 0.27) * np.cos(t / 2)], -1)
            outline = np.concatenate([arc,
                [(side, 0), (side, 0.5 * deck(side)), (side, deck(side)),
                (0.5 * (side + a), deck(0.5 * (side + a))), (a, deck(a))]])
            mid = np.array([0.62 * side + 0.38 * a, 0.78 * deck(side)])
            parts.append(side_plate(refined(outline, 2) - mid, 0.3).at(mid[0], 0, mid[1]))
    x = np.linspace(-0.5, 0.5, 12)
    road = hull([(a, 0.15, deck(a) - 0.01, deck(a) + 0.035) for a in x], square=8)
    rail = tube([(a, 0.145, deck(a) + 0.09) for a in np.linspace(-0.52, 0.52, 7)], 0.022)
    posts = rod((0, 0.145, 0), (0, 0.145, 0.12), 0.016).copies([(a, 0, deck(a)) for a in x])
    return each(dict(stones=[s.shade(lambda u, v,
        p: 1 - 0.1 * (((p[:, 1] * 16) % 1 < 0.14)
        | ((p[:, 0] * 11 + 0.5 * np.floor(p[:, 1] * 16)) % 1 < 0.09))) for s in parts], road=road,
        railing=[rail.both(), posts.both()], arches=[]), lambda s: s.turn("z", 90))


@kind("well", "buildings", also=("wishing well", "water well"),
    colours=dict(stones="stone|grey|brick", roof="red|brown", posts="wooden|brown",
        bucket="brown|silver", water="blue"))
def well(o, rng):
    wall = lathe([(0.3, 0), (0.36, 0), (0.36, 0.3), (0.28, 0.3), (0.28, 0.02), (0.3, 0)],
        sharp=True).shade(lambda u, v,
        p: 1 - 0.2 * (((p[:, 2] * 13) % 1 < 0.13)
        | ((u * 18 + 0.5 * np.floor(p[:, 2] * 13)) % 1 < 0.08)))
    return dict(stones=wall, water=cylinder(0.29, 0.02).at(z=0.1),
        posts=[block(0.06, 0.06, 0.72).at(0, 0.31, 0.38).both(),
        rod((0, -0.34, 0.56), (0, 0.34, 0.56), 0.03),
        rod((0, 0.34, 0.56), (0.1, 0.4, 0.56), 0.018)],
        roof=gable(0.5, 0.76, 0.3, 0.05).turn("z", 90).at(z=0.72).shade(tiles(14)),
        bucket=[cylinder(0.065, 0.12, 0.08).at(0, 0, 0.3)],
        brown=rod((0, 0, 0.42), (0, 0, 0.56), 0.008))


@kind("fence", "buildings", also=("picket fence", "garden fence"),
    colours=dict(planks="white|brown|wooden", rails="=planks"),
    counts=dict(planks="5|6|7|8"))
def fence(o, rng):
    n = o.planks
    y = np.linspace(-0.5 + 0.5 / n, 0.5 - 0.5 / n, n)
    plank = plate(refined([(0.32 / n, -0.26), (0.32 / n, 0.2), (0, 0.29), (-0.32 / n, 0.2),
        (-0.32 / n, -0.26)]), 0.03)
    return dict(planks=plank.copies(np.stack([0 * y, y, 0 * y + 0.26], -1)),
        rails=block(0.03, 1.0, 0.06).copies([(-0.025, 0, 0.14), (-0.025, 0, 0.36)]))
