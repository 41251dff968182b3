"""Sky and earth."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.palette import ripples
from jaxphys.library.patterns import (
    mottled,
)
from jaxphys.library.shapes import (
    ball,
    cone,
    cylinder,
    lathe,
    plate,
    polygon,
    refined,
    rod,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731


@kind("star", "nature", also=("five-pointed star", "gold star"),
    colours=dict(star="yellow|golden|red|blue|silver"),
    forms=dict(width="thin 0.7|1|thick 1.6"))
def star(o, rng):
    return dict(star=plate(polygon(5, 0.5, 0.24, np.pi / 2), 0.26 * o.width, puff=0.9))


def heart_outline(size: float) -> np.ndarray:
    t = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    z = 13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t)
    return np.stack([16 * np.sin(t) ** 3, z], -1) * size / 34


@kind("heart", "nature", also=("valentine heart", "love heart"),
    colours=dict(heart="red|pink|dark red|purple", arrow="golden|brown"),
    extras=dict(arrow=0.15))
def heart(o, rng):
    arrow = [rod((0.0, -0.6, -0.3), (0, 0.62, 0.3), 0.02),
        cone(0.06, 0.14).copies([(0, 0.58, 0.28)], [(0, 0.62, 0.31)])]
    return dict(heart=plate(heart_outline(1.0), 0.4, puff=1.0), arrow=arrow if o.arrow else [])


@kind("moon", "nature", also=("crescent moon", "half moon"),
    colours=dict(moon="yellow|cream|white|golden", face="!dark grey"),
    extras=dict(face=0.4))
def moon(o, rng):
    a = np.linspace(0.75, 2 * np.pi - 0.75, 21)
    path = np.stack([0 * a, 0.36 * np.cos(a), 0.4 * np.sin(a)], -1)
    r = 0.012 + 0.15 * np.sin((a - 0.75) / (2 * np.pi - 1.5) * np.pi) ** 1.1
    face = [ball(0.03).at(0.13, -0.36, 0.12),
        tube([(0.13, -0.4, -0.1), (0.15, -0.33, -0.13), (0.13, -0.27, -0.1)], 0.012)]
    return dict(moon=tube(path, r, sides=10), face=face if o.face else [])


@kind("sun", "nature", also=("smiling sun",),
    colours=dict(sun="yellow|orange", rays="orange|yellow", face="!dark brown"),
    counts=dict(rays="8|10|12"),
    extras=dict(face=0.6))
def sun(o, rng):
    n = o.rays
    ray = plate(refined([(0.09, -0.08), (0, 0.14), (-0.09, -0.08)], 4), 0.1, puff=0.6).at(z=0.42)
    face = [ball(0.02, 0.03, 0.045).at(0.3, 0.09, 0.09).both(),
        tube([(0.27, -0.13, -0.06), (0.29, 0, -0.12), (0.27, 0.13, -0.06)], 0.016)]
    return dict(sun=ball(0.3), rays=[ray.turn("x", 360 / n * k) for k in range(n)],
        face=face if o.face else [])


@kind("cloud", "nature", also=("fluffy cloud", "rain cloud"),
    colours=dict(cloud="white|light grey|grey", rain="light blue|blue"),
    extras=dict(rain=0.35))
def cloud(o, rng):
    puffs = [(0, -0.3, 0, 0.19), (0, -0.08, 0.1, 0.25), (0, 0.2, 0.06, 0.22),
        (0, 0.38, -0.03, 0.14), (0.08, 0.03, -0.04, 0.2), (-0.06, -0.42, -0.06, 0.11),
        (0.06, -0.2, -0.06, 0.16)]
    drop = lathe([(0, -0.06), (0.035, -0.04), (0.03, 0.0), (0, 0.09)])
    return dict(cloud=[ball(r, 1.1 * r, r).at(x, y, z) for x, y, z, r in puffs],
        rain=drop.copies([(0, y, -0.34 - 0.1 * (k % 2)) for k,
        y in enumerate((-0.35, -0.18, 0.0, 0.17, 0.34))]) if o.rain else [])


@kind("rainbow", "nature",
    colours=dict(clouds="white|light blue", bands="!red"),
    extras=dict(clouds=0.75))
def rainbow(o, rng):
    a = np.linspace(0, np.pi, 19)
    parts = {}
    for k, name in enumerate(("bands", "orange", "yellow", "green", "blue", "purple")):
        r = 0.5 - 0.055 * k
        parts[name] = tube(np.stack([0 * a, r * np.cos(a), r * np.sin(a)], -1), 0.03)
    puffs = [(0.03, 0.36, 0.0, 0.11), (0.03, 0.48, 0.02, 0.1), (0.04, 0.42, -0.04, 0.11),
        (0.02, 0.28, -0.03, 0.07)]
    parts["clouds"] = [ball(r).at(x, y, z).both() for x, y, z, r in puffs] if o.clouds else []
    return parts


@kind("mountain", "nature", also=("snowy mountain", "mountain peak"),
    colours=dict(rock="grey|brown|stone", snow="white", grass="green|dark green"),
    sizes=dict(peak="low 0.7|1|tall 1.3"))
def mountain(o, rng):
    wave, f = ripples(rng, 2.2), rng.uniform(0, 6, 3)
    a = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    r = 1 + 0.12 * np.sin(3 * a + f[0]) + 0.09 * np.sin(7 * a + f[1]) + 0.05 * np.sin(13 * a + f[2])
    line = np.stack([r * np.cos(a), r * np.sin(a)], -1)
    h = 0.68 * o.peak
    peak = lathe([(0, 0), (0.5, 0), (0.33, 0.25 * h), (0.2, 0.55 * h), (0.09, 0.85 * h), (0, h)],
        outline=line).coat("snow", lambda u, v,
        p: p[:, 2] > 0.66 * h + 0.06 * wave(p)).coat("grass", lambda u, v,
        p: p[:, 2] < 0.13 * h + 0.03 * wave(p))
    side = lathe([(0, 0), (0.34, 0), (0.2, 0.22 * h), (0.09, 0.45 * h), (0, 0.56 * h)],
        outline=line[::-1] * (1, -1)).coat("snow", lambda u, v,
        p: p[:, 2] > 0.42 * h + 0.04 * wave(p)).coat("grass", lambda u, v,
        p: p[:, 2] < 0.1 * h + 0.03 * wave(p))
    return dict(rock=[peak.shade(mottled(ripples(rng, 5), 0.07)),
        side.at(0.2, 0.34).shade(mottled(ripples(rng, 5), 0.07))])


@kind("volcano", "nature", also=("erupting volcano",),
    colours=dict(rock="brown|dark grey|dark brown", lava="orange|red", smoke="light grey|grey"),
    extras=dict(smoke=0.5))
def volcano(o, rng):
    wave = ripples(rng, 2.5)
    streams = lambda u, v, p: (p[:,
        2] > 0.12 + 0.12 * wave(p * (0.2, 0.2, 0))) & (np.cos(5 * np.arctan2(p[:, 1],
        p[:, 0]) + 2 * wave(p * 0.3)) > 0.55 - 0.5 * (p[:, 2] > 0.5))
    cone_ = lathe([(0, 0), (0.5, 0), (0.34, 0.2), (0.2, 0.46), (0.15, 0.6), (0.1, 0.6),
        (0.07, 0.52), (0, 0.5)], waves=(9, 0.03)).coat("lava",
        streams).shade(mottled(ripples(rng, 5), 0.08))
    puffs = [(0, 0, 0.74, 0.1), (0.05, 0.07, 0.88, 0.13), (-0.02, -0.07, 0.95, 0.13),
        (0.02, 0.1, 1.06, 0.14)]
    return dict(rock=cone_, lava=[cylinder(0.1, 0.03).at(z=0.53),
        lathe([(0, 0.5), (0.07, 0.56), (0.05, 0.66), (0, 0.7)])],
        smoke=[ball(r).at(x, y, z) for x, y, z, r in puffs] if o.smoke else [])


@kind("planet", "nature", also=("planet with rings", "saturn"),
    colours=dict(planet="orange|beige|light blue|purple", rings="golden|beige|white|pink",
        bands="light brown|cream"))
def planet(o, rng):
    wave = ripples(rng, 0.8)
    belt = lambda u, v, p: np.sin(22 * p[:, 2] + 1.2 * wave(p)) > 0.25
    disc = lathe([(0.38, -0.008), (0.6, -0.008), (0.6, 0.008), (0.38, 0.008), (0.38, -0.008)],
        sharp=True).shade(lambda u, v, p: 0.85 + 0.2 * np.sin(60 * np.hypot(p[:, 0], p[:, 1])))
    return each(dict(planet=ball(0.3, fine=12).coat("bands", belt), rings=disc),
        lambda s: s.turn("x", 22).turn("y", 10))


@kind("campfire", "nature", also=("bonfire", "fire"),
    colours=dict(logs="brown|wooden", flames="orange|red", stones="grey|stone"),
    extras=dict(stones=0.6))
def campfire(o, rng):
    log = rod((0.4, 0, 0.05), (-0.08, 0, 0.2), 0.06)
    flame = lambda r, h: lathe([(0, 0), (0.7 * r, 0.1 * h), (r, 0.32 * h), (0.45 * r, 0.68 * h),
        (0, h)])
    a = 2 * np.pi * np.arange(9) / 9
    return dict(logs=log.around(6),
        flames=[flame(0.18, 0.72).at(z=0.1), flame(0.11, 0.5).turn("x", 14).at(0.02, 0.1, 0.12),
        flame(0.11, 0.46).turn("x", -16).at(0.02, -0.11, 0.12),
        flame(0.1, 0.4).turn("y", 16).at(0.1, 0, 0.1)],
        yellow=[flame(0.1, 0.34).at(0.13, 0, 0.1), flame(0.09, 0.36).at(-0.12, 0, 0.1)],
        stones=ball(0.09, 0.08, 0.065).copies(np.stack([0.46 * np.cos(a), 0.46 * np.sin(a),
        0 * a + 0.04], -1), spin=a) if o.stones else [])


@kind("snowflake", "nature", also=("ice crystal",), colours=dict(ice="light blue|white|silver"))
def snowflake(o, rng):
    k = rng.uniform(0.8, 1.2)
    arm = [rod((0, 0, 0), (0, 0, 0.5), 0.028, 0.02)] + [rod((0, 0, z), (0, s * w, z + 0.8 * w),
        0.02, 0.014) for z, w in ((0.18, 0.09), (0.3, 0.13 * k)) for s in (-1, 1)]
    return dict(ice=[*(s.around(6, "x") for s in arm),
        plate(polygon(6, 0.09, None, np.pi / 2), 0.06)])
