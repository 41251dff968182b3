"""Clothes, shoes, bags and jewels; worn facing +x. Shoes point to +x."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    above,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cylinder,
    hull,
    lathe,
    limb,
    oblong,
    plate,
    polygon,
    refined,
    ring,
    rod,
    rounded,
    sheet,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731

CLOTH = "red|blue|white|green|yellow|purple|black"


@kind("sneaker", "clothes", also=("running shoe", "sports shoe", "trainer", "shoe"),
    colours=dict(upper="white|red|blue|black|green", sole="white|black|light grey",
        laces="white|black", stripe="red|blue|black|white", toe="=upper"),
    sizes=dict(sole="thin 0.7|1|thick 1.6"),
    forms=dict(height="low 0.85|1|high 1.3"))
def sneaker(o, rng):
    s, k = 0.08 * o.sole, o.height
    sole = hull([(-0.5, 0.08, 0, s * 1.2), (-0.42, 0.15, 0, s * 1.3), (-0.05, 0.135, 0, s),
        (0.25, 0.175, 0, s), (0.42, 0.14, 0.01, s), (0.52, 0.03, 0.04, s)], square=3.5)
    upper = hull([(-0.47, 0.06, s * 0.6, 0.3 * k), (-0.4, 0.125, s * 0.6, 0.42 * k),
        (-0.2, 0.13, s * 0.6, 0.36 * k), (-0.05, 0.125, s * 0.6, 0.33),
        (0.15, 0.145, s * 0.6, 0.24), (0.35, 0.13, s * 0.6, 0.17), (0.49, 0.04, s * 0.6, 0.11)],
        square=2.6)
    swoosh = lambda u, v, p: (np.abs(p[:,
        2] - 0.16 - 0.45 * (p[:, 0] + 0.1) ** 2 + 0.1 * (p[:, 0] + 0.05)) < 0.022) & (p[:,
        0] < 0.2) & (p[:, 0] > -0.36)
    cuts = np.linspace(-0.02, 0.2, 5)
    lace = [tube([(x, 0.085, 0.335 - 0.42 * (x + 0.02)), (x, 0, 0.355 - 0.42 * (x + 0.02)),
        (x, -0.085, 0.335 - 0.42 * (x + 0.02))], 0.016) for x in cuts]
    bow = [tube([(-0.04, 0, 0.35), (-0.03, s1 * 0.07, 0.4), (0.0, s1 * 0.12, 0.36),
        (-0.04, 0, 0.35)], 0.013) for s1 in (-1, 1)]
    hole = hull([(-0.4, 0.03, 0.35 * k, 0.42 * k), (-0.33, 0.085, 0.3 * k, 0.415 * k),
        (-0.16, 0.08, 0.28 * k, 0.355 * k), (-0.08, 0.03, 0.28, 0.34)], square=2.6)
    return dict(upper=upper.coat("stripe", swoosh).coat("toe", above("x", 0.33)), sole=sole,
        laces=[*lace, *bow], **{"dark grey": hole})


@kind("boot", "clothes", also=("rain boot", "rubber boot", "wellington boot"),
    colours=dict(boot="yellow|red|green|blue|leather|black", sole="black|brown|white",
        trim="=boot"),
    forms=dict(height="short 0.7|1|tall 1.3"))
def boot(o, rng):
    h = 0.66 * o.height
    shaft = lathe([(0, 0.1), (0.15, 0.1), (0.145, 0.3), (0.175, h), (0.145, h), (0.12, 0.4),
        (0, 0.35)]).scale(1.1, 0.95, 1).at(-0.16)
    foot = hull([(-0.32, 0.06, 0.05, 0.3), (-0.22, 0.14, 0.03, 0.36), (0.02, 0.135, 0.03, 0.28),
        (0.25, 0.15, 0.03, 0.2), (0.38, 0.05, 0.04, 0.12)], square=2.5)
    sole = hull([(-0.33, 0.08, 0, 0.07), (-0.25, 0.145, 0, 0.07), (0.0, 0.14, 0, 0.055),
        (0.28, 0.16, 0, 0.055), (0.4, 0.04, 0.01, 0.06)], square=3.5)
    return dict(boot=[shaft, foot], sole=[sole, block(0.2, 0.24, 0.08, 0.02).at(-0.22, 0, -0.01)],
        trim=ring(0.162, 0.022).scale(1.1, 0.95, 1).at(-0.16, 0, h - 0.01))


@kind("high heel", "clothes", also=("high-heeled shoe", "stiletto"),
    colours=dict(shoe="red|black|pink|golden", heel="=shoe", sole="beige|black"),
    sizes=dict(heel="short 0.6|1|long 1.35"))
def high_heel(o, rng):
    h = 0.36 * o.heel
    line = lambda x: h * np.clip((0.12 - x) / 0.5, 0, 1) ** 1.5
    xs = np.linspace(-0.44, 0.1, 8)
    bed = hull([*[(x, 0.075 + 0.03 * (x + 0.44), line(x), line(x) + 0.05) for x in xs],
        (0.3, 0.105, 0, 0.05), (0.46, 0.05, 0.0, 0.04), (0.5, 0.01, 0.01, 0.03)], square=3)
    toe = hull([(0.16, 0.1, 0.02, 0.14), (0.3, 0.11, 0.01, 0.16), (0.44, 0.06, 0.01, 0.1),
        (0.51, 0.01, 0.02, 0.05)], square=2.3)
    back = hull([(-0.46, 0.05, h, h + 0.2), (-0.42, 0.085, h - 0.02, h + 0.24),
        (-0.34, 0.09, h - 0.04, h + 0.17), (-0.2, 0.095, line(-0.2), line(-0.2) + 0.1),
        (0.0, 0.1, line(0), line(0) + 0.07)], square=2.5)
    inside = hull([(-0.4, 0.03, h + 0.06, h + 0.245), (-0.34, 0.07, h + 0.02, h + 0.19),
        (-0.2, 0.075, line(-0.2) + 0.02, line(-0.2) + 0.112), (0.0, 0.085, line(0), line(0) + 0.08),
        (0.17, 0.075, 0.03, 0.13)], square=2.5)
    return dict(shoe=[bed, toe, back], heel=rod((-0.37, 0, h + 0.03), (-0.34, 0, 0.0), 0.06, 0.02),
        sole=inside)


@kind("t-shirt", "clothes", also=("shirt", "tee shirt", "tshirt"),
    colours=dict(shirt="white|red|blue|green|yellow|black", sleeves="=shirt", collar="=shirt",
        star="yellow|white|red", stripes="white|dark blue"),
    sizes=dict(sleeves="short 0.7|1|long 2.0"),
    forms=dict(style="plain|striped"),
    extras=dict(star=0.25))
def t_shirt(o, rng):
    s = 0.24 * o.sleeves
    body = plate(refined([(0.27, -0.42), (0.27, 0.1), (0.3, 0.32), (0.12, 0.4), (-0.12, 0.4),
        (-0.3, 0.32), (-0.27, 0.1), (-0.27, -0.42)], 6), 0.17, puff=0.5)
    arm = hull([(0, 0.075, -0.11, 0.11), (s, 0.07, -0.1, 0.1), (s + 0.02, 0.06, -0.09, 0.09)],
        square=2.5, sharp=True).turn("z", 90).turn("x", -38).at(0, 0.2, 0.26)
    line = stripes(8, "y", 0.4)
    if o.style == "striped":
        body = body.coat("stripes", line)
    return dict(shirt=body, sleeves=arm.both(),
        collar=ring(0.12, 0.03).scale(0.6, 1, 1).turn("y", 14).at(0.01, 0, 0.4),
        star=plate(polygon(5, 0.13, 0.055, np.pi / 2), 0.02).at(0.1, 0, 0.08) if o.star else [])


@kind("trousers", "clothes", also=("jeans", "pants"),
    colours=dict(legs="blue|dark blue|black|brown|grey|green", belt="brown|black", buckle="!golden",
        pockets="=legs"),
    sizes=dict(legs="short 0.5|1|long 1.15"),
    extras=dict(belt=0.6))
def trousers(o, rng):
    h = 0.72 * o.legs
    leg = lathe([(0, 0.1), (0.155, 0.08), (0.13, -0.3 * h), (0.115, -h), (0, -h)],
        sharp=True).scale(0.85, 1, 1).turn("x", 5).at(0, 0.125, 0)
    seam = lambda u, v, p: 1 - 0.15 * (np.abs((u + 0.25) % 0.5 - 0.0) < 0.01)
    pocket = block(0.02, 0.1, 0.11, 0.01).at(-0.135, 0.12, 0.08).both()
    return dict(legs=[leg.shade(seam).both(),
        hull([(-0.14, 0.2, 0.0, 0.24), (-0.1, 0.26, -0.05, 0.24), (0.1, 0.26, -0.05, 0.24),
        (0.14, 0.2, 0.0, 0.24)], square=3)], pockets=pocket,
        belt=lathe([(0, 0.2), (1, 0.2), (1, 0.27), (0, 0.27)], sharp=True,
        outline=oblong(0.29, 0.54, 0.13)) if o.belt else [],
        buckle=block(0.02, 0.07, 0.07).at(0.15, 0, 0.235) if o.belt else [])


@kind("dress", "clothes", also=("gown", "summer dress"),
    colours=dict(dress="red|pink|blue|yellow|white|purple", belt="white|golden|black",
        pattern="white|yellow", top="=dress"),
    sizes=dict(skirt="short 0.65|1|long 1.3"),
    forms=dict(style="plain|dotted|striped"),
    extras=dict(belt=0.6))
def dress(o, rng):
    h = 0.62 * o.skirt
    skirt = lathe([(0, 0), (0.13, 0), (0.24, -0.4 * h), (0.36, -h), (0, -0.9 * h)], sharp=True,
        waves=(9, 0.06)).scale(0.85, 1, 1)
    top = lathe([(0, -0.02), (0.13, 0), (0.17, 0.2), (0.13, 0.3), (0, 0.3)]).scale(0.72, 1, 1)
    if o.style == "dotted":
        mark = lambda u, v, p: np.hypot((u * 14 + 0.5 * np.floor(p[:, 2] * 9)) % 1 - 0.5,
            (p[:, 2] * 9) % 1 - 0.5) < 0.24
        skirt, top = skirt.coat("pattern", mark), top.coat("pattern", mark)
    elif o.style == "striped":
        skirt, top = (x.coat("pattern", stripes(9, "z", 0.35)) for x in (skirt, top))
    return dict(dress=skirt,
        top=[top, tube([(0.06, 0.1, 0.26), (0.0, 0.105, 0.42), (-0.06, 0.1, 0.26)], 0.022).both()],
        belt=ring(0.13, 0.03).scale(0.76, 1.02, 1) if o.belt else [])


@kind("sock", "clothes", also=("striped sock", "christmas stocking"),
    colours=dict(sock="red|white|blue|green|grey", stripes="white|yellow", toe="=sock",
        heel="=sock", cuff="=sock"),
    forms=dict(style="*striped|plain"))
def sock(o, rng):
    path = [(-0.2, 0, 0.62), (-0.2, 0, 0.3), (-0.2, 0, 0.08), (-0.1, 0, -0.07), (0.12, 0, -0.1),
        (0.34, 0, -0.1)]
    body = tube(path, [0.145, 0.14, 0.135, 0.145, 0.135, 0.1])
    if o.style == "striped":
        body = body.coat("stripes", lambda u, v, p: (v * 11) % 1 < 0.42)
    return each(dict(sock=body, toe=ball(0.12, 0.11, 0.105).at(0.33, 0, -0.1),
        heel=ball(0.12, 0.115, 0.12).at(-0.2, 0, -0.04),
        cuff=lathe([(0, 0.52), (0.16, 0.52), (0.165, 0.66), (0.12, 0.66), (0, 0.56)]).at(-0.2)),
        lambda s: s.turn("z", 50))


@kind("mitten", "clothes", also=("glove", "winter glove", "woolly mitten"),
    colours=dict(mitten="red|blue|green|purple|white", cuff="white|cream", pattern="white|yellow"),
    forms=dict(style="plain|striped"))
def mitten(o, rng):
    body = ball(0.13, 0.25, 0.36).at(z=0.14)
    if o.style == "striped":
        body = body.coat("pattern", stripes(9, "z", 0.4))
    rib = lambda u, v, p: 0.86 + 0.15 * np.cos(2 * np.pi * 24 * u)
    return dict(mitten=[body, limb((0, 0.15, -0.02), (0, 0.34, 0.16), 0.095, 0.08)],
        cuff=lathe([(0, -0.38), (0.21, -0.38), (0.2, -0.2), (0.22, -0.12), (0, -0.12)]).scale(0.7,
        1, 1).shade(rib))


@kind("bow tie", "clothes", also=("bowtie",),
    colours=dict(bow="red|black|blue|purple", knot="=bow", pattern="white|yellow"),
    forms=dict(style="plain|dotted|striped"))
def bow_tie(o, rng):
    wing = plate(rounded([(0.28, 0.24), (0.3, 0), (0.28, -0.24), (0, -0.15), (-0.24, -0.07),
        (-0.24, 0.07), (0, 0.15)]), 0.2, puff=0.8)
    if o.style == "dotted":
        wing = wing.coat("pattern", lambda u, v,
            p: np.hypot((p[:, 0] * 9) % 1 - 0.5, (p[:, 1] * 9) % 1 - 0.5) < 0.26)
    elif o.style == "striped":
        wing = wing.coat("pattern", lambda u, v, p: ((p[:, 0] + p[:, 1]) * 9) % 1 < 0.4)
    return dict(bow=wing.at(y=0.22).both(), knot=block(0.22, 0.16, 0.2, 0.06))


@kind("tie", "clothes", also=("necktie",),
    colours=dict(tie="red|blue|black|green|purple", stripes="white|yellow|dark blue"),
    forms=dict(style="plain|striped"),
    sizes=dict(tie="short 0.7|1|long 1.2"))
def tie(o, rng):
    h = 0.85 * o.tie
    body = plate(refined([(0.06, 0.5 * h), (0.14, -0.36 * h), (0, -0.5 * h), (-0.14, -0.36 * h),
        (-0.06, 0.5 * h)], 6), 0.05)
    if o.style == "striped":
        body = body.coat("stripes", lambda u, v, p: ((p[:, 0] * 0.8 + p[:, 1]) * 8) % 1 < 0.4)
    return dict(tie=[body.at(z=-0.5 * h),
        plate(refined([(0.11, 0.07), (0.055, -0.07), (-0.055, -0.07), (-0.11, 0.07)], 4),
        0.1).at(z=0.04), tube([(0.0, 0.06, 0.08), (-0.06, 0.16, 0.2), (-0.16, 0, 0.24),
        (-0.06, -0.16, 0.2), (0, -0.06, 0.08)], 0.03, flat=0.6)])


@kind("handbag", "clothes", also=("purse", "ladies' bag"),
    colours=dict(bag="red|leather|black|pink|blue", handle="=bag", clasp="golden|silver",
        flap="=bag"),
    sizes=dict(handle="short 0.65|1|long 1.5"))
def handbag(o, rng):
    h = 0.4 * o.handle
    body = hull([(-0.13, 0.38, 0.0, 0.5), (-0.11, 0.42, 0, 0.52), (0.11, 0.42, 0, 0.52),
        (0.13, 0.38, 0.0, 0.5)], square=4)
    flap = plate(rounded([(0.4, 0.16), (0.36, -0.08), (0.16, -0.2), (-0.16, -0.2), (-0.36, -0.08),
        (-0.4, 0.16), (0, 0.18)]), 0.3).scale(0.93, 1, 1).at(0, 0, 0.38)
    return dict(bag=body, flap=flap, clasp=block(0.04, 0.09, 0.07, 0.02).at(0.145, 0, 0.2),
        handle=tube([(0, -0.28, 0.5), (0, -0.25, 0.5 + 0.8 * h), (0, 0, 0.5 + h),
        (0, 0.25, 0.5 + 0.8 * h), (0, 0.28, 0.5)], 0.028),
        golden=ring(0.04, 0.014).turn("x", 90).at(0, 0.28, 0.52).both())


@kind("backpack", "clothes", also=("rucksack", "school bag"),
    colours=dict(bag="blue|red|green|yellow|purple", pocket="=bag", straps="dark grey|brown|black",
        zips="!golden", flap="=bag"),
    sizes=dict(pocket="small 0.75|1|large 1.3"))
def backpack(o, rng):
    k = o.pocket
    body = hull([(-0.2, 0.26, 0.03, 0.7), (-0.14, 0.33, 0, 0.78), (0.1, 0.33, 0, 0.76),
        (0.2, 0.26, 0.03, 0.64)], square=3.5)
    return dict(bag=body, flap=hull([(-0.19, 0.27, 0.52, 0.74), (-0.12, 0.345, 0.5, 0.81),
        (0.12, 0.345, 0.48, 0.79), (0.225, 0.26, 0.46, 0.66)], square=3.5),
        pocket=[hull([(0.1, 0.24 * k, 0.06, 0.32 * k), (0.22, 0.23 * k, 0.05, 0.3 * k + 0.02),
        (0.28, 0.17 * k, 0.08, 0.26 * k)], square=3.5),
        block(0.2, 0.12, 0.3, 0.05).at(0, 0.34, 0.2).both()],
        straps=[tube([(-0.16, 0.17, 0.7), (-0.32, 0.19, 0.55), (-0.3, 0.19, 0.25),
        (-0.17, 0.22, 0.06)], 0.05, flat=0.5).both(),
        tube([(-0.14, 0.07, 0.77), (-0.14, 0.05, 0.88), (-0.14, -0.05, 0.88), (-0.14, -0.07, 0.77)],
        0.02), block(0.03, 0.04, 0.2).at(0.235, 0.12, 0.44).both()],
        zips=block(0.02, 0.05, 0.03).at(0.25, 0.12, 0.36).both())


@kind("glasses", "clothes", also=("eyeglasses", "sunglasses", "spectacles"),
    colours=dict(frame="black|brown|red|blue|golden", lenses="light blue|black|glass",
        arms="=frame"),
    forms=dict(shape="round|square"))
def glasses(o, rng):
    frame = ring(0.19, 0.03).turn("y",
        90) if o.shape == "round" else tube(np.concatenate([(q := oblong(0.38, 0.32, 0.07)),
        q[:1]])[:, [0, 0, 1]] * (0, 1, 1), 0.028, sharp=True)
    lens = cylinder(0.185, 0.02).turn("y",
        90) if o.shape == "round" else plate(oblong(0.37, 0.31, 0.07), 0.02)
    return dict(frame=[frame.at(y=0.24).both(),
        tube([(0.0, -0.06, 0.04), (0.02, 0, 0.08), (0, 0.06, 0.04)], 0.026)],
        lenses=lens.at(y=0.24).both(),
        arms=tube([(0, 0.43, 0.04), (-0.3, 0.46, 0.05), (-0.6, 0.46, 0.04), (-0.72, 0.45, -0.08)],
        0.024).both())


@kind("ring", "clothes", also=("diamond ring", "wedding ring", "engagement ring"),
    colours=dict(band="golden|silver", stone="light blue|red|green|white|purple"),
    sizes=dict(stone="small 0.6|1|large 1.5"))
def ring_(o, rng):
    s = 0.2 * o.stone
    gem = lathe([(0, -1.0), (1.0, 0.0), (0.6, 0.38), (0, 0.38)], sharp=True,
        outline=polygon(8, 1.0)).scale(s).shade(lambda u, v,
        p: 0.8 + 0.25 * ((np.floor(u * 8) + (p[:, 2] > 0)) % 2))
    return dict(band=[ring(0.4, 0.05).turn("y", 90).scale(1.3, 1, 1),
        limb((0, 0.0, 0.4), (0, s * 0.75, 0.46 + 0.9 * s), 0.025).around(4)],
        stone=gem.at(z=0.45 + 0.8 * s))


@kind("wristwatch", "clothes", also=("watch",),
    colours=dict(strap="brown|black|red|blue|leather", case="golden|silver|black",
        face="white|black|cream", hands="!dark grey", marks="!grey"))
def watch(o, rng):
    k = np.deg2rad(30 * np.arange(12))
    a = np.linspace(0.45, 2 * np.pi - 0.45, 25)
    strap = tube(np.stack([0.27 * np.cos(a) - 0.27, 0 * a, 0.34 * np.sin(a)], -1), 0.1, flat=0.22)
    strap = sheet(lambda u, v: np.stack([0.27 * np.cos(2 * np.pi * v) - 0.29, 0.11 * (2 * u - 1),
        0.34 * np.sin(2 * np.pi * v)], -1), 0.035, (3, 24))
    return dict(strap=strap,
        case=[cylinder(0.19, 0.08, bevel=0.02).turn("y", 90).at(-0.05),
        limb((-0.0, 0.18, 0), (-0.0, 0.23, 0), 0.025)],
        face=cylinder(0.16, 0.02).turn("y", 90).at(0.02),
        marks=block(0.01, 0.014, 0.03).copies([(0.04, 0.135 * np.sin(q),
        0.135 * np.cos(q)) for q in k]),
        hands=[block(0.012, 0.018, 0.09).at(0.045, 0, 0.04).turn("x", 50),
        block(0.012, 0.014, 0.13).at(0.045, 0, 0.06).turn("x", -30)])


@kind("scarf", "clothes", also=("woolly scarf", "knitted scarf"),
    colours=dict(scarf="red|blue|green|yellow|purple", stripes="white|yellow|dark blue",
        fringe="=scarf"),
    forms=dict(style="*striped|plain"))
def scarf(o, rng):
    strap = dict(scarf=[tube([(0.12, 0.1, 0.3), (0.26, 0.1, 0.16), (0.3, 0.09, -0.1),
        (0.3, 0.1, -0.42)], 0.12, flat=0.4),
        tube([(0.14, -0.06, 0.3), (0.25, -0.08, 0.12), (0.27, -0.1, -0.05), (0.27, -0.12, -0.3)],
        0.12, flat=0.4)])
    loop = [ring(0.26, 0.1, 0.9).scale(0.85, 1, 1).turn("y", 10).at(0, 0, 0.26),
        ring(0.23, 0.09, 0.9).scale(0.85, 1, 1).turn("y", 6).at(0.02, 0, 0.4)]
    mark = lambda u, v, p: (v * 9) % 1 < 0.4
    ends = [s.coat("stripes", mark) if o.style == "striped" else s for s in strap["scarf"]]
    wrap = [s.coat("stripes", lambda u, v,
        p: (u * 12) % 1 < 0.4) if o.style == "striped" else s for s in loop]
    return dict(scarf=[*ends, *wrap],
        fringe=[rod((0.3, y, -0.42), (0.3, y, -0.5), 0.014) for y in np.linspace(0.01, 0.19,
        6)] + [rod((0.27, y, -0.3), (0.27, y, -0.38), 0.014) for y in np.linspace(-0.21, -0.03, 6)])
