"""What flies and what swims; the bow faces +x."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    above,
    also,
    below,
    between,
    sectors,
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
    refined,
    ring,
    rod,
    rounded,
    sheet,
    side_plate,
    slab,
    tube,
)

# fmt: off
# ruff: noqa: E731


@kind("airplane", "vehicles", also=("plane", "aeroplane", "passenger plane"),
    colours=dict(body="white|silver|red|blue", wings="=body", tail="red|blue", engines="grey|white",
        windows="!dark blue"),
    sizes=dict(wings="short 0.75|1|long 1.25"))
def airplane(o, rng):
    w = 0.5 * o.wings
    body = hull([(-0.55, 0.015, 0.04, 0.08), (-0.4, 0.05, -0.03, 0.09), (-0.15, 0.09, -0.09, 0.09),
        (0.35, 0.09, -0.09, 0.09), (0.48, 0.06, -0.07, 0.05), (0.55, 0.01, -0.03, 0.0)])
    body = body.coat("windows",
        also(between("z", 0.015, 0.042), lambda u, v,
        p: ((p[:, 0] * 22) % 1 < 0.5) & (p[:, 0] > -0.35) & (p[:, 0] < 0.38))).coat("windows",
        also(above("x", 0.44), between("z", 0.01, 0.04)))
    wing = refined([(0.14, 0.0), (-0.08, w), (-0.16, w), (-0.13, 0.0)])
    wing = slab(wing - (0, 0.4 * w), 0.03).at(0.04, 0.4 * w + 0.04, -0.04).turn("x", 4).both()
    small = slab(refined([(0.07, -0.06), (-0.04, 0.2), (-0.09, 0.2), (-0.07, -0.06)]),
        0.02).at(-0.44, 0.06, 0.05).both()
    fin = side_plate(refined([(0.1, -0.06), (-0.06, 0.2), (-0.13, 0.2), (-0.09, -0.06)]),
        0.025).at(-0.42, 0, 0.11)
    engine = limb((-0.06, 0, 0), (0.09, 0, 0), 0.04).at(0.1, 0.2 * (0.5 + 0.5 * o.wings),
        -0.09).both()
    return dict(body=body, wings=[wing, small], tail=fin, engines=engine)


@kind("biplane", "vehicles", also=("propeller plane", "old airplane"),
    colours=dict(body="red|yellow|blue|green", wings="=body", propeller="wooden|brown",
        wheels="!black", stripes="white"))
def biplane(o, rng):
    body = hull([(-0.5, 0.02, -0.02, 0.05), (-0.2, 0.07, -0.07, 0.08), (0.15, 0.1, -0.11, 0.1),
        (0.36, 0.1, -0.1, 0.1), (0.4, 0.05, -0.06, 0.06)])
    wing = block(0.22, 1.0, 0.03, 0.01).coat("stripes", lambda u, v,
        p: np.abs(np.abs(p[:, 1]) - 0.36) < 0.04)
    return dict(body=[body, side_plate(refined([(0.1, -0.04), (0, 0.16), (-0.08, 0.16),
        (-0.08, -0.04)]), 0.025).at(-0.44, 0, 0.08)],
        wings=[wing.at(0.16, 0, 0.26), wing.at(0.12, 0, -0.07),
        block(0.14, 0.38, 0.02).at(-0.44, 0, 0.03)],
        brown=[rod((0.14, y, -0.07), (0.16, y, 0.26), 0.014).both() for y in (0.36,
        0.1)] + [ball(0.06, 0.05, 0.05).at(-0.02, 0, 0.13)],
        propeller=[ball(0.015, 0.03, 0.27).at(0.43, 0, 0), ball(0.05, 0.04, 0.04).at(0.42, 0, 0)],
        wheels=[cylinder(0.08, 0.04).turn("x", 90).at(0.2, 0.16, -0.24).both(),
        rod((0.2, 0.13, -0.24), (0.18, 0.06, -0.05), 0.015).both()])


@kind("helicopter", "vehicles", also=("chopper",),
    colours=dict(body="red|blue|yellow|green|white", tail="=body", blades="dark grey|black",
        windows="!glass", skids="grey|black"),
    sizes=dict(blades="short 0.7|1|long 1.2"))
def helicopter(o, rng):
    body = hull([(-0.2, 0.08, 0.02, 0.22), (0.0, 0.19, -0.14, 0.26), (0.2, 0.2, -0.16, 0.24),
        (0.36, 0.13, -0.13, 0.12), (0.42, 0.03, -0.06, 0.02)])
    glass = lambda u, v, p: (p[:, 0] > 0.16) & (p[:, 2] > -0.02) & (np.abs(p[:, 1]) > 0.012)
    long = 0.56 * o.blades
    return dict(body=body.coat("windows", glass),
        tail=[rod((-0.1, 0, 0.14), (-0.62, 0, 0.16), 0.075, 0.03),
        side_plate(refined([(0.06, -0.08), (-0.05, 0.18), (-0.12, 0.18), (-0.06, -0.08)]),
        0.03).at(-0.6, 0, 0.2)], blades=[block(2 * long, 0.07, 0.015).turn("z", a).at(0.1, 0,
        0.38) for a in (25, 115)] + [rod((0.1, 0, 0.2), (0.1, 0, 0.4), 0.025),
        block(0.03, 0.015, 0.26).turn("y", 30).at(-0.63, 0.04, 0.2)],
        skids=[limb((-0.2, 0.18, -0.29), (0.36, 0.18, -0.29), 0.02).both(),
        rod((0.0, 0.18, -0.29), (0.02, 0.1, -0.1), 0.015).both(),
        rod((0.2, 0.18, -0.29), (0.18, 0.1, -0.1), 0.015).both()])


@kind("rocket", "vehicles", also=("space rocket", "rocket ship", "spaceship"),
    colours=dict(body="white|silver|red", tip="red|blue", fins="=tip", window="light blue|blue",
        flame="orange|yellow"),
    forms=dict(height="short 0.75|1|tall 1.3"),
    extras=dict(flame=0.4),
    counts=dict(fins="3|4"))
def rocket(o, rng):
    h = 1.0 * o.height
    body = lathe([(0, 0), (0.13, 0.0), (0.19, 0.25 * h), (0.19, 0.5 * h), (0.12, 0.8 * h),
        (0, h)]).coat("tip", above("z", 0.76 * h)).coat("tip", between("z", 0.1 * h, 0.14 * h))
    fin = side_plate(refined([(-0.1, 0.18), (0.12, -0.06), (0.13, -0.2), (0.04, -0.18),
        (-0.08, -0.08)]), 0.04).at(0.24, 0, 0.14)
    a = 360 / o.fins
    return dict(body=body, fins=[fin.turn("z", 40 + a * k) for k in range(o.fins)],
        window=cylinder(0.07, 0.03, bevel=0.01).turn("y", 90).at(0.165, 0, 0.55 * h),
        grey=[ring(0.075, 0.018).turn("y", 90).at(0.18, 0, 0.55 * h),
        cylinder(0.11, 0.1, 0.07).at(z=-0.07)],
        flame=lathe([(0, -0.35), (0.06, -0.2), (0.1, -0.06), (0, -0.04)]) if o.flame else [])


@kind("hot air balloon", "vehicles", also=("balloon with a basket",),
    colours=dict(balloon="red|yellow|blue|orange", stripes="yellow|white|blue",
        basket="light brown|brown", ropes="!brown"),
    forms=dict(style="*striped|plain"))
def hot_air_balloon(o, rng):
    shape = lathe([(0, -0.32), (0.07, -0.32), (0.25, -0.08), (0.4, 0.2), (0.34, 0.48), (0.15, 0.62),
        (0, 0.64)])
    n = int(rng.integers(6, 9))
    corners = [(0.07 * np.cos(a), 0.07 * np.sin(a)) for a in np.pi / 4 + np.pi / 2 * np.arange(4)]
    return dict(balloon=shape.coat("stripes", sectors(n)) if o.style == "striped" else shape,
        basket=lathe([(0, -0.66), (0.75, -0.66), (1, -0.5), (0.9, -0.5), (0, -0.6)], sharp=True,
        outline=oblong(0.2, 0.2, 0.03)).shade(lambda u, v,
        p: 0.9 + 0.12 * (np.sin(90 * p[:, 2]) * np.sin(60 * (p[:, 0] + p[:, 1])) > 0)),
        ropes=[rod((x * 1.3, y * 1.3, -0.52), (x, y, -0.28), 0.008) for x, y in corners])


@kind("sailboat", "vehicles", also=("sailing boat", "yacht"),
    colours=dict(hull="white|red|blue|wooden", sails="white|red|cream", mast="wooden|brown",
        stripe="red|blue"),
    sizes=dict(sails="small 0.75|1|large 1.2"))
def sailboat(o, rng):
    s = o.sails
    boat = hull([(-0.45, 0.12, 0.03, 0.16), (-0.2, 0.17, -0.02, 0.16), (0.2, 0.13, 0.0, 0.17),
        (0.5, 0.01, 0.12, 0.2)], square=2.6).coat("stripe", above("z", 0.12))
    main = side_plate(refined([(0.2, -0.4), (0.2, 0.5), (-0.36, -0.4)]) * s, 0.025,
        puff=0.5).at(-0.16, 0, 0.68 * s + 0.04)
    jib = side_plate(refined([(0.26, -0.34), (-0.16, 0.4), (-0.14, -0.34)]) * s, 0.025,
        puff=0.5).at(0.26, 0.0, 0.6 * s + 0.03)
    return dict(hull=boat, sails=[main, jib],
        mast=[rod((0.06, 0, 0.1), (0.06, 0, 1.22 * s), 0.018),
        rod((0.06, 0, 0.25), (-0.5 * s, 0, 0.25), 0.014)])


@kind("ship", "vehicles", also=("steamship", "ocean liner", "cruise ship"),
    colours=dict(hull="black|red|dark blue|white", deck="white", funnels="red|orange|yellow",
        windows="!dark blue"),
    counts=dict(funnels="1|2|3|4"))
def ship(o, rng):
    h = hull([(-0.6, 0.1, 0.02, 0.17), (-0.5, 0.15, -0.04, 0.16), (0.3, 0.15, -0.05, 0.16),
        (0.62, 0.01, 0.1, 0.22)], square=3).coat("dark red", below("z", 0.0)).coat("white",
        between("z", 0.13, 0.145))
    decks = [block(0.85 - 0.2 * k, 0.22 - 0.03 * k, 0.09, 0.01).at(-0.04 + 0.02 * k, 0,
        0.2 + 0.09 * k).coat("windows", lambda u, v,
        p: (np.abs(p[:, 2]) < 0.016) & ((p[:, 0] * 20) % 1 < 0.5)) for k in range(3)]
    xs = np.linspace(-0.2, 0.2, o.funnels) if o.funnels > 1 else [0.0]
    return dict(hull=h, deck=decks,
        funnels=cylinder(0.05, 0.22).turn("y", -8).copies([(x, 0, 0.4) for x in xs]),
        black=cylinder(0.052, 0.05).turn("y", -8).copies([(x - 0.03, 0, 0.6) for x in xs]),
        brown=rod((0.42, 0, 0.15), (0.42, 0, 0.55), 0.012))


@kind("pirate ship", "vehicles", also=("sailing ship", "galleon"),
    colours=dict(hull="wooden|brown|dark brown", sails="white|cream|black|red", mast="brown",
        trim="golden|red", flag="black|red"),
    counts=dict(masts="2|3"))
def pirate_ship(o, rng):
    h = hull([(-0.55, 0.13, 0.1, 0.42), (-0.35, 0.18, 0.0, 0.34), (0.0, 0.19, -0.03, 0.2),
        (0.3, 0.15, 0.0, 0.24), (0.56, 0.01, 0.2, 0.34)], square=2.5).coat("trim",
        stripes(9, "z", 0.2))
    xs = np.linspace(-0.28, 0.26, o.masts)
    sails = []
    for x in xs:
        for z, w in ((0.46, 0.24), (0.8, 0.18)):
            sails.append(sheet(lambda u, v, x=x, z=z,
                w=w: np.stack([x + 0.03 + 0.12 * np.sin(np.pi * v) * np.sin(np.pi * np.clip(u, 0,
                1)), w * (2 * u - 1), z + 0.28 * v], -1), 0.02))
    return dict(hull=h, sails=sails,
        mast=[rod((x, 0, 0.1), (x, 0, 1.16), 0.022) for x in xs] + [rod((0.5, 0, 0.3),
        (0.82, 0, 0.42), 0.02, 0.01)], flag=block(0.02, 0.16, 0.1).at(xs[0], -0.09, 1.14), masts=[])


@kind("rowing boat", "vehicles", also=("rowboat", "canoe", "wooden boat"),
    colours=dict(hull="wooden|red|blue|green", inside="light brown|beige", oars="beige|wooden"),
    extras=dict(oars=0.8))
def rowing_boat(o, rng):
    outer = sheet(lambda u, v: np.stack([v - 0.5 + 0 * u,
        (0.02 + 0.22 * np.sin(np.pi * np.clip(0.22 + 0.78 * v, 0, 1)) ** 0.8) * np.cos(np.pi * u),
        0.24 + 0.08 * (v - 0.4) ** 2 * 2 - (0.24 - 0.1 * np.abs(v - 0.4))
        * np.sin(np.pi * u) ** 0.7], -1), 0.045, (16, 14))
    seats = block(0.1, 0.36, 0.03).copies([(-0.22, 0, 0.17), (0.08, 0, 0.17)])
    oars = [rod((0.0, 0.1, 0.28), (-0.06, 0.62, 0.06), 0.016),
        ball(0.05, 0.13, 0.012).turn("x", -22).at(-0.07, 0.68, 0.03)]
    return dict(hull=outer, inside=[seats,
        lathe([(0, 0), (1, 0), (1, 0.02), (0, 0.02)], sharp=True,
        outline=rounded([(0.4, 0), (0.1, 0.15), (-0.35, 0.12), (-0.45, 0), (-0.35, -0.12),
        (0.1, -0.15)])).at(z=0.06)], oars=[s.both() for s in oars] if o.oars else [])


@kind("submarine", "vehicles",
    colours=dict(body="yellow|grey|dark grey|blue", tower="=body", portholes="light blue",
        propeller="golden|copper"),
    counts=dict(portholes="2|3|4"))
def submarine(o, rng):
    body = hull([(-0.52, 0.03, -0.03, 0.03), (-0.35, 0.14, -0.14, 0.14), (0.0, 0.2, -0.2, 0.2),
        (0.32, 0.17, -0.17, 0.17), (0.5, 0.06, -0.06, 0.06)])
    xs = np.linspace(-0.2, 0.24, o.portholes)
    rims = ring(0.052, 0.016).turn("x",
        90).copies([(x, 0.19 - 0.25 * x * x, 0.02) for x in xs]).both()
    panes_ = cylinder(0.045, 0.02).turn("x",
        -90).copies([(x, 0.18 - 0.25 * x * x, 0.02) for x in xs]).both()
    return dict(body=body, tower=[hull([(-0.12, 0.05, 0.1, 0.34), (0.0, 0.085, 0.1, 0.35),
        (0.12, 0.04, 0.1, 0.34)], square=2.5, sharp=True),
        tube([(0.02, 0, 0.3), (0.02, 0, 0.46), (0.1, 0, 0.48)], 0.02),
        block(0.14, 0.42, 0.02).at(-0.42, 0, 0), block(0.14, 0.02, 0.4).at(-0.42, 0, 0)],
        portholes=panes_, grey=rims,
        propeller=ball(0.02, 0.045, 0.13).turn("x", 20).at(-0.54).around(2, "x"))


@kind("flying saucer", "vehicles", also=("ufo", "alien spaceship"),
    colours=dict(body="silver|grey|purple", dome="light blue|light green",
        lights="yellow|red|green"))
def flying_saucer(o, rng):
    k = 2 * np.pi * np.arange(10) / 10
    return dict(body=lathe([(0, -0.1), (0.2, -0.09), (0.5, 0.0), (0.46, 0.03), (0.2, 0.1),
        (0, 0.11)]), dome=ball(0.2, 0.2, 0.19).at(z=0.09),
        lights=ball(0.035, fine=4).copies(np.stack([0.42 * np.cos(k), 0.42 * np.sin(k),
        0 * k + 0.045], -1)), grey=limb((0.14, 0, -0.06), (0.24, 0, -0.2), 0.025).around(3))
