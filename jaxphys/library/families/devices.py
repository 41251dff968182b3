"""Machines of the household: clocks, screens, lenses."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.palette import ripples
from jaxphys.library.patterns import (
    mottled,
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
    oblong,
    plate,
    ring,
    rod,
    tube,
)
from jaxphys.library.solids import each, together

# fmt: off
# ruff: noqa: E731


@kind("phone", "household", also=("smartphone", "mobile phone", "cell phone"),
    colours=dict(body="black|white|silver|red|blue", screen="!light blue", buttons="=body"))
def phone(o, rng):
    icons = lambda u, v, p: (np.abs((p[:, 1] * 9.5) % 1 - 0.5)
        < 0.27) & (np.abs((p[:, 2] * 9.5 + 0.3) % 1 - 0.5) < 0.27) & (p[:, 0] > 0)
    face = block(0.02, 0.43, 0.86, 0.0).at(0.04)
    return each(dict(body=plate(oblong(0.5, 1.0, 0.08), 0.08, edge=0.015),
        screen=face.coat("white", lambda u, v, p: icons(u, v, p) & (p[:, 2] < 0.25)).coat("blue",
        lambda u, v, p: icons(u, v, p) & (np.sin(40 * p[:, 1] + 25 * p[:, 2]) > 0.2)),
        buttons=block(0.03, 0.02, 0.12).at(0, 0.255, 0.2),
        black=cylinder(0.045, 0.02).turn("y", -90).at(-0.04, 0.14, 0.38)),
        lambda s: s.turn("y", -10).turn("z", 15))


@kind("telephone", "household", also=("old telephone", "rotary phone"),
    colours=dict(body="red|black|green|cream", receiver="=body", dial="white|cream",
        holes="!black"))
def telephone(o, rng):
    base = lathe([(0, 0), (1, 0), (0.97, 0.1), (0.6, 0.3), (0, 0.32)],
        outline=oblong(0.56, 0.66, 0.12))
    k = np.deg2rad(36 * np.arange(10))
    holes = cylinder(0.025, 0.02).copies(np.stack([0.095 * np.cos(k), 0.095 * np.sin(k),
        0 * k + 0.03], -1))
    dial = [s.turn("y", 42).at(0.2, 0, 0.2) for s in (cylinder(0.14, 0.04), holes)]
    bar = tube([(0, -0.3, 0.4), (0, -0.2, 0.46), (0, 0, 0.49), (0, 0.2, 0.46), (0, 0.3, 0.4)], 0.05)
    return dict(body=[base, block(0.07, 0.34, 0.1, 0.02).at(-0.03, 0, 0.36)],
        receiver=[bar, lathe([(0, 0), (0.1, 0), (0.08, 0.1), (0, 0.1)]).at(0, 0.32, 0.32).both()],
        dial=dial[0], holes=dial[1])


@kind("laptop", "household", also=("notebook computer", "laptop computer"),
    colours=dict(body="silver|dark grey|white|black", screen="!light blue", keys="!black"))
def laptop(o, rng):
    lid = [block(0.03, 1.0, 0.66, 0.01).at(z=0.33),
        block(0.01, 0.92, 0.56).at(0.016, 0, 0.34).coat("blue", lambda u, v,
        p: p[:, 2] < 0.12 * np.sin(5 * p[:, 1]) - 0.05)]
    lid = [s.turn("y", -18).at(-0.33) for s in lid]
    return dict(body=[block(0.66, 1.0, 0.05, 0.02), lid[0],
        block(0.18, 0.3, 0.01).at(0.22, 0, 0.025).shade(lambda u, v, p: 0.88)], screen=lid[1],
        keys=block(0.055, 0.068, 0.02).copies([(x, y, 0.025) for x in (-0.22, -0.145, -0.07,
        0.005) for y in np.linspace(-0.4, 0.4, 11)]))


@kind("computer", "household", also=("desktop computer", "computer monitor", "old computer"),
    colours=dict(case="beige|white|black|silver", screen="!dark blue", keyboard="=case",
        keys="!light grey"))
def computer(o, rng):
    return dict(case=[block(0.1, 0.76, 0.54, 0.03).at(-0.1, 0, 0.52),
        hull([(-0.4, 0.2, 0.34, 0.66), (-0.14, 0.35, 0.27, 0.76)], square=6),
        block(0.3, 0.3, 0.16, 0.03, 0.6).at(-0.16, 0, 0.17),
        block(0.44, 0.6, 0.07, 0.02).at(-0.14, 0, 0.06)],
        screen=block(0.02, 0.62, 0.4).at(-0.045, 0, 0.54).coat("light green", lambda u, v,
        p: ((p[:, 2] * 19) % 1 < 0.35) & (p[:,
        1] < 0.15 * np.sin(40 * np.floor(p[:, 2] * 19)) + 0.1) & (np.abs(p[:, 2]) < 0.15) & (p[:,
        1] > -0.26)), keyboard=block(0.24, 0.72, 0.05, 0.015).at(0.36, 0, 0.03),
        keys=block(0.045, 0.05, 0.03).copies([(x, y, 0.055) for x in (0.28, 0.34, 0.4,
        0.45) for y in np.linspace(-0.31, 0.31, 11)]))


@kind("television", "household", also=("tv", "old television", "tv set"),
    colours=dict(case="wooden|brown|red|orange|black", screen="!light blue", knobs="silver|golden",
        legs="black|brown", antenna="silver"))
def television(o, rng):
    rods = [rod((-0.05, 0, 0.66), (-0.08, s * 0.26, 1.0), 0.01) for s in (-1, 1)]
    return dict(case=block(0.4, 0.9, 0.6, 0.05).at(z=0.37),
        screen=cushion(0.08, 0.58, 0.46, 4).at(0.19, -0.1, 0.37).coat("white", lambda u, v,
        p: (p[:, 1] + p[:, 2] > 0.22) & (p[:, 1] + p[:, 2] < 0.3)),
        knobs=[cylinder(0.05, 0.05, 0.04).turn("y",
        90).copies([(0.2, 0.33, 0.53), (0.2, 0.33, 0.39)])],
        **{"dark grey": block(0.02, 0.13,
        0.012).copies([(0.2, 0.33, z) for z in (0.18, 0.21, 0.24, 0.27)])},
        legs=rod((0.12, 0.34, 0.1), (0.17, 0.42, -0.12), 0.03, 0.018).both("y").both("x"),
        antenna=[*rods, ball(0.06).at(-0.05, 0, 0.67)])


@kind("radio", "household", also=("old radio", "portable radio"),
    colours=dict(case="wooden|red|turquoise|cream|brown", speaker="!beige",
        knobs="golden|silver|black", handle="=case", antenna="silver"),
    extras=dict(handle=0.6, antenna=0.6))
def radio(o, rng):
    mesh = cylinder(0.19, 0.03).turn("y", 90)
    return dict(case=block(0.26, 1.0, 0.56, 0.05).at(z=0.28),
        speaker=mesh.shade(lambda u, v, p: 0.75 + 0.25 * ((p[:, 0] * 26) % 1 < 0.55)).at(0.115,
        -0.24, 0.28), cream=block(0.02, 0.38, 0.14).at(0.13, 0.22, 0.4).coat("red", lambda u, v,
        p: np.abs(p[:, 1] - 0.04) < 0.012).coat("black", lambda u, v,
        p: (np.abs(p[:, 2] + 0.03) < 0.012) & ((p[:, 1] * 22) % 1 < 0.4)),
        knobs=cylinder(0.06, 0.06, 0.05).turn("y",
        90).copies([(0.12, 0.1, 0.16), (0.12, 0.32, 0.16)]),
        handle=tube([(0, -0.36, 0.52), (0, -0.34, 0.68), (0, 0, 0.72), (0, 0.34, 0.68),
        (0, 0.36, 0.52)], 0.025) if o.handle else [],
        antenna=rod((-0.08, 0.42, 0.55), (-0.08, 0.62, 1.0), 0.012) if o.antenna else [])


@kind("camera", "household", also=("photo camera",),
    colours=dict(body="black|silver|brown|red", top="silver|black", lens="black|dark grey",
        glass="!light blue", button="red|silver"),
    sizes=dict(lens="short 0.6|1|long 1.8"))
def camera(o, rng):
    long = 0.26 * o.lens
    return dict(body=block(0.28, 0.9, 0.42, 0.05).at(z=0.23).shade(mottled(ripples(rng, 24), 0.05)),
        top=[block(0.27, 0.9, 0.12, 0.03).at(z=0.5),
        block(0.22, 0.28, 0.14, 0.03, 0.8).at(0, 0, 0.6), cylinder(0.07, 0.07).at(0, -0.32, 0.55)],
        lens=[lathe([(0.0, 0), (0.2, 0), (0.2, 0.4 * long), (0.17, 0.45 * long), (0.17, long),
        (0.14, long), (0.1, long - 0.05), (0, long - 0.05)], sharp=True).turn("y", 90).at(0.12, 0,
        0.25)], glass=ball(0.03, 0.11, 0.11).at(0.08 + long, 0, 0.25),
        button=cylinder(0.04, 0.05).at(0, 0.32, 0.55),
        cream=block(0.02, 0.13, 0.08).at(0.14, 0.3, 0.48))


@kind("clock", "household", also=("wall clock", "round clock"),
    colours=dict(rim="red|blue|brown|golden|black|white", face="white|cream", hands="black|red",
        marks="!black"))
def clock(o, rng):
    k = np.deg2rad(30 * np.arange(12))
    marks = [block(0.02, 0.025, 0.08).turn("x", -30 * i).at(0.055, 0.36 * np.sin(a),
        0.36 * np.cos(a)) for i, a in enumerate(k)]
    a, b = rng.uniform(0, 360, 2)
    return dict(rim=ring(0.45, 0.055).turn("y", 90), face=cylinder(0.44, 0.05).turn("y", 90),
        marks=marks, hands=[block(0.02, 0.035, 0.22).at(0.065, 0, 0.1).turn("x", a),
        block(0.02, 0.025, 0.34).at(0.07, 0, 0.15).turn("x", b),
        cylinder(0.035, 0.04).turn("y", 90).at(0.05)])


@kind("alarm clock", "household",
    colours=dict(body="red|blue|yellow|turquoise|golden", face="white", bells="=body",
        hands="black", feet="silver|golden"))
def alarm_clock(o, rng):
    k = np.deg2rad(30 * np.arange(12))
    marks = [block(0.02, 0.02, 0.06).turn("x", -30 * i).at(0.15, 0.26 * np.sin(a),
        0.26 * np.cos(a)) for i, a in enumerate(k)]
    bell = lathe([(0.15, 0), (0.16, 0.01), (0.12, 0.1), (0, 0.14)]).turn("x", -32).at(0, 0.2, 0.33)
    return dict(body=cylinder(0.36, 0.26, bevel=0.04).at(z=-0.13).turn("y", 90),
        face=cylinder(0.31, 0.03).turn("y", 90).at(0.115), black=marks,
        hands=[block(0.02, 0.03, 0.15).at(0.155, 0, 0.07).turn("x", 60),
        block(0.02, 0.022, 0.24).at(0.16, 0, 0.11).turn("x", -40)], bells=bell.both(),
        feet=[limb((0, 0.2, -0.28), (0, 0.28, -0.43), 0.035).both(),
        tube([(0, 0.06, 0.5), (0, 0.05, 0.6), (0, -0.05, 0.6), (0, -0.06, 0.5)], 0.02),
        rod((0, 0, 0.34), (0, 0, 0.52), 0.02)])


@kind("hourglass", "household", also=("sand timer", "egg timer"),
    colours=dict(frame="wooden|golden|brown|black", sand="golden|straw|red|blue", glass="!glass"))
def hourglass(o, rng):
    bulb = lathe([(0, -0.4), (0.2, -0.4), (0.23, -0.25), (0.13, -0.08), (0.035, 0), (0.13, 0.08),
        (0.23, 0.25), (0.2, 0.4), (0, 0.4)])
    level = rng.uniform(0.15, 0.25)
    return dict(glass=bulb.coat("sand", lambda u, v,
        p: (p[:, 2] < -level) | (p[:, 2] > 0) & (p[:, 2] < 0.3 - level)),
        frame=[cylinder(0.3, 0.06, bevel=0.015).copies([(0, 0, 0.4), (0, 0, -0.46)]),
        rod((0.25, 0, -0.42), (0.25, 0, 0.42), 0.025).turn("z", 30).around(3)])


@kind("light bulb", "household", also=("lightbulb", "bulb"),
    colours=dict(glass="cream|yellow|white", base="silver|golden", tip="!black"))
def light_bulb(o, rng):
    return dict(glass=lathe([(0, -0.12), (0.13, -0.12), (0.15, 0.0), (0.28, 0.24), (0.29, 0.4),
        (0.2, 0.57), (0, 0.63)]),
        base=lathe([(0, -0.36), (0.1, -0.36), (0.13, -0.33), (0.13, -0.1),
        (0, -0.1)]).shade(lambda u, v, p: 0.72 + 0.28 * (((p[:, 2] + 0.02 * u) * 17) % 1 > 0.4)),
        tip=cone(0.08, 0.06).turn("x", 180).at(z=-0.35))


@kind("globe", "household", also=("world globe", "earth globe"),
    colours=dict(sea="blue|light blue|turquoise", land="green|beige|light green",
        stand="wooden|golden|brown", ice="!white"))
def globe(o, rng):
    wave = ripples(rng, 1.1, 10)
    a = np.linspace(-1.3, 1.3, 11) - 0.4
    arm = tube(np.stack([0 * a, 0.44 * np.cos(a), 0.44 * np.sin(a)], -1), 0.022)
    return dict(sea=ball(0.4, fine=12).coat("land", lambda u, v,
        p: (wave(p) - 0.25) * 8).coat("ice", lambda u, v, p: np.abs(p[:, 2]) > 0.36).turn("x", -23),
        stand=[arm, rod((0, -0.17, 0.4), (0, 0.17, -0.4), 0.012),
        rod((0, 0.1, -0.42), (0, 0, -0.62), 0.03),
        lathe([(0, -0.68), (0.26, -0.68), (0.24, -0.64), (0.05, -0.58), (0, -0.58)])])


@kind("telescope", "household", also=("spyglass",),
    colours=dict(tube="golden|white|blue|copper", rings="silver|brown|black",
        tripod="wooden|black|brown", lens="!light blue"))
def telescope(o, rng):
    body = [cylinder(0.1, 0.45).at(z=0.12), cylinder(0.075, 0.35).at(z=-0.2),
        cylinder(0.05, 0.14).at(z=-0.32)]
    bands = [ring(0.1, 0.018).copies([(0, 0, 0.56), (0, 0, 0.14)]), ring(0.075, 0.016).at(z=-0.19),
        ring(0.05, 0.014).at(z=-0.32)]
    tilt = lambda s: s.turn("y", 62).turn("z", 60).at(0, 0, 0.72)
    return dict(tube=[tilt(s) for s in body], rings=[tilt(s) for s in bands],
        lens=tilt(ball(0.085, 0.085, 0.02).at(z=0.57)),
        tripod=[rod((0.03, 0, 0.68), (0.3, 0, 0), 0.024).around(3), ball(0.055).at(z=0.68)])


@kind("headphones", "household", also=("headset",),
    colours=dict(band="black|white|red|blue", pads="black|dark grey", cups="=band"))
def headphones(o, rng):
    a = np.linspace(-0.15, np.pi + 0.15, 13)
    arc = tube(np.stack([0 * a, 0.38 * np.cos(a), 0.42 * np.sin(a)], -1), 0.045, flat=0.9)
    return dict(band=arc, cups=cylinder(0.17, 0.09, 0.14).turn("x", -90).at(0, 0.38, -0.14).both(),
        pads=[ring(0.12, 0.05).turn("x", 90).at(0, 0.345, -0.14).both(),
        tube(np.stack([0 * a[3:10], 0.36 * np.cos(a[3:10]), 0.4 * np.sin(a[3:10])], -1), 0.05)])


@kind("fan", "household", also=("electric fan", "table fan"),
    colours=dict(blades="light blue|white|blue|silver", cage="silver|white|black",
        stand="white|black|blue"),
    counts=dict(blades="3|4|5"))
def fan(o, rng):
    n = o.blades
    blade = ball(0.02, 0.11, 0.15).turn("z", 22).at(0, 0.03, 0.19)
    cage = [ring(0.37, 0.016).turn("y", 90).at(x) for x in (-0.06, 0.08)] + [ring(0.2,
        0.008).turn("y", 90).at(0.1)]
    wires = tube([(0.1, 0, 0.06), (0.11, 0, 0.2), (0.08, 0, 0.37), (-0.06, 0, 0.37)], 0.008,
        sides=6).around(16, "x")
    parts = dict(blades=[blade.turn("x", 360 / n * k) for k in range(n)],
        cage=[*cage, wires, cylinder(0.07, 0.04).turn("y", 90).at(0.08)])
    return together(each(parts, lambda s: s.at(z=0.72)),
        dict(stand=[rod((-0.12, 0, 0.05), (-0.12, 0, 0.72), 0.03),
        limb((-0.2, 0, 0.72), (0.02, 0, 0.72), 0.08),
        lathe([(0, 0), (0.24, 0), (0.2, 0.05), (0, 0.07)]).at(-0.08)]))
