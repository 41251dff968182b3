"""Savoury food."""

import numpy as np

from jaxphys.library.families.common import (
    foliage,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions, ripples
from jaxphys.library.patterns import (
    fading,
    mottled,
    patterned,
    stripes,
)
from jaxphys.library.shapes import (
    GOLDEN,
    ball,
    block,
    cushion,
    cylinder,
    lathe,
    limb,
    oblong,
    refined,
    ring,
    rod,
    sheet,
    slab,
    speck,
    tube,
)
from jaxphys.library.solids import Solid, each

# fmt: off
# ruff: noqa: E731, RUF005


def frill(radius: float, rng, wave: float = 0.03, thick: float = 0.02) -> Solid:
    """A wavy round leaf: lettuce."""
    f = rng.uniform(0, 6, 2)

    def surface(u, v):
        a = 2 * np.pi * u
        z = wave * (np.sin(13 * a + f[0]) + 0.6 * np.sin(7 * a + f[1])) * v**3 - 0.05 * v**6
        return np.stack([radius * v * np.cos(a), radius * v * np.sin(a), z], -1)

    return sheet(surface, thick, (40, 5)).shade(lambda u, v, p: 0.8 + 0.3 * v)


@kind("burger", "food", also=("hamburger", "cheeseburger"),
    colours=dict(bun="light brown|golden", patty="dark brown", cheese="yellow",
        lettuce="green|light green", tomato="red", sesame="cream|white"),
    counts=dict(patties="1|2"),
    extras=dict(tomato=0.7, cheese=0.9, lettuce=0.95))
def burger(o, rng):
    w, level = 0.46, 0.13
    parts = dict(bun=[lathe([(0, 0), (w * 0.9, 0), (w, 0.06), (w * 0.97, 0.13),
        (0, 0.13)]).shade(fading("z", 0, 0.15, 0.95, 1.1))], patty=[], cheese=[], tomato=[],
        lettuce=[])
    for _ in range(o.patties):
        rough = ripples(rng, 5)
        parts["patty"].append(lathe([(0, 0), (0.9 * w, 0), (1.03 * w, 0.06), (0.92 * w, 0.125),
            (0, 0.125)]).shade(mottled(rough, 0.16)).at(z=level))
        level += 0.125
        if o.cheese:
            def surface(u, v, z=level):
                x, y = w * (2.0 * u - 1), w * (2.0 * v - 1)
                over = np.maximum(np.hypot(x, y) - 0.98 * w, 0)
                return np.stack([x * (1 - 0.25 * over), y * (1 - 0.25 * over),
                    z + 0.016 - 0.7 * over], -1)
            parts["cheese"].append(sheet(surface, 0.03, (10, 10)).turn("z", rng.uniform(0, 90)))
            level += 0.02
    if o.tomato:
        parts["tomato"] = cylinder(0.25, 0.045,
            bevel=0.012).copies([(0.22 * np.cos(a), 0.22 * np.sin(a), level) for a in (0.2, 2.3,
            4.4)])
        level += 0.05
    if o.lettuce:
        parts["lettuce"] = [frill(w * 1.17, rng, 0.026).at(z=level + 0.035),
            frill(w * 1.1, rng, 0.02).at(z=level + 0.015)]
        level += 0.05
    h = rng.uniform(0.26, 0.34)
    dome = [(0, 0), (w * 0.97, 0), (w * 1.03, 0.07), (w * 0.87, 0.62 * h), (w * 0.5, 0.93 * h),
        (0, h)]
    parts["bun"].append(lathe(dome).shade(fading("z", 0.0, 0.1, 1.2, 1.0)).at(z=level))
    d = golden_directions(110)[:50]
    places = np.stack([0.97 * w * d[:, 0], 0.97 * w * d[:, 1],
        level + 0.008 + h * (1 - np.hypot(d[:, 0], d[:, 1]) ** 2.6) ** 0.62], -1)
    parts["sesame"] = speck(0.024, 0.015, 0.011).copies(places, d + (0, 0, 0.4),
        spin=rng.uniform(0, 3, len(d)))
    return parts


@kind("salmon nigiri", "food", also=("nigiri", "salmon sushi", "nigiri sushi"),
    colours=dict(fish="orange", rice="white", stripes="cream", seaweed="black|dark green"),
    extras=dict(seaweed=0.25))
def nigiri(o, rng):
    n = 420
    d = np.sign(g := golden_directions(n)) * np.abs(g) ** 0.62
    grain = speck(0.017, 0.036, 0.015).copies(d * (0.21, 0.46, 0.17),
        g + 0.2 * rng.normal(size=(n, 3)), spin=rng.uniform(0, 3, n))
    slant, k, f = rng.uniform(0.5, 1.0), rng.uniform(6, 8.5), rng.uniform(0, 6)
    lines = lambda u, v, p: np.cos(np.pi * (k * p[:,
        1] / 0.5 + slant * k * np.abs(p[:, 0] + 0.06) / 0.24 + 0.4 * np.sin(6 * p[:,
        1] + f))) > 0.72

    def surface(u, v):
        x, y = 2 * u - 1, 2 * v - 1
        wide = 0.25 * (1 - 0.12 * y**2)
        return np.stack([wide * np.sin(1.25 * x) / np.sin(1.25), 0.52 * y,
            0.235 - 0.15 * np.abs(x) ** 2.4 - 0.13 * np.abs(y) ** 3 + 0.01 * np.sin(9 * y + f)], -1)

    band = [ring(0.2, 0.02).scale(1, 1, 1).turn("x", 90).scale(1.26, 3.0, 1.14).at(0, 0,
        0.02)] if o.seaweed else []
    return dict(fish=sheet(surface, 0.075, (10, 14)).coat("stripes", lines),
        rice=[cushion(0.4, 0.9, 0.32, 3).shade(lambda u, v, p: 0.93), grain], seaweed=band)


@kind("sushi roll", "food", also=("maki", "maki roll", "maki sushi"),
    colours=dict(seaweed="black|dark green", rice="white", filling="orange|red|green|yellow"))
def maki(o, rng):
    speck_ = ripples(rng, 9)
    roll = cylinder(0.4, 0.46, bevel=0.01).at(z=-0.23)
    far = lambda p: np.hypot(p[:, 0], p[:, 1])
    faces = lambda u, v, p: (far(p) < 0.375) & (np.abs(p[:, 2] - 0.23) > 0.225)
    grains = speck(0.035, 0.02, 0.016)
    n = 80
    a, r = np.deg2rad(GOLDEN) * np.arange(n), 0.36 * np.sqrt(np.linspace(0.2, 1, n))
    top = np.stack([r * np.cos(a), r * np.sin(a), 0 * a + 0.232], -1)
    filling = [cylinder(0.13, 0.5, bevel=0.02).at(0.03, 0.02, -0.25)]
    return each(dict(seaweed=roll.coat("rice", faces),
        rice=[grains.copies(top * s, spin=a * 3).shade(mottled(speck_, 0.05)) for s in ((1, 1, 1),
        (1, 1, -1))], filling=filling), lambda s: s.turn("y", 25))


@kind("hot dog", "food", also=("hotdog",),
    colours=dict(bun="light brown|golden", sausage="brown|dark red", sauce="yellow|red"))
def hot_dog(o, rng):
    y = np.linspace(-0.5, 0.5, 34)
    wave = np.stack([0.05 * np.sin(26 * y), y, 0.235 + 0 * y], -1)
    bun = cushion(0.3, 1.0, 0.27, 2.6).turn("y", 18)
    return dict(bun=[bun.at(0.14).shade(fading("z", -0.1, 0.13, 0.95, 1.08)),
        bun.turn("z", 180).at(-0.14)], sausage=limb((0, -0.5, 0.13), (0, 0.5, 0.13), 0.105),
        sauce=tube(wave, 0.022, sharp=True, sides=6))


@kind("slice of pizza", "food", also=("pizza", "pizza slice", "pepperoni pizza"),
    colours=dict(cheese="yellow|golden", crust="light brown|golden", pepperoni="dark red|red",
        basil="green", olives="black"),
    extras=dict(basil=0.3, olives=0.3))
def pizza(o, rng):
    wedge = refined([(-0.5, 0), (0.46, -0.4), (0.52, 0), (0.46, 0.4)], 6)
    spots = [(-0.12, 0.0), (0.14, 0.13), (0.12, -0.15), (0.33, 0.02), (0.34, -0.26), (0.34, 0.26)]
    blot = ripples(rng, 2.5)
    parts = dict(cheese=slab(wedge, 0.05).shade(mottled(blot, 0.05)),
        crust=[limb((0.48, -0.4, 0.03), (0.54, 0, 0.03), 0.075),
        limb((0.54, 0, 0.03), (0.48, 0.4, 0.03), 0.075), slab(wedge * 1.01, 0.03).at(z=-0.025)],
        pepperoni=cylinder(0.085, 0.03, bevel=0.008).copies([(x, y, 0.018) for x, y in spots]))
    if o.basil:
        parts["basil"] = foliage(0.13, 0.07, rng.uniform(0, 360, 4), 5,
            [(x - 0.1, y + 0.05, 0.045) for x, y in spots[1:5]], 0.05)
    if o.olives:
        parts["olives"] = ring(0.032,
            0.016).copies([(x + 0.02, -y * 0.6 + 0.1, 0.04) for x, y in spots])
    return each(parts, lambda s: s.turn("z", 180).turn("y", 30))


@kind("whole pizza", "food", also=("pizza", "round pizza"),
    colours=dict(cheese="yellow|golden", crust="light brown|golden", pepperoni="dark red|red",
        basil="green"),
    extras=dict(basil=0.4))
def whole_pizza(o, rng):
    n = 14
    a, r = np.deg2rad(GOLDEN) * np.arange(n), 0.4 * np.sqrt((np.arange(n) + 0.4) / n)
    places = np.stack([r * np.cos(a), r * np.sin(a), 0 * a + 0.02], -1)
    cuts = lambda u, v, p: np.abs(np.sin(3 * np.arctan2(p[:, 1], p[:, 0]))) * np.hypot(p[:, 0],
        p[:, 1]) < 0.018
    parts = dict(cheese=cylinder(0.46,
        0.045).at(z=-0.02).shade(mottled(ripples(rng, 3), 0.05)).coat("light brown", cuts),
        crust=ring(0.46, 0.05, 0.8), pepperoni=cylinder(0.072, 0.02, bevel=0.006).copies(places))
    if o.basil:
        parts["basil"] = foliage(0.13, 0.07, rng.uniform(0, 360, 6), 8,
            places[1:7] * (0.8, -0.8, 1) + (0, 0, 0.025), 0.05)
    return each(parts, lambda s: s.turn("y", 28))


@kind("fried egg", "food", colours=dict(white="white", yolk="orange|yellow"))
def fried_egg(o, rng):
    a, f = np.linspace(0, 2 * np.pi, 64, endpoint=False), rng.uniform(0, 6, 2)
    r = 0.45 + 0.05 * np.sin(3 * a + f[0]) + 0.03 * np.sin(5 * a + f[1])
    return each(dict(white=slab(np.stack([r * np.cos(a), r * np.sin(a)], -1), 0.08, puff=0.6),
        yolk=ball(0.18, 0.18, 0.11).at(0.02, 0.03, 0.03)), lambda s: s.turn("y", 35))


@kind("egg", "food", also=("easter egg", "boiled egg"),
    colours=dict(shell="white|beige|light brown", pattern="red|blue|yellow"),
    forms=dict(style="plain|striped|dotted"))
def egg(o, rng):
    body = lathe([(0, -0.5), (0.28, -0.36), (0.37, -0.1), (0.3, 0.22), (0.15, 0.43), (0, 0.5)])
    return dict(shell=patterned(body.at(), o.style))


@kind("french fries", "food", also=("fries", "chips"),
    colours=dict(box="red|white|yellow", fries="yellow|golden", pattern="white|yellow"),
    forms=dict(style="plain|striped"))
def fries(o, rng):
    box = lathe([(0, -0.3), (0.78, -0.3), (1.0, 0.28), (0.9, 0.28), (0, 0.1)], sharp=True,
        outline=oblong(0.3, 0.58, 0.02))
    if o.style == "striped":
        box = box.coat("pattern", stripes(10, "y", 0.5))
    chips = []
    for _ in range(26):
        x, y = rng.uniform(-0.1, 0.1), rng.uniform(-0.22, 0.22)
        chips.append(block(0.06, 0.06, 0.54).turn("x", rng.normal(0, 7)).turn("y",
            rng.normal(0, 5)).at(x, y, 0.3 + rng.uniform(-0.06, 0.12)))
    return dict(box=box, fries=chips[0].joined(*chips[1:]))


@kind("chicken drumstick", "food", also=("drumstick", "chicken leg"),
    colours=dict(meat="light brown|brown|golden", bone="white|cream"))
def drumstick(o, rng):
    meat = lathe([(0, -0.45), (0.2, -0.38), (0.26, -0.18), (0.17, 0.12), (0.075, 0.3),
        (0, 0.3)]).shade(mottled(ripples(rng, 3), 0.1))
    return each(dict(meat=meat,
        bone=[cylinder(0.045, 0.35).at(z=0.2), ball(0.065).at(0, 0.04, 0.56).both()]),
        lambda s: s.turn("x", 55))


@kind("bowl of noodles", "food", also=("ramen", "noodle soup", "bowl of ramen"),
    colours=dict(bowl="white|red|black|blue", noodles="yellow|cream", egg="white", onions="green",
        chopsticks="wooden|brown", soup="light brown|brown"),
    extras=dict(chopsticks=0.7, egg=0.7))
def noodles(o, rng):
    bowl = lathe([(0, 0), (0.22, 0), (0.24, 0.05), (0.42, 0.2), (0.5, 0.36), (0.47, 0.36),
        (0.42, 0.26), (0, 0.22)])
    t = np.linspace(0, 1, 40)
    swirl = [tube(np.stack([(0.34 - 0.3 * t) * np.cos(9 * t + k) + 0.05 * np.cos(k),
        (0.34 - 0.3 * t) * np.sin(9 * t + k) + 0.05 * np.sin(2 * k),
        0.3 + 0.05 * t + 0.02 * np.sin(20 * t + k)], -1), 0.022, sharp=True,
        sides=6) for k in range(5)]
    halves = [ball(0.12, 0.1, 0.07).at(0.2, -0.16, 0.33)] if o.egg else []
    parts = dict(bowl=bowl, soup=cylinder(0.45, 0.02).at(z=0.28), noodles=swirl, egg=halves,
        onions=ring(0.03, 0.014).copies(rng.uniform((-0.25, 0.0, 0.35), (0.2, 0.28, 0.37), (9, 3))))
    if o.egg:
        parts["orange"] = ball(0.055, 0.05, 0.03).at(0.2, -0.16, 0.385)
    parts["chopsticks"] = [rod((0.3 + s, -0.5, 0.46), (-0.25 + 2 * s, 0.55, 0.46), 0.014,
        0.018) for s in (0, 0.07)] if o.chopsticks else []
    return parts


@kind("shrimp", "food", also=("prawn",),
    colours=dict(body="orange|pink", stripes="white|red", tail="red|orange"))
def shrimp(o, rng):
    a = np.linspace(-0.3, 3.5, 12)
    path = np.stack([0 * a, 0.32 * np.cos(a), 0.32 * np.sin(a)], -1)
    r = np.concatenate([np.linspace(0.1, 0.15, 4), np.linspace(0.145, 0.05, 8)])
    end = path[-1]
    fan = [ball(0.025, 0.06, 0.13).turn("x",
        s + 10).at(*(end + (0, 0.06 + 0.001 * s, -0.12))) for s in (-28, 0, 28)]
    feelers = [tube([path[0] + (0.03 * s, 0, -0.02), path[0] + (0.1 * s, 0.1, -0.2),
        path[0] + (0.14 * s, 0.02, -0.4)], 0.009) for s in (-1, 1)]
    legs = [limb(path[k] * 0.75, path[k] * 0.45 + (0, 0.02, -0.02), 0.018, 0.006) for k in range(3,
        8)]
    return dict(body=[tube(path, r, sides=10).coat("stripes", lambda u, v,
        p: np.sin(60 * v) > 0.55), ball(0.105, 0.11, 0.12).at(*path[0]), *legs, *feelers], tail=fan,
        black=ball(0.025).at(0.08, *(path[0][1:] + (0.03, -0.03))).both("x"))
