"""Fruit and vegetables."""

import numpy as np

from .palette import COLOURS, article, jitter, mix, pick, ripples
from .surfaces import ellipsoid, join, lathe, leaf, patch, tube, turn
from .sweets import berry_crown


def apple(rng):
    """An apple with a dimple, a stalk and a leaf."""
    name, skin = pick(rng, "red", "green", "yellow", "dark red")
    blush = jitter(rng, (0.92, 0.75, 0.30))

    def paint(u, v, points):
        streak = 0.25 * np.sin(40 * np.pi * u) ** 2
        return mix(skin, blush, np.clip((points[..., 2] - 0.2) / 0.3, 0, 1) * (0.5 + streak))

    body = lathe(
        [
            (0, -0.34),
            (0.16, -0.4),
            (0.36, -0.22),
            (0.45, 0.08),
            (0.38, 0.32),
            (0.2, 0.4),
            (0.06, 0.32),
            (0, 0.26),
        ],
        paint,
    )
    stalk = tube([(0, 0, 0.26), (0.02, 0.02, 0.42), (0.05, 0.05, 0.54)], 0.022, COLOURS["brown"])
    return join(
        body, stalk, leaf((0.01, 0.01, 0.42), (0.2, 1, 0.35), 0.32, 0.16, COLOURS["green"])
    ), ["an apple", f"{article(name)} apple", f"{article(name)} apple with a leaf"]


def round_fruit(rng):
    """An orange, a peach, a tomato or a plum."""
    kind = str(rng.choice(["orange", "peach", "tomato", "plum"]))
    colour = {
        "orange": (0.97, 0.55, 0.09),
        "peach": (0.98, 0.66, 0.45),
        "tomato": (0.86, 0.14, 0.09),
        "plum": (0.38, 0.13, 0.36),
    }[kind]
    colour, rough = jitter(rng, colour), ripples(rng, 9.0)
    flat = 0.85 if kind == "tomato" else 0.97
    body = ellipsoid(
        (0, 0, 0),
        (0.45, 0.45, 0.45 * flat),
        lambda u, v, p: colour * (1 + 0.03 * rough(p))[..., None],
        64,
        40,
    )
    if kind == "tomato":
        top = berry_crown(rng, 0.45 * flat, 0.28, 5)
    else:
        top = join(
            tube([(0, 0, 0.4), (0, 0.01, 0.46), (0.02, 0.02, 0.52)], 0.025, COLOURS["brown"]),
            leaf((0, 0, 0.46), (0.3, 1, 0.3), 0.3, 0.15, COLOURS["green"]),
        )
    return join(body, top), [article(kind), f"a ripe {kind}", f"a fresh {kind} fruit"]


def cherry(rng):
    """Two cherries on joined stalks."""
    name, red = pick(rng, "red", "dark red")
    green, parts = jitter(rng, COLOURS["green"]), []
    for side in (-1, 1):
        parts.append(ellipsoid((0, 0.24 * side, -0.3), 0.2, red))
        parts.append(
            tube([(0, 0.24 * side, -0.12), (0, 0.15 * side, 0.2), (0, 0, 0.45)], 0.018, green)
        )
    parts.append(leaf((0, 0, 0.45), (0.3, 1, 0.1), 0.4, 0.2, green))
    return join(*parts), ["cherries", f"two {name} cherries", "a cherry"]


def banana(rng):
    """A curved banana with dark tips."""
    skin = jitter(rng, (0.98, 0.84, 0.20))
    angle = np.linspace(-1.0, 1.0, 9)
    path = np.stack([0 * angle, 0.55 * np.sin(angle), 0.55 - 0.55 * np.cos(angle)], -1)
    width = [0.03, 0.05, 0.1, 0.12, 0.125, 0.12, 0.1, 0.045, 0.035]

    def paint(u, v, points):
        tip = np.clip((np.abs(v - 0.5) - 0.45) / 0.03, 0, 1)
        return mix(mix(skin, skin * 0.85, np.sin(2.5 * 2 * np.pi * u) ** 8), (0.35, 0.26, 0.1), tip)

    return tube(path, width, paint, sides=20, rows=60), ["a banana", "a ripe yellow banana"]


def citrus(rng):
    """A lemon or lime with pointed ends."""
    kind = str(rng.choice(["lemon", "lemon", "lime"]))
    colour = jitter(rng, (0.98, 0.87, 0.20) if kind == "lemon" else (0.52, 0.76, 0.20))
    rough = ripples(rng, 8.0)
    body = lathe(
        [(0, -0.5), (0.07, -0.46), (0.2, -0.34), (0.34, 0), (0.2, 0.34), (0.07, 0.46), (0, 0.5)],
        lambda u, v, p: colour * (1 + 0.03 * rough(p))[..., None],
    )
    return turn(body, (1, 0, 0), np.pi / 2), [
        article(kind),
        f"a {'yellow' if kind == 'lemon' else 'green'} {kind}",
    ]


def pear(rng):
    """A pear with a stalk."""
    name, skin = pick(rng, "light green", "yellow", "green")
    body = lathe(
        [
            (0, -0.46),
            (0.2, -0.45),
            (0.34, -0.22),
            (0.26, 0.08),
            (0.15, 0.3),
            (0.1, 0.42),
            (0, 0.45),
        ],
        skin,
    )
    stalk = tube([(0, 0, 0.42), (0, 0.02, 0.52), (0.03, 0.05, 0.6)], 0.022, COLOURS["brown"])
    return join(body, stalk, leaf((0, 0, 0.5), (0.2, 1, 0.2), 0.26, 0.13, COLOURS["green"])), [
        "a pear",
        f"a {name} pear",
    ]


def watermelon(rng):
    """A whole striped watermelon, or a slice with red flesh and seeds."""
    rind, dark, red = (
        jitter(rng, (0.50, 0.74, 0.32)),
        jitter(rng, (0.13, 0.38, 0.16)),
        jitter(rng, (0.92, 0.26, 0.26)),
    )
    if rng.random() < 0.5:
        wave = ripples(rng, 3.0)
        body = ellipsoid(
            (0, 0, 0),
            (0.42, 0.5, 0.42),
            lambda u, v, p: mix(
                rind, dark, 0.5 + 2.5 * np.sin(9 * np.arctan2(p[..., 2], p[..., 0]) + 0.8 * wave(p))
            ),
            96,
            64,
        )
        return body, ["a watermelon", "a whole green striped watermelon"]
    parts, half = [], 0.12

    def flesh(u, v, points):
        seeds = (
            (np.abs(np.sin(9 * np.pi * u)) > 0.93)
            & (np.abs((v * 3.2) % 1 - 0.5) < 0.10)
            & (v < 0.8)
        )
        skin = mix(red, (0.96, 0.95, 0.80), (v - 0.84) / 0.03)
        return mix(mix(skin, dark, (v - 0.93) / 0.02), (0.1, 0.07, 0.05), seeds.astype(float))

    for sign in (-1, 1):
        parts.append(
            patch(
                lambda u, v, s=sign: (
                    s * half + 0 * u,
                    0.5 * v * np.cos(np.pi * u),
                    -0.5 * v * np.sin(np.pi * u),
                ),
                flesh,
                120,
                60,
            )
        )
    parts.append(
        patch(
            lambda u, v: (half * (2 * v - 1), 0.5 * np.cos(np.pi * u), -0.5 * np.sin(np.pi * u)),
            dark,
            48,
            6,
        )
    )
    parts.append(patch(lambda u, v: (half * (2 * v - 1), 0.47 * (2 * u - 1), 0 * u), red, 20, 6))
    return join(*parts), [
        "a slice of watermelon",
        "a red watermelon slice with black seeds",
        "a watermelon",
    ]


def tuft(rng, height, rises, width, green, droop):
    """A leaf from (0, 0, height) for each of `rises`, the upward part of its direction, turned from
    one to the next by the golden angle.
    """
    angles = 2.39996 * np.arange(len(rises))
    return [
        leaf(
            (0, 0, height),
            (np.cos(angle), np.sin(angle), rise),
            0.42,
            width,
            green * rng.uniform(0.8, 1.2),
            droop=droop,
        )
        for angle, rise in zip(angles, rises, strict=True)
    ]


def pineapple(rng):
    """A pineapple with a checkered skin and a tuft."""
    skin, green = jitter(rng, (0.88, 0.63, 0.16)), jitter(rng, COLOURS["green"])

    def paint(u, v, points):
        grid = np.minimum(np.abs((7 * u + 6 * v) % 1 - 0.5), np.abs((7 * u - 6 * v) % 1 - 0.5))
        return mix(skin * 0.55, skin, grid * 4)

    parts = [
        lathe(
            [(0, -0.5), (0.2, -0.47), (0.3, -0.15), (0.26, 0.15), (0.12, 0.3), (0, 0.3)],
            paint,
            columns=113,
            rows=96,
        )
    ]
    rises = 0.4 + 2.2 * (1 - np.arange(22) / 22)
    parts += tuft(rng, 0.26, rises, 0.09, green, droop=0.35)
    return join(*parts), ["a pineapple", "a ripe pineapple with green leaves"]


def grapes(rng):
    """A bunch of grapes."""
    name, skin = pick(rng, "purple", "light green", "dark red")
    parts = []
    for index in range(34):
        level = index / 33
        radius = 0.26 * (1 - level) ** 0.6 * (0.75 + 0.25 * (index % 2))
        angle = 2.39996 * index
        parts.append(
            ellipsoid(
                (radius * np.cos(angle), radius * np.sin(angle), 0.3 - 0.75 * level),
                0.105,
                skin * rng.uniform(0.85, 1.12),
                16,
                10,
            )
        )
    parts.append(tube([(0, 0, 0.3), (0, 0, 0.45), (0, 0.06, 0.55)], 0.02, COLOURS["brown"]))
    parts.append(leaf((0, 0, 0.42), (0.5, -1, 0.2), 0.3, 0.24, COLOURS["green"]))
    return join(*parts), [
        "grapes",
        f"a bunch of {'green' if name == 'light green' else name} grapes",
    ]


def carrot(rng):
    """An orange carrot with feathery greens."""
    skin, green = jitter(rng, (0.95, 0.48, 0.10)), jitter(rng, COLOURS["green"])

    def paint(u, v, points):
        return mix(
            skin,
            skin * 0.8,
            (np.sin(60 * points[..., 2] + 4 * np.sin(2 * np.pi * u)) > 0.9).astype(float),
        )

    parts = [
        lathe([(0, -0.6), (0.03, -0.55), (0.1, -0.2), (0.16, 0.2), (0.12, 0.28), (0, 0.27)], paint)
    ]
    parts += tuft(rng, 0.25, np.full(9, 2.2), 0.12, green, droop=0.2)
    return join(*parts), ["a carrot", "an orange carrot with green leaves"]


def pumpkin(rng):
    """A ribbed orange pumpkin."""
    skin = jitter(rng, (0.94, 0.50, 0.10))
    ribs = int(rng.integers(8, 12))
    body = lathe(
        [(0, -0.28), (0.25, -0.34), (0.46, -0.1), (0.46, 0.1), (0.25, 0.32), (0, 0.24)],
        lambda u, v, p: mix(skin * 0.7, skin, np.abs(np.sin(np.pi * ribs * u)) * 1.6),
        columns=121,
        wave=lambda angle, v: 0.9 + 0.12 * np.abs(np.sin(0.5 * ribs * angle)),
    )
    stalk = tube(
        [(0, 0, 0.22), (0, 0.02, 0.36), (0.05, 0.08, 0.46)],
        [0.07, 0.05, 0.045],
        jitter(rng, (0.36, 0.45, 0.16)),
    )
    return join(body, stalk), ["a pumpkin", "an orange pumpkin"]
