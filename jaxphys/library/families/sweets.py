"""Cakes, ice cream and other sweet things."""

import numpy as np

from jaxphys.library.families.common import (
    eyes,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions, ripples
from jaxphys.library.patterns import (
    above,
    also,
    between,
    lattice,
    mottled,
    panes,
)
from jaxphys.library.shapes import (
    GOLDEN,
    ball,
    block,
    cylinder,
    lathe,
    limb,
    oblong,
    plate,
    polygon,
    refined,
    ring,
    rod,
    rounded,
    slab,
    speck,
    tube,
)
from jaxphys.library.solids import Parts, each

# fmt: off
# ruff: noqa: E731, RUF005

BERRY = "pink|white|dark brown|light blue|cream|yellow"
SPRINKLES = ("red", "yellow", "blue", "green", "white", "orange")


def sprinkled(places, up, rng, size=0.03) -> Parts:
    """Coloured grains lying on a surface."""
    grain = speck(size, 0.36 * size, 0.36 * size)
    spin = rng.uniform(0, 3.1, len(places))
    return {name: grain.copies(places[k::6], up[k::6], spin=spin[k::6]) for k,
        name in enumerate(SPRINKLES)}


@kind("ice cream", "sweets", also=("ice cream cone", "ice-cream"),
    colours=dict(scoops="pink|cream|dark brown|light green|white|purple", cone="light brown|golden",
        cherry="red", lines="!brown"),
    counts=dict(scoops="1|2|3"),
    extras=dict(cherry=0.3, sprinkles=0.3))
def ice_cream(o, rng):
    h = rng.uniform(0.85, 1.05)
    cone_ = lathe([(0, -h), (0.025, -h), (0.3, 0), (0.31, 0.03), (0, 0.03)],
        sharp=True).coat("lines", lattice(8, 5, 0.22))
    solids, level = [], 0.14
    for index in range(o.scoops):
        r = 0.34 * 0.93**index
        rough = ripples(rng, 3)
        solids += [ball(r).shade(mottled(rough, 0.04)).at(z=level),
            ring(0.88 * r, 0.1 * r).at(z=level - 0.5 * r),
            ball(0.12 * r).copies([(0.95 * r * np.cos(a), 0.95 * r * np.sin(a),
            level - (0.52 + 0.1 * np.sin(5 * a)) * r) for a in np.linspace(0, 6, 13)])]
        top, level = level, level + 1.3 * r
    parts = dict(scoops=solids, cone=cone_, cherry=[])
    if o.cherry:
        parts["cherry"] = ball(0.1).at(z=top + r + 0.05)
        parts["green"] = tube([(0, 0, top + r + 0.12), (0.02, 0.02, top + r + 0.2),
            (0.07, 0.05, top + r + 0.26)], 0.014)
    if o.sprinkles:
        d = golden_directions(90)[:38]
        parts |= sprinkled(d * r * 1.01 + (0, 0, top), d, rng, 0.036)
    return parts


@kind("popsicle", "sweets", also=("ice lolly", "ice pop"),
    colours=dict(ice="red|orange|pink|light blue|light green", tip="yellow|white",
        stick="wooden|beige"),
    forms=dict(style="plain|two-coloured"))
def popsicle(o, rng):
    bar = plate(oblong(0.42, 0.8, 0.19), 0.2, edge=0.05)
    if o.style == "two-coloured":
        bar = bar.coat("tip", above("y", 0.08, 0.02))
    return dict(ice=bar.shade(lambda u, v,
        p: 1 - 0.1 * (np.abs(np.abs(p[:, 0]) - 0.09) < 0.03) * (np.abs(p[:, 1]) < 0.28)).at(z=0.2),
        stick=plate(oblong(0.12, 0.5, 0.055), 0.05).at(z=-0.38))


@kind("pancakes", "sweets", also=("stack of pancakes", "fluffy pancakes"),
    colours=dict(pancakes="golden|light brown", crust="light brown|brown", butter="yellow|cream",
        syrup="brown|dark brown", plate="white|light blue", berries="dark blue|red"),
    counts=dict(pancakes="3|4|5|6"),
    extras=dict(butter=0.8, syrup=0.8, plate=0.4, berries=0.25))
def pancakes(o, rng):
    level, stack = 0.0, []
    for _ in range(o.pancakes):
        h, r = rng.uniform(0.1, 0.125), rng.uniform(0.46, 0.5)
        cake = lathe([(0, 0), (0.9 * r, 0.0), (r, 0.5 * h), (0.9 * r, h), (0, h)])
        stack.append(cake.coat("crust", lambda u, v, p,
            r=r: (0.93 * r - np.hypot(p[:, 0], p[:, 1])) / 0.05).at(*rng.normal(0, 0.018, 2),
            level))
        level += 0.95 * h
    parts = dict(pancakes=stack, butter=[], syrup=[], plate=[], berries=[])
    if o.syrup:
        a = np.linspace(0, 2 * np.pi, 96, endpoint=False)
        n, f = rng.integers(5, 8), rng.uniform(0, 6)
        reach = 0.37 + 0.07 * np.sin(n * a + f) + 0.03 * np.sin(3 * a)
        parts["syrup"] = [slab(np.stack([reach * np.cos(a), reach * np.sin(a)], -1), 0.04,
            puff=0.6).at(z=level + 0.005)]
        for k in range(n):
            b = (np.pi / 2 - f + 2 * np.pi * k) / n
            long = rng.uniform(0.1, 0.8) * level
            d = np.array([np.cos(b), np.sin(b), 0])
            parts["syrup"].append(tube([0.38 * d + (0, 0, level), 0.48 * d + (0, 0, level - 0.01),
                0.515 * d + (0, 0, level - 0.4 * long), 0.515 * d + (0, 0, level - long)],
                [0.05, 0.045, 0.03, 0.04]))
    if o.butter:
        parts["butter"] = block(0.2, 0.2, 0.09, 0.02).turn("z",
            rng.uniform(0, 90)).at(z=level + 0.06)
    if o.berries:
        a = rng.uniform(0, 6.28, 6)
        parts["berries"] = ball(0.06,
            fine=8).copies(np.stack([0.27 * np.cos(a), 0.27 * np.sin(a), 0 * a + level + 0.06], -1))
    if o.plate:
        parts["plate"] = lathe([(0, -0.05), (0.4, -0.05), (0.68, 0.02), (0.66, 0.035), (0.4, -0.01),
            (0, -0.01)], sharp=True)
    return parts


@kind("waffle", "sweets",
    colours=dict(waffle="golden|light brown", pits="brown", butter="yellow|cream", syrup="brown"),
    extras=dict(butter=0.6, syrup=0.4))
def waffle(o, rng):
    grid = lathe([(0, -0.06), (0.46, -0.06), (0.5, 0), (0.46, 0.06), (0, 0.06)],
        sharp=True).coat("pits", panes("x", "y", 7, 7, 0.55))
    ridges = [block(0.9 * np.sqrt(1 - (k / 3.6) ** 2), 0.05, 0.05).at(0, k * 0.135,
        0.075) for k in range(-3, 4)]
    ridges += [block(0.05, 0.9 * np.sqrt(1 - (k / 3.6) ** 2), 0.05).at(k * 0.135, 0,
        0.075) for k in range(-3, 4)]
    return dict(waffle=[grid, *ridges],
        butter=block(0.18, 0.18, 0.08, 0.02).turn("z", 20).at(z=0.13) if o.butter else [],
        syrup=slab(rounded(0.3 * polygon(7, 1.0, 0.7)[::4]), 0.03,
        puff=0.6).at(z=0.1) if o.syrup else [])


@kind("donut", "sweets", also=("doughnut",),
    colours=dict(icing="pink|dark brown|white|light blue", dough="light brown|golden"),
    extras=dict(sprinkles=0.6))
def donut(o, rng):
    f, amount = rng.uniform(0, 6, 2), rng.uniform(0.6, 1.2)
    glaze = lambda u, v, p: 40 * (p[:,
        2] - 0.02 - 0.025 * amount
        * (np.sin(6 * 2 * np.pi * u + f[0]) + 0.7 * np.sin(11 * 2 * np.pi * u + f[1])))
    parts = dict(icing=[ring(0.31, 0.2, 0.8).coat("dough", lambda u, v,
        p: 1 - np.clip(glaze(u, v, p), 0, 1))])
    if o.sprinkles:
        a, b = rng.uniform(0, 6.28, 60), rng.uniform(0.55, 2.5, 60)
        up = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1)
        places = np.stack([(0.31 + 0.2 * np.cos(b)) * np.cos(a),
            (0.31 + 0.2 * np.cos(b)) * np.sin(a), 0.16 * np.sin(b)], -1)
        parts |= sprinkled(places, up, rng, 0.03)
    lean = rng.choice([0, 35, 90])
    return each(parts, lambda s: s.turn("y", lean))


@kind("cake", "sweets", also=("birthday cake", "layer cake"),
    colours=dict(icing="pink|white|dark brown|light blue|cream", layers="light brown|golden",
        cherries="red", candles="light blue|yellow|red", filling="cream|pink", plate="white"),
    counts=dict(layers="1|2|3"),
    extras=dict(candles=0.45, cherries=0.45, plate=0.3))
def cake(o, rng):
    r, level, tiers = 0.46, 0.0, o.layers
    parts = dict(icing=[], layers=[], candles=[], cherries=[], plate=[])
    for _ in range(tiers):
        h = (0.42, 0.3, 0.25)[tiers - 1] * rng.uniform(0.9, 1.1)
        parts["layers"].append(cylinder(r, h).coat("filling",
            between("z", 0.42 * h, 0.56 * h)).at(z=level))
        n, f = int(rng.integers(9, 13)), rng.uniform(0, 6)
        a = 2 * np.pi * np.arange(n) / n + f
        drops = [limb((r * np.cos(b), r * np.sin(b), level + h),
            (r * np.cos(b), r * np.sin(b), level + h * rng.uniform(0.4, 0.75)), 0.045) for b in a]
        parts["icing"] += [cylinder(r + 0.025, 0.07, bevel=0.02).at(z=level + h - 0.045), *drops]
        level += h + 0.02
        last, r = r, r * 0.68
    a = 2 * np.pi * np.arange(6) / 6
    around = np.stack([0.68 * last * np.cos(a), 0.68 * last * np.sin(a), 0 * a + level], -1)
    if o.candles:
        parts["candles"] = cylinder(0.022, 0.2).copies(around)
        parts["orange"] = speck(0.022, 0.022, 0.045).copies(around + (0, 0, 0.25))
    if o.cherries:
        parts["cherries"] = ball(0.065,
            fine=8).copies(around[:, :] * (1.15, 1.15, 1) + (0, 0,
            0.06) if not o.candles else around * (0.4, 0.4, 1) + (0, 0, 0.05))
    if o.plate:
        parts["plate"] = cylinder(0.62, 0.04, bevel=0.01).at(z=-0.04)
    return parts


@kind("slice of cake", "sweets", also=("piece of cake", "cake slice"),
    colours=dict(icing=BERRY, layers="light brown|golden|dark brown", filling="cream|white|red",
        cherry="red"),
    counts=dict(layers="2|3"),
    extras=dict(cherry=0.6))
def cake_slice(o, rng):
    wedge = refined([(0.45, 0), (-0.35, 0.3), (-0.4, 0), (-0.35, -0.3)], 6)
    n, h = o.layers, 0.46
    bands = lambda u, v, p: ((p[:, 2] + 0.5 * h) / h * n) % 1 > 0.78
    return dict(layers=slab(wedge, h).coat("filling", bands),
        icing=[slab(wedge * 1.02, 0.07).at(z=0.25), block(0.05, 0.62, 0.53).at(-0.39, 0, 0.02),
        ball(0.08, 0.08, 0.06).copies([(-0.28, y, 0.3) for y in (-0.18, 0, 0.18)])],
        cherry=ball(0.085).at(-0.28, 0, 0.4) if o.cherry else [])


@kind("cupcake", "sweets", also=("muffin with cream",),
    colours=dict(cream="pink|white|dark brown|light blue", cup="red|blue|yellow|turquoise",
        cherry="red"),
    extras=dict(cherry=0.5, sprinkles=0.35))
def cupcake(o, rng):
    cup = lathe([(0, 0), (0.24, 0), (0.34, 0.34), (0.0, 0.34)], sharp=True,
        waves=(22, 0.025)).shade(lambda u, v, p: 0.86 + 0.16 * np.cos(2 * np.pi * 22 * u))
    t = np.linspace(0, 1, 34)
    a, r = 2 * np.pi * 3.3 * t, 0.3 * (1 - t) ** 0.8
    swirl = tube(np.stack([r * np.cos(a), r * np.sin(a), 0.38 + 0.42 * t], -1), 0.125 - 0.07 * t,
        sharp=True, sides=10)
    parts = dict(cream=[swirl, lathe([(0, 0.34), (0.36, 0.34), (0.3, 0.42), (0, 0.76)])], cup=cup,
        cherry=ball(0.08).at(z=0.9) if o.cherry else [])
    if o.sprinkles:
        d = golden_directions(70)[:40]
        parts |= sprinkled(d * (0.38, 0.38, 0.4) + (0, 0, 0.4), d, rng, 0.03)
    return parts


@kind("muffin", "sweets",
    colours=dict(top="light brown|golden|dark brown", cup="beige|white|brown",
        berries="dark blue|dark brown"),
    extras=dict(berries=0.7))
def muffin(o, rng):
    cup = lathe([(0, 0), (0.27, 0), (0.36, 0.32), (0.0, 0.32)], sharp=True,
        waves=(22, 0.025)).shade(lambda u, v, p: 0.86 + 0.16 * np.cos(2 * np.pi * 22 * u))
    d = golden_directions(36)[:16]
    return dict(top=lathe([(0, 0.3), (0.38, 0.28), (0.46, 0.36), (0.4, 0.5), (0.22, 0.62),
        (0, 0.66)]).shade(mottled(ripples(rng, 4), 0.07)), cup=cup,
        berries=speck(0.045).copies(d * (0.43, 0.43, 0.33) + (0, 0, 0.34)) if o.berries else [])


@kind("lollipop", "sweets", also=("candy on a stick",),
    colours=dict(candy="red|pink|blue|green|orange", swirl="white|yellow", stick="white"),
    sizes=dict(stick="short 0.6|1|long 1.4"))
def lollipop(o, rng):
    spiral = lambda u, v, p: np.sin(2 * np.arctan2(p[:, 2], p[:, 1]) + 22 * np.hypot(p[:, 1],
        p[:, 2])) > 0
    return dict(candy=ball(0.11, 0.4, 0.4, fine=12).coat("swirl", spiral),
        stick=rod((0, 0, -0.35), (0, 0, -0.35 - 0.7 * o.stick), 0.03))


@kind("cookie", "sweets", also=("biscuit", "chocolate chip cookie"),
    colours=dict(dough="light brown|golden", chips="dark brown"),
    sizes=dict(chips="small 0.7|1|large 1.4"))
def cookie(o, rng):
    n = 16
    a, r = np.deg2rad(GOLDEN) * np.arange(n), 0.4 * np.sqrt((np.arange(n) + 0.5) / n)
    z = 0.065 - 0.14 * r**4
    body = lathe([(0, -0.05), (0.44, -0.05), (0.5, 0.0), (0.4, 0.06),
        (0, 0.08)]).shade(mottled(ripples(rng, 5), 0.06))
    parts = dict(dough=body,
        chips=speck(0.05, 0.045, 0.035).scale(o.chips).copies(np.stack([r * np.cos(a),
        r * np.sin(a), z], -1)))
    return each(parts, lambda s: s.turn("y", 50))


@kind("gingerbread man", "sweets", also=("gingerbread cookie",),
    colours=dict(dough="brown|light brown", icing="white", buttons="red|green|blue"))
def gingerbread(o, rng):
    dough = [plate(polygon(24, 0.2), 0.12, puff=0.4).at(z=0.33),
        plate(oblong(0.34, 0.42, 0.14), 0.12, puff=0.4).at(z=-0.02),
        limb((0, 0.1, 0.08), (0, 0.34, 0.1), 0.085).scale(0.75, 1, 1).both(),
        limb((0, 0.09, -0.14), (0, 0.2, -0.42), 0.095).scale(0.7, 1, 1).both()]
    line = lambda pts: tube(pts, 0.014)
    icing = [line([(0.06, -0.09, 0.27), (0.065, 0, 0.24), (0.06, 0.09, 0.27)]),
        line([(0.06, 0.3, 0.02), (0.07, 0.29, 0.1), (0.06, 0.3, 0.18)]).both(),
        line([(0.06, 0.1, -0.36), (0.07, 0.18, -0.35), (0.06, 0.26, -0.32)]).both(),
        eyes(0.06, 0.07, 0.37, 0.026)]
    return dict(dough=dough, icing=icing,
        buttons=ball(0.036).copies([(0.06, 0, z) for z in (-0.1, 0.01, 0.12)]))


@kind("chocolate bar", "sweets", also=("bar of chocolate",),
    colours=dict(chocolate="dark brown|brown|cream", wrapper="red|blue|purple|golden"))
def chocolate_bar(o, rng):
    cells = block(0.15, 0.15, 0.06, 0.02,
        0.85).copies([(x, y, 0.07) for x in (0.4, 0.23, 0.06) for y in (-0.17, 0, 0.17)])
    return each(dict(chocolate=[block(1.0, 0.54, 0.09, 0.02), cells],
        wrapper=[block(0.56, 0.57, 0.15, 0.02).at(-0.24, 0, 0.02).coat("white",
        also(above("z", 0.07), between("y", -0.1, 0.1), between("x", -0.2, 0.2)))]),
        lambda s: s.turn("y", -35))


@kind("candy", "sweets", also=("wrapped candy", "sweet"),
    colours=dict(wrapper="red|pink|yellow|light blue|green", stripes="white|yellow"),
    forms=dict(style="plain|striped"))
def candy(o, rng):
    twist = lathe([(0.04, 0), (0.1, 0.06), (0.2, 0.24), (0.17, 0.25), (0.05, 0.08), (0.04, 0)],
        waves=(9, 0.16)).turn("x", -90).at(y=0.26)
    body = ball(0.24, 0.32, 0.24)
    return dict(wrapper=[body.coat("stripes", lambda u, v,
        p: np.sin(4 * np.arctan2(p[:, 2], p[:, 0]) + 9 * p[:, 1]) > 0) if o.style == "striped"
        else body, twist.both()])


@kind("macaron", "sweets", also=("french macaron",),
    colours=dict(shells="pink|light green|yellow|light blue|purple|brown", cream="white|cream"))
def macaron(o, rng):
    half = lathe([(0, 0), (0.43, 0), (0.46, 0.04), (0.44, 0.07), (0.47, 0.09), (0.4, 0.22),
        (0.2, 0.28), (0, 0.29)])
    return dict(shells=[half.at(z=0.07), half.turn("x", 180).at(z=-0.07)],
        cream=cylinder(0.43, 0.16, bevel=0.03).at(z=-0.08))


@kind("pie", "sweets", also=("apple pie",),
    colours=dict(crust="golden|light brown", filling="red|orange|dark blue|dark red",
        dish="silver|white|red"))
def pie(o, rng):
    dish = lathe([(0, 0), (0.38, 0), (0.5, 0.17), (0.46, 0.17), (0, 0.1)], sharp=True)
    strips = [block(0.9 * np.sqrt(1 - (k / 3.2) ** 2), 0.075, 0.035).at(0, k * 0.15,
        0.19 + 0.01 * (k % 2)) for k in (-2, -1, 0, 1, 2)]
    strips += [s.turn("z", 90).at(z=0.012) for s in strips]
    return dict(crust=[*strips, ring(0.45, 0.06).at(z=0.17),
        ball(0.05).copies([(0.46 * np.cos(a), 0.46 * np.sin(a), 0.2) for a in np.linspace(0, 6.1,
        26)])], filling=lathe([(0, 0.1), (0.45, 0.1), (0.44, 0.17), (0, 0.19)]), dish=dish)
