"""What drives on wheels; the front faces +x."""

import numpy as np

from jaxphys.library.families.common import (
    pairs,
    wheels,
)
from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    above,
    also,
    below,
    between,
    panes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cylinder,
    hull,
    lathe,
    limb,
    oblong,
    refined,
    ring,
    rod,
    sheet,
    side_plate,
    tube,
)
from jaxphys.library.solids import Parts, each, together

# fmt: off
# ruff: noqa: E731


def car_body(length: float, height: float, cabin: tuple[float, float], roof: float, width=0.24,
        nose=0.62) -> Parts:
    """A rounded car body with its cabin between two x, and dark windows; wheels not counted."""
    h, half = 0.13 * height, 0.5 * length
    base = hull([(-half, 0.85 * width, 0.09, 0.12 + 0.8 * h), (-0.92 * half, width, 0.07, 0.14 + h),
        (0.3 * half, width, 0.07, 0.14 + h), (0.9 * half, 0.94 * width, 0.07, 0.13 + nose * h),
        (half, 0.8 * width, 0.09, 0.1 + 0.5 * nose * h)], square=4)
    back, front = cabin
    z = 0.1 + h
    top = hull([(back, 0.7 * width, z, z + 0.02), (back + 0.3 * roof, 0.82 * width, z, z + roof),
        (front - 0.75 * roof, 0.82 * width, z, z + roof), (front, 0.78 * width, z, z + 0.02)],
        square=4, sharp=True)
    glass = also(above("z", z + 0.24 * roof + 0.02, 0.001), below("z", z + 0.84 * roof, 0.001),
        lambda u, v, p: np.abs(p[:, 0] - 0.5 * (back + front - 0.5 * roof)) > 0.014)
    return dict(body=base, cabin=top.coat("windows", glass))


def lights(front: float, back: float, y: float, z: float, size=0.035) -> Parts:
    one = ball(0.5 * size, size, size, fine=4)
    return {"headlights": one.at(front, y, z).both(), "dark red": one.at(back, y, z).both()}


CAR = dict(wheels="!black", hubs="silver|light grey", windows="!glass", cabin="=body",
    headlights="!cream")


@kind("car", "vehicles", also=("small car", "automobile"),
    colours=dict(body="red|blue|yellow|white|green|silver", stripes="white|black", **CAR),
    forms=dict(height="flat 0.85|1|tall 1.35", style="plain|striped"),
    sizes=dict(wheels="small 0.8|1|large 1.3"))
def car(o, rng):
    parts = car_body(1.0, 1.35 * o.height, (-0.36, 0.28), 0.19 * o.height)
    if o.style == "striped":
        parts = each(parts, lambda s: s.coat("stripes", lambda u, v,
            p: (np.abs(np.abs(p[:, 1]) - 0.05) < 0.025) & (p[:, 2] > 0.16)))
    r = 0.105 * o.wheels
    parts = each(parts, lambda s: s.at(z=0.4 * r - 0.03))
    return together(parts, wheels(pairs((-0.3, 0.3), 0.215, r), r, 0.09),
        lights(0.485, -0.495, 0.15, 0.17 + 0.02 * o.height))


@kind("taxi", "vehicles", also=("taxi cab", "cab"),
    colours=dict(body="yellow|black|white", sign="white|yellow", checks="black", **CAR))
def taxi(o, rng):
    parts = car_body(1.0, 1.4, (-0.36, 0.28), 0.19)
    band = lambda u, v, p: (np.abs(p[:, 2] - 0.21) < 0.025) & (np.abs(p[:,
        1]) > 0.2) & ((np.floor(p[:, 0] * 26) + (p[:, 2] > 0.21)) % 2 < 1)
    parts["body"] = parts["body"].coat("checks", band)
    return together(parts, wheels(pairs((-0.3, 0.3), 0.215, 0.105), 0.105, 0.09),
        lights(0.485, -0.495, 0.15, 0.19),
        dict(sign=block(0.07, 0.2, 0.06, 0.015).at(-0.06, 0, 0.5)))


@kind("police car", "vehicles",
    colours=dict(body="white|dark blue", doors="black|blue", siren="!blue", **CAR))
def police_car(o, rng):
    parts = car_body(1.0, 1.4, (-0.36, 0.28), 0.19)
    parts["body"] = parts["body"].coat("doors", between("x", -0.26, 0.16))
    return together(parts, wheels(pairs((-0.3, 0.3), 0.215, 0.105), 0.105, 0.09),
        lights(0.485, -0.495, 0.15, 0.19),
        dict(siren=block(0.07, 0.13, 0.06, 0.02).at(-0.06, 0.075, 0.5),
        red=block(0.07, 0.13, 0.06, 0.02).at(-0.06, -0.075, 0.5)))


@kind("race car", "vehicles", also=("racing car", "formula one car"),
    colours=dict(body="red|blue|green|orange", wings="=body", helmet="white|yellow",
        wheels="!black", hubs="silver", stripes="white"),
    sizes=dict(wings="small 0.8|1|large 1.25"))
def race_car(o, rng):
    body = hull([(-0.5, 0.08, 0.06, 0.2), (-0.25, 0.16, 0.05, 0.26), (0.0, 0.15, 0.05, 0.22),
        (0.25, 0.09, 0.05, 0.17), (0.56, 0.03, 0.06, 0.1)], square=3)
    w = o.wings
    return together(dict(body=[body.coat("stripes", lambda u, v, p: np.abs(p[:, 1]) < 0.025),
        hull([(-0.3, 0.04, 0.2, 0.24), (-0.14, 0.06, 0.2, 0.36), (-0.07, 0.05, 0.2, 0.3)])],
        helmet=ball(0.07).at(0.02, 0, 0.25),
        wings=[block(0.13, 0.52 * w, 0.03).at(0.52, 0, 0.07),
        block(0.14, 0.46 * w, 0.04).turn("y", -10).at(-0.5, 0, 0.36),
        block(0.16, 0.02, 0.2).at(-0.5, 0.22 * w, 0.3).both()]),
        wheels(pairs((-0.36,), 0.25, 0.13), 0.13, 0.14),
        wheels(pairs((0.34,), 0.24, 0.11), 0.11, 0.11))


@kind("truck", "vehicles", also=("lorry", "cargo truck"),
    colours=dict(cab="red|blue|green|orange", box="white|light grey|silver", wheels="!black",
        hubs="silver", windows="!glass", bumper="dark grey", headlights="!cream"),
    sizes=dict(box="short 0.7|1|long 1.3"))
def truck(o, rng):
    b = 0.72 * o.box
    cab = block(0.3, 0.36, 0.38, 0.05).at(0.36, 0, 0.32).coat("windows", lambda u, v,
        p: (p[:, 2] > 0.03) & (p[:,
        2] < 0.14) & ((p[:, 0] > 0.135) & (np.abs(p[:, 1]) < 0.14) | (np.abs(p[:, 1]) > 0.15)
        & (np.abs(p[:, 0]) < 0.09)))
    xs = (0.36, 0.16 - 0.82 * b, 0.16 - 0.5 * b)
    return together(dict(cab=cab, box=block(b, 0.4, 0.5, 0.015).at(0.18 - 0.5 * b, 0, 0.42),
        bumper=[block(b + 0.3, 0.26, 0.08).at(0.3 - 0.5 * b, 0, 0.14),
        block(0.06, 0.36, 0.08, 0.02).at(0.51, 0, 0.15)]), wheels(pairs(xs, 0.17, 0.1), 0.1, 0.1),
        dict(headlights=ball(0.02, 0.035, 0.035).at(0.51, 0.13, 0.22).both()))


@kind("fire truck", "vehicles", also=("fire engine",),
    colours=dict(body="red", ladder="white|silver", stripe="white|yellow", wheels="!black",
        hubs="silver", windows="!glass", siren="!blue"),
    sizes=dict(ladder="short 0.7|1|long 1.2"))
def fire_truck(o, rng):
    cab = block(0.28, 0.36, 0.36, 0.04).at(0.38, 0, 0.3).coat("windows", lambda u, v,
        p: (p[:, 2] > 0.02) & (p[:,
        2] < 0.13) & ((p[:, 0] > 0.125) & (np.abs(p[:, 1]) < 0.14) | (np.abs(p[:, 1]) > 0.15)
        & (np.abs(p[:, 0]) < 0.09)))
    back = block(0.74, 0.36, 0.3, 0.02).at(-0.14, 0, 0.27).coat("stripe",
        between("z", -0.05, 0.0)).coat("light grey",
        also(between("z", 0.03, 0.12), panes("x", "z", 7, 3, 0.8), lambda u, v,
        p: np.abs(p[:, 1]) > 0.17))
    long = 0.85 * o.ladder
    rails = rod((0, 0.07, 0), (long, 0.07, 0), 0.018).both()
    rungs = rod((0, -0.07, 0), (0, 0.07, 0),
        0.012).copies([(x, 0, 0) for x in np.linspace(0.04, long - 0.04, 10)])
    ladder = [s.turn("y", -9).at(-0.46, 0, 0.46) for s in (rails, rungs)]
    return together(dict(body=[cab, back], ladder=ladder,
        siren=ball(0.05, 0.09, 0.04).at(0.4, 0, 0.49),
        silver=block(0.05, 0.36, 0.07, 0.02).at(0.52, 0, 0.14)),
        wheels(pairs((-0.34, 0.36), 0.16, 0.1), 0.1, 0.1))


@kind("bus", "vehicles", also=("school bus", "city bus"),
    colours=dict(body="yellow|red|blue", stripe="black|white", wheels="!black", hubs="silver",
        windows="!glass", headlights="!cream"),
    forms=dict(length="short 0.75|1|long 1.3"),
    counts=dict(decks="1|2"))
def bus(o, rng):
    b, h = 1.0 * o.length, 0.3 + 0.24 * (o.decks - 1)
    glass = lambda u, v, p: (np.abs(((p[:, 2] + 0.5 * h - 0.12) % 0.24) - 0.065) < 0.055) & (p[:,
        2] > -0.5 * h + 0.1) & ((np.abs(p[:, 1]) > 0.155) & ((p[:, 0] * 7.5) % 1 < 0.76)
        & (np.abs(p[:, 0]) < 0.45 * b) | (np.abs(p[:, 0]) > 0.49 * b) & (np.abs(p[:, 1]) < 0.14))
    body = block(b, 0.33, h, 0.035).coat("windows", glass).coat("stripe",
        between("z", -0.5 * h + 0.05, -0.5 * h + 0.075)).at(z=0.1 + 0.5 * h)
    return together(dict(body=body, decks=[]),
        wheels(pairs((-0.3 * b, 0.32 * b), 0.14, 0.085), 0.085, 0.07),
        lights(0.5 * b, -0.5 * b, 0.12, 0.15, 0.03))


@kind("van", "vehicles", also=("ambulance van", "delivery van"),
    colours=dict(body="white|blue|orange|light green", roof="=body", wheels="!black", hubs="silver",
        windows="!glass", headlights="!cream"))
def van(o, rng):
    body = hull([(-0.5, 0.2, 0.08, 0.52), (-0.48, 0.22, 0.07, 0.55), (0.22, 0.22, 0.07, 0.55),
        (0.38, 0.215, 0.07, 0.34), (0.48, 0.2, 0.08, 0.28), (0.5, 0.17, 0.1, 0.2)], square=5,
        sharp=True)
    glass = lambda u, v, p: (p[:, 2] > 0.34) & (p[:,
        2] < 0.48) & ((p[:, 0] > 0.24) & (np.abs(p[:, 1]) < 0.17) | (np.abs(p[:, 1]) > 0.18)
        & (np.abs(((p[:, 0] + 0.5) * 3.3) % 1 - 0.5) < 0.38) & (p[:, 0] < 0.28))
    return together(dict(body=body.coat("roof", above("z", 0.5)).coat("windows", glass)),
        wheels(pairs((-0.3, 0.31), 0.18, 0.095), 0.095, 0.08), lights(0.49, -0.5, 0.14, 0.22))


@kind("tractor", "vehicles", also=("farm tractor",),
    colours=dict(body="green|red|blue", hubs="yellow|red", wheels="!black", roof="=body",
        pipe="dark grey", windows="!glass"),
    sizes=dict(wheels="small 0.85|1|large 1.15"))
def tractor(o, rng):
    r = 0.26 * o.wheels
    cab = block(0.32, 0.32, 0.36, 0.03).at(-0.2, 0, 0.55).coat("windows", lambda u, v,
        p: (np.abs(p[:, 2]) < 0.13) & ((np.abs(p[:, 1]) < 0.12) | (np.abs(p[:, 0]) < 0.12)))
    hood = block(0.5, 0.24, 0.24, 0.05).at(0.22, 0, 0.36).coat("black", lambda u, v,
        p: (p[:, 0] > 0.23) & ((p[:, 2] * 22) % 1 < 0.5))
    return together(dict(body=[hood, cab, block(0.3, 0.54, 0.04, 0.015).at(-0.2, 0, r + 0.26)],
        roof=block(0.38, 0.38, 0.05, 0.02).at(-0.2, 0, 0.75),
        pipe=rod((0.28, 0.06, 0.45), (0.28, 0.06, 0.74), 0.028)),
        wheels(pairs((-0.22,), 0.25, r), r, 0.15), wheels(pairs((0.32,), 0.2, 0.15), 0.15, 0.1))


@kind("train", "vehicles", also=("steam train", "locomotive", "toy train"),
    colours=dict(boiler="black|red|green|blue", cab="red|green|blue", chimney="=boiler",
        wheels="red|black", hubs="golden|silver", trim="golden", windows="!glass"),
    sizes=dict(chimney="short 0.7|1|long 1.4"))
def train(o, rng):
    c = 0.16 * o.chimney
    boiler = cylinder(0.16, 0.62).turn("y", 90).at(-0.12, 0, 0.34).coat("trim", lambda u, v,
        p: (p[:, 2] * 4.4) % 1 < 0.13)
    cab = block(0.28, 0.36, 0.42).at(-0.26, 0, 0.42).coat("windows", lambda u, v,
        p: (np.abs(p[:, 2] - 0.08) < 0.07) & (np.abs(p[:, 0]) < 0.07))
    return together(dict(boiler=[boiler, block(0.95, 0.26, 0.08).at(0.06, 0, 0.16),
        cylinder(0.06, 0.09, 0.04).at(0.12, 0, 0.48)], cab=cab,
        black=[block(0.34, 0.42, 0.04, 0.01).at(-0.26, 0, 0.65),
        side_plate(refined([(0.16, -0.08), (-0.06, 0.08), (-0.06, -0.08)]), 0.26).at(0.54, 0,
        0.13)], chimney=lathe([(0, 0), (0.05, 0), (0.05, c), (0.09, c + 0.1), (0.06, c + 0.1),
        (0, c)], sharp=True).at(0.38, 0, 0.48), headlight=[],
        trim=ball(0.055, 0.05, 0.055).at(0.5, 0, 0.36)),
        wheels(pairs((-0.32, -0.06), 0.16, 0.15), 0.15, 0.05),
        wheels(pairs((0.2, 0.38), 0.15, 0.09), 0.09, 0.05))


@kind("bicycle", "vehicles", also=("bike",),
    colours=dict(frame="red|blue|green|black|turquoise", wheels="!black", saddle="brown|black",
        basket="light brown"),
    extras=dict(basket=0.25))
def bicycle(o, rng):
    r = 0.27
    hubs = [(-0.42, r), (0.42, r)]
    tyre = [ring(r - 0.02, 0.026).turn("x", 90).at(x, 0, z) for x, z in hubs]
    spoke = rod((0, 0, 0), (r - 0.03, 0, 0), 0.006).around(12, "y")
    bars = [((-0.42, r), (-0.06, 0.24)), ((-0.06, 0.24), (-0.16, 0.6)),
        ((-0.16, 0.58), (0.3, 0.56)), ((-0.06, 0.24), (0.31, 0.52)), ((-0.42, r), (-0.15, 0.55)),
        ((0.42, r), (0.28, 0.68))]
    frame = [rod((a[0], 0, a[1]), (b[0], 0, b[1]), 0.022) for a, b in bars]
    return dict(frame=frame, wheels=tyre,
        silver=[spoke.at(x, 0, z) for x,
        z in hubs] + [cylinder(0.07, 0.02).turn("x", 90).at(-0.06, -0.03, 0.24),
        rod((-0.06, -0.09, 0.15), (-0.06, 0.09, 0.33), 0.014),
        tube([(0.2, 0.22, 0.7), (0.29, 0.14, 0.74), (0.28, 0, 0.7), (0.29, -0.14, 0.74),
        (0.2, -0.22, 0.7)], 0.018)], saddle=ball(0.12, 0.06, 0.03).at(-0.17, 0, 0.63),
        basket=lathe([(0, 0), (0.75, 0), (1, 0.16), (0.93, 0.16), (0.7, 0.02), (0, 0.02)],
        sharp=True, outline=oblong(0.22, 0.26, 0.04)).at(0.43, 0, 0.56) if o.basket else [])


@kind("motorcycle", "vehicles", also=("motorbike",),
    colours=dict(body="red|black|blue|orange", seat="black|brown", wheels="!black", hubs="silver",
        exhaust="silver"))
def motorcycle(o, rng):
    r = 0.21
    tyres = ring(r - 0.05, 0.055).turn("x", 90).copies([(-0.38, 0, r), (0.42, 0, r)])
    return dict(body=[hull([(-0.1, 0.06, 0.4, 0.5), (0.08, 0.12, 0.36, 0.58),
        (0.24, 0.07, 0.42, 0.54)]), ball(0.16, 0.05, 0.04).turn("y", -12).at(0.42, 0, 0.46),
        ball(0.17, 0.06, 0.04).at(-0.42, 0, 0.46), ball(0.06, 0.09, 0.1).at(0.3, 0, 0.66)],
        seat=hull([(-0.45, 0.07, 0.48, 0.53), (-0.25, 0.1, 0.44, 0.52), (-0.02, 0.08, 0.44, 0.5)]),
        wheels=tyres, hubs=[cylinder(0.09, 0.05).turn("x",
        90).copies([(-0.38, 0.025, r), (0.42, 0.025, r)]),
        rod((0.42, 0.06, r), (0.26, 0.06, 0.68), 0.022).both(),
        tube([(0.16, 0.28, 0.7), (0.25, 0.16, 0.74), (0.26, 0, 0.71), (0.25, -0.16, 0.74),
        (0.16, -0.28, 0.7)], 0.02)],
        exhaust=[limb((-0.02, 0.1, 0.2), (-0.5, 0.12, 0.26), 0.035, 0.05).both()],
        grey=[block(0.26, 0.16, 0.2, 0.04).at(0.04, 0, 0.26),
        cylinder(0.09, 0.2, bevel=0.01).turn("y", 15).at(0.06, 0, 0.24),
        rod((-0.38, 0.06, r), (0.0, 0.06, 0.28), 0.025).both()],
        cream=ball(0.05, 0.07, 0.07).at(0.37, 0, 0.66))


@kind("scooter", "vehicles", also=("vespa", "moped"),
    colours=dict(body="light blue|red|turquoise|yellow|cream", seat="brown|black", wheels="!black",
        hubs="silver", headlights="!cream"))
def scooter(o, rng):
    return together(dict(body=[hull([(-0.5, 0.05, 0.22, 0.3), (-0.32, 0.15, 0.12, 0.44),
        (-0.1, 0.13, 0.1, 0.4), (0.04, 0.1, 0.1, 0.16), (0.24, 0.12, 0.1, 0.15)]),
        hull([(0.18, 0.16, 0.12, 0.2), (0.24, 0.17, 0.14, 0.55), (0.31, 0.12, 0.25, 0.62),
        (0.34, 0.03, 0.5, 0.6)]), ball(0.16, 0.07, 0.1).at(0.36, 0, 0.2),
        ball(0.08, 0.11, 0.08).at(0.24, 0, 0.72)],
        seat=hull([(-0.42, 0.08, 0.42, 0.47), (-0.25, 0.12, 0.4, 0.5), (0.0, 0.09, 0.4, 0.46)]),
        headlights=ball(0.04, 0.06, 0.06).at(0.31, 0, 0.72),
        black=limb((0.2, 0.1, 0.74), (0.15, 0.27, 0.74), 0.024).both(),
        silver=rod((0.36, 0, 0.14), (0.24, 0, 0.7), 0.03)),
        wheels([(-0.3, 0, 0.11), (0.36, 0, 0.11)], 0.11, 0.07))


@kind("skateboard", "vehicles",
    colours=dict(deck="red|blue|black|wooden|green", wheels="white|yellow|black", hubs="silver"))
def skateboard(o, rng):
    deck = sheet(lambda u, v: np.stack([v - 0.5,
        0.13 * (2 * u - 1) * np.clip(1 - np.abs(2 * v - 1) ** 7, 0.02, 1) ** 0.5,
        0.13 + 0.12 * np.maximum(np.abs(v - 0.5) - 0.32, 0) * 4 * np.abs(v - 0.5)], -1), 0.03)
    return together(dict(deck=deck,
        silver=block(0.06, 0.2, 0.05).copies([(-0.27, 0, 0.09), (0.27, 0, 0.09)])),
        wheels(pairs((-0.27, 0.27), 0.1, 0.05), 0.05, 0.05))


@kind("tank", "vehicles", also=("army tank",),
    colours=dict(body="green|dark green|beige|grey", tracks="!dark grey", barrel="=body",
        turret="=body"),
    sizes=dict(barrel="short 0.65|1|long 1.35"))
def tank(o, rng):
    track = side_plate(oblong(0.95, 0.24, 0.12), 0.14).at(0, 0.23, 0.13).both()
    rollers = cylinder(0.075, 0.16).turn("x",
        90).copies([(x, 0.31, 0.12) for x in (-0.34, -0.11, 0.11, 0.34)]).both()
    return dict(body=[hull([(-0.46, 0.2, 0.14, 0.28), (-0.42, 0.28, 0.12, 0.3),
        (0.3, 0.28, 0.12, 0.3), (0.5, 0.24, 0.14, 0.18)], square=6, sharp=True)], tracks=[track],
        grey=rollers, turret=[block(0.42, 0.36, 0.16, 0.05, 0.8).at(-0.06, 0, 0.38),
        cylinder(0.08, 0.05).at(-0.12, 0, 0.45)],
        barrel=[rod((0.1, 0, 0.38), (0.16 + 0.5 * o.barrel, 0, 0.41), 0.035),
        rod((0.1 + 0.5 * o.barrel, 0, 0.405), (0.2 + 0.5 * o.barrel, 0, 0.412), 0.05)])
