"""Buildings and what stands beside them; the door faces +x."""

import numpy as np

from experiments.priors.models.kinds import kind
from experiments.priors.models.palette import ripples
from experiments.priors.models.patterns import (
    below,
    mottled,
    panes,
    stripes,
)
from experiments.priors.models.shapes import (
    ball,
    block,
    cone,
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
from experiments.priors.models.solids import Solid, each

# fmt: off


def gable(length: float, width: float, rise: float, over: float = 0.05) -> Solid:
    """A saddle roof along x standing on z = 0."""
    w = 0.5 * width + over
    return plate(refined([(w, -rise / 3), (0, 2 * rise / 3), (-w, -rise / 3)]), length + 2 * over).at(z=rise / 3)


def tiles(size: float = 16):
    return lambda u, v, p: 1 - 0.16 * ((p[:, 0] * size + p[:, 2] * size) % 1 < 0.12) - 0.1 * ((p[:, 2] * size) % 1 < 0.2)


def door(x: float, y: float, width: float, height: float, z: float = 0.0) -> Solid:
    return block(0.03, width, height).at(x, y, z + 0.5 * height)


def battlements(radius: float, z: float, count: int, size: float) -> Solid:
    return block(0.6 * size, size, size).at(radius, 0, z + 0.5 * size).around(count)


@kind("house", "buildings", also=("cottage", "small house", "home"), colours=dict(walls="white|cream|yellow|light blue|brick", roof="red|brown|dark grey", door="brown|red|blue|green", windows="light blue|dark blue", chimney="brick|grey", frames="!white"), sizes=dict(roof="flat 0.6|1|steep 1.5", chimney="short 0.7|1|tall 1.7"), counts=dict(floors="1|2"), extras=dict(chimney=0.7))
def house(o, rng):
    w, h, rise = 0.7, 0.3 * o.floors + 0.08, 0.34 * o.roof
    body = block(0.6, w, h).at(z=0.5 * h)
    front = plate(refined([(0.5 * w, -rise / 3), (0, 2 * rise / 3), (-0.5 * w, -rise / 3)]), 0.6).at(z=h + rise / 3)
    spots = [(0.3, y, 0.2 + 0.3 * k) for k in range(o.floors) for y in ((-0.22, 0.22) if k == 0 else (-0.22, 0, 0.22))]
    side = [(x, 0.35, 0.2 + 0.3 * k) for k in range(o.floors) for x in (-0.15, 0.15)]
    pane, rim = block(0.03, 0.12, 0.13), block(0.02, 0.15, 0.16)
    return dict(walls=[body, front], roof=gable(0.6, w, rise * 1.12).at(z=h - 0.01).shade(tiles()), door=door(0.3, 0, 0.14, 0.25), windows=[pane.copies(spots), pane.turn("z", 90).copies(side).both()], frames=[rim.copies(spots), rim.turn("z", 90).copies(side).both()],
                chimney=block(0.1, 0.1, 0.3 * o.chimney).at(-0.12, 0.2, h + 0.62 * rise + 0.05 * o.chimney) if o.chimney else [], golden=ball(0.012).at(0.32, 0.05, 0.12))


@kind("barn", "buildings", also=("red barn", "farm barn"), colours=dict(walls="red|brown", roof="dark grey|grey|brown", door="white|red", trim="white"))
def barn(o, rng):
    arch = refined([(0.36, -0.3), (0.36, 0.08), (0.25, 0.27), (0, 0.36), (-0.25, 0.27), (-0.36, 0.08), (-0.36, -0.3)])
    body = plate(arch, 0.84).at(z=0.3).coat("trim", lambda u, v, p: (np.abs(v - 0.5) > 0.17) & (np.abs(v - 0.5) < 0.2))
    lid = plate(arch * (1.13, 1.12), 0.76).coat("walls", below("y", -0.02)).at(z=0.3)
    cross = lambda u, v, p: (np.abs(np.abs(p[:, 1] / 0.16) - np.abs(p[:, 2] / 0.17)) < 0.13) | (np.abs(p[:, 1]) > 0.14) | (np.abs(p[:, 2]) > 0.15)  # noqa: E731
    return dict(walls=body.shade(lambda u, v, p: 1 - 0.08 * ((p[:, 0] * 14) % 1 < 0.1)), roof=lid, door=block(0.03, 0.34, 0.36).at(0.42, 0, 0.18).coat("walls", lambda u, v, p: ~cross(u, v, p)), trim=block(0.02, 0.14, 0.14).at(0.42, 0, 0.5))


@kind("castle", "buildings", also=("fortress", "fairytale castle"), colours=dict(walls="stone|light grey|grey|beige", roofs="blue|red|purple", gate="brown|wooden", flags="red|yellow|blue", windows="!dark grey"), counts=dict(towers="2|4"), sizes=dict(towers="short 0.8|1|tall 1.35"))
def castle(o, rng):
    h = 0.55 * rng.uniform(0.9, 1.1)
    places = [(0.3, 0.34), (0.3, -0.34), (-0.3, 0.34), (-0.3, -0.34)][: max(2, int(o.towers))]
    spots = [(x, y, 0) for x, y in places]
    body = [block(0.56, 0.62, 0.34).at(z=0.17), block(0.3, 0.34, 0.62).at(-0.05, 0, 0.31)]
    tower = [cylinder(0.13, h).copies(spots), cylinder(0.15, 0.07).copies([(x, y, h - 0.02) for x, y in places])]
    teeth = [block(0.06, 0.06, 0.06).copies([(0.27, y, 0.37) for y in np.linspace(-0.24, 0.24, 5)]), block(0.06, 0.06, 0.06).copies([(-0.05 + x, y, 0.65) for x, y in ((0.12, 0.14), (0.12, -0.14), (-0.12, 0.14), (-0.12, -0.14), (0.12, 0), (-0.12, 0), (0, 0.14), (0, -0.14))])]
    wall = [s.shade(lambda u, v, p: 1 - 0.1 * (((p[:, 2] * 18) % 1 < 0.12) | ((p[:, 1] * 11 + 0.5 * np.floor(p[:, 2] * 18)) % 1 < 0.08))) for s in (*body, *tower)]
    tops = [(x, y, h + 0.05) for x, y in places]
    return dict(walls=[*wall, *teeth], roofs=[cone(0.17, 0.3).copies(tops)], gate=[block(0.05, 0.17, 0.17).at(0.28, 0, 0.085), cylinder(0.085, 0.05).turn("y", 90).at(0.255, 0, 0.17)], flags=[block(0.01, 0.12, 0.07).copies([(x, y + 0.07, z + 0.39) for x, y, z in tops])], brown=rod((0, 0, 0.28), (0, 0, 0.43), 0.01).copies(tops),
                windows=[block(0.03, 0.04, 0.1).copies([(x + 0.12 * np.sign(x), y, 0.62 * h) for x, y in places]), block(0.03, 0.05, 0.1).copies([(0.1, y, 0.5) for y in (-0.08, 0.08)])], towers=[])


@kind("lighthouse", "buildings", colours=dict(tower="white|red", stripes="red|blue|black", lamp="yellow", roof="red|black|dark grey", rock="stone|grey", door="brown|red", gallery="dark grey"), forms=dict(height="short 0.75|1|tall 1.25", style="*striped|plain"))
def lighthouse(o, rng):
    h = 0.95 * o.height
    tower = cylinder(0.17, h, 0.11).at(z=0.1)
    n = int(rng.integers(5, 8))
    if o.style == "striped":
        tower = tower.coat("stripes", lambda u, v, p: np.floor(p[:, 2] / h * n) % 2)
    rough = ripples(rng, 3)
    stone = lathe([(0, -0.08), (0.42, -0.08), (0.36, 0.04), (0.25, 0.12), (0, 0.14)], waves=(7, 0.08)).shade(mottled(rough, 0.1))
    t = 0.1 + h
    return dict(tower=tower, rock=stone, gallery=[cylinder(0.16, 0.03).at(z=t), ring(0.155, 0.01).at(z=t + 0.09), rod((0.155, 0, t), (0.155, 0, t + 0.09), 0.008).around(10), *[rod((0.085 * np.cos(a), 0.085 * np.sin(a), t), (0.085 * np.cos(a), 0.085 * np.sin(a), t + 0.16), 0.012) for a in np.pi / 3 * np.arange(6)]],
                lamp=cylinder(0.08, 0.16).at(z=t + 0.02), roof=[cone(0.13, 0.14).at(z=t + 0.17), ball(0.025).at(z=t + 0.32)], door=block(0.03, 0.1, 0.18, 0.0).at(0.165, 0, 0.2), light=[], **{"dark blue": block(0.03, 0.05, 0.08).copies([(0.15, 0, 0.1 + 0.45 * h), (0.135, 0, 0.1 + 0.72 * h)])})


@kind("windmill", "buildings", also=("dutch windmill",), colours=dict(tower="white|brick|beige|brown", cap="brown|red|dark grey", blades="white|wooden|brown", door="brown|green|blue", windows="light blue"), sizes=dict(blades="short 0.75|1|long 1.2"))
def windmill(o, rng):
    long = 0.46 * o.blades
    sail = [block(0.015, 0.13, long).at(0, 0.055, 0.06 + 0.5 * long).coat("brown", lambda u, v, p: ((p[:, 2] * 17) % 1 < 0.16) | ((p[:, 1] * 15) % 1 < 0.16)), block(0.03, 0.03, long + 0.05).at(0, 0, 0.5 * long)]
    turned = [s.turn("x", 20).around(4, "x").at(0.26, 0, 0.68) for s in sail]
    return dict(tower=lathe([(0, 0), (0.27, 0), (0.17, 0.62), (0, 0.62)], sharp=True), cap=lathe([(0, 0.6), (0.2, 0.6), (0.19, 0.66), (0.1, 0.78), (0, 0.8)]), blades=turned, door=block(0.05, 0.12, 0.2).at(0.25, 0, 0.1), windows=block(0.05, 0.08, 0.08).copies([(0.21, 0, 0.33), (0.185, 0, 0.48)]), brown=rod((0.1, 0, 0.68), (0.28, 0, 0.68), 0.03))


@kind("church", "buildings", also=("chapel",), colours=dict(walls="white|stone|beige|brick", roof="brown|red|dark grey", cross="golden|black", door="brown", windows="light blue|purple"), sizes=dict(tower="short 0.8|1|tall 1.25"))
def church(o, rng):
    t = 0.62 * o.tower
    glass = block(0.1, 0.03, 0.2, 0.02).copies([(x, 0.22, 0.22) for x in (-0.4, -0.2, 0.0)]).both()
    return dict(walls=[block(0.72, 0.42, 0.36).at(-0.15, 0, 0.18), plate(refined([(0.21, -0.09), (0, 0.18), (-0.21, -0.09)]), 0.72).at(-0.15, 0, 0.45), block(0.24, 0.24, t).at(0.28, 0, 0.5 * t)], roof=[gable(0.72, 0.42, 0.3, 0.03).at(-0.15, 0, 0.35).shade(tiles()), lathe([(0, 0), (1, 0), (0, 0.38)], sharp=True, outline=oblong(0.27, 0.27)).at(0.28, 0, t)],
                cross=[block(0.02, 0.025, 0.16).at(0.28, 0, t + 0.44), block(0.02, 0.1, 0.025).at(0.28, 0, t + 0.46)], door=[block(0.03, 0.11, 0.17).at(0.4, 0, 0.085), cylinder(0.055, 0.03).turn("y", 90).at(0.385, 0, 0.17)], windows=[glass, cylinder(0.05, 0.03).turn("y", 90).at(0.385, 0, 0.42)], tower=[])


@kind("skyscraper", "buildings", also=("office tower", "tall building"), colours=dict(walls="grey|light grey|light blue|dark grey|beige", windows="dark blue|light blue|yellow", top="=walls"), forms=dict(height="short 0.7|1|tall 1.3"))
def skyscraper(o, rng):
    h = 1.0 * o.height
    glass = panes("y", "z", 12, 14, 0.62)
    other = panes("x", "z", 12, 14, 0.62)
    where = lambda u, v, p: (glass(u, v, p) & (np.abs(p[:, 0]) > 0.98 * p[:, 0].max()) | other(u, v, p) & (np.abs(p[:, 1]) > 0.98 * p[:, 1].max()))  # noqa: E731
    tiers = [block(0.42, 0.42, 0.55 * h).at(z=0.275 * h), block(0.34, 0.34, 0.3 * h).at(z=0.7 * h), block(0.25, 0.25, 0.15 * h).at(z=0.925 * h)]
    return dict(walls=[s.coat("windows", where) for s in tiers], top=[rod((0, 0, h), (0, 0, 1.18 * h), 0.02, 0.006), block(0.12, 0.12, 0.04).at(z=1.01 * h)])


@kind("tent", "buildings", also=("camping tent",), colours=dict(tent="orange|green|blue|yellow|red", door="dark grey|brown|beige", poles="brown|grey"), forms=dict(style="plain|striped"), sizes=dict(door="small 0.7|1|large 1.3"))
def tent(o, rng):
    front = refined([(0.42, -0.22), (0, 0.4), (-0.42, -0.22)])
    body = plate(front, 0.9).at(z=0.22)
    if o.style == "striped":
        body = body.coat("white", stripes(8, "z", 0.5))
    slit = plate(refined([(0.15, -0.14), (0, 0.26), (-0.15, -0.14)]) * o.door, 0.03).at(0.445, 0, 0.14 * o.door)
    ropes = [rod((0.44, s * 0.3, 0.22), (0.62, s * 0.5, 0.0), 0.008) for s in (-1, 1)]
    return dict(tent=body, door=slit, poles=[rod((0.45, 0, 0.6), (0.45, 0, 0.68), 0.016), rod((-0.45, 0, 0.6), (-0.45, 0, 0.68), 0.016), *ropes])


@kind("igloo", "buildings", also=("snow house",), colours=dict(snow="white|light blue", lines="light grey|light blue", entrance="!dark blue"))
def igloo(o, rng):
    brick = lambda u, v, p: ((p[:, 2] * 11) % 1 < 0.11) | ((u * 16 + 0.5 * (np.floor(p[:, 2] * 11) % 2)) % 1 < 0.06)  # noqa: E731
    dome = lathe([(0, 0), (0.48, 0), (0.46, 0.18), (0.34, 0.36), (0.16, 0.45), (0, 0.47)]).coat("lines", brick)
    arch = lathe([(0, -0.16), (0.2, -0.16), (0.2, 0.16), (0, 0.16)], sharp=True).turn("y", 90).at(0.48, 0, 0.02)
    return dict(snow=[dome, arch.coat("lines", lambda u, v, p: (u * 14) % 1 < 0.08)], entrance=cylinder(0.14, 0.02).turn("y", 90).at(0.635, 0, 0.02))


@kind("pyramid", "buildings", also=("egyptian pyramid",), colours=dict(stones="beige|straw|golden", lines="light brown|brown", entrance="dark brown"))
def pyramid(o, rng):
    body = lathe([(0, 0), (1, 0), (0, 0.62)], sharp=True, outline=oblong(1.0, 1.0)).coat("lines", lambda u, v, p: 0.55 * (((p[:, 2] * 18) % 1 < 0.14) | ((u * 44 + 0.5 * (np.floor(p[:, 2] * 18) % 2)) % 1 < 0.07)))
    return dict(stones=body, entrance=block(0.1, 0.1, 0.13).at(0.42, 0, 0.065))


@kind("temple", "buildings", also=("greek temple",), colours=dict(columns="white|cream|stone", roof="=columns", base="=columns"), counts=dict(columns="4|6"))
def temple(o, rng):
    n = o.columns
    y = np.linspace(-0.38, 0.38, n)
    places = [(0.3, a, 0.1) for a in y] + [(-0.3, a, 0.1) for a in y] + [(x, s * 0.38, 0.1) for x in (-0.1, 0.1) for s in (-1, 1)]
    flute = cylinder(0.05, 0.4, 0.042).shade(lambda u, v, p: 0.9 + 0.1 * np.cos(2 * np.pi * 14 * u)).copies(places)
    cap = block(0.12, 0.12, 0.035).copies([(a, b, 0.51) for a, b, _ in places])
    return dict(columns=[flute, cap, block(0.42, 0.56, 0.4).at(-0.06, 0, 0.3)], roof=[block(0.8, 0.96, 0.07).at(z=0.56), gable(0.76, 0.9, 0.22, 0.04).at(z=0.59)], base=[block(0.84, 1.0, 0.05).at(z=0.075), block(0.94, 1.1, 0.05).at(z=0.025)])


@kind("pagoda", "buildings", also=("japanese pagoda", "temple tower"), colours=dict(walls="red|white|brown", roofs="dark grey|green|blue", spire="golden"), counts=dict(roofs="3|4|5"))
def pagoda(o, rng):
    n = o.roofs
    parts = dict(walls=[], roofs=[], spire=[])
    for k in range(n):
        w, z = 0.46 - 0.28 * k / n, 0.2 * k
        parts["walls"].append(block(w, w, 0.17).at(z=z + 0.06).coat("cream", lambda u, v, p: (np.abs(p[:, 2]) < 0.04) & (np.minimum(np.abs((p[:, 0] * 9) % 1 - 0.5), np.abs((p[:, 1] * 9) % 1 - 0.5)) < 0.25)))
        parts["roofs"].append(lathe([(0, 0.13), (1.02, 0.12), (0.98, 0.155), (0.7, 0.165), (0.5, 0.2), (0, 0.24)], outline=oblong(w + 0.26, w + 0.26)).at(z=z))
    z = 0.2 * n + 0.02
    parts["spire"] = [rod((0, 0, z), (0, 0, z + 0.24), 0.018, 0.005), ball(0.035).at(z=z + 0.07), ring(0.035, 0.012).copies([(0, 0, z + 0.12), (0, 0, z + 0.16)])]
    return parts


@kind("bridge", "buildings", also=("stone bridge", "arch bridge"), colours=dict(stones="stone|grey|brick|beige", road="dark grey|light brown", railing="=stones"), counts=dict(arches="1|2|3"))
def bridge(o, rng):
    n = o.arches
    span = 1.0 / n
    t = np.linspace(0, np.pi, 12)
    deck = lambda x: 0.34 + 0.08 * np.cos(np.pi * x)  # noqa: E731
    parts = []
    for k in range(n):
        for s in (-1, 1):
            a = span * (k + 0.5) - 0.5
            r = 0.36 * span
            side = a + s * 0.5 * span
            arc = np.stack([a + s * r * np.sin(t / 2), np.minimum(r, 0.27) * np.cos(t / 2)], -1)
            outline = np.concatenate([arc, [(side, 0), (side, 0.5 * deck(side)), (side, deck(side)), (0.5 * (side + a), deck(0.5 * (side + a))), (a, deck(a))]])
            mid = np.array([0.62 * side + 0.38 * a, 0.78 * deck(side)])
            parts.append(side_plate(refined(outline, 2) - mid, 0.3).at(mid[0], 0, mid[1]))
    x = np.linspace(-0.5, 0.5, 12)
    road = hull([(a, 0.15, deck(a) - 0.01, deck(a) + 0.035) for a in x], square=8)
    rail = tube([(a, 0.145, deck(a) + 0.09) for a in np.linspace(-0.52, 0.52, 7)], 0.022)
    posts = rod((0, 0.145, 0), (0, 0.145, 0.12), 0.016).copies([(a, 0, deck(a)) for a in x])
    return each(dict(stones=[s.shade(lambda u, v, p: 1 - 0.1 * (((p[:, 1] * 16) % 1 < 0.14) | ((p[:, 0] * 11 + 0.5 * np.floor(p[:, 1] * 16)) % 1 < 0.09))) for s in parts], road=road, railing=[rail.both(), posts.both()], arches=[]), lambda s: s.turn("z", 90))


@kind("well", "buildings", also=("wishing well", "water well"), colours=dict(stones="stone|grey|brick", roof="red|brown", posts="wooden|brown", bucket="brown|silver", water="blue"))
def well(o, rng):
    wall = lathe([(0.3, 0), (0.36, 0), (0.36, 0.3), (0.28, 0.3), (0.28, 0.02), (0.3, 0)], sharp=True).shade(lambda u, v, p: 1 - 0.2 * (((p[:, 2] * 13) % 1 < 0.13) | ((u * 18 + 0.5 * np.floor(p[:, 2] * 13)) % 1 < 0.08)))
    return dict(stones=wall, water=cylinder(0.29, 0.02).at(z=0.1), posts=[block(0.06, 0.06, 0.72).at(0, 0.31, 0.38).both(), rod((0, -0.34, 0.56), (0, 0.34, 0.56), 0.03), rod((0, 0.34, 0.56), (0.1, 0.4, 0.56), 0.018)], roof=gable(0.5, 0.76, 0.3, 0.05).turn("z", 90).at(z=0.72).shade(tiles(14)), bucket=[cylinder(0.065, 0.12, 0.08).at(0, 0, 0.3)], brown=rod((0, 0, 0.42), (0, 0, 0.56), 0.008))


@kind("fence", "buildings", also=("picket fence", "garden fence"), colours=dict(planks="white|brown|wooden", rails="=planks"), counts=dict(planks="5|6|7|8"))
def fence(o, rng):
    n = o.planks
    y = np.linspace(-0.5 + 0.5 / n, 0.5 - 0.5 / n, n)
    plank = plate(refined([(0.32 / n, -0.26), (0.32 / n, 0.2), (0, 0.29), (-0.32 / n, 0.2), (-0.32 / n, -0.26)]), 0.03)
    return dict(planks=plank.copies(np.stack([0 * y, y, 0 * y + 0.26], -1)), rails=block(0.03, 1.0, 0.06).copies([(-0.025, 0, 0.14), (-0.025, 0, 0.36)]))
