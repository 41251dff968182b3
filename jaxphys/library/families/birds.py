"""Birds."""

import numpy as np

from jaxphys.library.families.common import (
    ears,
    eyes,
)
from jaxphys.library.kinds import kind
from jaxphys.library.shapes import (
    ball,
    block,
    cone,
    cylinder,
    hull,
    lathe,
    limb,
    ring,
    rod,
    tube,
)

# fmt: off
# ruff: noqa: E731, RUF005


@kind("bird", "animals", also=("little bird", "songbird"),
    colours=dict(plumage="blue|red|brown|yellow", belly="white|orange|cream", beak="orange|yellow",
        wings="=plumage", tail="=plumage", legs="orange", eyes="!black"),
    sizes=dict(tail="short 0.6|1|long 1.5", beak="short 0.7|1|long 1.9"))
def bird(o, rng):
    body = ball(0.32, 0.22, 0.22).turn("y", -28).at(z=0.42)
    return dict(plumage=[body, ball(0.17).at(0.24, 0, 0.72)],
        belly=ball(0.24, 0.18, 0.19).turn("y", -28).at(0.09, 0, 0.36),
        beak=cone(0.055, 0.16 * o.beak).turn("y", 95).at(0.38, 0, 0.72),
        wings=ball(0.26, 0.05, 0.13).turn("y", -5).turn("z", 5).at(-0.08, 0.2, 0.46).both(),
        tail=block(0.36 * o.tail, 0.15, 0.04, 0.02).turn("y", -12).at(-0.34 - 0.14 * o.tail, 0,
        0.26 - 0.03 * o.tail), legs=[limb((0.02, 0.08, 0.25), (0.04, 0.08, 0.02), 0.018).both(),
        *[limb((0.03, 0.08, 0.02), (0.13, 0.08 + y, 0.015), 0.014).both() for y in (-0.05, 0,
        0.05)]], eyes=eyes(0.34, 0.1, 0.77, 0.03))


@kind("duck", "animals", also=("mallard",),
    colours=dict(plumage="light brown|white|brown", head="dark green|white", ring="white",
        beak="yellow|orange", wings="=plumage", feet="orange", eyes="!black"))
def duck(o, rng):
    body = hull([(-0.55, 0.02, 0.4, 0.44), (-0.4, 0.14, 0.22, 0.44), (0, 0.25, 0.1, 0.5),
        (0.3, 0.18, 0.16, 0.48), (0.42, 0.03, 0.28, 0.4)])
    neck = tube([(0.3, 0, 0.36), (0.36, 0, 0.55), (0.33, 0, 0.75)], [0.13, 0.085, 0.09])
    return dict(plumage=body, head=[neck, ball(0.15, 0.125, 0.12).at(0.36, 0, 0.8)],
        ring=ring(0.09, 0.025).at(0.36, 0, 0.54), beak=ball(0.13, 0.07, 0.03).at(0.54, 0, 0.77),
        wings=ball(0.3, 0.05, 0.14).turn("y", 8).at(-0.12, 0.23, 0.36).both(),
        eyes=eyes(0.45, 0.09, 0.84, 0.022),
        feet=[limb((0, 0.1, 0.15), (0.02, 0.1, 0.02), 0.025).both(),
        ball(0.12, 0.08, 0.015).at(0.1, 0.1, 0.015).both()])


@kind("chicken", "animals", also=("hen", "rooster"),
    colours=dict(plumage="white|brown|orange", comb="red", beak="yellow|orange", wings="=plumage",
        tail="=plumage", legs="orange|yellow", eyes="!black"),
    sizes=dict(tail="small 0.7|1|large 1.4"))
def chicken(o, rng):
    body = hull([(-0.42, 0.06, 0.5, 0.62), (-0.25, 0.2, 0.26, 0.62), (0.05, 0.23, 0.2, 0.58),
        (0.28, 0.13, 0.3, 0.6), (0.34, 0.03, 0.4, 0.5)])
    feathers = [ball(0.2 * o.tail, 0.03, 0.08).turn("y", 50 + 16 * k).at(-0.44, 0,
        0.68) for k in range(3)]
    return dict(plumage=[body,
        tube([(0.2, 0, 0.45), (0.28, 0, 0.68), (0.28, 0, 0.82)], [0.17, 0.1, 0.085]),
        ball(0.105, 0.095, 0.1).at(0.3, 0, 0.84)],
        comb=[ball(0.055, 0.02, 0.06).copies([(0.36, 0, 0.95), (0.3, 0, 0.97), (0.23, 0, 0.95)]),
        ball(0.03, 0.02, 0.06).at(0.39, 0, 0.73)],
        beak=cone(0.04, 0.11).turn("y", 100).at(0.39, 0, 0.84),
        wings=ball(0.22, 0.05, 0.14).at(-0.04, 0.21, 0.42).both(), tail=feathers,
        legs=[limb((0, 0.09, 0.22), (0.01, 0.09, 0.02), 0.02).both(),
        *[limb((0, 0.09, 0.02), (0.12, 0.09 + y, 0.015), 0.016).both() for y in (-0.06, 0, 0.06)]],
        eyes=eyes(0.37, 0.075, 0.88, 0.02))


@kind("penguin", "animals",
    colours=dict(plumage="black|dark blue", belly="white", beak="orange", feet="orange",
        wings="=plumage", eyes="!black", scarf="red|blue"),
    extras=dict(scarf=0.25),
    forms=dict(girth="slim 0.8|1|fat 1.25"))
def penguin(o, rng):
    g = o.girth
    body = lathe([(0, 0), (0.22 * g, 0.02), (0.29 * g, 0.25), (0.23 * g, 0.58), (0.17, 0.74),
        (0.165, 0.86), (0.1, 0.96), (0, 0.98)])
    front = lathe([(0, 0.02), (0.18 * g, 0.04), (0.245 * g, 0.25), (0.19 * g, 0.55), (0.12, 0.68),
        (0, 0.7)]).at(x=0.06 * g)
    face = ball(0.08, 0.075, 0.1).at(0.1, 0.06, 0.83).both()
    return dict(plumage=body, belly=[front, face],
        beak=cone(0.05, 0.15).turn("y", 95).at(0.14, 0, 0.82), eyes=eyes(0.17, 0.065, 0.87, 0.025),
        wings=ball(0.12, 0.035, 0.27).turn("x", 14).at(0, 0.27 * g, 0.44).both(),
        feet=ball(0.14, 0.08, 0.04).at(0.12, 0.12, 0.02).both(),
        scarf=[ring(0.175, 0.05).at(0.02, 0, 0.68),
        limb((0.18, 0.08, 0.66), (0.26 * g, 0.1, 0.42), 0.045)] if o.scarf else [])


@kind("owl", "animals",
    colours=dict(plumage="brown|light brown|grey|white", belly="cream|beige",
        wings="dark brown|brown", face="beige|white", beak="orange|yellow", eyes="yellow|orange",
        pupils="!black", feet="orange"))
def owl(o, rng):
    body = lathe([(0, 0), (0.24, 0.03), (0.31, 0.3), (0.28, 0.6), (0.29, 0.78), (0.18, 0.95),
        (0, 0.98)]).scale(0.9, 1, 1)
    flecks = lambda u, v, p: (np.sin(60 * p[:, 1]) > 0.2) & (np.sin(50 * p[:,
        2] + 3 * np.sin(60 * p[:, 1])) > 0.5)
    disc = cylinder(0.125, 0.06, 0.1).turn("y", 90)
    return dict(plumage=[body, ears(np.array([0.06, 0, 0.86]), 0.16, 0.16, 0.07, out=40)],
        belly=ball(0.16, 0.2, 0.27).at(0.15, 0, 0.34).coat("wings", flecks),
        wings=ball(0.16, 0.055, 0.3).turn("x", 6).at(-0.02, 0.28, 0.38).both(),
        face=disc.at(0.19, 0.115, 0.76).both(),
        eyes=ball(0.04, 0.08, 0.08).at(0.245, 0.115, 0.76).both(),
        pupils=ball(0.02, 0.04, 0.04).at(0.275, 0.115, 0.76).both(),
        beak=cone(0.04, 0.12).turn("y", 140).at(0.25, 0, 0.7),
        feet=ball(0.07, 0.05, 0.03).at(0.18, 0.1, 0.02).both())


@kind("flamingo", "animals",
    colours=dict(plumage="pink", neck="=plumage", beak="black", legs="pink|flesh", wings="=plumage",
        eyes="!black"),
    sizes=dict(neck="short 0.7|1|long 1.25", legs="short 0.6|1|long 1.2"))
def flamingo(o, rng):
    z = 0.75 * o.legs
    n = o.neck
    path = [(0.25, 0, z + 0.1), (0.45, 0, z + 0.12), (0.42, 0, z + 0.36 * n),
        (0.3, 0, z + 0.55 * n), (0.36, 0, z + 0.72 * n), (0.48, 0, z + 0.68 * n)]
    head = np.array([0.5, 0, z + 0.66 * n])
    return dict(plumage=hull([(-0.45, 0.01, z, z + 0.02), (-0.2, 0.13, z, z + 0.22),
        (0.1, 0.16, z - 0.04, z + 0.24), (0.33, 0.05, z + 0.03, z + 0.18)]),
        neck=[tube(path, [0.06, 0.05, 0.045, 0.042, 0.045, 0.06]),
        ball(0.085, 0.065, 0.065).at(*head)],
        beak=tube([head + (0.06, 0, 0), head + (0.15, 0, -0.03), head + (0.15, 0, -0.14)],
        [0.045, 0.042, 0.012]), wings=ball(0.26, 0.04, 0.11).turn("y", -6).at(-0.12, 0.14,
        z + 0.13).both(), legs=[limb((0, 0.06, z), (0.02, 0.06, 0.02), 0.022).both(),
        ball(0.08, 0.05, 0.015).at(0.05, 0.06, 0.015).both(),
        ball(0.03).at(0.01, 0.06, 0.5 * z).both()],
        eyes=eyes(head[0] + 0.03, 0.055, head[2] + 0.025, 0.015))


@kind("parrot", "animals",
    colours=dict(plumage="red|green|blue", wings="blue|yellow|green", tail="blue|red",
        beak="black|grey", face="white", perch="brown", eyes="!black"),
    sizes=dict(tail="short 0.6|1|long 1.3"))
def parrot(o, rng):
    body = ball(0.17, 0.16, 0.32).turn("y", 12).at(z=0.55)
    return dict(plumage=[body, ball(0.16, 0.145, 0.15).at(0.11, 0, 0.9)],
        face=ball(0.08, 0.11, 0.08).at(0.16, 0, 0.89),
        beak=tube([(0.2, 0, 0.93), (0.32, 0, 0.9), (0.31, 0, 0.78)], [0.065, 0.055, 0.01]),
        wings=ball(0.12, 0.04, 0.28).turn("y", 18).at(-0.06, 0.16, 0.52).both(),
        tail=ball(0.05, 0.07, 0.3 * o.tail).turn("y", 18).at(-0.12 - 0.06 * o.tail, 0,
        0.28 - 0.22 * o.tail), perch=rod((0.06, -0.4, 0.24), (0.06, 0.4, 0.24), 0.035),
        eyes=eyes(0.21, 0.1, 0.93, 0.022))
