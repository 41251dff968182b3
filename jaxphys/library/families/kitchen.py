"""What a meal is cooked in and eaten from: teapot, mug, pan, knife."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    above,
    below,
    patterned,
)
from jaxphys.library.shapes import (
    ball,
    bend,
    block,
    cylinder,
    handle,
    hull,
    lathe,
    limb,
    plate,
    refined,
    ring,
    rod,
    sheet,
    speck,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731

CHINA = "white|light blue|cream|light green"


@kind("teapot", "kitchen", also=("tea pot", "china teapot"),
    colours=dict(body=CHINA, lid="=body", knob="=lid", handle="=body", spout="=body",
        pattern="light blue|red"),
    sizes=dict(spout="short 0.6|1|long 1.75", handle="small 0.7|1|large 1.3"),
    forms=dict(height="flat 0.75|1|tall 1.35", style="plain|striped|dotted"),)
def teapot(o, rng):
    h = 0.36 * o.height
    body = lathe([(0, -h), (0.25, -h), (0.3, -0.9 * h), (0.46, -0.1 * h), (0.4, 0.5 * h),
        (0.2, 0.93 * h), (0, h)])
    reach = 0.3 * o.spout
    spout = bend((0, -0.36, -0.45 * h), (0, -0.36 - 0.95 * reach, -0.5 * h),
        (0, -0.42 - reach, 0.75 * h))
    lid = lathe([(0, 0.85 * h), (0.24, 0.85 * h), (0.22, 0.98 * h), (0.1, 1.16 * h), (0, 1.2 * h)])
    loop = handle((0, 0.3, 0.62 * h), (0, 0.4, -0.4 * h), 0.28 * o.handle, 0.05)
    return dict(body=patterned(body, o.style), lid=lid, knob=ball(0.07).at(z=1.3 * h), handle=loop,
        spout=tube(spout, np.linspace(0.14, 0.055, 7)),)


@kind("mug", "kitchen", also=("coffee mug", "cup", "coffee cup"),
    colours=dict(body="white|red|blue|yellow|light blue", handle="=body", coffee="dark brown",
        pattern="red|blue"),
    sizes=dict(handle="small 0.7|1|large 1.35"),
    forms=dict(height="short 0.75|1|tall 1.45", style="plain|striped|dotted"),
    extras=dict(coffee=0.4),)
def mug(o, rng):
    r, h = 0.32, 0.68 * o.height
    cup = lathe([(0, 0), (0.92 * r, 0), (r, 0.05), (r, h), (0.87 * r, h), (0.85 * r, 0.07),
        (0, 0.06)], sharp=True)
    loop = handle((0, 0.9 * r, 0.8 * h), (0, 0.9 * r, 0.2 * h), 0.27 * o.handle, 0.05)
    coffee = cylinder(0.86 * r, 0.02).at(z=0.86 * h)
    return dict(body=patterned(cup, o.style, h), handle=loop, coffee=[coffee] if o.coffee else [])


@kind("pan", "kitchen", also=("frying pan", "skillet"),
    colours=dict(body="black|dark grey|metal", handle="black|wooden|brown"),
    sizes=dict(handle="short 0.65|1|long 1.4"),
    forms=dict(depth="shallow 0.7|1|deep 1.8"),)
def pan(o, rng):
    h = 0.12 * o.depth
    body = lathe([(0, 0), (0.36, 0), (0.45, h), (0.42, h), (0.34, 0.03), (0, 0.03)], sharp=True)
    grip = tube([(0.4, 0, 0.8 * h), (0.6, 0, h + 0.03), (0.45 + 0.5 * o.handle, 0, h + 0.06)],
        [0.03, 0.045, 0.05], flat=0.55)
    return dict(body=body, handle=grip)


@kind("pot", "kitchen", also=("cooking pot", "saucepan", "stew pot"),
    colours=dict(pot="silver|red|blue|black|metal", lid="=pot", handles="black|silver",
        knob="=handles"),
    forms=dict(height="flat 0.75|1|tall 1.4"),
    extras=dict(lid=0.75))
def pot(o, rng):
    h = 0.42 * o.height
    body = lathe([(0, 0), (0.38, 0), (0.42, 0.04), (0.42, h), (0.44, h), (0.39, h), (0.38, 0.05),
        (0, 0.05)], sharp=True)
    lid = [lathe([(0, h), (0.44, h), (0.44, h + 0.03), (0.25, h + 0.1), (0, h + 0.12)])]
    grips = tube([(0.1, 0.4, 0.78 * h), (0.09, 0.53, 0.8 * h), (-0.09, 0.53, 0.8 * h),
        (-0.1, 0.4, 0.78 * h)], 0.03).both()
    return dict(pot=body, handles=grips, lid=lid if o.lid else [],
        knob=lathe([(0, h + 0.1), (0.03, h + 0.1), (0.03, h + 0.15), (0.07, h + 0.19),
        (0, h + 0.22)]) if o.lid else [])


@kind("kettle", "kitchen", also=("tea kettle",),
    colours=dict(body="red|silver|blue|metal|black", handle="black|wooden", spout="=body",
        lid="=body", knob="=handle"),
    sizes=dict(spout="short 0.65|1|long 1.5"))
def kettle(o, rng):
    body = lathe([(0, 0), (0.4, 0), (0.44, 0.08), (0.4, 0.3), (0.2, 0.46), (0, 0.5)])
    s = o.spout
    arch = tube([(0, 0.3, 0.36), (0, 0.36, 0.62), (0, 0, 0.82), (0, -0.36, 0.62), (0, -0.3, 0.36)],
        [0.022, 0.03, 0.05, 0.03, 0.022])
    return dict(body=body, handle=arch,
        spout=tube([(0, -0.34, 0.18), (0, -0.44 - 0.08 * s, 0.26),
        (0, -0.46 - 0.16 * s, 0.36 + 0.12 * s)], [0.1, 0.065, 0.04]),
        lid=lathe([(0, 0.42), (0.19, 0.42), (0.17, 0.49), (0, 0.53)]), knob=ball(0.055).at(z=0.56))


@kind("bowl", "kitchen", also=("soup bowl", "cereal bowl"),
    colours=dict(bowl="white|blue|red|light green|wooden", pattern="blue|red|golden",
        soup="orange|red|light green"),
    forms=dict(depth="shallow 0.65|1|deep 1.4", style="plain|striped|dotted"),
    extras=dict(soup=0.3))
def bowl(o, rng):
    h = 0.4 * o.depth
    body = lathe([(0, 0), (0.2, 0), (0.21, 0.05), (0.4, 0.45 * h), (0.5, h), (0.47, h),
        (0.36, 0.5 * h), (0, 0.08)])
    return dict(bowl=patterned(body, o.style, 0.7),
        soup=cylinder(0.42, 0.02).at(z=0.76 * h) if o.soup else [])


@kind("plate", "kitchen", also=("dinner plate", "dish"),
    colours=dict(plate="white|light blue|cream", rim="blue|golden|red"),
    forms=dict(style="rimmed|plain"))
def plate_(o, rng):
    body = lathe([(0, 0), (0.26, 0), (0.3, 0.02), (0.5, 0.07), (0.49, 0.085), (0.3, 0.04),
        (0.26, 0.025), (0, 0.025)])
    edge = lambda u, v, p: (np.abs(np.hypot(p[:, 0],
        p[:, 1]) - 0.46) < 0.022) | (np.abs(np.hypot(p[:, 0], p[:, 1]) - 0.31) < 0.008)
    return each(dict(plate=body.coat("rim", edge) if o.style == "rimmed" else body),
        lambda s: s.turn("y", 55))


@kind("wine glass", "kitchen", also=("glass of wine", "goblet"),
    colours=dict(glass="glass|golden|silver", wine="dark red|red|yellow|pink"),
    sizes=dict(stem="short 0.6|1|long 1.4"),
    extras=dict(wine=0.75))
def wine_glass(o, rng):
    s = 0.32 * o.stem
    body = lathe([(0, 0), (0.22, 0), (0.21, 0.02), (0.03, 0.05), (0.022, s), (0.05, s + 0.03),
        (0.2, s + 0.16), (0.21, s + 0.3), (0.16, s + 0.46), (0.15, s + 0.46), (0.19, s + 0.3),
        (0.17, s + 0.17), (0, s + 0.06)])
    if o.wine:
        body = body.coat("wine", lambda u, v, p: (p[:, 2] > s + 0.05) & (p[:, 2] < s + 0.27))
    return dict(glass=body, wine=lathe([(0, s + 0.07), (0.18, s + 0.19), (0.192, s + 0.265),
        (0, s + 0.265)], sharp=True) if o.wine else [])


@kind("tea cup", "kitchen", also=("teacup", "cup and saucer", "cup of tea"),
    colours=dict(cup="white|light blue|pink|cream", saucer="=cup", handle="=cup",
        tea="brown|light brown", rim="golden|blue|red"),
    extras=dict(tea=0.7, rim=0.6),
    sizes=dict(handle="small 0.75|1|large 1.3"))
def tea_cup(o, rng):
    body = lathe([(0, 0.06), (0.14, 0.06), (0.14, 0.09), (0.26, 0.2), (0.32, 0.4), (0.3, 0.4),
        (0.24, 0.22), (0, 0.12)])
    if o.rim:
        body = body.coat("rim", above("z", 0.375))
    return dict(cup=body, saucer=lathe([(0, 0.02), (0.2, 0.0), (0.5, 0.07), (0.49, 0.085),
        (0.2, 0.04), (0, 0.05)]),
        handle=handle((0, 0.3, 0.35), (0, 0.24, 0.17), 0.16 * o.handle, 0.026),
        tea=cylinder(0.285, 0.02).at(z=0.32) if o.tea else [])


@kind("fork", "kitchen", also=("dinner fork",),
    colours=dict(fork="silver|golden|metal", handle="=fork"),
    counts=dict(prongs="3|4"),
    sizes=dict(handle="short 0.7|1|long 1.25"))
def fork(o, rng):
    n = o.prongs
    h = 0.6 * o.handle
    y = np.linspace(-0.075, 0.075, n)
    prongs = [tube([(0.0, a * 0.9, 0.1), (0.035, a, 0.2), (0.02, a, 0.42)],
        [0.02, 0.017, 0.008]) for a in y]
    return each(dict(fork=[*prongs,
        hull([(0, 0.02, -0.02, 0.02), (0.1, 0.06, -0.02, 0.02),
        (0.2, 0.095, -0.02, 0.02)]).turn("y", -90).at(0.0, 0, -0.06),
        rod((0, 0, -0.05), (0, 0, -0.15), 0.022)],
        handle=tube([(0, 0, -0.08), (0, 0, -0.4 * h - 0.1), (0, 0, -h - 0.1)],
        [0.022, 0.032, 0.045], flat=0.5).scale(0.8, 1, 1), prongs=[]), lambda s: s.turn("x", 20))


@kind("spoon", "kitchen", also=("tablespoon", "wooden spoon"),
    colours=dict(spoon="silver|golden|wooden|metal", handle="=spoon"),
    sizes=dict(handle="short 0.7|1|long 1.3"))
def spoon(o, rng):
    h = 0.66 * o.handle
    cup = sheet(lambda u, v: np.stack([-0.07 * (1 - (2 * u - 1) ** 2) * np.sin(np.pi * v),
        0.14 * (2 * u - 1) * np.sqrt(np.clip(1 - (2 * v - 1) ** 2, 0.0004, 1)), 0.38 * v - 0.02],
        -1), 0.022, (8, 10))
    return each(dict(spoon=cup,
        handle=tube([(0, 0, 0.0), (-0.005, 0, -0.12), (0.02, 0, -0.6 * h), (0, 0, -h)],
        [0.035, 0.024, 0.034, 0.042], flat=0.55)), lambda s: s.turn("x", 20))


@kind("knife", "kitchen", also=("kitchen knife", "chef's knife"),
    colours=dict(blade="silver|metal", handle="black|wooden|brown|red", rivets="!silver"),
    sizes=dict(blade="short 0.6|1|long 1.25"))
def knife(o, rng):
    b = 0.62 * o.blade
    line = refined([(0.06, -0.02), (0.06, 0.55 * b), (0.0, b), (-0.075, 0.6 * b), (-0.085, 0.0),
        (-0.04, -0.02)])
    return each(dict(blade=plate(line - (0, 0.4 * b), 0.018).at(z=0.4 * b),
        handle=block(0.055, 0.1, 0.38, 0.02).at(0, 0.01, -0.2),
        rivets=cylinder(0.014, 0.065).turn("y",
        90).copies([(-0.032, 0.01, z) for z in (-0.1, -0.2, -0.3)])), lambda s: s.turn("x", 35))


@kind("rolling pin", "kitchen",
    colours=dict(roller="wooden|beige|light brown", handles="wooden|red|brown"),
    sizes=dict(handles="short 0.7|1|long 1.5"))
def rolling_pin(o, rng):
    h = 0.2 * o.handles
    grip = lathe([(0, 0), (0.03, 0), (0.045, 0.3 * h), (0.04, 0.7 * h), (0.05, 0.95 * h),
        (0, h)]).turn("x", -90).at(0, 0.33, 0)
    return each(dict(roller=cylinder(0.11, 0.66, bevel=0.02).at(z=-0.33).turn("x", 90),
        handles=grip.both()), lambda s: s.turn("x", 22))


@kind("whisk", "kitchen", also=("egg whisk",),
    colours=dict(wires="silver|golden", handle="black|wooden|red|blue"),
    sizes=dict(handle="short 0.7|1|long 1.3"))
def whisk(o, rng):
    h = 0.42 * o.handle
    loop = tube([(0, 0.02, 0), (0, 0.13, 0.22), (0, 0.15, 0.4), (0, 0, 0.56), (0, -0.15, 0.4),
        (0, -0.13, 0.22), (0, -0.02, 0)], 0.011, sides=5)
    return each(dict(wires=[loop.turn("z", a) for a in (0, 45, 90, 135)],
        handle=lathe([(0, -h), (0.04, -h), (0.05, -0.6 * h), (0.038, -0.1), (0.032, 0.03),
        (0, 0.03)])), lambda s: s.turn("x", 25))


@kind("jug", "kitchen", also=("pitcher", "milk jug"),
    colours=dict(jug="white|blue|light blue|yellow|glass", handle="=jug",
        milk="white|orange|light blue", pattern="blue|red"),
    sizes=dict(handle="small 0.75|1|large 1.3"),
    forms=dict(height="short 0.75|1|tall 1.3", style="plain|striped|dotted"),
    extras=dict(milk=0.4))
def jug(o, rng):
    h = 0.75 * o.height
    body = lathe([(0, 0), (0.2, 0), (0.29, 0.3 * h), (0.2, 0.75 * h), (0.21, h), (0.19, h),
        (0.17, 0.76 * h), (0.24, 0.35 * h), (0, 0.06)])
    lip = tube([(0, -0.15, 0.84 * h), (0, -0.2, 0.93 * h), (0, -0.29, 1.0 * h)],
        [0.05, 0.075, 0.04], flat=0.7)
    return dict(jug=[patterned(body, o.style, h), lip],
        handle=handle((0, 0.19, 0.88 * h), (0, 0.25, 0.36 * h), 0.2 * o.handle, 0.032),
        milk=cylinder(0.18, 0.02).at(z=0.85 * h) if o.milk else [])


@kind("toaster", "kitchen",
    colours=dict(body="silver|red|light blue|cream|white", bread="light brown|brown",
        lever="black|red", slots="!dark grey"),
    extras=dict(bread=0.6))
def toaster(o, rng):
    slice_ = block(0.07, 0.4, 0.3, 0.03)
    return dict(body=[block(0.46, 0.78, 0.5, 0.12).at(z=0.28),
        block(0.42, 0.72, 0.05, 0.03).at(z=0.025)],
        slots=block(0.1, 0.52, 0.02).copies([(x, 0, 0.525) for x in (-0.1, 0.1)]),
        bread=slice_.copies([(x, 0, 0.55) for x in (-0.1, 0.1)]).coat("cream", lambda u, v,
        p: (np.abs(p[:, 1]) < 0.15) & (np.abs(p[:, 2]) < 0.11)) if o.bread else [],
        lever=block(0.13, 0.06, 0.06, 0.02).at(0, 0.42, 0.36),
        black=cylinder(0.05, 0.04).turn("x", -90).at(0.0, 0.38, 0.16))


@kind("blender", "kitchen", also=("mixer", "smoothie blender"),
    colours=dict(base="red|black|silver|white", glass="glass",
        smoothie="pink|orange|light green|purple", lid="black|grey", buttons="!silver"),
    extras=dict(smoothie=0.7))
def blender(o, rng):
    cup = lathe([(0, 0.3), (0.13, 0.3), (0.21, 0.82), (0, 0.82)], sharp=True)
    if o.smoothie:
        cup = cup.coat("smoothie", below("z", 0.68))
    return dict(base=lathe([(0, 0), (0.24, 0), (0.22, 0.1), (0.15, 0.28), (0.15, 0.31), (0, 0.31)]),
        glass=[cup, handle((0, 0.19, 0.74), (0, 0.15, 0.42), 0.16, 0.026)],
        lid=[cylinder(0.22, 0.06, bevel=0.015).at(z=0.81), cylinder(0.08, 0.06).at(z=0.86)],
        buttons=cylinder(0.03, 0.05).turn("y",
        75).copies([(0.19, y, 0.1) for y in (-0.08, 0, 0.08)]))


@kind("salt shaker", "kitchen", also=("pepper shaker", "salt cellar"),
    colours=dict(body="white|glass|red|light blue|wooden", top="silver|golden", holes="!black"))
def salt_shaker(o, rng):
    return dict(body=lathe([(0, 0), (0.22, 0), (0.2, 0.1), (0.15, 0.46), (0, 0.46)],
        waves=(8, 0.025)), top=lathe([(0, 0.44), (0.165, 0.44), (0.17, 0.52), (0.13, 0.6),
        (0, 0.64)]), holes=speck(0.014).copies([(0.0, 0, 0.64),
        *[(0.065 * np.cos(a), 0.065 * np.sin(a), 0.625) for a in np.pi / 3 * np.arange(6)]]))


@kind("ladle", "kitchen", also=("soup ladle",),
    colours=dict(ladle="silver|metal|black|wooden", handle="=ladle"),
    sizes=dict(handle="short 0.7|1|long 1.3"))
def ladle(o, rng):
    h = 0.72 * o.handle
    cup = lathe([(0, -0.17), (0.14, -0.12), (0.19, 0), (0.175, 0), (0.13, -0.1), (0, -0.14)])
    return dict(ladle=cup, handle=tube([(0, 0.17, -0.01), (0, 0.23, 0.15), (0, 0.25, 0.6 * h),
        (0, 0.24, h), (0, 0.16, h + 0.05), (0, 0.13, h - 0.03)], 0.022, flat=0.7))


@kind("microwave", "kitchen", also=("microwave oven",),
    colours=dict(body="white|silver|black|red", window="!dark grey", buttons="!light grey",
        handle="silver|black"))
def microwave(o, rng):
    return dict(body=block(0.5, 0.96, 0.52, 0.03).at(z=0.29),
        window=block(0.02, 0.58, 0.36).at(0.25, -0.14, 0.29).shade(lambda u, v,
        p: 1 + 0.5 * (np.abs(p[:, 1] + p[:, 2]) < 0.03)),
        buttons=block(0.02, 0.05,
        0.04).copies([(0.255, y, z) for y in (0.29, 0.355, 0.42) for z in (0.14, 0.2, 0.26, 0.32)]),
        handle=limb((0.29, 0.2, 0.12), (0.29, 0.2, 0.46), 0.022),
        **{"light green": block(0.02, 0.18, 0.07).at(0.25, 0.355, 0.46)})


@kind("stove", "kitchen", also=("oven", "cooker"),
    colours=dict(body="white|silver|black|red", window="!dark grey", knobs="black|silver|red",
        handle="silver", plates="!black"),
    counts=dict(knobs="4|5"))
def stove(o, rng):
    return dict(body=[block(0.6, 0.66, 0.86, 0.02).at(z=0.45),
        block(0.04, 0.66, 0.12).at(-0.28, 0, 0.93)],
        window=block(0.02, 0.44, 0.26).at(0.3, 0, 0.42),
        handle=limb((0.33, -0.24, 0.63), (0.33, 0.24, 0.63), 0.022),
        knobs=cylinder(0.035, 0.05).turn("y",
        90).copies([(0.29, y, 0.78) for y in np.linspace(-0.24, 0.24, o.knobs)]),
        plates=ring(0.085, 0.02).joined(ring(0.085,
        0.02).scale(0.5)).copies([(x, y, 0.885) for x in (-0.13, 0.14) for y in (-0.16, 0.16)]),
        grey=block(0.02, 0.6, 0.012).at(0.3, 0, 0.16))


@kind("refrigerator", "kitchen", also=("fridge",),
    colours=dict(body="white|silver|red|light blue|black", handles="silver|golden|black"))
def refrigerator(o, rng):
    return dict(body=[block(0.42, 0.5, 0.62, 0.04).at(z=0.34),
        block(0.42, 0.5, 0.34, 0.04).at(z=0.83)],
        handles=[limb((0.24, -0.18, 0.4), (0.24, -0.18, 0.6), 0.018),
        limb((0.24, -0.18, 0.72), (0.24, -0.18, 0.86), 0.018)],
        **{"dark grey": [block(0.4, 0.46, 0.04).at(z=0.02), block(0.4, 0.48, 0.02).at(z=0.655)]})
