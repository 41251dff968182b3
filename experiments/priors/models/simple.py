"""Plain things and toys: from a ball, a cube and a mug to a rubber duck and a snowman."""

from itertools import pairwise

import numpy as np

from .palette import COLOURS, article, jitter, mix, pick
from .surfaces import (
    box,
    ellipsoid,
    extrude,
    join,
    lathe,
    leaf,
    move,
    rounded_box,
    torus,
    tube,
    turn,
)


def ball(rng):
    """A plain, striped or beach ball."""
    name, first = pick(rng)
    kind = str(rng.choice(["plain", "striped", "beach"]))
    second = np.asarray(COLOURS["white"] if name != "white" else COLOURS["red"])

    def paint(u, v, points):
        if kind == "striped":
            return mix(first, second, (np.abs(v - 0.5) < 0.1) * 1.0)
        if kind == "beach":
            return mix(first, second, (np.floor(u * 8) % 2 == 0) * 1.0)
        return np.broadcast_to(first, points.shape)

    whole = turn(ellipsoid((0, 0, 0), 0.5, paint, 97, 60), rng.normal(size=3), rng.uniform(0, 3))
    label = {"plain": f"{name} ball", "striped": f"striped {name} ball"}.get(kind, "beach ball")
    return whole, ["a ball", article(label)]


def cube(rng):
    """A cube or a die with pips."""
    name, colour = pick(rng)
    body = rounded_box((0, 0, 0), 0.5, 0.12, colour, 120, 80)
    if rng.random() < 0.5:
        return box((0, 0, 0), (0.5, 0.5, 0.5), colour), ["a cube", f"{article(name)} cube"]
    pip = COLOURS["black"] if name in ("white", "yellow") else COLOURS["white"]
    parts = [body]
    spots = {
        0: [(0, 0)],
        1: [(-1, -1), (1, 1), (0, 0), (-1, 1), (1, -1)],
        2: [(-1, -1), (1, 1), (0, 0)],
    }
    for axis, places in spots.items():
        for sign in (-1, 1):
            for a, b in places:
                at, size = np.zeros(3), np.full(3, 0.085)
                at[axis], size[axis] = 0.495 * sign, 0.02
                at[(axis + 1) % 3], at[(axis + 2) % 3] = 0.25 * a, 0.25 * b
                parts.append(ellipsoid(at, size, pip, 16, 10))
    return join(*parts), ["a die", f"{article(name)} die with dots", "a game die"]


def star(rng):
    """A puffed five-pointed star facing +x."""
    name, colour = pick(rng, "yellow", "yellow", "golden", "red", "blue", "silver")
    angle = np.pi / 2 + np.pi / 5 * np.arange(10)
    radius = np.where(np.arange(10) % 2 == 0, 0.5, 0.22)
    corners = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)
    ring = np.concatenate([corners, corners[:1]])
    outline = np.concatenate(
        [
            first + (second - first) * np.linspace(0, 1, 12, endpoint=False)[:, None]
            for first, second in pairwise(ring)
        ]
    )
    return extrude(outline, rng.uniform(0.2, 0.3), colour, puff=0.9), [
        "a star",
        f"{article(name)} star",
    ]


def heart(rng):
    """A puffed heart facing +x."""
    name, colour = pick(rng, "red", "red", "pink", "purple", "dark red")
    t = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    y = 16 * np.sin(t) ** 3
    z = 13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t)
    outline = np.stack([y, z], -1) / 34
    return extrude(outline, rng.uniform(0.3, 0.42), colour, puff=0.95, rows=24), [
        "a heart",
        f"{article(name)} heart",
    ]


def mug(rng):
    """A mug with a handle, some filled with coffee."""
    name, glaze = pick(rng)
    radius, height = 0.3, rng.uniform(0.6, 0.75)
    cup = lathe(
        [
            (0, 0),
            (radius, 0),
            (radius, height),
            (0.88 * radius, height),
            (0.88 * radius, 0.05),
            (0, 0.05),
        ],
        glaze,
        sharp=True,
    )
    t = np.linspace(-1.45, 1.45, 9)
    path = np.stack([0 * t, radius + 0.2 * np.cos(t) - 0.03, 0.5 * height + 0.22 * np.sin(t)], -1)
    parts = [cup, tube(path, 0.045, glaze)]
    coffee = rng.random() < 0.5
    if coffee:
        parts.append(
            rounded_box((0, 0, 0.85 * height), (0.27, 0.27, 0.01), (1, 1), (0.3, 0.18, 0.1))
        )
    return join(*parts), ["a mug", f"{article(name)} mug", "a cup of coffee" if coffee else "a cup"]


def bottle(rng):
    """A bottle with a label and a cap."""
    name, glass = pick(rng, "green", "brown", "blue", "red", "white", "dark green")
    label, cap = pick(rng)[1], pick(rng, "red", "white", "blue", "golden", "black")[1]
    wide = rng.uniform(0.14, 0.19)

    def paint(u, v, points):
        z = points[..., 2]
        return mix(mix(glass, label, ((z > 0.15) & (z < 0.42)) * 1.0), cap, (z > 0.92) * 1.0)

    profile = [
        (0, 0),
        (wide, 0.02),
        (wide, 0.5),
        (0.06, 0.75),
        (0.055, 0.91),
        (0.07, 0.92),
        (0.07, 1),
        (0, 1),
    ]
    return lathe(profile, paint, rows=160, columns=64), [
        "a bottle",
        f"{article(name)} bottle with a label",
    ]


def lamp(rng):
    """A table lamp with a shade."""
    name, shade = pick(rng, "cream", "red", "yellow", "light blue", "green", "white")
    foot = pick(rng, "brown", "golden", "black", "silver", "blue")[1]
    stand = lathe(
        [
            (0, 0),
            (0.18, 0),
            (0.17, 0.04),
            (0.03, 0.07),
            (0.07, 0.22),
            (0.02, 0.4),
            (0.02, 0.6),
            (0, 0.6),
        ],
        foot,
    )
    hood = lathe([(0.3, 0.52), (0.17, 0.95), (0.16, 0.95), (0.29, 0.52)], shade, sharp=True)
    bulb = ellipsoid((0, 0, 0.68), 0.07, (1.0, 0.95, 0.7), 16, 12)
    return join(stand, hood, bulb), ["a lamp", f"a table lamp with {article(name)} shade"]


def candle(rng):
    """A candle with a flame, on a saucer."""
    name, wax = pick(rng, "white", "red", "cream", "blue", "pink", "yellow")
    radius, height = rng.uniform(0.09, 0.18), rng.uniform(0.45, 0.7)
    parts = [
        lathe(
            [
                (0, 0.02),
                (radius, 0.02),
                (radius, height),
                (0.8 * radius, height - 0.01),
                (0, height - 0.03),
            ],
            wax,
        ),
        tube(
            [(0, 0, height - 0.03), (0, 0, height + 0.02), (0.005, 0, height + 0.06)],
            0.012,
            COLOURS["black"],
        ),
        lathe(
            [(0, height + 0.03), (0.05, height + 0.1), (0.02, height + 0.19), (0, height + 0.24)],
            (1.0, 0.72, 0.18),
        ),
        lathe(
            [(0, 0), (0.2, 0), (0.28, 0.06), (0.26, 0.06), (0.18, 0.02), (0, 0.02)],
            jitter(rng, COLOURS["golden"]),
        ),
    ]
    return join(*parts), ["a candle", f"{article(name)} candle with a flame", "a burning candle"]


def hat(rng):
    """A top hat, a party hat or a sun hat."""
    kind = str(rng.choice(["top hat", "party hat", "sun hat"]))
    name, band = pick(rng, "red", "blue", "green", "purple", "pink", "yellow")
    if kind == "party hat":
        stripe = COLOURS["white"]
        cone = lathe(
            [(0.32, 0), (0.02, 0.8), (0, 0.8)],
            lambda u, v, p: mix(band, stripe, (np.sin(2 * np.pi * (4 * u + 3 * v)) > 0.4) * 1.0),
            sharp=True,
        )
        return join(cone, ellipsoid((0, 0, 0.82), 0.08, stripe)), [
            "a hat",
            "a party hat",
            f"{article(name)} party hat",
        ]
    felt = jitter(rng, COLOURS["black"] if kind == "top hat" else COLOURS["golden"])
    rise = 0.55 if kind == "top hat" else 0.3
    profile = [
        (0.0, 0.0),
        (0.5, 0.02),
        (0.5, 0.04),
        (0.28, 0.04),
        (0.27, rise),
        (0.24, rise + 0.03),
        (0, rise + 0.03),
    ]

    def paint(u, v, points):
        near = (np.hypot(points[..., 0], points[..., 1]) < 0.3) & (
            np.abs(points[..., 2] - 0.1) < 0.06
        )
        return mix(felt, band, near * 1.0)

    return lathe(profile, paint, sharp=True, rows=140), [
        "a hat",
        article(kind),
        f"{article(kind)} with {article(name)} band",
    ]


def duck(rng):
    """A rubber duck facing +x."""
    name, body = pick(rng, "yellow", "yellow", "yellow", "pink", "light blue")
    beak = jitter(rng, COLOURS["orange"])
    parts = [
        ellipsoid((0, 0, 0), (0.42, 0.3, 0.26), body, 40, 28),
        ellipsoid((0.2, 0, 0.36), 0.22, body, 36, 24),
        turn(
            move(ellipsoid((0, 0, 0), (0.18, 0.12, 0.09), body), (-0.42, 0, 0.06)), (0, 1, 0), 0.35
        ),
        ellipsoid((0.43, 0, 0.33), (0.1, 0.1, 0.035), beak, 24, 14),
    ]
    for side in (-1, 1):
        parts.append(ellipsoid((0.34, 0.12 * side, 0.43), 0.036, COLOURS["black"], 14, 10))
        parts.append(
            ellipsoid(
                (-0.05, 0.27 * side, 0.04), (0.22, 0.06, 0.13), np.asarray(body) * 0.93, 24, 16
            )
        )
    return join(*parts), ["a rubber duck", "a duck", f"{article(name)} rubber duck toy"]


def fish(rng):
    """A fish seen from its side when looked at from +x."""
    name, skin = pick(rng, "orange", "blue", "red", "yellow", "silver", "purple")
    stripe = np.asarray(COLOURS["white"])
    striped = rng.random() < 0.5

    def paint(u, v, points):
        band = striped * (np.sin(14 * points[..., 1]) > 0.55)
        return mix(mix(skin, stripe, band), stripe, (points[..., 2] < -0.1) * 0.5)

    parts = [ellipsoid((0, 0, 0), (0.13, 0.4, 0.22), paint, 64, 48)]
    for rise in (0.75, -0.75):
        parts.append(
            leaf((0, -0.34, 0), (0, -1, rise), 0.34, 0.2, skin * 0.85, droop=0.0, up=(1, 0, 0))
        )
    parts.append(
        leaf((0, 0.12, 0.17), (0, -1, 0.5), 0.4, 0.22, skin * 0.85, droop=0.0, up=(1, 0, 0))
    )
    for side in (-1, 1):
        parts.append(ellipsoid((0.09 * side, 0.26, 0.06), (0.03, 0.045, 0.045), (1, 1, 1), 14, 10))
        parts.append(ellipsoid((0.115 * side, 0.27, 0.06), (0.012, 0.024, 0.024), (0, 0, 0), 12, 8))
    return join(*parts), ["a fish", f"{article(name)} fish", "a tropical fish"]


def snowman(rng):
    """Three balls of snow with a carrot, buttons, a scarf and a hat."""
    name, scarf = pick(rng, "red", "blue", "green", "purple")
    snow, coal = jitter(rng, COLOURS["white"], 0.01), COLOURS["black"]
    parts = [
        ellipsoid((0, 0, z), r, snow, 40, 28) for z, r in ((0, 0.34), (0.46, 0.25), (0.83, 0.18))
    ]
    parts.append(torus((0, 0, 0.67), 0.15, 0.055, scarf))
    parts.append(
        tube(
            [(0.17, 0, 0.83), (0.26, 0, 0.83), (0.36, 0, 0.82)],
            [0.035, 0.022, 0.003],
            COLOURS["orange"],
        )
    )
    for side in (-1, 1):
        parts.append(ellipsoid((0.155, 0.065 * side, 0.89), 0.025, coal, 10, 8))
        parts.append(
            tube(
                [(0, 0.22 * side, 0.5), (0, 0.4 * side, 0.6), (0, 0.52 * side, 0.72)],
                0.015,
                COLOURS["brown"],
            )
        )
    parts += [ellipsoid((0.25, 0, z), 0.028, coal, 10, 8) for z in (0.4, 0.5)]
    parts.append(
        lathe(
            [(0, 0.96), (0.22, 0.96), (0.22, 0.98), (0.14, 0.98), (0.13, 1.16), (0, 1.16)],
            coal,
            sharp=True,
        )
    )
    return join(*parts), ["a snowman", f"a snowman with {article(name)} scarf and a black hat"]


MODELS = {
    "ball": ball,
    "cube": cube,
    "star": star,
    "heart": heart,
    "mug": mug,
    "bottle": bottle,
    "lamp": lamp,
    "candle": candle,
    "hat": hat,
    "duck": duck,
    "fish": fish,
    "snowman": snowman,
}
