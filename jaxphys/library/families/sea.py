"""Animals of the sea."""

import numpy as np

from jaxphys.library.families.common import (
    eyes,
)
from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    below,
    near,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    cushion,
    hull,
    lathe,
    limb,
    refined,
    rounded,
    side_plate,
    slab,
    tube,
)

# fmt: off


@kind("fish", "animals", also=("goldfish", "tropical fish"),
    colours=dict(body="orange|blue|yellow|silver", fins="=body", tail="=fins", stripes="white",
        eyes="white", pupils="!black"),
    sizes=dict(tail="short 0.7|1|long 1.7", fins="small 0.7|1|large 1.5"),
    forms=dict(style="plain|striped", girth="slim 0.7|1|round 1.3"))
def fish(o, rng):
    g = o.girth
    body = hull([(-0.45, 0.02, -0.04, 0.04), (-0.2, 0.11, -0.18 * g, 0.18 * g),
        (0.12, 0.15, -0.26 * g, 0.26 * g), (0.36, 0.1, -0.14 * g, 0.15 * g),
        (0.47, 0.03, -0.04, 0.04)])
    if o.style == "striped":
        body = body.coat("stripes", stripes(4.5, "x", 0.35))
    t, f = 0.3 * o.tail, o.fins
    fork = rounded([(0.1, 0), (-0.55 * t, 0.2), (-t, 0.24), (-0.7 * t, 0), (-t, -0.24),
        (-0.55 * t, -0.2)])
    back = rounded([(0.2, 0), (0, 0.17 * f), (-0.2, 0.14 * f), (-0.2, 0), (0, -0.03)])
    return dict(body=body, tail=side_plate(fork, 0.03).at(-0.45),
        fins=[side_plate(back, 0.03).at(0.0, 0, 0.22 * g),
        side_plate(0.6 * back * (1, -1), 0.03).at(-0.05, 0, -0.2 * g),
        ball(0.12 * f, 0.02, 0.07 * f).turn("y", -25).turn("z", 30).at(0.05, 0.19, -0.08).both()],
        eyes=eyes(0.32, 0.085, 0.05, 0.045), pupils=ball(0.028).at(0.335, 0.11, 0.05).both())


@kind("shark", "animals",
    colours=dict(skin="grey|dark grey|light blue", belly="white", fins="=skin", tail="=skin",
        eyes="!black"),
    sizes=dict(fins="small 0.7|1|large 1.4"))
def shark(o, rng):
    body = hull([(-0.7, 0.02, -0.02, 0.03), (-0.4, 0.08, -0.08, 0.1), (0.1, 0.17, -0.17, 0.19),
        (0.4, 0.14, -0.13, 0.15), (0.66, 0.03, 0.0, 0.05)])
    f = o.fins
    fin = refined([(0.16, 0), (-0.12 * f, 0.26 * f), (-0.1, 0.0), (0.02, -0.05)])
    side = refined([(0.14, 0), (-0.16 * f, 0.3 * f), (-0.06, 0.0), (0.02, -0.05)])
    tail = refined([(0.16, 0), (-0.22, 0.3), (-0.08, 0), (-0.16, -0.18)])
    return dict(skin=body.coat("belly", below("z", -0.05, 0.02)).coat("black",
        near((0.52, 0, -0.05), 0.06, (1, 2, 0.15))),
        fins=[side_plate(fin, 0.04).at(0.08, 0, 0.16),
        slab(side, 0.03).turn("x", -22).at(0.2, 0.13, -0.08).both()],
        tail=side_plate(tail, 0.035).at(-0.66, 0, 0.01), eyes=eyes(0.5, 0.085, 0.06, 0.018))


@kind("whale", "animals",
    colours=dict(skin="blue|dark blue|grey", belly="white|light blue", tail="=skin", fins="=skin",
        water="light blue", eyes="!black"),
    extras=dict(water=0.5))
def whale(o, rng):
    body = hull([(-0.75, 0.03, 0.22, 0.28), (-0.5, 0.12, 0.02, 0.24), (-0.1, 0.28, -0.24, 0.28),
        (0.25, 0.32, -0.28, 0.3), (0.5, 0.24, -0.2, 0.2), (0.6, 0.05, -0.08, 0.05)])
    fluke = rounded([(0.12, 0), (-0.05, 0.2), (-0.22, 0.32), (-0.18, 0.1), (-0.1, 0), (-0.18, -0.1),
        (-0.22, -0.32), (-0.05, -0.2)])
    spout = [tube([(0.2, 0, 0.28), (0.2, 0.02 * s, 0.45), (0.2, 0.16 * s, 0.52),
        (0.2, 0.2 * s, 0.44)], [0.03, 0.03, 0.035, 0.03]) for s in (-1, 1)]
    return dict(skin=body.coat("belly", below("z", -0.1, 0.02)),
        tail=slab(fluke, 0.05).turn("y", 20).at(-0.78, 0, 0.28),
        fins=ball(0.16, 0.05, 0.08).turn("y", 40).turn("z", -30).at(0.12, 0.32, -0.2).both(),
        water=spout if o.water else [], eyes=eyes(0.42, 0.25, -0.0, 0.028))


@kind("dolphin", "animals",
    colours=dict(skin="grey|light blue|blue", belly="white|light grey", fins="=skin", tail="=skin",
        eyes="!black"))
def dolphin(o, rng):
    body = hull([(-0.6, 0.02, -0.2, -0.15), (-0.3, 0.09, -0.12, 0.08), (0.05, 0.15, -0.12, 0.2),
        (0.3, 0.13, -0.12, 0.16), (0.42, 0.09, -0.12, 0.05), (0.47, 0.035, -0.1, -0.03),
        (0.6, 0.015, -0.09, -0.06)])
    fluke = rounded([(0.1, 0), (-0.05, 0.16), (-0.16, 0.22), (-0.08, 0), (-0.16, -0.22),
        (-0.05, -0.16)])
    return dict(skin=body.coat("belly", below("z", -0.05, 0.02)),
        tail=slab(fluke, 0.04).turn("y", -25).at(-0.64, 0, -0.21),
        fins=[side_plate(refined([(0.14, 0), (-0.1, 0.2), (-0.07, 0), (0, -0.04)]), 0.035).at(0.02,
        0, 0.18), ball(0.13, 0.025, 0.05).turn("y", 40).turn("z", -35).at(0.2, 0.15, -0.14).both()],
        eyes=eyes(0.39, 0.09, 0.0, 0.018))


@kind("octopus", "animals",
    colours=dict(skin="orange|red|purple", tentacles="=skin", eyes="white", pupils="!black"),
    sizes=dict(tentacles="short 0.7|1|long 1.3"))
def octopus(o, rng):
    t = o.tentacles
    arm = tube([(0.1, 0, 0.2), (0.3 * t, 0, 0.05), (0.5 * t, 0.03, 0.04), (0.64 * t, 0.12, 0.06),
        (0.62 * t, 0.2, 0.1)], [0.1, 0.085, 0.06, 0.04, 0.02])
    return dict(skin=lathe([(0, 0.1), (0.2, 0.12), (0.22, 0.28), (0.27, 0.5), (0.24, 0.72),
        (0, 0.86)]), tentacles=arm.turn("z", 22).around(8), eyes=eyes(0.19, 0.1, 0.36, 0.07),
        pupils=ball(0.04).at(0.24, 0.1, 0.36).both())


@kind("jellyfish", "animals",
    colours=dict(bell="pink|light blue|purple", tentacles="=bell"),
    sizes=dict(tentacles="short 0.6|1|long 1.4"))
def jellyfish(o, rng):
    bell = lathe([(0.0, 0.06), (0.3, 0.0), (0.36, -0.04), (0.36, 0.03), (0.28, 0.24), (0.14, 0.34),
        (0, 0.36)])
    arms = [tube([(0.26 * np.cos(a), 0.26 * np.sin(a), 0.02),
        *[(0.26 * np.cos(a) + 0.03 * np.sin(3 * k + a * 5), 0.26 * np.sin(a) + 0.03 * np.cos(3 * k),
        -0.2 * k * o.tentacles) for k in (1, 2, 3)]],
        [0.03, 0.025, 0.02, 0.01]) for a in np.linspace(0, 5.6, 9)]
    inner = [tube([(0.07 * np.cos(a), 0.07 * np.sin(a), 0.1),
        (0.1 * np.cos(a), 0.1 * np.sin(a), -0.2),
        (0.05 * np.cos(a), 0.05 * np.sin(a), -0.45 * o.tentacles)], [0.06, 0.06, 0.03],
        flat=0.5) for a in (0.3, 1.9, 3.5, 5.1)]
    return dict(bell=bell.shade(lambda u, v, p: 0.9 + 0.12 * np.cos(2 * np.pi * 8 * u)),
        tentacles=[*arms, *inner])


@kind("crab", "animals",
    colours=dict(shell="red|orange", claws="=shell", legs="=shell", eyes="!black"),
    sizes=dict(claws="small 0.7|1|large 1.4"))
def crab(o, rng):
    c = o.claws
    leg = [limb((0.16 - 0.13 * k, 0.26, 0.2), (0.18 - 0.17 * k, 0.48, 0.28),
        0.035).both() for k in range(3)]
    foot = [limb((0.18 - 0.17 * k, 0.48, 0.28), (0.2 - 0.2 * k, 0.6, 0.0), 0.03,
        0.01).both() for k in range(3)]
    claw = [ball(0.15 * c, 0.06 * c, 0.09 * c).turn("z", -25).at(0.5, 0.3 + 0.02 * c, 0.3).both(),
        *[tube([(0.56, 0.26, 0.3), (0.6 + 0.1 * c, 0.2 + s * 0.05 * c, 0.31 + s * 0.03),
        (0.55 + 0.22 * c, 0.15 + s * 0.02, 0.32)],
        [0.045 * c, 0.04 * c, 0.008]).both() for s in (-1, 1)]]
    return dict(shell=cushion(0.46, 0.66, 0.26, 2.3).at(z=0.22), legs=[*leg, *foot],
        claws=[limb((0.14, 0.26, 0.22), (0.38, 0.38, 0.26), 0.05).both(), *claw], stalks=[],
        eyes=[limb((0.2, 0.08, 0.28), (0.24, 0.08, 0.42), 0.02).both(),
        ball(0.035).at(0.24, 0.08, 0.44).both()])


@kind("starfish", "animals", also=("sea star",),
    colours=dict(skin="orange|red|pink", dots="cream|yellow"),
    counts=dict(arms="5|6|7"))
def starfish(o, rng):
    arm = hull([(-0.05, 0.12, 0, 0.14), (0.25, 0.085, 0, 0.1), (0.5, 0.02, 0, 0.03)])
    x = np.linspace(0.06, 0.44, 7)
    bump = ball(0.018, fine=4).copies(np.stack([x, 0 * x, 0.135 - 0.2 * x], -1))
    return dict(skin=[arm.around(o.arms), ball(0.15, 0.15, 0.09).at(z=0.06)],
        dots=bump.around(o.arms), arms=[])
