"""Flowers, trees and what else grows."""

import numpy as np

from jaxphys.library.families.common import (
    bloom,
    daisy,
    foliage,
    tulip_cup,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions, ripples
from jaxphys.library.patterns import (
    mottled,
    near,
    patterned,
)
from jaxphys.library.shapes import (
    GOLDEN,
    ball,
    block,
    cone,
    cylinder,
    golden,
    lathe,
    leaf,
    limb,
    petal,
    plate,
    polygon,
    speck,
    spray,
    tube,
)
from jaxphys.library.solids import Solid, each, together

# fmt: off
# ruff: noqa: E731, RUF005


@kind("rose", "plants", also=("rose flower", "rose in bloom"),
    colours=dict(petals="red|pink|white|yellow|dark red", stem="dark green|green", leaves="=stem"),
    sizes=dict(stem="short 0.6|1|long 1.35"))
def rose(o, rng):
    long = 0.85 * o.stem
    head = each(bloom(rng, 0.42), lambda s: s.at(z=0.02))
    lean = rng.normal(0, 0.05, 2)
    angles = rng.uniform(0, 360) + 150 * np.arange(3)
    places = [(0, 0, -long * h) for h in (0.35, 0.55, 0.72)]
    return together(head, dict(stem=[tube([(*lean, -long), (*(0.4 * lean), -0.5 * long),
        (0, 0, 0.06)], [0.03, 0.028, 0.035]), ball(0.085, 0.085, 0.07).at(z=0.02),
        foliage(0.22, 0.08, 72 * np.arange(5), -15, (0, 0, 0.02), 0.3)],
        leaves=foliage(0.38, 0.2, angles, rng.uniform(15, 40, 3), places, 0.35)))


@kind("vase with flowers", "plants",
    also=("vase of flowers", "flower vase", "bouquet of flowers in a vase"),
    colours=dict(vase="blue|white|light blue|turquoise|beige",
        flowers="red|pink|yellow|white|purple|orange", stems="green", leaves="=stems",
        pattern="white|dark blue", middles="yellow"),
    forms=dict(style="plain|striped|dotted"))
def vase_with_flowers(o, rng):
    belly, neck, h = rng.uniform(0.24, 0.32), rng.uniform(0.1, 0.15), rng.uniform(0.55, 0.72)
    lip = neck * rng.uniform(1.2, 1.7)
    vase = patterned(lathe([(0, 0), (0.55 * belly, 0), (belly, 0.38 * h), (neck, 0.85 * h),
        (lip, h), (0.85 * lip, h), (0.8 * neck, 0.85 * h), (0, 0.8 * h)]), o.style)
    sort, count = rng.choice(["daisies", "roses", "tulips"]), int(rng.integers(6, 10))
    parts = [dict(vase=vase)]
    for k in range(count):
        a, tilt = GOLDEN * k + rng.normal(0, 8), 38 * np.sqrt((k + 0.15) / count)
        long = rng.uniform(0.6, 0.74)
        t = np.deg2rad([a, tilt])
        d = np.array([np.sin(t[1]) * np.cos(t[0]), np.sin(t[1]) * np.sin(t[0]), np.cos(t[1])])
        foot = np.array([0, 0, 0.85 * h])
        end = foot + long * d
        head = {"daisies": lambda: daisy(0.2, 9, 0.28), "roses": lambda: bloom(rng, 0.15),
            "tulips": lambda: tulip_cup(0.1, 0.24)}[sort]()
        named = {"flowers": head["petals"]} | ({"middles": head["middle"]} if "middle" in head
            else {})
        parts.append(each(named, lambda s, a=a, tilt=tilt,
            end=end: s.turn("y", 1.3 * tilt).turn("z", a).at(*end)))
        parts.append(dict(stems=tube([foot, foot + 0.5 * long * (d + (0, 0, 0.12)), end], 0.015,
            sides=5)))
    n = int(rng.integers(6, 10))
    parts.append(dict(leaves=foliage(0.42, 0.14, golden(n) + 50, rng.uniform(20, 55, n),
        (0, 0, 0.92 * h))))
    return together(*parts)


@kind("flower", "plants", also=("daisy",),
    colours=dict(petals="white|pink|yellow|purple|orange|red", middle="yellow|golden|brown",
        stem="green", leaves="=stem"),
    sizes=dict(stem="short 0.6|1|long 1.4", petals="small 0.75|1|large 1.25"))
def flower(o, rng):
    n, long = int(rng.integers(7, 12)), 0.75 * o.stem
    head = each(daisy(0.4 * o.petals, n, 1.0 / n + 0.14),
        lambda s: s.turn("y", rng_tilt))if (rng_tilt := 55) else {}
    return together(head, dict(stem=tube([(0, 0, -long), (0, 0.03, -0.4 * long), (-0.04, 0, -0.02)],
        0.03), leaves=foliage(0.45, 0.16, [60, 240], 45,
        [(0, 0, -0.85 * long), (0, 0, -0.7 * long)])))


@kind("sunflower", "plants",
    colours=dict(petals="yellow|golden", middle="dark brown|brown", stem="green", leaves="=stem"),
    sizes=dict(stem="short 0.6|1|long 1.3"))
def sunflower(o, rng):
    n, long = 20, 0.95 * o.stem
    petals = [spray(petal(0.42, 0.15, 0.1, 0.15), 18 * np.arange(n) + s, rise) for s,
        rise in ((0, 5), (9, 16))]
    k = np.arange(90)
    r, a = 0.21 * np.sqrt((k + 0.5) / 90), np.deg2rad(GOLDEN) * k
    head = dict(petals=petals,
        middle=[ball(0.23, 0.23, 0.07).at(z=0.02),
        speck(0.015).copies(np.stack([r * np.cos(a), r * np.sin(a), 0.085 - 0.9 * r**2],
        -1)).shade(lambda u, v, p: 1.5)])
    return together(each(head, lambda s: s.turn("y", 68)),
        dict(stem=tube([(-0.02, 0, -long), (-0.05, 0.02, -0.5 * long), (-0.06, 0, -0.03)], 0.035),
        leaves=foliage(0.4, 0.25, [70, 250], 30, [(0, 0, -0.75 * long), (0, 0, -0.55 * long)])))


@kind("tulip", "plants",
    colours=dict(petals="red|yellow|pink|purple|orange|white", stem="green|light green",
        leaves="=stem"),
    sizes=dict(stem="short 0.6|1|long 1.3"))
def tulip(o, rng):
    long = 0.8 * o.stem
    blade = spray(leaf(0.66, 0.17, 0.12, 0.4), [20, 200], 72, place=(0, 0, -long))
    return together(tulip_cup(0.19, 0.42),
        dict(stem=tube([(0, 0, -long), (0, 0.015, -0.5 * long), (0, 0, 0.04)], 0.032),
        leaves=blade))


@kind("mushroom", "plants", also=("toadstool",),
    colours=dict(cap="red|brown|light brown", spots="white", stem="cream|white"),
    sizes=dict(stem="short 0.65|1|long 1.4", cap="small 0.75|1|large 1.25"),
    forms=dict(style="*spotted|plain"))
def mushroom(o, rng):
    h, w = 0.5 * o.stem, o.cap
    cap = lathe([(0, 0.03), (0.38 * w, 0.0), (0.46 * w, 0.07), (0.36 * w, 0.28), (0.18 * w, 0.4),
        (0, 0.42)]).coat("stem", lambda u, v, p: (v < 0.36) & (p[:, 2] < 0.06))
    d = golden_directions(44)[:20]
    spots = near(d * (0.44 * w, 0.44 * w, 0.42) + (0, 0, 0.02), 0.062)
    return dict(cap=cap.coat("spots", spots) if o.style == "spotted" else cap,
        stem=[lathe([(0, -h), (0.17, -h), (0.13, -0.4 * h), (0.12, 0.1), (0, 0.1)]),
        lathe([(0.12, -0.12), (0.2, -0.17), (0.12, -0.08), (0.12, -0.12)])])


@kind("cactus", "plants", also=("potted cactus",),
    colours=dict(stem="green|dark green", pot="orange|brown|white", flower="pink|red|yellow",
        spines="!cream"),
    counts=dict(arms="1|2|3"),
    extras=dict(flower=0.4))
def cactus(o, rng):
    rib = lambda u, v, p: 0.76 + 0.26 * np.abs(np.cos(np.pi * 8 * u))
    pot = lathe([(0, -0.5), (0.2, -0.5), (0.27, -0.2), (0.31, -0.2), (0.31, -0.12), (0.26, -0.12),
        (0, -0.16)], sharp=True)
    stems = [lathe([(0, -0.2), (0.15, -0.2), (0.165, 0.1), (0.15, 0.45), (0.09, 0.57), (0, 0.6)],
        waves=(16, 0.05)).shade(rib)]
    for k in range(o.arms):
        z = (0.05, 0.18, 0.3)[k]
        arm = tube([(0, 0.1, z), (0, 0.27, z + 0.01), (0, 0.33, z + 0.09), (0, 0.33, z + 0.28),
            (0, 0.33, z + 0.31)], [0.075, 0.078, 0.078, 0.075, 0.04], sides=12)
        stems.append(arm.turn("z", 180 * k if k < 2 else 70).shade(rib))
    z, a = np.repeat(np.linspace(-0.1, 0.5, 9), 8), np.tile(2 * np.pi * np.arange(8) / 8, 9)
    spines = cone(0.008, 0.05).copies(np.stack([0.16 * np.cos(a), 0.16 * np.sin(a), z], -1),
        np.stack([np.cos(a), np.sin(a), 0.2 + 0 * a], -1))
    bud = each(daisy(0.14, 7, 0.36), lambda s: s.at(z=0.6))
    return dict(stem=stems, pot=pot, spines=spines, brown=cylinder(0.26, 0.02).at(z=-0.15),
        flower=bud["petals"] if o.flower else [], yellow=bud["middle"] if o.flower else [])


def crown(rng, places, size: float) -> Solid:
    """Balls of leaves."""
    rough = ripples(rng, 5)
    one = ball(size, fine=8).shade(mottled(rough, 0.13))
    return one.copies(places, sizes=rng.uniform(0.85, 1.1, len(places)))


@kind("tree", "plants", also=("leafy tree", "oak tree"),
    colours=dict(leaves="green|dark green|light green|orange", trunk="brown|dark brown",
        apples="red"),
    sizes=dict(trunk="short 0.6|1|long 1.4"),
    extras=dict(apples=0.15))
def tree(o, rng):
    low = -0.1 - 0.4 * o.trunk
    d = golden_directions(22)
    tufts = crown(rng, d * (0.3, 0.3, 0.26) + (0, 0, 0.25), 0.2)
    small = speck(0.05, 0.035,
        0.03).copies(golden_directions(240) * (0.5, 0.5, 0.44) * rng.uniform(0.9, 1.03,
        (240, 1)) + (0, 0, 0.25), golden_directions(240) + rng.normal(0, 0.4, (240, 3)))
    limbs = [tube([(0, 0, low), (0, 0.01, 0.5 * low), (0, 0, 0.15)], [0.1, 0.065, 0.05]),
        *[limb((0, 0, -0.12), (0.2 * np.cos(a), 0.2 * np.sin(a), 0.1), 0.04, 0.03) for a in (0.4,
        2.6, 4.5)]]
    return dict(leaves=[tufts, small], trunk=limbs,
        apples=ball(0.05).copies(d[::2] * (0.49, 0.49, 0.44) + (0, 0, 0.23)) if o.apples else [])


@kind("fir tree", "plants", also=("pine tree", "fir", "evergreen tree"),
    colours=dict(needles="dark green|green", trunk="brown", snow="white"),
    extras=dict(snow=0.25))
def fir(o, rng):
    tiers = [lathe([(0, 0.06), (w, 0), (0.03, 0.42), (0, 0.43)], sharp=True,
        waves=(11, 0.07)).at(z=z) for z,
        w in ((-0.4, 0.42), (-0.19, 0.35), (0.02, 0.27), (0.22, 0.18))]
    tiers = [t.shade(lambda u, v,
        p: 0.85 + 0.2 * np.cos(2 * np.pi * 22 * u + 9 * v)) for t in tiers]
    if o.snow:
        tiers = [t.coat("snow", lambda u, v,
            p: p[:, 2] > 0.16 + 0.04 * np.sin(2 * np.pi * 7 * u)) for t in tiers]
    return dict(needles=tiers, trunk=cylinder(0.07, 0.3).at(z=-0.62))


@kind("christmas tree", "plants", also=("decorated fir tree",),
    colours=dict(needles="dark green|green", baubles="red|golden", star="golden|yellow",
        trunk="brown", lights="yellow|white"))
def christmas_tree(o, rng):
    tiers = [lathe([(0, 0.06), (w, 0), (0.03, 0.42), (0, 0.43)], sharp=True,
        waves=(11, 0.06)).at(z=z).shade(lambda u, v,
        p: 0.85 + 0.2 * np.cos(2 * np.pi * 22 * u + 9 * v)) for z,
        w in ((-0.4, 0.44), (-0.19, 0.36), (0.02, 0.27), (0.22, 0.18))]
    k = np.arange(26)
    z = -0.38 + 0.9 * k / 26
    a, r = np.deg2rad(GOLDEN) * k, 0.42 * (0.68 - z) / 1.08
    places = np.stack([r * np.cos(a), r * np.sin(a), z], -1)
    return dict(needles=tiers, baubles=ball(0.045, fine=8).copies(places),
        lights=speck(0.022).copies(places[:-1] * (-1, -1, 1) + (0, 0, 0.03)),
        star=plate(polygon(5, 0.12, 0.05, np.pi / 2), 0.05, puff=0.5).at(z=0.7),
        trunk=cylinder(0.07, 0.3).at(z=-0.6))


@kind("palm tree", "plants", also=("palm", "coconut palm"),
    colours=dict(leaves="green|dark green", trunk="brown|light brown", coconuts="brown"),
    extras=dict(coconuts=0.6),
    sizes=dict(trunk="short 0.65|1|long 1.25"))
def palm(o, rng):
    h = 0.95 * o.trunk
    path = [(0, 0, 0), (0.05, 0.05, 0.4 * h), (0.03, 0.14, 0.75 * h), (-0.02, 0.24, h)]
    n = 11
    blades = foliage(0.56, 0.15, 360 / n * np.arange(n) + rng.normal(0, 6, n),
        rng.uniform(8, 38, n), (-0.02, 0.24, h), 0.6)
    return dict(leaves=blades,
        trunk=tube(path, [0.085, 0.06, 0.05, 0.05]).shade(lambda u, v,
        p: 0.85 + 0.2 * (np.sin(70 * v) > 0)),
        coconuts=ball(0.065).copies([(-0.02 + 0.08 * np.cos(a), 0.24 + 0.08 * np.sin(a),
        h - 0.05) for a in (0, 2.1, 4.2)]) if o.coconuts else [])


@kind("potted plant", "plants", also=("houseplant", "plant in a pot"),
    colours=dict(pot="white|orange|brown|grey", leaves="green|dark green", earth="dark brown",
        pattern="brown|red"),
    sizes=dict(leaves="short 0.65|1|long 1.35"),
    forms=dict(style="plain|striped"))
def potted_plant(o, rng):
    pot = patterned(lathe([(0, 0), (0.18, 0), (0.25, 0.32), (0.21, 0.32), (0, 0.27)], sharp=True),
        o.style, 0.4)
    n = int(rng.integers(11, 18))
    return dict(pot=pot, earth=cylinder(0.21, 0.02).at(z=0.28),
        leaves=foliage(0.55 * o.leaves, 0.16, golden(n), rng.uniform(25, 80, n), (0, 0, 0.28), 0.45,
        rng.uniform(0.75, 1.1, n)))


@kind("bonsai", "plants", also=("bonsai tree",),
    colours=dict(leaves="green|dark green", trunk="brown|dark brown", pot="blue|brown|grey"))
def bonsai(o, rng):
    trunk = tube([(0, 0, 0.12), (0, 0.13, 0.28), (0, -0.02, 0.45), (0, 0.08, 0.66)],
        [0.1, 0.075, 0.06, 0.04])
    tufts = [crown(rng, golden_directions(14) * (s, 1.3 * s, 0.35 * s) + np.array(c),
        0.55 * s) for c, s in (((0, 0.1, 0.72), 0.2), ((0, -0.28, 0.52), 0.15),
        ((0.02, 0.34, 0.44), 0.14))]
    arms = [limb((0, -0.02, 0.42), (0, -0.26, 0.5), 0.035, 0.02),
        limb((0, 0.1, 0.3), (0, 0.32, 0.42), 0.035, 0.02)]
    return dict(leaves=tufts, trunk=[trunk, *arms],
        pot=[block(0.4, 0.62, 0.16, 0.05, 1.12).at(z=0.06), block(0.1, 0.5, 0.05).at(z=-0.04)],
        brown=block(0.38, 0.58, 0.03).at(z=0.14))


@kind("bush", "plants", also=("shrub", "rose bush"),
    colours=dict(leaves="green|dark green|light green", flowers="red|pink|white|yellow"),
    extras=dict(flowers=0.5))
def bush(o, rng):
    d = golden_directions(30)
    d = d[d[:, 2] > -0.3]
    small = golden_directions(300)[:210]
    leaves = [crown(rng, d * (0.34, 0.38, 0.24) + (0, 0, 0.12), 0.17),
        speck(0.045, 0.03, 0.025).copies(small * (0.51, 0.55, 0.4) + (0, 0, 0.12),
        small + rng.normal(0, 0.4, small.shape))]
    parts = dict(leaves=leaves, flowers=[])
    if o.flowers:
        at = golden_directions(26)[:18]
        one = daisy(0.085, 6, 0.36)
        parts["flowers"] = one["petals"].copies(at * (0.54, 0.58, 0.43) + (0, 0, 0.12), at)
        parts["yellow"] = one["middle"].copies(at * (0.54, 0.58, 0.43) + (0, 0, 0.12), at)
    return parts


@kind("clover", "plants", also=("shamrock", "clover leaf"),
    colours=dict(leaves="green|light green|dark green", stem="=leaves"),
    counts=dict(leaves="3|4"))
def clover(o, rng):
    t = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    heart = np.stack([(13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t)),
        16 * np.sin(t) ** 3], -1) / 58
    one = plate(heart[:, ::-1] * (1, 1), 0.06, puff=0.6).at(z=0.31).shade(lambda u, v,
        p: 1.1 - 0.25 * (np.abs(p[:, 1]) < 0.012))
    solids = [one.turn("x", 360 / o.leaves * k + (45 if o.leaves == 4 else 0))
        for k in range(o.leaves)]
    return dict(leaves=solids,
        stem=tube([(0, 0, 0), (-0.02, 0.04, -0.35), (0, 0.14, -0.68)], 0.028))
