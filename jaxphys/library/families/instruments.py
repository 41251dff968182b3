"""Musical instruments."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.shapes import (
    ball,
    block,
    cylinder,
    lathe,
    limb,
    plate,
    refined,
    ring,
    rod,
    rounded,
    slab,
    tube,
)
from jaxphys.library.solids import Solid, each, together

# fmt: off
# ruff: noqa: E731


def strings(count: int, width: float, low: float, high: float, x: float) -> Solid:
    return rod((x, 0, low), (x, 0, high),
        0.004).copies([(0, y, 0) for y in np.linspace(-width, width, count)])


@kind("guitar", "instruments", also=("acoustic guitar", "wooden guitar"),
    colours=dict(body="wooden|light brown|brown|golden", neck="dark brown|brown", head="=neck",
        pegs="silver|golden", pickguard="dark brown|black", hole="!black", bridge="!dark brown",
        strings="!silver"),
    sizes=dict(neck="short 0.75|1|long 1.2"))
def guitar(o, rng):
    outline = rounded([(0, -0.46), (0.23, -0.42), (0.31, -0.24), (0.26, -0.05), (0.17, 0.06),
        (0.2, 0.2), (0.17, 0.32), (0.05, 0.36), (-0.05, 0.36), (-0.17, 0.32), (-0.2, 0.2),
        (-0.17, 0.06), (-0.26, -0.05), (-0.31, -0.24), (-0.23, -0.42)], 80)
    rim = lambda u, v, p: (np.abs(v - 0.5) < 0.16) & (np.abs(v - 0.5) > 0.13)
    n = 0.62 * o.neck
    frets = block(0.012, 0.078, 0.008).copies([(0.092, 0, 0.3 + n * k / 11) for k in range(11)])
    top = 0.32 + n
    pegs = [limb((0.04, s * 0.05, top + z), (0.04, s * 0.09, top + z), 0.016) for s in (-1,
        1) for z in (0.05, 0.11, 0.17)]
    return dict(body=plate(outline, 0.16, edge=0.01).coat("dark brown", rim),
        hole=cylinder(0.088, 0.02).turn("y", 90).at(0.065, 0, 0.1),
        cream=ring(0.095, 0.01).turn("y", 90).at(0.082, 0, 0.1),
        neck=block(0.05, 0.08, n + 0.12).at(0.065, 0, 0.26 + 0.5 * n),
        head=block(0.04, 0.12, 0.22, 0.015).turn("y", -10).at(0.045, 0, top + 0.11), pegs=pegs,
        bridge=block(0.03, 0.2, 0.045).at(0.085, 0, -0.19),
        strings=strings(6, 0.028, -0.19, top + 0.06, 0.105), silver=frets,
        pickguard=plate(rounded([(0.0, -0.1), (0.09, -0.04), (0.07, 0.06), (0, 0.1), (-0.03, 0)]),
        0.01).at(0.083, 0.13, 0.0))


@kind("electric guitar", "instruments",
    colours=dict(body="red|black|blue|white", pickguard="white|black", neck="light brown|brown",
        head="=neck", pickups="!silver", knobs="golden|silver", strings="!silver"))
def electric_guitar(o, rng):
    outline = rounded([(0, -0.36), (0.2, -0.34), (0.26, -0.18), (0.17, 0.0), (0.22, 0.2),
        (0.17, 0.34), (0.09, 0.2), (0.0, 0.13), (-0.09, 0.17), (-0.13, 0.27), (-0.21, 0.2),
        (-0.16, 0.0), (-0.25, -0.2), (-0.18, -0.34)], 90)
    return dict(body=plate(outline, 0.09, edge=0.02),
        pickguard=plate(rounded([(0.12, -0.2), (0.14, 0.05), (0.0, 0.12), (-0.1, 0.05),
        (-0.06, -0.12), (0.02, -0.24)]), 0.02).at(0.045),
        neck=block(0.04, 0.07, 0.7).at(0.05, 0, 0.42),
        head=plate(refined([(0.05, -0.1), (0.03, 0.14), (-0.06, 0.1), (-0.05, -0.1)]),
        0.035).at(0.04, 0, 0.85),
        pickups=block(0.02, 0.13, 0.035).copies([(0.06, 0, z) for z in (-0.14, -0.05, 0.04)]),
        knobs=cylinder(0.022, 0.03).turn("y",
        90).copies([(0.05, 0.12, -0.14), (0.05, 0.15, -0.22)]),
        strings=strings(6, 0.022, -0.2, 0.82, 0.078),
        silver=block(0.025, 0.12, 0.03).at(0.055, 0,
        -0.21).joined(block(0.025, 0.12, 0.03).at(0.055, 0, -0.21)),
        black=ball(0.014).copies([(0.05, -0.075, 0.8 + 0.04 * k) for k in range(5)]))


@kind("violin", "instruments", also=("fiddle",),
    colours=dict(body="brown|wooden|dark red", neck="black|dark brown", bow="brown|black",
        strings="!silver"),
    extras=dict(bow=0.5))
def violin(o, rng):
    outline = rounded([(0, -0.4), (0.18, -0.37), (0.24, -0.24), (0.2, -0.12), (0.125, -0.02),
        (0.16, 0.1), (0.17, 0.2), (0.1, 0.29), (0, 0.31), (-0.1, 0.29), (-0.17, 0.2), (-0.16, 0.1),
        (-0.125, -0.02), (-0.2, -0.12), (-0.24, -0.24), (-0.18, -0.37)], 90)
    holes = lambda u, v, p: (np.abs(np.abs(p[:, 0]) - 0.085 - 0.02 * np.sin(22 * p[:, 1]))
        < 0.01) & (np.abs(p[:, 1] + 0.05) < 0.1) & (p[:, 2] > 0)
    scroll = [rod((0.04, 0, 0.62), (0.02, 0, 0.78), 0.025),
        cylinder(0.05, 0.05).turn("x", 90).at(0.03, 0.025, 0.8)]
    return dict(body=[plate(outline, 0.12, puff=0.35).coat("black", holes), *scroll],
        neck=[block(0.03, 0.055, 0.58).at(0.085, 0, 0.35),
        block(0.03, 0.09, 0.16, 0.0, 0.6).at(0.085, 0, -0.3),
        rod((0.05, -0.07, 0.7), (0.05, 0.07, 0.7), 0.012),
        rod((0.05, -0.07, 0.75), (0.05, 0.07, 0.75), 0.012)],
        beige=block(0.06, 0.11, 0.02).at(0.09, 0, -0.09),
        strings=strings(4, 0.018, -0.26, 0.64, 0.118),
        bow=[tube([(0.16, 0.3, -0.5), (0.17, 0.3, 0.0), (0.16, 0.28, 0.6)], 0.012),
        rod((0.14, 0.27, -0.48), (0.14, 0.25, 0.58), 0.007)] if o.bow else [])


@kind("drum", "instruments", also=("snare drum", "toy drum"),
    colours=dict(shell="red|blue|golden|green", head="white|cream", rims="golden|silver|white",
        sticks="wooden|beige", laces="white|golden"),
    extras=dict(sticks=0.7),
    forms=dict(height="flat 0.65|1|tall 1.5"))
def drum(o, rng):
    h = 0.5 * o.height
    zig = lambda u, v, p: (np.abs(np.abs((u * 8) % 1 - 0.5) * 2 - np.clip(p[:, 2] / h, 0,
        1)) < 0.07) & (p[:, 2] > 0) & (p[:, 2] < h)
    sticks = [each(dict(s=[rod((-0.3, 0, 0), (0.36, 0, 0.0), 0.02, 0.014), ball(0.033).at(0.37)]),
        lambda s, a=a: s.turn("z", a).at(0, 0, h + 0.05))["s"] for a in (60, 115)]
    return dict(shell=cylinder(0.4, h).coat("laces", zig),
        head=cylinder(0.385, 0.03).at(z=h - 0.005),
        rims=ring(0.405, 0.028).copies([(0, 0, 0.01), (0, 0, h)]),
        sticks=[s for pair in sticks for s in pair] if o.sticks else [])


@kind("piano", "instruments", also=("grand piano",),
    colours=dict(case="black|white|brown|red", lid="=case", keys="!white", legs="=case",
        stool="black|brown"),
    extras=dict(stool=0.4))
def piano(o, rng):
    shape = rounded([(0.36, -0.46), (0.36, 0.46), (0.05, 0.46), (-0.15, 0.3), (-0.35, 0.22),
        (-0.52, 0.02), (-0.5, -0.3), (-0.35, -0.46)], 64)
    keys = block(0.14, 0.88, 0.03).at(0.38, 0, 0.42).coat("black", lambda u, v,
        p: ((p[:, 1] * 32) % 1 < 0.1)
        | (((p[:, 1] * 32 + 0.3) % 1 < 0.55) & (((np.floor(p[:, 1] * 32 + 0.3)) % 7) % 4 != 3)
        & (p[:, 0] < 0.01)))
    lid = slab(shape * 0.98, 0.025).turn("x", -40).at(-0.05, -0.12, 0.82)
    return each(dict(case=[slab(shape, 0.16).at(z=0.44), block(0.16, 0.94, 0.08).at(0.38, 0, 0.38),
        block(0.03, 0.9, 0.12).at(0.3, 0, 0.48), rod((-0.1, 0.25, 0.5), (-0.1, 0.16, 0.85), 0.012),
        block(0.02, 0.5, 0.18).turn("y", -15).at(0.2, 0, 0.58)], lid=lid, keys=keys,
        legs=rod((0, 0, 0), (0, 0, 0.36), 0.03,
        0.045).copies([(0.33, -0.4, 0), (0.33, 0.4, 0), (-0.36, -0.1, 0)]),
        stool=[block(0.22, 0.34, 0.06, 0.03).at(0.66, 0, 0.26),
        rod((0.58, 0.12, 0), (0.58, 0.12, 0.24), 0.02).both(),
        rod((0.74, 0.12, 0), (0.74, 0.12, 0.24), 0.02).both()] if o.stool else [],
        golden=block(0.02, 0.02, 0.1).at(0.1, 0, 0.1)), lambda s: s.turn("z", 10))


@kind("trumpet", "instruments", also=("horn",),
    colours=dict(brass="golden|silver|copper", valves="silver|white"))
def trumpet(o, rng):
    bell = lathe([(0, 0), (0.03, 0), (0.035, 0.2), (0.06, 0.32), (0.11, 0.4), (0.17, 0.44),
        (0.15, 0.44), (0.04, 0.34), (0, 0.2)]).turn("x", -90).at(0, 0.22, 0.06)
    loop = tube([(0, 0.24, 0.06), (0, -0.25, 0.06), (0, -0.33, -0.02), (0, -0.25, -0.1),
        (0, 0.2, -0.1), (0, 0.27, -0.06), (0.03, 0.2, 0.0), (0.05, -0.6, 0.04)], 0.026)
    valves = [cylinder(0.042, 0.24).copies([(0.0, y, -0.13) for y in (-0.08, 0.02, 0.12)])]
    return each(dict(brass=[bell, loop, *valves,
        lathe([(0, 0), (0.025, 0), (0.05, 0.06), (0, 0.05)]).turn("x", 90).at(0.05, -0.58, 0.04)],
        valves=[cylinder(0.014, 0.1).copies([(0.0, y, 0.1) for y in (-0.08, 0.02, 0.12)]),
        cylinder(0.035, 0.015).copies([(0.0, y, 0.19) for y in (-0.08, 0.02, 0.12)])]),
        lambda s: s.turn("x", 12))


@kind("saxophone", "instruments", also=("sax",),
    colours=dict(brass="golden|silver|copper", keys="silver|golden|white", mouthpiece="!black"))
def saxophone(o, rng):
    path = [(0, -0.24, 0.62), (0, -0.12, 0.66), (0, -0.06, 0.56), (0, -0.05, 0.2), (0, -0.04, -0.2),
        (0, 0.02, -0.36), (0, 0.13, -0.38), (0, 0.21, -0.25), (0, 0.25, 0.0)]
    body = tube(path, [0.02, 0.028, 0.034, 0.05, 0.07, 0.082, 0.088, 0.09, 0.1])
    bell = lathe([(0, 0), (0.1, 0), (0.12, 0.08), (0.19, 0.15), (0.17, 0.155), (0.1, 0.08),
        (0, 0.02)]).turn("x", -9).at(0, 0.25, -0.02)
    pads = cylinder(0.036, 0.03).turn("y",
        90).copies([(0.045 + 0.004 * k, -0.05, 0.36 - 0.09 * k) for k in range(6)])
    return dict(brass=[body, bell],
        keys=[pads, rod((0.06, -0.09, 0.42), (0.08, -0.09, -0.15), 0.01),
        cylinder(0.045, 0.03).turn("y", 90).copies([(0.085, 0.2, -0.22), (0.09, 0.13, -0.34)])],
        mouthpiece=rod((0, -0.23, 0.62), (0, -0.36, 0.58), 0.03, 0.018))


@kind("flute", "instruments", also=("recorder", "wooden flute"),
    colours=dict(tube="wooden|beige|silver|brown|golden", rings="white|golden|black",
        holes="!black"),
    counts=dict(holes="5|6|7"))
def flute(o, rng):
    z = np.linspace(-0.3, 0.16, o.holes)
    body = lathe([(0, -0.5), (0.06, -0.5), (0.065, -0.46), (0.045, -0.4), (0.05, 0.24),
        (0.06, 0.28), (0.06, 0.4), (0.03, 0.5), (0, 0.5)], sharp=True)
    return each(dict(tube=body, rings=ring(0.052, 0.016).copies([(0, 0, 0.26), (0, 0, -0.38)]),
        holes=[cylinder(0.018, 0.02).turn("y", 90).copies([(0.036, 0, a) for a in z]),
        block(0.02, 0.045, 0.05).at(0.05, 0, 0.37)]), lambda s: s.turn("x", 42))


@kind("bell", "instruments", also=("hand bell", "golden bell"),
    colours=dict(bell="golden|silver|copper", handle="wooden|black|golden", clapper="!dark grey",
        ribbon="red|blue"),
    extras=dict(ribbon=0.3))
def bell(o, rng):
    dome = lathe([(0.43, -0.46), (0.37, -0.36), (0.28, -0.05), (0.22, 0.1), (0.1, 0.18), (0, 0.19)])
    return dict(bell=[dome, ring(0.41, 0.03).at(z=-0.44)],
        handle=lathe([(0, 0.17), (0.04, 0.17), (0.06, 0.32), (0.04, 0.42), (0.065, 0.5),
        (0, 0.54)]), clapper=ball(0.08).at(z=-0.47),
        ribbon=[ball(0.04, 0.11, 0.07).turn("x", -15).at(0.06, 0.1, 0.2).both(),
        ball(0.05).at(0.07, 0, 0.2)] if o.ribbon else [])


@kind("harp", "instruments",
    colours=dict(frame="golden|brown|white", strings="!cream", base="=frame"))
def harp(o, rng):
    y = np.linspace(-0.22, 0.26, 13)
    lines = [rod((0, a, -0.42 + 0.95 * (0.3 - a) * 0.0 + 0.6 * (a + 0.28) ** 1.4),
        (0, a, 0.44 - 0.18 * np.sin(3.6 * (a + 0.22))), 0.006) for a in y]
    return dict(frame=[tube([(0, -0.3, -0.45), (0, -0.3, 0.1), (0, -0.3, 0.5)],
        [0.05, 0.035, 0.045]), tube([(0, -0.3, 0.5), (0, -0.12, 0.44), (0, 0.1, 0.3),
        (0, 0.28, 0.36), (0, 0.34, 0.3)], [0.05, 0.04, 0.04, 0.045, 0.04]),
        tube([(0, -0.28, -0.47), (0, 0.0, -0.2), (0, 0.33, 0.3)], [0.09, 0.075, 0.045], flat=0.8),
        lathe([(0, 0), (0.07, 0), (0.03, 0.06), (0.06, 0.1), (0, 0.13)]).at(0, -0.3, 0.5)],
        base=block(0.24, 0.22, 0.07, 0.02).at(0, -0.28, -0.52), strings=lines)


@kind("banjo", "instruments",
    colours=dict(rim="wooden|brown|silver", head="white|cream", neck="brown|dark brown",
        strings="!silver", pegs="silver|golden"))
def banjo(o, rng):
    return dict(rim=[ring(0.27, 0.045).turn("y", 90)],
        silver=rod((0.04, 0.3, 0), (-0.04, 0.3, 0), 0.012).around(14, "x"),
        head=cylinder(0.26, 0.04).turn("y", 90),
        neck=[block(0.045, 0.075, 0.68).at(0.04, 0, 0.58),
        block(0.04, 0.11, 0.17, 0.03).at(0.03, 0, 0.98)],
        brown=block(0.05, 0.12, 0.025).at(0.055, 0, -0.1),
        strings=strings(4, 0.024, -0.22, 0.94, 0.075),
        pegs=ball(0.018).copies([(0.04, s * 0.07, z) for s in (-1, 1) for z in (0.94, 1.02)]))


@kind("maracas", "instruments", also=("pair of maracas",),
    colours=dict(heads="red|yellow|green|orange", handles="wooden|beige|brown",
        bands="yellow|blue|white"))
def maracas(o, rng):
    one = dict(heads=lathe([(0, 0), (0.09, 0.03), (0.17, 0.2), (0.12, 0.37),
        (0, 0.42)]).coat("bands", lambda u, v,
        p: (np.abs(p[:, 2] - 0.2) < 0.035)
        | (np.abs(p[:, 2] - 0.28 - 0.02 * np.cos(8 * 2 * np.pi * u)) < 0.012)),
        handles=lathe([(0, 0.02), (0.035, 0.02), (0.03, -0.3), (0.045, -0.4), (0, -0.42)]))
    return together(each(one, lambda s: s.turn("x", -24).at(0.02, 0.09, 0)),
        each(one, lambda s: s.turn("x", 24).at(-0.04, -0.09, 0)))


@kind("xylophone", "instruments", also=("glockenspiel",),
    colours=dict(frame="wooden|white|brown", mallets="red|wooden|blue"),
    counts=dict(bars="6|7|8"))
def xylophone(o, rng):
    n = o.bars
    names = ("red", "orange", "yellow", "light green", "green", "light blue", "blue", "purple")
    y = np.linspace(-0.43, 0.43, n)
    parts = dict(frame=[block(0.05, 1.0, 0.05).turn("z", s * -6).at(s * 0.16, 0, 0.04) for s in (-1,
        1)] + [block(0.5, 0.05, 0.06).at(0, -0.48, 0.03), block(0.3, 0.05, 0.06).at(0, 0.48, 0.03)],
        bars=[])
    for k, (a, name) in enumerate(zip(y, names, strict=False)):
        parts[name] = [block(0.58 - 0.3 * k / n, 0.8 / n, 0.035, 0.01).at(0, a, 0.085)]
    parts["mallets"] = [rod((0.1, -0.36, 0.13), (0.36, 0.22, 0.2), 0.014),
        ball(0.05).at(0.08, -0.4, 0.14)]
    return each(parts, lambda s: s.turn("y", 25))


@kind("microphone", "instruments", also=("handheld microphone", "stage microphone"),
    colours=dict(handle="black|dark grey|golden|red|blue", mesh="silver|metal|dark grey",
        band="silver|golden|black", switch="!light grey"),
    sizes=dict(handle="short 0.7|1|long 1.3"))
def microphone(o, rng):
    h = 0.66 * o.handle
    weave = lambda u, v, p: 0.72 + 0.3 * ((np.sin(2 * np.pi * 22 * u) * np.sin(60 * v)) > -0.2)
    return each(dict(handle=lathe([(0, -h), (0.075, -h), (0.085, -h + 0.03), (0.13, 0), (0, 0)],
        sharp=True), mesh=ball(0.2, 0.2, 0.205, fine=12).at(z=0.17).shade(weave),
        band=[ring(0.195, 0.026).at(z=0.16), cylinder(0.13, 0.05, 0.15).at(z=-0.02)],
        switch=block(0.03, 0.045, 0.11, 0.01).at(0.108, 0, -0.22)),
        lambda s: s.turn("x", float(rng.choice([0, 25]))))
