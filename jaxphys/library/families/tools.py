"""Tools for hand and garden; they lie or stand so that their shape is seen from +x."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    below,
    between,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cone,
    cylinder,
    handle,
    helix,
    hull,
    lathe,
    limb,
    oblong,
    plate,
    refined,
    ring,
    rod,
    rounded,
    sheet,
    tube,
)
from jaxphys.library.solids import each, together

# fmt: off
# ruff: noqa: E731

GRIP = "wooden|brown|red|black"


@kind("hammer", "tools", also=("claw hammer",),
    colours=dict(handle=GRIP, head="metal|dark grey|silver", grip="=handle"),
    sizes=dict(handle="short 0.65|1|long 1.35", head="small 0.8|1|large 1.3"))
def hammer(o, rng):
    long, k = 0.78 * o.handle, o.head
    claw = tube([(0, -0.02, 0), (0, -0.14 * k, 0.035), (0, -0.27 * k, -0.05)],
        [0.055 * k, 0.05 * k, 0.02], flat=0.7)
    prongs = [claw.scale(0.55, 1, 1).at(x=0.035 * k), claw.scale(0.55, 1, 1).at(x=-0.035 * k)]
    return dict(handle=lathe([(0, -long), (0.05, -long), (0.058, -0.8 * long), (0.04, -0.5 * long),
        (0.036, 0), (0, 0)]).scale(0.8, 1, 1),
        grip=lathe([(0, -1.01 * long), (0.06, -long), (0.066, -0.8 * long), (0.056, -0.56 * long),
        (0, -0.56 * long)]).scale(0.85, 1, 1),
        head=[*prongs, block(0.13 * k, 0.14 * k, 0.14 * k, 0.02),
        cylinder(0.05 * k, 0.16 * k).turn("x", -90).at(0, 0.04, 0),
        cylinder(0.08 * k, 0.08 * k, bevel=0.012).turn("x", -90).at(0, 0.19 * k, 0)])


@kind("screwdriver", "tools",
    colours=dict(handle="red|yellow|blue|orange|green", shaft="silver|metal", bands="black"),
    sizes=dict(shaft="short 0.55|1|long 1.4"))
def screwdriver(o, rng):
    s = 0.48 * o.shaft
    grip = lathe([(0, 0.42), (0.07, 0.42), (0.085, 0.34), (0.075, 0.14), (0.05, 0.06), (0.06, 0.0),
        (0, 0)], waves=(6, 0.08))
    return each(dict(handle=grip.coat("bands", between("z", 0.3, 0.34)),
        shaft=[rod((0, 0, 0.02), (0, 0, -s), 0.022), block(0.015, 0.05, 0.06, 0.0, 0.8).at(z=-s)]),
        lambda x: x.turn("x", 35))


@kind("wrench", "tools", also=("spanner",),
    colours=dict(body="silver|metal|dark grey"),
    sizes=dict(handle="short 0.65|1|long 1.3"))
def wrench(o, rng):
    h = 0.36 * o.handle
    a = np.deg2rad(np.linspace(50, 310, 14))
    jaw = tube(np.stack([0 * a, 0.115 * np.cos(a + np.pi / 2 - np.pi / 2 + 0.0), 0.115 * np.sin(a)],
        -1), 0.048, flat=1.0, sharp=False).scale(0.7, 1, 1).turn("x", 90)
    box = ring(0.1, 0.038).turn("y", 90).scale(0.75, 1, 1)
    return each(dict(body=[block(0.045, 0.085, 2 * h, 0.02), jaw.at(z=h + 0.12),
        box.at(z=-h - 0.09)], handle=[]), lambda s: s.turn("x", 30))


@kind("saw", "tools", also=("hand saw",),
    colours=dict(blade="silver|metal", handle="wooden|red|brown|orange"),
    sizes=dict(blade="short 0.7|1|long 1.25"))
def saw(o, rng):
    long = 0.8 * o.blade
    n = 22
    top = [(0.0, 0.12), (long, 0.02), (long, -0.06)]
    teeth = np.stack([np.linspace(long, 0.0, n), np.where(np.arange(n) % 2 == 0, -0.09, -0.125)],
        -1)
    outline = np.concatenate([top, teeth]) - (0.5 * long, 0)
    hold = [ring(0.11, 0.04).turn("y", 90).scale(0.7, 1.0, 1.15).at(0, -0.08, 0),
        block(0.05, 0.1, 0.26, 0.02).at(0, 0.03, 0)]
    return each(dict(blade=plate(outline, 0.02).at(0, 0.5 * long, 0), handle=hold),
        lambda s: s.at(y=-0.4).turn("x", -12))


@kind("axe", "tools", also=("hatchet", "ax"),
    colours=dict(head="metal|silver|red", handle="wooden|brown", edge="silver"),
    sizes=dict(handle="short 0.6|1|long 1.25"))
def axe(o, rng):
    long = 0.85 * o.handle
    blade = rounded([(0.34, 0.22), (0.38, 0.0), (0.34, -0.24), (0.2, -0.12), (-0.02, -0.08),
        (-0.06, 0), (-0.02, 0.08), (0.2, 0.1)])
    head = plate(blade, 0.08).coat("edge", lambda u, v, p: p[:, 0] > 0.29)
    return dict(head=[head.at(0, 0.02, 0), block(0.11, 0.13, 0.17, 0.02)],
        handle=tube([(0, 0, 0.12), (0, 0, -0.3 * long), (0, -0.03, -0.7 * long), (0, 0.03, -long)],
        [0.04, 0.042, 0.042, 0.055], flat=0.75))


@kind("shovel", "tools", also=("spade",),
    colours=dict(blade="metal|silver|dark grey|red", handle="wooden|brown", grip="=handle"),
    sizes=dict(handle="short 0.6|1|long 1.25"))
def shovel(o, rng):
    h = 0.72 * o.handle
    blade = sheet(lambda u, v: np.stack([-0.05 * np.cos(np.pi * (u - 0.5)) + 0.03 - 0.05 * v,
        0.15 * (2 * u - 1) * np.clip(1 - np.clip(v - 0.55, 0, 1) ** 2 * 4.4, 0.02, 1) ** 0.5,
        -0.38 * v], -1), 0.025)
    return dict(blade=[blade, limb((0.0, 0, 0.1), (-0.01, 0, -0.12), 0.032)],
        handle=rod((0, 0, 0.02), (0, 0, h), 0.026),
        grip=[limb((0, -0.1, h + 0.1), (0, 0.1, h + 0.1), 0.025),
        limb((0, 0.1, h + 0.1), (0, 0, h - 0.02), 0.02).both()])


@kind("rake", "tools", also=("garden rake",),
    colours=dict(head="metal|green|red|dark grey", handle="wooden|brown"),
    counts=dict(teeth="6|7|8|9"))
def rake(o, rng):
    y = np.linspace(-0.22, 0.22, o.teeth)
    teeth = [tube([(0, a, 0), (0.09, a, 0.01), (0.1, a, -0.1)], 0.012) for a in y]
    return dict(head=[block(0.04, 0.48, 0.04, 0.01), *teeth, rod((0, 0.02, 0), (0, 0, 0.12), 0.02)],
        handle=rod((0, 0, 0.05), (0, 0, 1.0), 0.022), teeth=[])


@kind("drill", "tools", also=("power drill", "electric drill"),
    colours=dict(body="yellow|red|green|blue|orange", grip="black|dark grey", bit="silver|metal",
        chuck="dark grey"),
    sizes=dict(bit="short 0.6|1|long 1.7"))
def drill(o, rng):
    b = 0.24 * o.bit
    turns = lambda u, v, p: 0.8 + 0.25 * (np.sin(2 * np.pi * u + 130 * p[:, 2]) > 0)
    return dict(body=[hull([(-0.3, 0.08, 0.1, 0.26), (-0.24, 0.1, 0.08, 0.28),
        (0.1, 0.1, 0.08, 0.28), (0.16, 0.07, 0.11, 0.25)], square=2.5),
        block(0.18, 0.13, 0.12, 0.03).turn("y", 12).at(-0.24, 0, -0.28)],
        grip=[block(0.12, 0.1, 0.32, 0.04).turn("y", 12).at(-0.18, 0, -0.06),
        block(0.04, 0.05, 0.09, 0.015).at(-0.08, 0, 0.02)],
        chuck=cylinder(0.06, 0.13, 0.04).turn("y", 90).at(0.15, 0, 0.18),
        bit=[cylinder(0.02, b, 0.018).turn("y", 90).at(0.27, 0, 0.18).shade(turns),
        cone(0.018, 0.04).turn("y", 90).at(0.27 + b, 0, 0.18)])


@kind("pliers", "tools", also=("pair of pliers",),
    colours=dict(handles="red|blue|yellow|orange", jaws="metal|silver"),
    sizes=dict(handles="short 0.7|1|long 1.3"))
def pliers(o, rng):
    h = o.handles
    one = tube([(0, -0.02, 0.02), (0, 0.07, -0.1), (0, 0.14, -0.3 * h), (0, 0.1, -0.58 * h)],
        [0.035, 0.042, 0.045, 0.04], flat=0.8)
    jaw = tube([(0, 0.02, -0.02), (0, 0.085, 0.1), (0, 0.028, 0.3)], [0.04, 0.05, 0.022], flat=0.9)
    return each(dict(handles=one.both(),
        jaws=[jaw.both(), cylinder(0.075, 0.09).turn("y", 90).at(-0.045, 0, 0.01)]),
        lambda s: s.turn("x", 20))


@kind("scissors", "tools", also=("pair of scissors",),
    colours=dict(handles="red|orange|blue|black", blades="silver|metal"),
    sizes=dict(blades="short 0.65|1|long 1.3"))
def scissors(o, rng):
    b = 0.56 * o.blades
    blade = plate(refined([(0.045, -0.1), (0.035, 0.5 * b), (-0.015, b), (-0.045, 0.3 * b),
        (-0.04, -0.1)]), 0.022)
    loop = ring(0.115, 0.034).turn("y", 90).scale(0.7, 1, 1.25)
    one = dict(blades=[blade.at(0.012), rod((0, 0, -0.08), (0, -0.05, -0.2), 0.028)],
        handles=loop.at(0, -0.1, -0.33))
    other = each(one, lambda s: s.mapped(np.diag([-1.0, -1, 1])))
    return each(together(each(one, lambda s: s.turn("x", -13)),
        each(other, lambda s: s.turn("x", 13)),
        dict(grey=cylinder(0.028, 0.06).turn("y", 90).at(-0.03))), lambda s: s.turn("x", 15))


@kind("paintbrush", "tools", also=("brush", "paint brush"),
    colours=dict(handle="wooden|red|blue|brown", paint="blue|red|green|yellow",
        bristles="beige|straw|black", band="silver|golden"),
    forms=dict(width="thin 0.5|1|wide 1.6"))
def paintbrush(o, rng):
    w = 0.11 * o.width
    hair = lathe([(0, 0), (0.9, 0), (1.05, 0.14), (0.85, 0.3), (0, 0.33)],
        outline=oblong(0.09, 2 * w, 0.04)).coat("paint", lambda u, v,
        p: p[:, 2] > 0.15 + 0.03 * np.sin(60 * p[:, 1])).shade(lambda u, v,
        p: 0.92 + 0.1 * np.sin(160 * p[:, 1]))
    return each(dict(bristles=hair, band=block(0.1, 2.05 * w, 0.13, 0.04).at(z=-0.05),
        handle=tube([(0, 0, -0.1), (0, 0, -0.22), (0, 0, -0.45), (0, 0, -0.66)],
        [0.75 * w, 0.04, 0.05, 0.03], flat=0.8)), lambda s: s.turn("x", 28))


@kind("ladder", "tools", also=("step ladder",),
    colours=dict(rails="wooden|silver|yellow|red", rungs="=rails"),
    counts=dict(rungs="4|5|6|7|8"))
def ladder(o, rng):
    z = np.linspace(0.08, 0.95, o.rungs)
    return each(dict(rails=block(0.06, 0.045, 1.04).at(0, 0.2, 0.52).both(),
        rungs=rod((0, -0.2, 0), (0, 0.2, 0), 0.022).copies([(0, 0, a) for a in z])),
        lambda s: s.turn("y", -12))


@kind("bucket", "tools", also=("pail",),
    colours=dict(bucket="blue|red|silver|yellow|green", handle="silver|black",
        water="light blue|blue"),
    extras=dict(water=0.4),
    forms=dict(height="flat 0.75|1|tall 1.3"))
def bucket(o, rng):
    h = 0.5 * o.height
    body = lathe([(0, 0), (0.26, 0), (0.36, h), (0.39, h), (0.39, h - 0.04), (0.37, h - 0.04),
        (0.36, h), (0.33, h), (0.25, 0.03), (0, 0.03)], sharp=True)
    a = np.linspace(0, np.pi, 11)
    lift = tube(np.stack([0.2 * np.sin(a), 0.38 * np.cos(a), h - 0.03 + 0.3 * np.sin(a)], -1),
        0.015)
    return dict(bucket=body, handle=[lift, ball(0.03).at(0, 0.38, h - 0.03).both()],
        water=cylinder(0.34, 0.02).at(z=0.82 * h) if o.water else [])


@kind("watering can", "tools",
    colours=dict(can="green|blue|silver|red|yellow", handle="=can", spout="=can", rose="=spout"),
    sizes=dict(spout="short 0.7|1|long 1.4", handle="small 0.75|1|large 1.3"))
def watering_can(o, rng):
    body = lathe([(0, 0), (0.26, 0), (0.24, 0.36), (0.2, 0.42), (0.16, 0.42), (0.2, 0.36),
        (0, 0.33)], sharp=True)
    end = np.array([0, -0.24 - 0.36 * o.spout, 0.3 + 0.2 * o.spout])
    d = end - (0, -0.2, 0.1)
    d /= np.linalg.norm(d)
    return dict(can=body, handle=[handle((0, 0.2, 0.4), (0, 0.26, 0.08), 0.22 * o.handle, 0.026),
        tube([(0, 0.18, 0.38), (0, 0.05, 0.38 + 0.24 * o.handle), (0, -0.15, 0.4)], 0.024)],
        spout=rod((0, -0.2, 0.1), end, 0.06, 0.03),
        rose=[cylinder(0.03, 0.07, 0.1).copies([end - 0.01 * d], [d]).coat("dark grey", lambda u, v,
        p: (p[:, 2] > 0.066) & ((u * 12) % 1 < 0.4)
        & ((np.hypot(p[:, 0], p[:, 1]) * 34) % 1 < 0.5))])


@kind("broom", "tools", also=("besom",),
    colours=dict(handle="wooden|brown|red|blue", bristles="straw|beige|yellow", band="red|brown"))
def broom(o, rng):
    head = lathe([(0, -0.3), (1.2, -0.3), (0.85, -0.1), (0.35, 0.06), (0, 0.06)],
        outline=oblong(0.16, 0.36, 0.06)).shade(lambda u, v,
        p: 0.85 + 0.15 * np.sin(190 * p[:, 1] / (1.2 - 2 * p[:, 2])))
    return dict(bristles=head.coat("band", between("z", -0.04, 0.0)),
        handle=rod((0, 0, 0), (0, 0, 0.85), 0.024))


@kind("flashlight", "tools", also=("torch", "hand torch"),
    colours=dict(body="black|red|yellow|silver|blue", head="=body", lens="cream|yellow",
        button="red|grey"),
    sizes=dict(head="small 0.85|1|large 1.25"))
def flashlight(o, rng):
    k = o.head
    return each(dict(body=lathe([(0, -0.42), (0.08, -0.42), (0.09, -0.38), (0.08, 0.22), (0, 0.22)],
        sharp=True).shade(lambda u, v,
        p: 1 - 0.25 * ((p[:, 2] > -0.3) & (p[:, 2] < -0.02) & ((p[:, 2] * 40) % 1 < 0.3))),
        head=lathe([(0, 0.18), (0.085, 0.18), (0.16 * k, 0.36), (0.16 * k, 0.44), (0.14 * k, 0.44),
        (0, 0.4)], sharp=True), lens=ball(0.14 * k, 0.14 * k, 0.02).at(z=0.43),
        button=ball(0.035, 0.03, 0.05).at(0.075, 0, 0.08)),
        lambda s: s.turn("z", -30).turn("x", -60).turn("z", 55))


@kind("magnet", "tools", also=("horseshoe magnet",),
    colours=dict(body="red|blue", tips="silver|white"))
def magnet(o, rng):
    a = np.linspace(0, np.pi, 11)
    path = np.concatenate([[(0, 0.26, -0.4)],
        np.stack([0 * a, 0.26 * np.cos(a), 0.26 * np.sin(a)], -1), [(0, -0.26, -0.4)]])
    return dict(body=tube(path, 0.11, sides=8, flat=0.85, sharp=False).scale(0.85, 1,
        1).coat("tips", below("z", -0.24)))


@kind("screw", "tools", also=("wood screw", "bolt"),
    colours=dict(metal="silver|golden|metal"),
    sizes=dict(thread="short 0.7|1|long 1.3"))
def screw(o, rng):
    long = 0.75 * o.thread
    return each(dict(metal=[lathe([(0, 0.1), (0.2, 0.1), (0.21, 0.07), (0.08, -0.05), (0.07, -0.1),
        (0.06, -long), (0, -long - 0.12)]),
        helix(0.068, long - 0.1, 9 * o.thread, 0.022).at(z=-long)],
        **{"dark grey": [block(0.28, 0.045, 0.02).at(z=0.098),
        block(0.045, 0.28, 0.02).at(z=0.098)]}, thread=[]), lambda s: s.turn("y", 35))


@kind("anvil", "tools",
    colours=dict(body="dark grey|black|metal", block="wooden|brown"),
    extras=dict(block=0.5))
def anvil(o, rng):
    z = 0.25 if o.block else 0.0
    return each(dict(body=[block(0.62, 0.24, 0.16, 0.01).at(-0.1, 0, 0.4),
        hull([(0.18, 0.12, 0.34, 0.48), (0.3, 0.1, 0.36, 0.48), (0.52, 0.01, 0.44, 0.47)]),
        lathe([(0, 0), (1.1, 0), (1.0, 0.07), (0.55, 0.16), (0.55, 0.24), (0.9, 0.34), (0, 0.34)],
        outline=oblong(0.42, 0.3, 0.03)).at(-0.1)],
        block=cylinder(0.34, 0.26).at(-0.1, 0, -0.26) if z else []), lambda s: s.turn("z", 60))


@kind("wheelbarrow", "tools",
    colours=dict(tray="red|green|blue|metal", wheel="!black", handles="wooden|brown|black",
        legs="=handles"))
def wheelbarrow(o, rng):
    tray = lathe([(0, 0.24), (0.6, 0.24), (1, 0.48), (0.94, 0.48), (0.56, 0.27), (0, 0.27)],
        sharp=True, outline=oblong(0.7, 0.5, 0.1))
    return dict(tray=tray, wheel=[ring(0.13, 0.045).turn("x", 90).at(0.48, 0, 0.17)],
        silver=[cylinder(0.05, 0.08).turn("x", 90).at(0.48, 0.04, 0.17)],
        handles=[rod((0.5, 0.06, 0.17), (-0.62, 0.22, 0.36), 0.024).both()],
        legs=[rod((-0.14, 0.17, 0.26), (-0.2, 0.18, 0.0), 0.022).both()])
