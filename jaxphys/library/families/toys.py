"""Toys."""

import numpy as np

from jaxphys.library.families.common import (
    beast,
    ears,
    eyes,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions, ripples
from jaxphys.library.patterns import (
    between,
    dots,
    either,
    mottled,
    stripes,
)
from jaxphys.library.shapes import (
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
    sheet,
    smooth,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731, RUF005


@kind("teddy bear", "toys", also=("plush bear", "stuffed bear", "teddy"),
    colours=dict(fur="brown|light brown|beige|white", muzzle="beige|cream", ears="=fur",
        paws="=muzzle", nose="!black", eyes="!black", bow_tie="red|blue|green"),
    sizes=dict(ears="small 0.75|1|large 1.35", arms="short 0.8|1|long 1.3"),
    extras=dict(bow_tie=0.5))
def teddy_bear(o, rng):
    plush = ripples(rng, 9)
    soft = lambda s: s.shade(mottled(plush, 0.05))
    e = o.ears
    arm = limb((0.06, 0.2, 0.12), (0.16, 0.24 + 0.16 * o.arms, -0.02 - 0.13 * o.arms), 0.12, 0.1)
    head = ball(0.28, 0.3, 0.27).at(0.02, 0, 0.52)
    mouth = tube([(0.39, -0.05, 0.40), (0.405, 0, 0.385), (0.39, 0.05, 0.40)], 0.01)
    return dict(fur=[soft(s) for s in (ball(0.29, 0.3, 0.36), head, arm.both(),
        limb((0.1, 0.16, -0.24), (0.42, 0.23, -0.26), 0.14, 0.13).both())],
        ears=[soft(ball(0.07, 0.115 * e, 0.115 * e).at(0.0, 0.23, 0.75)).both()],
        muzzle=[soft(ball(0.13, 0.14, 0.11).at(0.26, 0, 0.45)),
        ball(0.05, 0.075 * e, 0.075 * e).at(0.045, 0.23, 0.75).both(),
        soft(ball(0.1, 0.2, 0.24).at(0.22, 0, 0.0))],
        paws=ball(0.045, 0.095, 0.1).at(0.53, 0.235, -0.26).both(),
        nose=ball(0.045, 0.06, 0.042).at(0.375, 0, 0.49), black=mouth,
        eyes=eyes(0.265, 0.115, 0.57, 0.036),
        bow_tie=[ball(0.05, 0.11, 0.075).turn("x", -12).at(0.27, 0.11, 0.27).both(),
        ball(0.05).at(0.3, 0, 0.27)] if o.bow_tie else [])


@kind("rubber duck", "toys", also=("rubber ducky", "toy duck", "bath duck"),
    colours=dict(body="yellow", head="=body", beak="orange", wings="=body", eyes="!black",
        hat="red|blue|black", tail="=body"),
    sizes=dict(beak="small 0.75|1|large 1.4"),
    extras=dict(hat=0.12))
def rubber_duck(o, rng):
    b = 1.2 * o.beak
    body = hull([(-0.5, 0.02, 0.16, 0.22), (-0.36, 0.17, -0.1, 0.2), (-0.1, 0.3, -0.24, 0.18),
        (0.2, 0.29, -0.24, 0.2), (0.4, 0.16, -0.13, 0.14), (0.46, 0.04, -0.04, 0.06)])
    return dict(body=body, head=[ball(0.235).at(0.2, 0, 0.37),
        cylinder(0.17, 0.12).at(0.19, 0, 0.13)],
        beak=[ball(0.12 * b, 0.12 * b, 0.035 * b).turn("y", -12).at(0.43, 0, 0.36),
        ball(0.09 * b, 0.09 * b, 0.03 * b).turn("y", 14).at(0.42, 0, 0.32)],
        wings=ball(0.2, 0.055, 0.13).turn("y", 14).at(-0.06, 0.28, 0.05).both(),
        eyes=ball(0.028, 0.03, 0.045).at(0.39, 0.1, 0.44).both(),
        tail=cone(0.1, 0.16).turn("y", -55).at(-0.42, 0, 0.16),
        hat=lathe([(0, 0.56), (0.18, 0.56), (0.18, 0.585), (0.11, 0.585), (0.1, 0.74), (0, 0.74)],
        sharp=True).at(0.18) if o.hat else [])


@kind("snowman", "toys",
    colours=dict(snow="white", scarf="red|blue|green", hat="black|dark blue", nose="!orange",
        buttons="!black", arms="brown", eyes="!black"),
    counts=dict(balls="2|3"),
    extras=dict(scarf=0.8, hat=0.85))
def snowman(o, rng):
    three = o.balls == 3
    balls = [ball(0.34), ball(0.25).at(z=0.46),
        ball(0.19).at(z=0.83)] if three else [ball(0.36).at(z=0.1), ball(0.24).at(z=0.62)]
    z, r = (0.83, 0.19) if three else (0.62, 0.24)
    mid = 0.46 if three else 0.2
    branch = [rod((0, 0.2, mid + 0.06), (0, 0.54, mid + 0.26), 0.018, 0.012),
        rod((0, 0.43, mid + 0.2), (0, 0.5, mid + 0.32), 0.01)]
    mouth = ball(0.016).copies([(np.sqrt(r**2 - y**2 - 0.0064) , y,
        z - 0.08 - 0.02 * np.cos(12 * y)) for y in (-0.08, -0.04, 0, 0.04, 0.08)])
    return dict(snow=balls, nose=cone(0.035, 0.22).turn("y", 92).at(r - 0.02, 0, z),
        eyes=eyes(r - 0.03, 0.07, z + 0.06, 0.026), black=mouth,
        buttons=ball(0.028).copies([(np.sqrt(0.0625 - h * h) if three
        else np.sqrt(0.1296 - (h + 0.05) ** 2), 0, mid + h) for h in (-0.07, 0.03, 0.13)]),
        arms=[s.both() for s in branch],
        scarf=[ring(0.82 * r, 0.05).at(z=z - 0.75 * r),
        limb((0.16, 0.1, z - 0.8 * r), (0.25 if three else 0.32, 0.13, z - 0.8 * r - 0.2),
        0.045)] if o.scarf else [],
        hat=lathe([(0, 0), (1.2 * r, 0), (1.2 * r, 0.025), (0.78 * r, 0.025), (0.76 * r, 0.22),
        (0, 0.22)], sharp=True).at(z=z + 0.72 * r) if o.hat else [])


@kind("robot", "toys", also=("toy robot", "tin robot"),
    colours=dict(body="silver|blue|red|grey|turquoise", head="=body", arms="grey|silver",
        legs="=arms", eyes="yellow|light blue|red", buttons="!red", antenna="red|yellow"),
    counts=dict(antennas="1|2"),
    sizes=dict(arms="short 0.75|1|long 1.3"))
def robot(o, rng):
    a = 0.34 * o.arms
    spots = [0.0] if o.antennas == 1 else [-0.1, 0.1]
    claw = ring(0.055, 0.022).turn("y", 90)
    joints = ring(0.05, 0.012).copies([(0, 0.31, 0.52 - a * t) for t in (0.2, 0.4, 0.6, 0.8)])
    return dict(body=[block(0.34, 0.48, 0.46, 0.04).at(z=0.38), cylinder(0.09, 0.1).at(z=0.6)],
        head=block(0.32, 0.38, 0.28, 0.04).at(z=0.82),
        eyes=cylinder(0.06, 0.04).turn("y", 90).at(0.15, 0.09, 0.86).both(),
        white=block(0.02, 0.2, 0.05).at(0.16, 0, 0.75).coat("black", lambda u, v,
        p: (p[:, 1] * 26) % 1 < 0.3),
        antenna=[rod((0, y, 0.94), (0, 1.5 * y, 1.1),
        0.014) for y in spots] + [ball(0.04).copies([(0, 1.5 * y, 1.11) for y in spots])],
        antennas=[], arms=[limb((0, 0.27, 0.53), (0, 0.31, 0.52 - a), 0.045).both(), joints.both(),
        claw.at(0, 0.32, 0.46 - a).both()],
        legs=[rod((0, 0.12, 0.17), (0, 0.12, 0.04), 0.055).both(),
        block(0.24, 0.16, 0.08, 0.03).at(0.04, 0.13, 0.03).both()],
        buttons=[ball(0.03, 0.035, 0.035).copies([(0.17, y, 0.3) for y in (-0.1, 0, 0.1)])],
        **{"light blue": block(0.02, 0.26, 0.14).at(0.17, 0, 0.47).coat("green", lambda u, v,
        p: np.abs(p[:, 2] - 0.04 * np.sin(50 * p[:, 1])) < 0.012)})


@kind("balloon", "toys", also=("party balloon",),
    colours=dict(balloon="red|blue|yellow|pink|green|purple", string="!white",
        pattern="white|yellow"),
    forms=dict(style="plain|dotted|striped"))
def balloon(o, rng):
    body = lathe([(0, -0.42), (0.06, -0.37), (0.24, -0.16), (0.35, 0.12), (0.27, 0.36), (0, 0.46)])
    if o.style == "dotted":
        body = body.coat("pattern", dots(44, 0.15, (0, 0, 0.1)))
    elif o.style == "striped":
        body = body.coat("pattern", stripes(7, "z", 0.4))
    return dict(balloon=[body, cone(0.07, 0.08).at(z=-0.47)],
        string=tube([(0, 0, -0.44), (0.03, 0.03, -0.65), (-0.02, -0.04, -0.85),
        (0.02, 0.02, -1.05)], 0.009))


@kind("kite", "toys",
    colours=dict(kite="red|blue|yellow|green", panels="yellow|white|light blue", tail="=kite",
        bows="blue|red|yellow"),
    counts=dict(bows="3|4|5"))
def kite(o, rng):
    quad = refined([(0.34, 0.12), (0, 0.5), (-0.34, 0.12), (0, -0.5)], 6)
    body = plate(quad, 0.03).coat("panels", lambda u, v,
        p: p[:, 0] * (p[:, 1] - 0.12) > 0).at(z=0.3)
    z = np.linspace(-0.3, -0.9, o.bows)
    line = lambda a: np.array([0, 0.07 * np.sin(11 * a), a])
    path = [line(a) for a in np.linspace(-0.2, -0.95, 12)]
    bow = cone(0.055, 0.1).turn("x", -90).both()
    return dict(kite=body, brown=[rod((0.02, 0, -0.2), (0.02, 0, 0.8), 0.01),
        rod((0.02, -0.34, 0.42), (0.02, 0.34, 0.42), 0.01)], tail=tube(path, 0.01),
        bows=bow.mapped(np.diag([1.0, -1, 1])).copies([line(a) + (0, 0, 0) for a in z]))


@kind("spinning top", "toys", also=("toy top",),
    colours=dict(top="red|blue|yellow|green", stripes="yellow|white|blue",
        handle="wooden|red|yellow"),
    counts=dict(stripes="1|2|3"))
def spinning_top(o, rng):
    n = o.stripes
    where = either(*[between("z", -0.2 + 0.42 * (k + 0.3) / n,
        -0.2 + 0.42 * (k + 0.3) / n + 0.06) for k in range(n)])
    return each(dict(top=lathe([(0, -0.5), (0.03, -0.48), (0.1, -0.35), (0.38, -0.05), (0.42, 0.06),
        (0.3, 0.2), (0.08, 0.28), (0, 0.29)]).coat("stripes", where),
        handle=lathe([(0, 0.25), (0.05, 0.25), (0.035, 0.4), (0.065, 0.5), (0, 0.53)]), stripes=[]),
        lambda s: s.turn("x", 14))


@kind("toy blocks", "toys", also=("building blocks", "stack of blocks", "wooden blocks"),
    colours=dict(blocks="red|wooden|blue"),
    counts=dict(blocks="3|4|6"))
def toy_blocks(o, rng):
    names = list(rng.permutation(["blue", "yellow", "green", "red", "orange", "purple",
        "light blue"]))
    places = {3: [(0, -0.17, 0.15), (0, 0.17, 0.15), (0, 0, 0.46)],
        4: [(0, -0.34, 0.15), (0, 0, 0.15), (0, 0.34, 0.15), (0, 0.05, 0.46)],
        6: [(0, -0.34, 0.15), (0, 0, 0.15), (0, 0.34, 0.15), (0, -0.17, 0.46), (0, 0.17, 0.46),
        (0, 0, 0.77)]}[o.blocks]
    rim = lambda u, v, p: (np.abs(p).max(1) > 0.14) & (np.sort(np.abs(p), 1)[:,
        1] < 0.115) & (np.sort(np.abs(p), 1)[:, 1] > 0.085)
    parts = {}
    for k, place in enumerate(places):
        parts.setdefault("blocks" if k == 0 else str(names[k]),
            []).append(block(0.3, 0.3, 0.3, 0.025).coat("white", rim).turn("z",
            rng.normal(0, 9)).at(*place))
    return parts


@kind("rocking horse", "toys",
    colours=dict(horse="wooden|white|brown", rockers="red|blue|wooden", mane="brown|cream|black",
        saddle="red|blue", tail="=mane"))
def rocking_horse(o, rng):
    parts, head = beast(0.8, 0.17, 0.34, 0.055, 0.3, 60, 0.105, 0.15, 0.65, paws=False, droop=45)
    a = np.linspace(-0.62, 0.62, 9)
    rocker = tube(np.stack([a, 0 * a + 0.13, 0.42 * a**2 - 0.07], -1), 0.032).both()
    mane = [ball(0.05).at(*(head + np.array([-0.1 - 0.055 * k, 0, 0.08 - 0.085 * k])))
        for k in range(5)]
    return dict(horse=[*parts["body"], parts["muzzle"], *parts["legs"]],
        rockers=[rocker, rod((-0.34, -0.13, 0.0), (-0.34, 0.13, 0.0), 0.025),
        rod((0.34, -0.13, 0.0), (0.34, 0.13, 0.0), 0.025)], mane=mane,
        saddle=[cushion(0.26, 0.3, 0.09, 3).at(-0.03, 0, 0.64),
        cushion(0.16, 0.37, 0.24, 3).at(-0.03, 0, 0.52)],
        tail=tube([(-0.38, 0, 0.55), (-0.5, 0, 0.5), (-0.52, 0, 0.25)], [0.03, 0.05, 0.02]),
        black=eyes(head[0] + 0.06, 0.085, head[2] + 0.02, 0.02),
        ears=ears(head, 0.1, 0.1, 0.04, out=25))


@kind("pinwheel", "toys", also=("toy windmill",),
    colours=dict(blades="red|blue|yellow|pink", stick="white|wooden", pin="golden|white",
        backs="white|yellow"),
    counts=dict(blades="4|6|8"))
def pinwheel(o, rng):
    n = o.blades
    w = 1.5 / n
    blade = sheet(lambda u, v: np.stack([0.13 * np.sin(np.pi * u) * v,
        0.04 + 0.42 * v * (1 - 0.35 * u), w * v * u * 1.1], -1), 0.015)
    both = blade.coat("backs", lambda u, v, p: u > 0.5)
    return dict(blades=[both.turn("x", 360 / n * k).at(z=0.4) for k in range(n)],
        pin=ball(0.045).at(0.04, 0, 0.4), stick=rod((-0.02, 0, 0.4), (-0.02, 0, -0.55), 0.018))


@kind("doll", "toys", also=("rag doll", "little girl doll"),
    colours=dict(dress="red|pink|blue|yellow|purple", hair="brown|yellow|black|orange",
        skin="skin|brown|light brown", shoes="black|red|brown", eyes="!black", bow="=dress"),
    extras=dict(bow=0.6))
def doll(o, rng):
    strands = golden_directions(90)
    keep = (strands[:, 2] > -0.2) & (strands[:, 0] < 0.45) | (strands[:, 2] > 0.6)
    hair = ball(0.06).copies(strands[keep] * 0.2 + (0, 0, 0.66))
    return dict(dress=[lathe([(0, 0.46), (0.1, 0.46), (0.13, 0.3), (0.28, -0.02), (0, 0.0)],
        waves=(8, 0.05)), limb((0, 0.12, 0.4), (0.04, 0.22, 0.3), 0.065).both()],
        hair=[hair, tube([(-0.03, 0.2, 0.66), (0.0, 0.29, 0.55), (0.0, 0.28, 0.38)],
        [0.05, 0.065, 0.03]).both()],
        skin=[ball(0.21, 0.2, 0.21).at(0.02, 0, 0.66),
        limb((0.04, 0.22, 0.3), (0.08, 0.3, 0.14), 0.045).both(),
        limb((0, 0.09, 0.05), (0, 0.09, -0.24), 0.055).both(), cylinder(0.06, 0.1).at(z=0.43)],
        shoes=ball(0.1, 0.065, 0.06).at(0.04, 0.09, -0.27).both(),
        eyes=eyes(0.2, 0.075, 0.68, 0.026),
        red=tube([(0.215, -0.045, 0.59), (0.225, 0, 0.575), (0.215, 0.045, 0.59)], 0.011),
        pink=ball(0.02, 0.035, 0.03).at(0.19, 0.12, 0.61).both(),
        bow=[ball(0.04, 0.075, 0.05).turn("x", -15).at(0.06, 0.07, 0.88).both(),
        ball(0.035).at(0.07, 0, 0.87)] if o.bow else [])


@kind("yo-yo", "toys", also=("yoyo",),
    colours=dict(body="red|blue|green|yellow", sides="yellow|white", string="!white"))
def yoyo(o, rng):
    half = lathe([(0, 0.02), (0.1, 0.02), (0.33, 0.06), (0.36, 0.12), (0.28, 0.2),
        (0, 0.22)]).coat("sides", lambda u, v,
        p: (np.hypot(p[:, 0], p[:, 1]) < 0.2) & (p[:, 2] > 0.12))
    return each(dict(body=[half.turn("x", 90).both(),
        cylinder(0.09, 0.1).at(z=-0.05).turn("x", 90)],
        string=[rod((0, 0, 0.05), (0.0, 0, 0.85), 0.01),
        ring(0.06, 0.01).turn("x", 90).at(0, 0, 0.9)]), lambda s: s.turn("z", 55))


@kind("dinosaur", "toys", also=("t-rex", "tyrannosaurus", "toy dinosaur"),
    colours=dict(skin="green|dark green|light brown|purple|orange",
        belly="light green|cream|yellow", spikes="=skin", eyes="white|yellow", teeth="!white",
        claws="!cream"),
    sizes=dict(tail="short 0.7|1|long 1.25"),
    extras=dict(spikes=0.6))
def dinosaur(o, rng):
    t = 0.62 * o.tail
    spine = [(-0.12 - t, 0, 0.08), (-0.12 - 0.55 * t, 0, 0.18), (-0.15, 0, 0.4), (0.08, 0, 0.56),
        (0.2, 0, 0.78), (0.26, 0, 0.86)]
    body = tube(spine, [0.015, 0.09, 0.21, 0.19, 0.12, 0.1], sides=12)
    head = [hull([(0.1, 0.05, 0.82, 0.96), (0.22, 0.13, 0.78, 1.02), (0.4, 0.11, 0.84, 0.98),
        (0.56, 0.08, 0.84, 0.93), (0.59, 0.03, 0.86, 0.9)], square=2.6),
        hull([(0.16, 0.09, 0.74, 0.84), (0.4, 0.085, 0.74, 0.79), (0.53, 0.05, 0.755, 0.785)],
        square=2.6)]
    leg = [ball(0.16, 0.09, 0.19).at(-0.08, 0.16, 0.33),
        limb((-0.02, 0.18, 0.22), (-0.1, 0.19, 0.06), 0.075, 0.055),
        ball(0.13, 0.075, 0.045).at(0.0, 0.19, 0.045)]
    arm = [limb((0.17, 0.12, 0.58), (0.28, 0.16, 0.52), 0.04),
        limb((0.28, 0.16, 0.52), (0.34, 0.14, 0.57), 0.03, 0.015)]
    at = np.linspace(0.06, 0.8, 9)
    path = smooth(np.array(spine), 60)
    radius = np.interp(at, [0, 0.25, 0.5, 0.7, 1], [0.03, 0.09, 0.2, 0.18, 0.11])
    where = path[(at * 59).astype(int)]
    slope = np.gradient(path, axis=0)[(at * 59).astype(int)]
    up = np.stack([-slope[:, 2], 0 * at, slope[:, 0]], -1)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    spikes = cone(0.045, 0.11).scale(1, 0.5, 1).copies(where + 0.92 * radius[:, None] * up, up)
    teeth = cone(0.014, 0.05).turn("x",
        180).copies([(x, s * (0.09 - 0.05 * (x - 0.3)), 0.845) for x in np.linspace(0.3, 0.55,
        6) for s in (-1, 1)])
    return dict(skin=[body, *head, *(s.both() for s in leg), *(s.both() for s in arm)],
        belly=ball(0.13, 0.15, 0.22).turn("y", 40).at(0.08, 0, 0.46),
        spikes=spikes if o.spikes else [], eyes=eyes(0.27, 0.11, 0.97, 0.036),
        black=ball(0.02).at(0.295, 0.13, 0.975).both(), teeth=teeth,
        claws=cone(0.02, 0.06).turn("y",
        90).copies([(0.1, s * 0.19 + y, 0.035) for s in (-1, 1) for y in (-0.045, 0, 0.045)]))
