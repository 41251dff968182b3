"""Reptiles, insects and other small creatures."""

import numpy as np

from jaxphys.library.families.common import (
    eyes,
    pairs,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions
from jaxphys.library.patterns import (
    above,
    below,
    near,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    cone,
    cylinder,
    hull,
    lathe,
    limb,
    plate,
    rod,
    rounded,
    tube,
)

# fmt: off
# ruff: noqa: E731


@kind("turtle", "animals", also=("tortoise",),
    colours=dict(skin="light green|green", shell="brown|dark green|green", belly="cream",
        plates="light brown|light green", eyes="!black"),
    sizes=dict(shell="small 0.85|1|large 1.2"))
def turtle(o, rng):
    s = o.shell
    dome = lathe([(0, 0.1), (0.36 * s, 0.1), (0.39 * s, 0.15), (0.34 * s, 0.27),
        (0.2 * s, 0.37 * s), (0, 0.4 * s)]).scale(1.1, 0.9, 1)
    cells = lambda u, v, p: np.sort(-((p[:, None] - golden_directions(34) * (0.37 * s, 0.37 * s,
        0.33 * s) - (0, 0, 0.1)) ** 2).sum(-1), 1)[:, -1] < -0.0042
    return dict(skin=[limb((0.3, 0, 0.18), (0.52, 0, 0.28), 0.09),
        ball(0.12, 0.1, 0.1).at(0.56, 0, 0.3),
        *[ball(0.13, 0.085, 0.075).turn("z", s1 * a).at(x, s1 * 0.28, 0.08) for x,
        a in ((0.28, 30), (-0.26, -30)) for s1 in (-1, 1)],
        cone(0.05, 0.16).turn("y", -100).at(-0.38, 0, 0.12)], shell=dome.coat("plates", cells),
        belly=cylinder(0.33, 0.05).at(z=0.07), eyes=eyes(0.63, 0.07, 0.34, 0.022))


@kind("frog", "animals", also=("toad",),
    colours=dict(skin="green|light green", belly="light green|cream", legs="=skin",
        eyes="white|yellow", pupils="!black", spots="dark green"),
    forms=dict(style="plain|spotted"))
def frog(o, rng):
    body = hull([(-0.35, 0.08, 0.05, 0.2), (-0.15, 0.26, 0.02, 0.34), (0.15, 0.27, 0.06, 0.42),
        (0.34, 0.2, 0.16, 0.42), (0.43, 0.05, 0.24, 0.34)])
    if o.style == "spotted":
        body = body.coat("spots",
            near(rng.uniform((-0.35, -0.25, 0.25), (0.3, 0.25, 0.45), (16, 3)), 0.05))
    return dict(skin=body.coat("belly", below("z", 0.2, 0.03)),
        legs=[ball(0.2, 0.08, 0.14).turn("y", 25).at(-0.2, 0.27, 0.14).both(),
        ball(0.17, 0.07, 0.03).at(0.0, 0.34, 0.03).both(),
        limb((0.2, 0.22, 0.22), (0.26, 0.27, 0.04), 0.06).both(),
        ball(0.09, 0.08, 0.025).at(0.31, 0.28, 0.025).both()],
        eyes=ball(0.085).at(0.22, 0.14, 0.45).both(),
        pupils=ball(0.05).at(0.275, 0.155, 0.47).both())


@kind("snake", "animals", also=("serpent",),
    colours=dict(skin="green|brown|yellow", bands="dark green|black|red", eyes="!black",
        tongue="red"),
    forms=dict(style="plain|banded"))
def snake(o, rng):
    t = np.linspace(0, 1, 26)
    a, r = 2 * np.pi * 2.0 * t, 0.42 - 0.16 * t
    path = np.stack([r * np.cos(a), r * np.sin(a), 0.07 + 0.24 * t], -1)
    rise = np.array([(0.3, 0.05, 0.42), (0.3, 0.02, 0.6), (0.4, 0, 0.68)])
    body = tube(np.concatenate([path, rise]),
        np.concatenate([np.linspace(0.02, 0.085, 8), np.full(18, 0.085), [0.08, 0.07, 0.065]]),
        winds=True)
    band = lambda u, v, p: np.sin(110 * v) > 0.2
    return dict(skin=[body.coat("bands", band) if o.style == "banded" else body,
        ball(0.12, 0.09, 0.065).at(0.46, 0, 0.68)], eyes=eyes(0.51, 0.06, 0.72, 0.02),
        tongue=[rod((0.56, 0, 0.66), (0.68, 0, 0.65), 0.01),
        rod((0.68, 0, 0.65), (0.73, 0.025, 0.65), 0.008).both()])


@kind("crocodile", "animals", also=("alligator",),
    colours=dict(skin="green|dark green", belly="cream|light green", legs="=skin", teeth="white",
        eyes="yellow"),
    sizes=dict(tail="short 0.7|1|long 1.25"))
def crocodile(o, rng):
    t = 0.8 * o.tail
    body = hull([(-0.35 - t, 0.01, 0.04, 0.07), (-0.35 - 0.5 * t, 0.06, 0.02, 0.14),
        (-0.3, 0.13, 0.05, 0.25), (0.05, 0.17, 0.05, 0.28), (0.3, 0.11, 0.08, 0.25),
        (0.4, 0.12, 0.08, 0.26), (0.5, 0.1, 0.09, 0.21), (0.8, 0.07, 0.1, 0.17),
        (0.86, 0.03, 0.11, 0.15)])
    x = np.linspace(-0.3 - 0.7 * t, 0.25, 14)
    spikes = cone(0.03, 0.07).copies([(a, s * 0.05,
        0.24 - 0.14 * max(0, (-0.3 - a) / (0.7 * t))) for a in x for s in (-1, 1)])
    teeth = cone(0.014, 0.04).turn("x",
        180).copies([(a, s * 0.08, 0.13) for a in np.linspace(0.5, 0.8, 7) for s in (-1, 1)])
    legs = [limb((a, s * 0.14, 0.14), (a + 0.03, s * 0.24, 0.03), 0.05, 0.04) for a in (-0.22,
        0.22) for s in (-1, 1)]
    return dict(skin=[body.coat("belly", below("z", 0.085, 0.01)), spikes],
        legs=[*legs, ball(0.07, 0.05, 0.02).copies(pairs((-0.15, 0.29), 0.25, 0.02))], teeth=teeth,
        eyes=eyes(0.42, 0.06, 0.27, 0.035))


@kind("snail", "animals",
    colours=dict(body="beige|light brown|cream", shell="brown|orange|light brown",
        swirl="dark brown|cream", eyes="!black"),
    sizes=dict(shell="small 0.75|1|large 1.25"))
def snail(o, rng):
    s = o.shell
    t = np.linspace(0, 1, 30)
    a, r = 2 * np.pi * 2.3 * t - 1.2, 0.25 * s * (1 - t) ** 1.0 + 0.02
    path = np.stack([-0.08 - r * np.cos(a) * 1.0, 0.13 * t * s - 0.02,
        0.12 + 0.27 * s + r * np.sin(a)], -1)
    coil = tube(path, 0.15 * s * (1 - t) + 0.05, sharp=False).coat("swirl", lambda u, v,
        p: np.abs((u + 0.1) % 1 - 0.5) < 0.07)
    other = tube(path * (1, -1, 1), 0.15 * s * (1 - t) + 0.05).coat("swirl", lambda u, v,
        p: np.abs((u + 0.1) % 1 - 0.5) < 0.07)
    body = hull([(-0.5, 0.02, 0, 0.03), (-0.2, 0.12, 0, 0.13), (0.2, 0.12, 0, 0.15),
        (0.36, 0.1, 0.02, 0.26), (0.44, 0.04, 0.1, 0.24)])
    return dict(body=[body, ball(0.12, 0.1, 0.12).at(0.36, 0, 0.22),
        *[limb((0.4, s1 * 0.05, 0.28), (0.47, s1 * 0.09, 0.48), 0.02) for s1 in (-1, 1)]],
        shell=[coil, other, ball(0.25 * s, 0.14 * s, 0.25 * s).at(-0.08, 0, 0.12 + 0.27 * s)],
        eyes=ball(0.032).at(0.47, 0.09, 0.5).both())


@kind("butterfly", "animals",
    colours=dict(wings="orange|blue|yellow|purple", edges="black|dark brown",
        body="black|dark brown", spots="white|yellow"),
    sizes=dict(wings="small 0.8|1|large 1.2"))
def butterfly(o, rng):
    w = o.wings
    upper = rounded(np.array([(0.02, 0.0), (0.3, 0.12), (0.46, 0.36), (0.34, 0.46),
        (0.1, 0.3)]) * w - 0.2 * w)
    lower = rounded(np.array([(0.02, 0.0), (0.3, -0.02), (0.38, -0.2), (0.24, -0.36),
        (0.08, -0.2)]) * w - (0.2 * w, -0.12 * w))
    rim = lambda u, v, p: np.abs(v - 0.5) < 0.27
    both = [plate(line, 0.025).coat("edges", rim).coat("spots", dots_at).at(0, 0.2 * w + 0.02,
        dz) for line, dz, dots_at in ((upper, 0.2 * w,
        near([(0, 0.1 * w, 0.12 * w), (0, 0.18 * w, 0.02)], 0.03)),
        (lower, -0.12 * w, near((0, 0.04, -0.1), 0.035)))]
    wings = [s.turn("z", -14).both() for s in both]
    body = limb((0.02, 0, -0.24), (0.02, 0, 0.2), 0.03, 0.04)
    return dict(wings=wings,
        body=[body, ball(0.05).at(0.02, 0, 0.25),
        tube([(0.02, 0.02, 0.28), (0.02, 0.08, 0.4), (0.02, 0.14, 0.45)], 0.009).both()])


@kind("bee", "animals", also=("bumblebee",),
    colours=dict(body="yellow", stripes="black|dark brown", wings="white|light blue",
        head="black|yellow", eyes="white|black"))
def bee(o, rng):
    body = ball(0.4, 0.28, 0.28).coat("stripes", stripes(4.6, "x", 0.45, 0.2))
    return dict(body=[body, ball(0.2).at(0.38, 0, 0.03).coat("head", above("x", -1.0))],
        head=[ball(0.19).at(0.42, 0, 0.03),
        tube([(0.48, 0.06, 0.18), (0.55, 0.1, 0.34), (0.64, 0.12, 0.36)],
        [0.018, 0.015, 0.022]).both(), cone(0.04, 0.13).turn("y", -90).at(-0.38)],
        wings=ball(0.16, 0.28, 0.025).turn("z", 25).turn("x", 28).at(0.0, 0.28, 0.38).both(),
        eyes=eyes(0.54, 0.1, 0.07, 0.055), legs=[])


@kind("ladybug", "animals", also=("ladybird", "beetle"),
    colours=dict(shell="red|orange", dots="black", head="black", eyes="white"),
    sizes=dict(dots="small 0.7|1|large 1.35"))
def ladybug(o, rng):
    dome = lathe([(0, 0), (0.38, 0), (0.41, 0.06), (0.32, 0.26), (0.16, 0.35),
        (0, 0.37)]).scale(1.1, 1, 1)
    r = 0.075 * o.dots
    spots = [(x, s * y, z) for x, y,
        z in ((0.22, 0.17, 0.28), (0, 0.25, 0.26), (-0.22, 0.17, 0.28),
        (0.03, 0.1, 0.36)) for s in (-1, 1)]
    line = lambda u, v, p: (np.abs(p[:, 1]) < 0.014) & (p[:, 2] > 0.05)
    return dict(shell=dome.coat("dots", near(spots, r, (1, 1, 2))).coat("black", line),
        head=[ball(0.17, 0.2, 0.15).at(0.42, 0, 0.11),
        limb((0, 0, 0), (0, 0.22, -0.1),
        0.025).copies([(x, 0.3, 0.08) for x in (-0.25, 0, 0.25)]).both(),
        tube([(0.5, 0.05, 0.2), (0.58, 0.1, 0.3)], 0.015).both()],
        eyes=eyes(0.52, 0.1, 0.17, 0.045))


@kind("spider", "animals",
    colours=dict(body="black|dark brown|brown", legs="=body", eyes="red|white"),
    sizes=dict(legs="short 0.7|1|long 1.3"))
def spider(o, rng):
    s = o.legs
    knee, foot = (0.34 * s, 0.3 * s), (0.6 * s, -0.05)
    legs = []
    for angle in (35, 68, 105, 142):
        a = np.deg2rad(angle)
        out = np.array([np.cos(a), np.sin(a), 0])
        legs += [limb(0.12 * out + (0.1, 0, 0.18), knee[0] * out + (0.1, 0, 0.1 + knee[1]),
            0.025).both(), limb(knee[0] * out + (0.1, 0, 0.1 + knee[1]),
            foot[0] * out + (0.1, 0, 0.02), 0.022, 0.008).both()]
    return dict(body=[ball(0.26, 0.22, 0.2).at(-0.2, 0, 0.24),
        ball(0.15, 0.14, 0.11).at(0.12, 0, 0.18)], legs=legs,
        eyes=[eyes(0.24, 0.045, 0.24, 0.025), eyes(0.22, 0.09, 0.22, 0.016)])
