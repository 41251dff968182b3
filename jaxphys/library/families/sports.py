"""Sports and games."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.palette import ripples
from jaxphys.library.patterns import (
    above,
    also,
    below,
    between,
    dots,
    either,
    mottled,
    near,
    sectors,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cylinder,
    handle,
    lathe,
    limb,
    plate,
    polygon,
    refined,
    ring,
    rod,
    rounded,
    side_plate,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731


def patches() -> np.ndarray:
    """Directions (12, 3) of the dark patches of a football: the corners of an icosahedron."""
    phi = (1 + 5**0.5) / 2
    corners = np.array([(0, s, t * phi) for s in (-1, 1) for t in (-1, 1)])
    return np.concatenate([np.roll(corners, k, 1) for k in range(3)]) / np.sqrt(1 + phi**2)


@kind("soccer ball", "sports", also=("football", "soccerball"),
    colours=dict(ball="white", patches="black|blue|red"))
def soccer_ball(o, rng):
    corners = patches()
    dark = lambda u, v, p: (p @ corners.T).max(1) / 0.5 > np.cos(0.4)

    def seam(u, v, p):
        near_two = np.sort(p @ corners.T, 1)[:, -3:] / 0.5
        return 1 - 0.45 * ((near_two[:, 2] - near_two[:, 1] < 0.035) & (near_two[:,
            2] < np.cos(0.36)))

    return dict(ball=ball(0.5, fine=12).shade(seam).coat("patches", dark))


@kind("basketball", "sports", colours=dict(ball="orange|brown", lines="black"))
def basketball(o, rng):
    lines = lambda u, v, p: (np.abs(p[:, 0]) < 0.012) | (np.abs(p[:,
        2]) < 0.012) | (np.abs(np.hypot(p[:, 0] * 1.0, p[:, 2]) - 0.38 + 0.0 * p[:, 1]) < 0.012)
    return dict(ball=ball(0.5, fine=12).coat("lines", lines).shade(mottled(ripples(rng, 16), 0.04)))


@kind("tennis ball", "sports", colours=dict(ball="yellow|light green", line="white"))
def tennis_ball(o, rng):
    def seam(u, v, p):
        x, y, z = p.T / 0.5
        return np.abs(z - 0.62 * (x**2 - y**2) * 1.25) < 0.06
    return dict(ball=ball(0.5, fine=12).coat("line", seam).shade(mottled(ripples(rng, 20), 0.05)))


@kind("beach ball", "sports", also=("striped ball", "inflatable ball"),
    colours=dict(ball="red|blue|yellow|orange", stripes="white|yellow", cap="white"),
    counts=dict(stripes="3|4|5"))
def beach_ball(o, rng):
    return each(dict(ball=ball(0.5, fine=12).coat("stripes", sectors(o.stripes)).coat("cap",
        lambda u, v, p: np.abs(p[:, 2]) > 0.47)), lambda s: s.turn("x", 25).turn("y", 20))


@kind("ball", "toys", also=("rubber ball", "toy ball", "sphere"),
    colours=dict(ball="red|blue|yellow|green|orange|purple|pink", pattern="white|yellow"),
    forms=dict(style="plain|striped|dotted"))
def plain_ball(o, rng):
    body = ball(0.5, fine=12)
    if o.style == "striped":
        body = body.coat("pattern", between("z", -0.11, 0.11))
    elif o.style == "dotted":
        body = body.coat("pattern", dots(40, 0.16))
    return dict(ball=body.turn((1.0, 0.4, 0), 25))


@kind("baseball bat", "sports", also=("wooden bat",),
    colours=dict(bat="wooden|beige|black|red", grip="black|red|blue"),
    sizes=dict(grip="short 0.7|1|long 1.4"))
def baseball_bat(o, rng):
    g = 0.26 * o.grip
    return each(dict(bat=lathe([(0, -0.5), (0.055, -0.5), (0.055, -0.47), (0.03, -0.44),
        (0.035, -0.1), (0.075, 0.25), (0.08, 0.42), (0.05, 0.5), (0, 0.5)]).coat("grip",
        also(below("z", -0.46 + g), above("z", -0.46)))), lambda s: s.turn("x", -35))


@kind("tennis racket", "sports", also=("racket", "tennis racquet"),
    colours=dict(frame="red|blue|black|yellow|green", grip="black|white|brown", strings="!white"),
    extras=dict(ball=0.4),
    sizes=dict(handle="short 0.7|1|long 1.3"))
def tennis_racket(o, rng):
    h = 0.4 * o.handle
    t = np.linspace(-0.2, 0.2, 9)
    lines = [rod((0, y, -0.27 * np.sqrt(1 - (y / 0.23) ** 2)),
        (0, y, 0.27 * np.sqrt(1 - (y / 0.23) ** 2)), 0.005) for y in t]
    lines += [rod((0, -0.22 * np.sqrt(1 - (z / 0.28) ** 2), z),
        (0, 0.22 * np.sqrt(1 - (z / 0.28) ** 2), z), 0.005) for z in np.linspace(-0.24, 0.24, 11)]
    parts = dict(frame=[ring(0.24, 0.024).turn("y", 90).scale(1, 1, 1.2).at(z=0.3),
        rod((0, 0.09, 0.05), (0, 0.0, -0.12), 0.022).both(),
        rod((0, 0, -0.1), (0, 0, -0.2), 0.026)], strings=[s.at(z=0.3) for s in lines],
        grip=lathe([(0, -0.18 - h), (0.045, -0.18 - h), (0.036, -0.15 - h), (0.036, -0.18),
        (0, -0.18)], sharp=True).shade(lambda u, v,
        p: 0.85 + 0.2 * ((p[:, 2] * 26 + u) % 1 > 0.25)))
    if o.ball:
        parts["yellow"] = ball(0.09).at(0.06, 0.26, -0.3)
    return each(parts, lambda s: s.turn("x", -18))


@kind("bowling pin", "sports", also=("skittle",),
    colours=dict(pin="white", stripes="red|blue"),
    counts=dict(stripes="1|2"))
def bowling_pin(o, rng):
    where = either(*[between("z", 0.2 + 0.08 * k, 0.24 + 0.08 * k) for k in range(o.stripes)])
    return dict(pin=lathe([(0, -0.5), (0.11, -0.5), (0.18, -0.22), (0.14, 0.05), (0.075, 0.26),
        (0.1, 0.4), (0.07, 0.48), (0, 0.5)]).coat("stripes", where), stripes=[])


@kind("bowling ball", "sports",
    colours=dict(ball="black|blue|red|purple|green", holes="!dark grey"))
def bowling_ball(o, rng):
    places = np.array([(0.36, 0.06, 0.34), (0.36, -0.06, 0.34), (0.44, 0.0, 0.23)])
    swirl = ripples(rng, 1.5)
    return dict(ball=ball(0.5, fine=12).shade(mottled(swirl, 0.14)).coat("holes",
        near(places * (0.5 / np.linalg.norm(places, axis=1, keepdims=True)), 0.045)))


@kind("dumbbell", "sports", also=("weight", "hand weight"),
    colours=dict(weights="black|dark grey|red|blue|pink", bar="silver|black"),
    sizes=dict(weights="small 0.7|1|large 1.3"))
def dumbbell(o, rng):
    k = o.weights
    disc = lathe([(0, 0), (0.2 * k, 0), (0.23 * k, 0.04), (0.23 * k, 0.13), (0.2 * k, 0.17),
        (0, 0.17)], sharp=True, outline=polygon(6, 1.0) if rng.random() < 0.5 else None)
    return each(dict(weights=disc.turn("x", -90).at(0, 0.24, 0).both(),
        bar=rod((0, -0.3, 0), (0, 0.3, 0), 0.05).shade(lambda u, v,
        p: 1 - 0.12 * ((p[:, 2] * 40) % 1 < 0.5))), lambda s: s.turn("z", 25))


@kind("trophy", "sports", also=("golden cup", "winner's cup"),
    colours=dict(cup="golden|silver|copper", base="black|wooden|brown", plaque="!golden",
        star="red|white|blue"),
    sizes=dict(handles="small 0.75|1|large 1.35"),
    extras=dict(star=0.35))
def trophy(o, rng):
    cup = lathe([(0, 0.18), (0.13, 0.18), (0.1, 0.22), (0.045, 0.3), (0.06, 0.4), (0.2, 0.52),
        (0.29, 0.72), (0.31, 0.92), (0.27, 0.92), (0.24, 0.7), (0, 0.5)])
    k = o.handles
    return dict(cup=[cup, handle((0, 0.29, 0.86), (0, 0.18, 0.5), 0.24 * k, 0.026).both()],
        base=[block(0.36, 0.36, 0.16, 0.02).at(z=0.08), block(0.27, 0.27, 0.06, 0.01).at(z=0.17)],
        plaque=block(0.02, 0.2, 0.08).at(0.18, 0, 0.08),
        star=plate(polygon(5, 0.11, 0.045, np.pi / 2), 0.06).turn("y", 12).at(0.285, 0,
        0.75) if o.star else [])


@kind("medal", "sports", also=("gold medal",),
    colours=dict(medal="golden|silver|copper", ribbon="red|blue|green", star="=medal",
        stripe="white|yellow"))
def medal(o, rng):
    strip = plate(refined([(0.09, -0.24), (0.09, 0.24), (-0.09, 0.24), (-0.09, -0.24)], 4),
        0.03).coat("stripe", lambda u, v, p: np.abs(p[:, 0]) < 0.03)
    return dict(medal=[cylinder(0.26, 0.07, bevel=0.02).turn("y", 90).at(-0.035),
        ring(0.235, 0.03).turn("y", 90).at(0.03), ring(0.05, 0.018).turn("y", 90).at(0, 0, 0.29)],
        star=plate(polygon(5, 0.15, 0.065, np.pi / 2), 0.05).at(0.035),
        ribbon=[strip.turn("x", s * 22).at(0.01 * s, s * -0.1, 0.52) for s in (-1, 1)])


@kind("boxing glove", "sports",
    colours=dict(glove="red|blue|black", cuff="white|black", laces="white"))
def boxing_glove(o, rng):
    return dict(glove=[ball(0.28, 0.24, 0.3).at(0.02, 0, 0.28),
        ball(0.24, 0.22, 0.22).at(0.06, 0, 0.12),
        limb((0.02, 0.18, 0.02), (0.14, 0.24, 0.28), 0.12, 0.1)],
        cuff=lathe([(0, -0.34), (0.2, -0.34), (0.22, -0.3), (0.19, -0.06), (0, -0.06)]),
        laces=[rod((0.19, -0.07, z), (0.19, 0.07, z + 0.03), 0.014) for z in (-0.28, -0.2, -0.12)])


@kind("dartboard", "sports", also=("dart board", "target"),
    colours=dict(board="black", light="cream|white", rings="red|green", dart="blue|red|yellow"),
    extras=dict(dart=0.6))
def dartboard(o, rng):
    far = lambda p: np.hypot(p[:, 0], p[:, 1])
    sector = lambda p: np.floor((np.arctan2(p[:, 1], p[:, 0]) / (2 * np.pi) * 20) % 20) % 2
    board = cylinder(0.48, 0.08).coat("light", lambda u, v,
        p: (sector(p) > 0) & (far(p) < 0.39)).coat("rings", lambda u, v,
        p: ((np.abs(far(p) - 0.375) < 0.018) | (np.abs(far(p) - 0.23) < 0.018))
        & (sector(p) > 0)).coat("green", lambda u, v,
        p: ((np.abs(far(p) - 0.375) < 0.018) | (np.abs(far(p) - 0.23) < 0.018) | (far(p) < 0.05))
        & ~((sector(p) > 0) & (far(p) > 0.06))).coat("rings", lambda u, v, p: far(p) < 0.025)
    parts = dict(board=board.turn("y", 90), dart=[], silver=[])
    if o.dart:
        parts |= dict(silver=rod((0.06, 0.05, 0.08), (0.26, 0.06, 0.11), 0.018),
            dart=[block(0.12, 0.012, 0.11).at(0.33, 0.064, 0.12),
            block(0.12, 0.11, 0.012).at(0.33, 0.064, 0.12)])
    return parts


@kind("surfboard", "sports",
    colours=dict(board="white|yellow|blue|red|turquoise", stripe="red|blue|orange|green",
        fin="=board", tip="=board"),
    forms=dict(width="thin 0.75|1|wide 1.25"))
def surfboard(o, rng):
    w = 0.15 * o.width
    outline = rounded([(0, 0.52), (0.6 * w, 0.38), (w, 0.08), (0.95 * w, -0.2), (0.55 * w, -0.46),
        (0, -0.5), (-0.55 * w, -0.46), (-0.95 * w, -0.2), (-w, 0.08), (-0.6 * w, 0.38)])
    body = plate(outline, 0.07, puff=0.5).coat("stripe", lambda u, v,
        p: (np.abs(p[:, 0]) < 0.022)
        | (np.abs(p[:, 1] - 0.2 - 1.2 * np.abs(p[:, 0])) < 0.03)).coat("tip", above("y", 0.4))
    return dict(board=body, fin=side_plate(refined([(0.03, 0.07), (-0.1, -0.03), (0.03, -0.07)]),
        0.02).at(-0.05, 0, -0.36))


@kind("helmet", "sports", also=("motorcycle helmet", "crash helmet"),
    colours=dict(helmet="red|white|blue|black|yellow", visor="!dark grey",
        stripe="white|black|yellow"),
    forms=dict(style="*striped|plain"))
def helmet(o, rng):
    shell = ball(0.44, 0.4, 0.44).at()
    if o.style == "striped":
        shell = shell.coat("stripe", lambda u, v, p: (np.abs(p[:, 1]) < 0.07) & (p[:, 2] > -0.1))
    opening = lambda u, v, p: (p[:, 0] > 0.18) & (np.abs(p[:, 2] + 0.02) < 0.15)
    return dict(helmet=[shell.coat("black", below("z", -0.36)),
        lathe([(0, -0.4), (0.33, -0.4), (0.36, -0.25), (0, -0.25)]).scale(1.1, 1, 1).at(0.06)],
        visor=ball(0.455, 0.4, 0.43).coat("helmet", lambda u, v, p: ~opening(u, v, p)).at(0.005),
        silver=cylinder(0.05, 0.03).turn("x", -90).at(0.1, 0.385, 0.08).both())


@kind("chess pawn", "sports", also=("pawn", "chess piece"),
    colours=dict(pawn="white|black|wooden|cream"))
def pawn(o, rng):
    return dict(pawn=[lathe([(0, -0.5), (0.27, -0.5), (0.27, -0.42), (0.2, -0.36), (0.12, -0.2),
        (0.08, 0.06), (0.09, 0.12), (0, 0.12)]), ball(0.16).at(z=0.25),
        lathe([(0, 0.06), (0.15, 0.09), (0, 0.13)])])


@kind("dice", "sports", also=("die", "game die", "cube with dots"),
    colours=dict(die="white|red|blue|black|green", dots="black|white|golden"))
def dice(o, rng):
    g = 0.24
    faces = {"z": [(0, 0)], "-z": [(a, b) for a in (-1, 1) for b in (-1, 0, 1)],
        "x": [(-1, -1), (0, 0), (1, 1)], "-x": [(-1, -1), (-1, 1), (1, -1), (1, 1)],
        "y": [(-1, 1), (1, -1)], "-y": [(-1, -1), (1, 1), (0, 0), (-1, 1), (1, -1)]}
    spots = []
    for face, places in faces.items():
        s, axis = (-1 if face[0] == "-" else 1), "xyz".index(face[-1])
        for a, b in places:
            p = np.zeros(3)
            p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = 0.5 * s, g * a, g * b
            spots.append(p)
    return each(dict(die=block(1.0, 1.0, 1.0, 0.1).coat("dots", near(spots, 0.095))),
        lambda s: s.turn("z", 20))


@kind("cube", "sports", also=("box", "plain cube", "block"),
    colours=dict(cube="red|blue|green|yellow|wooden|white|purple", pattern="white|yellow"),
    forms=dict(style="plain|striped|dotted"))
def cube(o, rng):
    body = block(1.0, 1.0, 1.0, 0.04)
    if o.style == "striped":
        body = body.coat("pattern", stripes(5, "z", 0.45))
    elif o.style == "dotted":
        body = body.coat("pattern", lambda u, v,
            p: ((np.abs(((p + 0.5) * 4) % 1 - 0.5)) ** 2).sum(1) - 0.25 < 0.09)
    return dict(cube=body)
