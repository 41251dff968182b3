"""Birds, sea animals, reptiles and small creatures."""

import numpy as np

from experiments.priors.models.families.common import (
    ears,
    eyes,
    pairs,
)
from experiments.priors.models.kinds import kind
from experiments.priors.models.palette import golden_directions
from experiments.priors.models.patterns import (
    above,
    below,
    near,
    stripes,
)
from experiments.priors.models.shapes import (
    ball,
    block,
    cone,
    cushion,
    cylinder,
    hull,
    lathe,
    limb,
    plate,
    refined,
    ring,
    rod,
    rounded,
    side_plate,
    slab,
    tube,
)

# fmt: off


@kind("bird", "animals", also=("little bird", "songbird"),
      colours=dict(plumage="blue|red|brown|yellow", belly="white|orange|cream", beak="orange|yellow", wings="=plumage", tail="=plumage", legs="orange", eyes="!black"),
      sizes=dict(tail="short 0.6|1|long 1.5", beak="short 0.7|1|long 1.9"))
def bird(o, rng):
    body = ball(0.32, 0.22, 0.22).turn("y", -28).at(z=0.42)
    return dict(plumage=[body, ball(0.17).at(0.24, 0, 0.72)], belly=ball(0.24, 0.18, 0.19).turn("y", -28).at(0.09, 0, 0.36),
                beak=cone(0.055, 0.16 * o.beak).turn("y", 95).at(0.38, 0, 0.72), wings=ball(0.26, 0.05, 0.13).turn("y", -5).turn("z", 5).at(-0.08, 0.2, 0.46).both(),
                tail=block(0.36 * o.tail, 0.15, 0.04, 0.02).turn("y", -12).at(-0.34 - 0.14 * o.tail, 0, 0.26 - 0.03 * o.tail),
                legs=[limb((0.02, 0.08, 0.25), (0.04, 0.08, 0.02), 0.018).both(), *[limb((0.03, 0.08, 0.02), (0.13, 0.08 + y, 0.015), 0.014).both() for y in (-0.05, 0, 0.05)]],
                eyes=eyes(0.34, 0.1, 0.77, 0.03))


@kind("duck", "animals", also=("mallard",),
      colours=dict(plumage="light brown|white|brown", head="dark green|white", ring="white", beak="yellow|orange", wings="=plumage", feet="orange", eyes="!black"))
def duck(o, rng):
    body = hull([(-0.55, 0.02, 0.4, 0.44), (-0.4, 0.14, 0.22, 0.44), (0, 0.25, 0.1, 0.5), (0.3, 0.18, 0.16, 0.48), (0.42, 0.03, 0.28, 0.4)])
    neck = tube([(0.3, 0, 0.36), (0.36, 0, 0.55), (0.33, 0, 0.75)], [0.13, 0.085, 0.09])
    return dict(plumage=body, head=[neck, ball(0.15, 0.125, 0.12).at(0.36, 0, 0.8)], ring=ring(0.09, 0.025).at(0.36, 0, 0.54), beak=ball(0.13, 0.07, 0.03).at(0.54, 0, 0.77),
                wings=ball(0.3, 0.05, 0.14).turn("y", 8).at(-0.12, 0.23, 0.36).both(), eyes=eyes(0.45, 0.09, 0.84, 0.022),
                feet=[limb((0, 0.1, 0.15), (0.02, 0.1, 0.02), 0.025).both(), ball(0.12, 0.08, 0.015).at(0.1, 0.1, 0.015).both()])


@kind("chicken", "animals", also=("hen", "rooster"),
      colours=dict(plumage="white|brown|orange", comb="red", beak="yellow|orange", wings="=plumage", tail="=plumage", legs="orange|yellow", eyes="!black"), sizes=dict(tail="small 0.7|1|large 1.4"))
def chicken(o, rng):
    body = hull([(-0.42, 0.06, 0.5, 0.62), (-0.25, 0.2, 0.26, 0.62), (0.05, 0.23, 0.2, 0.58), (0.28, 0.13, 0.3, 0.6), (0.34, 0.03, 0.4, 0.5)])
    feathers = [ball(0.2 * o.tail, 0.03, 0.08).turn("y", 50 + 16 * k).at(-0.44, 0, 0.68) for k in range(3)]
    return dict(plumage=[body, tube([(0.2, 0, 0.45), (0.28, 0, 0.68), (0.28, 0, 0.82)], [0.17, 0.1, 0.085]), ball(0.105, 0.095, 0.1).at(0.3, 0, 0.84)],
                comb=[ball(0.055, 0.02, 0.06).copies([(0.36, 0, 0.95), (0.3, 0, 0.97), (0.23, 0, 0.95)]), ball(0.03, 0.02, 0.06).at(0.39, 0, 0.73)],
                beak=cone(0.04, 0.11).turn("y", 100).at(0.39, 0, 0.84), wings=ball(0.22, 0.05, 0.14).at(-0.04, 0.21, 0.42).both(), tail=feathers,
                legs=[limb((0, 0.09, 0.22), (0.01, 0.09, 0.02), 0.02).both(), *[limb((0, 0.09, 0.02), (0.12, 0.09 + y, 0.015), 0.016).both() for y in (-0.06, 0, 0.06)]],
                eyes=eyes(0.37, 0.075, 0.88, 0.02))


@kind("penguin", "animals", colours=dict(plumage="black|dark blue", belly="white", beak="orange", feet="orange", wings="=plumage", eyes="!black", scarf="red|blue"), extras=dict(scarf=0.25), forms=dict(girth="slim 0.8|1|fat 1.25"))
def penguin(o, rng):
    g = o.girth
    body = lathe([(0, 0), (0.22 * g, 0.02), (0.29 * g, 0.25), (0.23 * g, 0.58), (0.17, 0.74), (0.165, 0.86), (0.1, 0.96), (0, 0.98)])
    front = lathe([(0, 0.02), (0.18 * g, 0.04), (0.245 * g, 0.25), (0.19 * g, 0.55), (0.12, 0.68), (0, 0.7)]).at(x=0.06 * g)
    face = ball(0.08, 0.075, 0.1).at(0.1, 0.06, 0.83).both()
    return dict(plumage=body, belly=[front, face], beak=cone(0.05, 0.15).turn("y", 95).at(0.14, 0, 0.82), eyes=eyes(0.17, 0.065, 0.87, 0.025),
                wings=ball(0.12, 0.035, 0.27).turn("x", 14).at(0, 0.27 * g, 0.44).both(), feet=ball(0.14, 0.08, 0.04).at(0.12, 0.12, 0.02).both(),
                scarf=[ring(0.175, 0.05).at(0.02, 0, 0.68), limb((0.18, 0.08, 0.66), (0.26 * g, 0.1, 0.42), 0.045)] if o.scarf else [])


@kind("owl", "animals", colours=dict(plumage="brown|light brown|grey|white", belly="cream|beige", wings="dark brown|brown", face="beige|white", beak="orange|yellow", eyes="yellow|orange", pupils="!black", feet="orange"))
def owl(o, rng):
    body = lathe([(0, 0), (0.24, 0.03), (0.31, 0.3), (0.28, 0.6), (0.29, 0.78), (0.18, 0.95), (0, 0.98)]).scale(0.9, 1, 1)
    flecks = lambda u, v, p: (np.sin(60 * p[:, 1]) > 0.2) & (np.sin(50 * p[:, 2] + 3 * np.sin(60 * p[:, 1])) > 0.5)  # noqa: E731
    disc = cylinder(0.125, 0.06, 0.1).turn("y", 90)
    return dict(plumage=[body, ears(np.array([0.06, 0, 0.86]), 0.16, 0.16, 0.07, out=40)], belly=ball(0.16, 0.2, 0.27).at(0.15, 0, 0.34).coat("wings", flecks),
                wings=ball(0.16, 0.055, 0.3).turn("x", 6).at(-0.02, 0.28, 0.38).both(), face=disc.at(0.19, 0.115, 0.76).both(), eyes=ball(0.04, 0.08, 0.08).at(0.245, 0.115, 0.76).both(),
                pupils=ball(0.02, 0.04, 0.04).at(0.275, 0.115, 0.76).both(), beak=cone(0.04, 0.12).turn("y", 140).at(0.25, 0, 0.7), feet=ball(0.07, 0.05, 0.03).at(0.18, 0.1, 0.02).both())


@kind("flamingo", "animals", colours=dict(plumage="pink", neck="=plumage", beak="black", legs="pink|flesh", wings="=plumage", eyes="!black"), sizes=dict(neck="short 0.7|1|long 1.25", legs="short 0.6|1|long 1.2"))
def flamingo(o, rng):
    z = 0.75 * o.legs
    n = o.neck
    path = [(0.25, 0, z + 0.1), (0.45, 0, z + 0.12), (0.42, 0, z + 0.36 * n), (0.3, 0, z + 0.55 * n), (0.36, 0, z + 0.72 * n), (0.48, 0, z + 0.68 * n)]
    head = np.array([0.5, 0, z + 0.66 * n])
    return dict(plumage=hull([(-0.45, 0.01, z, z + 0.02), (-0.2, 0.13, z, z + 0.22), (0.1, 0.16, z - 0.04, z + 0.24), (0.33, 0.05, z + 0.03, z + 0.18)]),
                neck=[tube(path, [0.06, 0.05, 0.045, 0.042, 0.045, 0.06]), ball(0.085, 0.065, 0.065).at(*head)], beak=tube([head + (0.06, 0, 0), head + (0.15, 0, -0.03), head + (0.15, 0, -0.14)], [0.045, 0.042, 0.012]),
                wings=ball(0.26, 0.04, 0.11).turn("y", -6).at(-0.12, 0.14, z + 0.13).both(), legs=[limb((0, 0.06, z), (0.02, 0.06, 0.02), 0.022).both(), ball(0.08, 0.05, 0.015).at(0.05, 0.06, 0.015).both(), ball(0.03).at(0.01, 0.06, 0.5 * z).both()],
                eyes=eyes(head[0] + 0.03, 0.055, head[2] + 0.025, 0.015))


@kind("parrot", "animals", colours=dict(plumage="red|green|blue", wings="blue|yellow|green", tail="blue|red", beak="black|grey", face="white", perch="brown", eyes="!black"), sizes=dict(tail="short 0.6|1|long 1.3"))
def parrot(o, rng):
    body = ball(0.17, 0.16, 0.32).turn("y", 12).at(z=0.55)
    return dict(plumage=[body, ball(0.16, 0.145, 0.15).at(0.11, 0, 0.9)], face=ball(0.08, 0.11, 0.08).at(0.16, 0, 0.89), beak=tube([(0.2, 0, 0.93), (0.32, 0, 0.9), (0.31, 0, 0.78)], [0.065, 0.055, 0.01]),
                wings=ball(0.12, 0.04, 0.28).turn("y", 18).at(-0.06, 0.16, 0.52).both(), tail=ball(0.05, 0.07, 0.3 * o.tail).turn("y", 18).at(-0.12 - 0.06 * o.tail, 0, 0.28 - 0.22 * o.tail),
                perch=rod((0.06, -0.4, 0.24), (0.06, 0.4, 0.24), 0.035), eyes=eyes(0.21, 0.1, 0.93, 0.022))


@kind("fish", "animals", also=("goldfish", "tropical fish"),
      colours=dict(body="orange|blue|yellow|silver", fins="=body", tail="=fins", stripes="white", eyes="white", pupils="!black"), sizes=dict(tail="short 0.7|1|long 1.7", fins="small 0.7|1|large 1.5"), forms=dict(style="plain|striped", girth="slim 0.7|1|round 1.3"))
def fish(o, rng):
    g = o.girth
    body = hull([(-0.45, 0.02, -0.04, 0.04), (-0.2, 0.11, -0.18 * g, 0.18 * g), (0.12, 0.15, -0.26 * g, 0.26 * g), (0.36, 0.1, -0.14 * g, 0.15 * g), (0.47, 0.03, -0.04, 0.04)])
    if o.style == "striped":
        body = body.coat("stripes", stripes(4.5, "x", 0.35))
    t, f = 0.3 * o.tail, o.fins
    fork = rounded([(0.1, 0), (-0.55 * t, 0.2), (-t, 0.24), (-0.7 * t, 0), (-t, -0.24), (-0.55 * t, -0.2)])
    back = rounded([(0.2, 0), (0, 0.17 * f), (-0.2, 0.14 * f), (-0.2, 0), (0, -0.03)])
    return dict(body=body, tail=side_plate(fork, 0.03).at(-0.45), fins=[side_plate(back, 0.03).at(0.0, 0, 0.22 * g), side_plate(0.6 * back * (1, -1), 0.03).at(-0.05, 0, -0.2 * g),
                                                                       ball(0.12 * f, 0.02, 0.07 * f).turn("y", -25).turn("z", 30).at(0.05, 0.19, -0.08).both()],
                eyes=eyes(0.32, 0.085, 0.05, 0.045), pupils=ball(0.028).at(0.335, 0.11, 0.05).both())


@kind("shark", "animals", colours=dict(skin="grey|dark grey|light blue", belly="white", fins="=skin", tail="=skin", eyes="!black"), sizes=dict(fins="small 0.7|1|large 1.4"))
def shark(o, rng):
    body = hull([(-0.7, 0.02, -0.02, 0.03), (-0.4, 0.08, -0.08, 0.1), (0.1, 0.17, -0.17, 0.19), (0.4, 0.14, -0.13, 0.15), (0.66, 0.03, 0.0, 0.05)])
    f = o.fins
    fin = refined([(0.16, 0), (-0.12 * f, 0.26 * f), (-0.1, 0.0), (0.02, -0.05)])
    side = refined([(0.14, 0), (-0.16 * f, 0.3 * f), (-0.06, 0.0), (0.02, -0.05)])
    tail = refined([(0.16, 0), (-0.22, 0.3), (-0.08, 0), (-0.16, -0.18)])
    return dict(skin=body.coat("belly", below("z", -0.05, 0.02)).coat("black", near((0.52, 0, -0.05), 0.06, (1, 2, 0.15))), fins=[side_plate(fin, 0.04).at(0.08, 0, 0.16), slab(side, 0.03).turn("x", -22).at(0.2, 0.13, -0.08).both()],
                tail=side_plate(tail, 0.035).at(-0.66, 0, 0.01), eyes=eyes(0.5, 0.085, 0.06, 0.018))


@kind("whale", "animals", colours=dict(skin="blue|dark blue|grey", belly="white|light blue", tail="=skin", fins="=skin", water="light blue", eyes="!black"), extras=dict(water=0.5))
def whale(o, rng):
    body = hull([(-0.75, 0.03, 0.22, 0.28), (-0.5, 0.12, 0.02, 0.24), (-0.1, 0.28, -0.24, 0.28), (0.25, 0.32, -0.28, 0.3), (0.5, 0.24, -0.2, 0.2), (0.6, 0.05, -0.08, 0.05)])
    fluke = rounded([(0.12, 0), (-0.05, 0.2), (-0.22, 0.32), (-0.18, 0.1), (-0.1, 0), (-0.18, -0.1), (-0.22, -0.32), (-0.05, -0.2)])
    spout = [tube([(0.2, 0, 0.28), (0.2, 0.02 * s, 0.45), (0.2, 0.16 * s, 0.52), (0.2, 0.2 * s, 0.44)], [0.03, 0.03, 0.035, 0.03]) for s in (-1, 1)]
    return dict(skin=body.coat("belly", below("z", -0.1, 0.02)), tail=slab(fluke, 0.05).turn("y", 20).at(-0.78, 0, 0.28), fins=ball(0.16, 0.05, 0.08).turn("y", 40).turn("z", -30).at(0.12, 0.32, -0.2).both(),
                water=spout if o.water else [], eyes=eyes(0.42, 0.25, -0.0, 0.028))


@kind("dolphin", "animals", colours=dict(skin="grey|light blue|blue", belly="white|light grey", fins="=skin", tail="=skin", eyes="!black"))
def dolphin(o, rng):
    body = hull([(-0.6, 0.02, -0.2, -0.15), (-0.3, 0.09, -0.12, 0.08), (0.05, 0.15, -0.12, 0.2), (0.3, 0.13, -0.12, 0.16), (0.42, 0.09, -0.12, 0.05), (0.47, 0.035, -0.1, -0.03), (0.6, 0.015, -0.09, -0.06)])
    fluke = rounded([(0.1, 0), (-0.05, 0.16), (-0.16, 0.22), (-0.08, 0), (-0.16, -0.22), (-0.05, -0.16)])
    return dict(skin=body.coat("belly", below("z", -0.05, 0.02)), tail=slab(fluke, 0.04).turn("y", -25).at(-0.64, 0, -0.21), fins=[side_plate(refined([(0.14, 0), (-0.1, 0.2), (-0.07, 0), (0, -0.04)]), 0.035).at(0.02, 0, 0.18),
                ball(0.13, 0.025, 0.05).turn("y", 40).turn("z", -35).at(0.2, 0.15, -0.14).both()], eyes=eyes(0.39, 0.09, 0.0, 0.018))


@kind("octopus", "animals", colours=dict(skin="orange|red|purple", tentacles="=skin", eyes="white", pupils="!black"), sizes=dict(tentacles="short 0.7|1|long 1.3"))
def octopus(o, rng):
    t = o.tentacles
    arm = tube([(0.1, 0, 0.2), (0.3 * t, 0, 0.05), (0.5 * t, 0.03, 0.04), (0.64 * t, 0.12, 0.06), (0.62 * t, 0.2, 0.1)], [0.1, 0.085, 0.06, 0.04, 0.02])
    return dict(skin=lathe([(0, 0.1), (0.2, 0.12), (0.22, 0.28), (0.27, 0.5), (0.24, 0.72), (0, 0.86)]), tentacles=arm.turn("z", 22).around(8), eyes=eyes(0.19, 0.1, 0.36, 0.07), pupils=ball(0.04).at(0.24, 0.1, 0.36).both())


@kind("jellyfish", "animals", colours=dict(bell="pink|light blue|purple", tentacles="=bell"), sizes=dict(tentacles="short 0.6|1|long 1.4"))
def jellyfish(o, rng):
    bell = lathe([(0.0, 0.06), (0.3, 0.0), (0.36, -0.04), (0.36, 0.03), (0.28, 0.24), (0.14, 0.34), (0, 0.36)])
    arms = [tube([(0.26 * np.cos(a), 0.26 * np.sin(a), 0.02), *[(0.26 * np.cos(a) + 0.03 * np.sin(3 * k + a * 5), 0.26 * np.sin(a) + 0.03 * np.cos(3 * k), -0.2 * k * o.tentacles) for k in (1, 2, 3)]], [0.03, 0.025, 0.02, 0.01]) for a in np.linspace(0, 5.6, 9)]
    inner = [tube([(0.07 * np.cos(a), 0.07 * np.sin(a), 0.1), (0.1 * np.cos(a), 0.1 * np.sin(a), -0.2), (0.05 * np.cos(a), 0.05 * np.sin(a), -0.45 * o.tentacles)], [0.06, 0.06, 0.03], flat=0.5) for a in (0.3, 1.9, 3.5, 5.1)]
    return dict(bell=bell.shade(lambda u, v, p: 0.9 + 0.12 * np.cos(2 * np.pi * 8 * u)), tentacles=[*arms, *inner])


@kind("crab", "animals", colours=dict(shell="red|orange", claws="=shell", legs="=shell", eyes="!black"), sizes=dict(claws="small 0.7|1|large 1.4"))
def crab(o, rng):
    c = o.claws
    leg = [limb((0.16 - 0.13 * k, 0.26, 0.2), (0.18 - 0.17 * k, 0.48, 0.28), 0.035).both() for k in range(3)]
    foot = [limb((0.18 - 0.17 * k, 0.48, 0.28), (0.2 - 0.2 * k, 0.6, 0.0), 0.03, 0.01).both() for k in range(3)]
    claw = [ball(0.15 * c, 0.06 * c, 0.09 * c).turn("z", -25).at(0.5, 0.3 + 0.02 * c, 0.3).both(), *[tube([(0.56, 0.26, 0.3), (0.6 + 0.1 * c, 0.2 + s * 0.05 * c, 0.31 + s * 0.03), (0.55 + 0.22 * c, 0.15 + s * 0.02, 0.32)], [0.045 * c, 0.04 * c, 0.008]).both() for s in (-1, 1)]]
    return dict(shell=cushion(0.46, 0.66, 0.26, 2.3).at(z=0.22), legs=[*leg, *foot], claws=[limb((0.14, 0.26, 0.22), (0.38, 0.38, 0.26), 0.05).both(), *claw], stalks=[], eyes=[limb((0.2, 0.08, 0.28), (0.24, 0.08, 0.42), 0.02).both(), ball(0.035).at(0.24, 0.08, 0.44).both()])


@kind("starfish", "animals", also=("sea star",), colours=dict(skin="orange|red|pink", dots="cream|yellow"), counts=dict(arms="5|6|7"))
def starfish(o, rng):
    arm = hull([(-0.05, 0.12, 0, 0.14), (0.25, 0.085, 0, 0.1), (0.5, 0.02, 0, 0.03)])
    x = np.linspace(0.06, 0.44, 7)
    bump = ball(0.018, fine=4).copies(np.stack([x, 0 * x, 0.135 - 0.2 * x], -1))
    return dict(skin=[arm.around(o.arms), ball(0.15, 0.15, 0.09).at(z=0.06)], dots=bump.around(o.arms), arms=[])


@kind("turtle", "animals", also=("tortoise",), colours=dict(skin="light green|green", shell="brown|dark green|green", belly="cream", plates="light brown|light green", eyes="!black"), sizes=dict(shell="small 0.85|1|large 1.2"))
def turtle(o, rng):
    s = o.shell
    dome = lathe([(0, 0.1), (0.36 * s, 0.1), (0.39 * s, 0.15), (0.34 * s, 0.27), (0.2 * s, 0.37 * s), (0, 0.4 * s)]).scale(1.1, 0.9, 1)
    cells = lambda u, v, p: np.sort(-((p[:, None] - golden_directions(34) * (0.37 * s, 0.37 * s, 0.33 * s) - (0, 0, 0.1)) ** 2).sum(-1), 1)[:, -1] < -0.0042  # noqa: E731
    return dict(skin=[limb((0.3, 0, 0.18), (0.52, 0, 0.28), 0.09), ball(0.12, 0.1, 0.1).at(0.56, 0, 0.3), *[ball(0.13, 0.085, 0.075).turn("z", s1 * a).at(x, s1 * 0.28, 0.08) for x, a in ((0.28, 30), (-0.26, -30)) for s1 in (-1, 1)], cone(0.05, 0.16).turn("y", -100).at(-0.38, 0, 0.12)],
                shell=dome.coat("plates", cells), belly=cylinder(0.33, 0.05).at(z=0.07), eyes=eyes(0.63, 0.07, 0.34, 0.022))


@kind("frog", "animals", also=("toad",), colours=dict(skin="green|light green", belly="light green|cream", legs="=skin", eyes="white|yellow", pupils="!black", spots="dark green"), forms=dict(style="plain|spotted"))
def frog(o, rng):
    body = hull([(-0.35, 0.08, 0.05, 0.2), (-0.15, 0.26, 0.02, 0.34), (0.15, 0.27, 0.06, 0.42), (0.34, 0.2, 0.16, 0.42), (0.43, 0.05, 0.24, 0.34)])
    if o.style == "spotted":
        body = body.coat("spots", near(rng.uniform((-0.35, -0.25, 0.25), (0.3, 0.25, 0.45), (16, 3)), 0.05))
    return dict(skin=body.coat("belly", below("z", 0.2, 0.03)), legs=[ball(0.2, 0.08, 0.14).turn("y", 25).at(-0.2, 0.27, 0.14).both(), ball(0.17, 0.07, 0.03).at(0.0, 0.34, 0.03).both(), limb((0.2, 0.22, 0.22), (0.26, 0.27, 0.04), 0.06).both(), ball(0.09, 0.08, 0.025).at(0.31, 0.28, 0.025).both()],
                eyes=ball(0.085).at(0.22, 0.14, 0.45).both(), pupils=ball(0.05).at(0.275, 0.155, 0.47).both())


@kind("snake", "animals", also=("serpent",), colours=dict(skin="green|brown|yellow", bands="dark green|black|red", eyes="!black", tongue="red"), forms=dict(style="plain|banded"))
def snake(o, rng):
    t = np.linspace(0, 1, 26)
    a, r = 2 * np.pi * 2.0 * t, 0.42 - 0.16 * t
    path = np.stack([r * np.cos(a), r * np.sin(a), 0.07 + 0.24 * t], -1)
    rise = np.array([(0.3, 0.05, 0.42), (0.3, 0.02, 0.6), (0.4, 0, 0.68)])
    body = tube(np.concatenate([path, rise]), np.concatenate([np.linspace(0.02, 0.085, 8), np.full(18, 0.085), [0.08, 0.07, 0.065]]))
    band = lambda u, v, p: np.sin(110 * v) > 0.2  # noqa: E731
    return dict(skin=[body.coat("bands", band) if o.style == "banded" else body, ball(0.12, 0.09, 0.065).at(0.46, 0, 0.68)], eyes=eyes(0.51, 0.06, 0.72, 0.02), tongue=[rod((0.56, 0, 0.66), (0.68, 0, 0.65), 0.01), rod((0.68, 0, 0.65), (0.73, 0.025, 0.65), 0.008).both()])


@kind("crocodile", "animals", also=("alligator",), colours=dict(skin="green|dark green", belly="cream|light green", legs="=skin", teeth="white", eyes="yellow"), sizes=dict(tail="short 0.7|1|long 1.25"))
def crocodile(o, rng):
    t = 0.8 * o.tail
    body = hull([(-0.35 - t, 0.01, 0.04, 0.07), (-0.35 - 0.5 * t, 0.06, 0.02, 0.14), (-0.3, 0.13, 0.05, 0.25), (0.05, 0.17, 0.05, 0.28), (0.3, 0.11, 0.08, 0.25), (0.4, 0.12, 0.08, 0.26), (0.5, 0.1, 0.09, 0.21), (0.8, 0.07, 0.1, 0.17), (0.86, 0.03, 0.11, 0.15)])
    x = np.linspace(-0.3 - 0.7 * t, 0.25, 14)
    spikes = cone(0.03, 0.07).copies([(a, s * 0.05, 0.24 - 0.14 * max(0, (-0.3 - a) / (0.7 * t))) for a in x for s in (-1, 1)])
    teeth = cone(0.014, 0.04).turn("x", 180).copies([(a, s * 0.08, 0.13) for a in np.linspace(0.5, 0.8, 7) for s in (-1, 1)])
    legs = [limb((a, s * 0.14, 0.14), (a + 0.03, s * 0.24, 0.03), 0.05, 0.04) for a in (-0.22, 0.22) for s in (-1, 1)]
    return dict(skin=[body.coat("belly", below("z", 0.085, 0.01)), spikes], legs=[*legs, ball(0.07, 0.05, 0.02).copies(pairs((-0.15, 0.29), 0.25, 0.02))], teeth=teeth, eyes=eyes(0.42, 0.06, 0.27, 0.035))


@kind("snail", "animals", colours=dict(body="beige|light brown|cream", shell="brown|orange|light brown", swirl="dark brown|cream", eyes="!black"), sizes=dict(shell="small 0.75|1|large 1.25"))
def snail(o, rng):
    s = o.shell
    t = np.linspace(0, 1, 30)
    a, r = 2 * np.pi * 2.3 * t - 1.2, 0.25 * s * (1 - t) ** 1.0 + 0.02
    path = np.stack([-0.08 - r * np.cos(a) * 1.0, 0.13 * t * s - 0.02, 0.12 + 0.27 * s + r * np.sin(a)], -1)
    coil = tube(path, 0.15 * s * (1 - t) + 0.05, sharp=False).coat("swirl", lambda u, v, p: np.abs((u + 0.1) % 1 - 0.5) < 0.07)
    other = tube(path * (1, -1, 1), 0.15 * s * (1 - t) + 0.05).coat("swirl", lambda u, v, p: np.abs((u + 0.1) % 1 - 0.5) < 0.07)
    body = hull([(-0.5, 0.02, 0, 0.03), (-0.2, 0.12, 0, 0.13), (0.2, 0.12, 0, 0.15), (0.36, 0.1, 0.02, 0.26), (0.44, 0.04, 0.1, 0.24)])
    return dict(body=[body, ball(0.12, 0.1, 0.12).at(0.36, 0, 0.22), *[limb((0.4, s1 * 0.05, 0.28), (0.47, s1 * 0.09, 0.48), 0.02) for s1 in (-1, 1)]], shell=[coil, other, ball(0.25 * s, 0.14 * s, 0.25 * s).at(-0.08, 0, 0.12 + 0.27 * s)], eyes=ball(0.032).at(0.47, 0.09, 0.5).both())


@kind("butterfly", "animals", colours=dict(wings="orange|blue|yellow|purple", edges="black|dark brown", body="black|dark brown", spots="white|yellow"), sizes=dict(wings="small 0.8|1|large 1.2"))
def butterfly(o, rng):
    w = o.wings
    upper = rounded(np.array([(0.02, 0.0), (0.3, 0.12), (0.46, 0.36), (0.34, 0.46), (0.1, 0.3)]) * w - 0.2 * w)
    lower = rounded(np.array([(0.02, 0.0), (0.3, -0.02), (0.38, -0.2), (0.24, -0.36), (0.08, -0.2)]) * w - (0.2 * w, -0.12 * w))
    rim = lambda u, v, p: np.abs(v - 0.5) < 0.27  # noqa: E731
    both = [plate(line, 0.025).coat("edges", rim).coat("spots", dots_at).at(0, 0.2 * w + 0.02, dz) for line, dz, dots_at in
            ((upper, 0.2 * w, near([(0, 0.1 * w, 0.12 * w), (0, 0.18 * w, 0.02)], 0.03)), (lower, -0.12 * w, near((0, 0.04, -0.1), 0.035)))]
    wings = [s.turn("z", -14).both() for s in both]
    body = limb((0.02, 0, -0.24), (0.02, 0, 0.2), 0.03, 0.04)
    return dict(wings=wings, body=[body, ball(0.05).at(0.02, 0, 0.25), tube([(0.02, 0.02, 0.28), (0.02, 0.08, 0.4), (0.02, 0.14, 0.45)], 0.009).both()])


@kind("bee", "animals", also=("bumblebee",), colours=dict(body="yellow", stripes="black|dark brown", wings="white|light blue", head="black|yellow", eyes="white|black"))
def bee(o, rng):
    body = ball(0.4, 0.28, 0.28).coat("stripes", stripes(4.6, "x", 0.45, 0.2))
    return dict(body=[body, ball(0.2).at(0.38, 0, 0.03).coat("head", above("x", -1.0))], head=[ball(0.19).at(0.42, 0, 0.03), tube([(0.48, 0.06, 0.18), (0.55, 0.1, 0.34), (0.64, 0.12, 0.36)], [0.018, 0.015, 0.022]).both(), cone(0.04, 0.13).turn("y", -90).at(-0.38)],
                wings=ball(0.16, 0.28, 0.025).turn("z", 25).turn("x", 28).at(0.0, 0.28, 0.38).both(), eyes=eyes(0.54, 0.1, 0.07, 0.055), legs=[])


@kind("ladybug", "animals", also=("ladybird", "beetle"), colours=dict(shell="red|orange", dots="black", head="black", eyes="white"), sizes=dict(dots="small 0.7|1|large 1.35"))
def ladybug(o, rng):
    dome = lathe([(0, 0), (0.38, 0), (0.41, 0.06), (0.32, 0.26), (0.16, 0.35), (0, 0.37)]).scale(1.1, 1, 1)
    r = 0.075 * o.dots
    spots = [(x, s * y, z) for x, y, z in ((0.22, 0.17, 0.28), (0, 0.25, 0.26), (-0.22, 0.17, 0.28), (0.03, 0.1, 0.36)) for s in (-1, 1)]
    line = lambda u, v, p: (np.abs(p[:, 1]) < 0.014) & (p[:, 2] > 0.05)  # noqa: E731
    return dict(shell=dome.coat("dots", near(spots, r, (1, 1, 2))).coat("black", line), head=[ball(0.17, 0.2, 0.15).at(0.42, 0, 0.11), limb((0, 0, 0), (0, 0.22, -0.1), 0.025).copies([(x, 0.3, 0.08) for x in (-0.25, 0, 0.25)]).both(), tube([(0.5, 0.05, 0.2), (0.58, 0.1, 0.3)], 0.015).both()],
                eyes=eyes(0.52, 0.1, 0.17, 0.045))


@kind("spider", "animals", colours=dict(body="black|dark brown|brown", legs="=body", eyes="red|white"), sizes=dict(legs="short 0.7|1|long 1.3"))
def spider(o, rng):
    s = o.legs
    knee, foot = (0.34 * s, 0.3 * s), (0.6 * s, -0.05)
    legs = []
    for angle in (35, 68, 105, 142):
        a = np.deg2rad(angle)
        out = np.array([np.cos(a), np.sin(a), 0])
        legs += [limb(0.12 * out + (0.1, 0, 0.18), knee[0] * out + (0.1, 0, 0.1 + knee[1]), 0.025).both(), limb(knee[0] * out + (0.1, 0, 0.1 + knee[1]), foot[0] * out + (0.1, 0, 0.02), 0.022, 0.008).both()]
    return dict(body=[ball(0.26, 0.22, 0.2).at(-0.2, 0, 0.24), ball(0.15, 0.14, 0.11).at(0.12, 0, 0.18)], legs=legs, eyes=[eyes(0.24, 0.045, 0.24, 0.025), eyes(0.22, 0.09, 0.22, 0.016)])
