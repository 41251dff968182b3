"""What is worn on the head."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions
from jaxphys.library.patterns import (
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    hull,
    lathe,
    plate,
    polygon,
    ring,
    rounded,
    sheet,
    slab,
)

# fmt: off
# ruff: noqa: E731


@kind("top hat", "clothes", also=("magician's hat", "black hat"),
    colours=dict(hat="black|dark grey", band="red|white|purple"),
    forms=dict(height="short 0.65|1|tall 1.4"))
def top_hat(o, rng):
    h = 0.56 * o.height
    felt = lathe([(0, 0), (0.5, 0.03), (0.52, 0.06), (0.5, 0.06), (0.29, 0.04), (0.28, 0.5 * h),
        (0.31, h), (0, h)], sharp=True)
    return dict(hat=felt, band=lathe([(0.27, 0.04), (0.298, 0.04), (0.292, 0.17), (0.27, 0.17),
        (0.27, 0.04)], sharp=True))


@kind("party hat", "clothes", also=("birthday hat", "cone hat"),
    colours=dict(hat="blue|red|yellow|pink|green", pattern="white|yellow",
        pompom="yellow|white|red"),
    forms=dict(style="striped|dotted|plain"))
def party_hat(o, rng):
    cone_ = lathe([(0.0, 0), (0.33, 0), (0.02, 0.85), (0, 0.85)], sharp=True)
    if o.style == "striped":
        cone_ = cone_.coat("pattern", lambda u, v, p: (u * 3 + p[:, 2] * 3) % 1 < 0.42)
    elif o.style == "dotted":
        cone_ = cone_.coat("pattern", lambda u, v,
            p: np.hypot((u * 8 + 0.5 * np.floor(p[:, 2] * 7)) % 1 - 0.5,
            (p[:, 2] * 7) % 1 - 0.5) < 0.24)
    return dict(hat=cone_, pompom=ball(0.035).copies(golden_directions(24) * 0.065 + (0, 0, 0.86)))


@kind("sun hat", "clothes", also=("straw hat", "beach hat", "hat"),
    colours=dict(hat="straw|golden|white|beige", band="red|blue|pink|green|black"),
    sizes=dict(brim="narrow 0.7|1|wide 1.3"))
def sun_hat(o, rng):
    b = 0.3 + 0.24 * o.brim
    weave = lambda u, v, p: 0.9 + 0.12 * (np.sin(90 * np.hypot(p[:, 0], p[:, 1]) + 60 * p[:,
        2]) * np.sin(2 * np.pi * 36 * u) > 0)
    return dict(hat=lathe([(0, 0.0), (b, -0.03), (b, 0.0), (0.3, 0.04), (0.27, 0.2), (0.18, 0.3),
        (0, 0.32)], waves=(5, 0.02)).shade(weave),
        band=lathe([(0.27, 0.04), (0.305, 0.04), (0.295, 0.13), (0.27, 0.13), (0.27, 0.04)],
        sharp=True))


@kind("cowboy hat", "clothes",
    colours=dict(hat="brown|light brown|black|white|leather", band="dark brown|red|golden"))
def cowboy_hat(o, rng):
    rim = sheet(lambda u, v: np.stack([0.52 * np.sqrt(v) * np.cos(2 * np.pi * u),
        0.4 * np.sqrt(v) * np.sin(2 * np.pi * u), 0.24 * v * np.abs(np.sin(2 * np.pi * u)) ** 3],
        -1), 0.03, (24, 5))
    crown = hull([(-0.27, 0.1, 0.0, 0.24), (-0.2, 0.2, 0.0, 0.36), (0.1, 0.19, 0.0, 0.33),
        (0.27, 0.06, 0.0, 0.24)], square=3)
    return dict(hat=[rim, crown.shade(lambda u, v,
        p: 1 - 0.25 * ((np.abs(p[:, 1]) < 0.045) & (p[:, 2] > 0.28)))],
        band=hull([(-0.285, 0.11, 0.02, 0.11), (-0.2, 0.215, 0.02, 0.11), (0.1, 0.205, 0.02, 0.11),
        (0.285, 0.07, 0.02, 0.11)], square=3))


@kind("baseball cap", "clothes", also=("cap",),
    colours=dict(cap="red|blue|black|white|green", brim="=cap", button="=cap", logo="white|yellow"))
def cap(o, rng):
    seams = lambda u, v, p: 1 - 0.14 * (np.abs((u * 6) % 1 - 0.5) > 0.475)
    brim = slab(rounded([(0.3, 0.0), (0.2, 0.22), (0.0, 0.3), (-0.2, 0.28), (-0.26, 0),
        (-0.2, -0.28), (0.0, -0.3), (0.2, -0.22)]), 0.03).scale(1.1, 1.05, 1).turn("y", 8).at(0.36,
        0, 0.0)
    return dict(cap=lathe([(0, -0.02), (0.36, 0), (0.36, 0.1), (0.28, 0.26), (0.14, 0.34),
        (0, 0.36)]).shade(seams), brim=brim, button=ball(0.035, 0.035, 0.02).at(z=0.36),
        logo=plate(polygon(5, 0.09, 0.04, np.pi / 2), 0.02).turn("y", -25).at(0.325, 0, 0.16))


@kind("beanie", "clothes", also=("woolly hat", "winter hat", "bobble hat"),
    colours=dict(hat="red|blue|green|purple|white", pompom="white|yellow", cuff="=hat",
        stripes="white|yellow"),
    extras=dict(pompom=0.8),
    forms=dict(style="plain|striped"))
def beanie(o, rng):
    rib = lambda u, v, p: 0.88 + 0.13 * np.cos(2 * np.pi * 36 * u)
    body = lathe([(0, 0), (0.34, 0), (0.36, 0.15), (0.3, 0.38), (0.15, 0.5), (0, 0.53)])
    if o.style == "striped":
        body = body.coat("stripes", stripes(9, "z", 0.45))
    return dict(hat=body.shade(rib),
        cuff=lathe([(0.33, -0.02), (0.39, 0), (0.4, 0.09), (0.38, 0.16), (0.33, 0.15),
        (0.33, -0.02)]).shade(rib),
        pompom=ball(0.06).copies(golden_directions(40) * 0.11 + (0, 0, 0.57)) if o.pompom else [])


@kind("crown", "clothes", also=("golden crown", "king's crown"),
    colours=dict(crown="golden|silver", jewels="red|blue|green", velvet="red|purple"),
    counts=dict(points="5|6|8"),
    extras=dict(velvet=0.4))
def crown_(o, rng):
    n = o.points
    a = 2 * np.pi * np.arange(n) / n
    tips = np.stack([0.43 * np.cos(a), 0.43 * np.sin(a), 0 * a + 0.46], -1)

    def wall(u, v):
        t = 2 * np.pi * u
        peak = 0.24 + 0.2 * np.abs(1 - 2 * ((u * n) % 1)) ** 1.3
        r = 0.37 + 0.06 * v
        return np.stack([r * np.cos(t), r * np.sin(t), v * peak], -1)

    gems = ball(0.035).copies(np.stack([0.395 * np.cos(a + np.pi / n),
        0.395 * np.sin(a + np.pi / n), 0 * a + 0.1], -1))
    return dict(crown=[sheet(wall, 0.03, (8 * n, 3)), ring(0.38, 0.035), ball(0.04).copies(tips)],
        jewels=[gems, ball(0.045).copies(np.stack([0.4 * np.cos(a), 0.4 * np.sin(a), 0 * a + 0.17],
        -1))], velvet=lathe([(0, 0.02), (0.35, 0.02), (0.37, 0.2), (0.2, 0.34),
        (0, 0.32)]) if o.velvet else [])
