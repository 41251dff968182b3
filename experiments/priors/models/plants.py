"""Rose, vase with flowers, trees, fruit and vegetables."""

import numpy as np

from .palette import COLOURS, article, golden_directions, jitter, mix, pick, ripples
from .surfaces import (
    Mesh,
    ellipsoid,
    join,
    lathe,
    leaf,
    move,
    patch,
    rounded_box,
    stretch,
    tube,
    turn,
)
from .sweets import berry_crown


def bloom(rng, colour, layers: int = 5) -> Mesh:
    """A rose's head of unit height and width about the origin: cupped petals in a golden spiral."""
    parts, index = [], 0
    for layer in range(layers):
        openness = layer / (layers - 1)
        for _ in range(3 + layer):
            heading = 2.39996 * index + rng.normal(0, 0.08)
            index += 1
            reach, height = 0.08 + 0.30 * openness, 0.66 - 0.12 * openness
            spread = 1.15 - 0.35 * openness
            curl, tint = 0.06 + 0.16 * openness, rng.uniform(0.92, 1.06)

            def surface(
                u, v, heading=heading, reach=reach, height=height, spread=spread, curl=curl
            ):
                across = 2 * u - 1
                outline = np.sqrt(np.maximum(1 - (0.75 * np.abs(across)) ** 3, 0))
                rise = v * outline
                radius = reach * (0.2 + 0.9 * np.sin(0.5 * np.pi * np.minimum(1.7 * rise, 1)))
                radius = radius + curl * np.maximum(rise - 0.62, 0) ** 1.5 * 2.2
                angle = heading + spread * across * (0.45 + 0.55 * rise)
                z = height * rise - 0.10 * np.maximum(rise - 0.75, 0) * (1 + 3 * reach)
                return radius * np.cos(angle), radius * np.sin(angle), z

            def paint(u, v, points, tint=tint, openness=openness):
                rim = np.maximum(v - 0.72, 0) / 0.28
                return np.clip(
                    np.asarray(colour)
                    * (tint * (0.68 + 0.26 * openness + 0.10 * v) + 0.12 * rim)[..., None],
                    0,
                    1,
                )

            parts.append(patch(surface, paint, 20, 16))
    return join(*parts)


def rose(rng):
    """A rose: spiral of petals on a green stem with pointed leaves and sepals."""
    name, colour = pick(rng, "red", "red", "red", "pink", "white", "yellow", "dark red")
    green = jitter(rng, (0.16, 0.44, 0.16))
    size, length = rng.uniform(0.95, 1.1), rng.uniform(0.75, 1.0)
    head = stretch(bloom(rng, colour), size)
    bend = rng.normal(0, 0.05, 2)
    parts = [
        head,
        tube(
            [(*bend, -length), (*(bend * 0.4), -0.5 * length), (0, 0, 0.06)],
            [0.035, 0.032, 0.045],
            green,
        ),
    ]
    parts.append(ellipsoid((0, 0, 0.03), (0.12, 0.12, 0.09), green))
    for index in range(5):
        angle = 2 * np.pi * index / 5
        parts.append(
            leaf(
                (0, 0, 0.03), (np.cos(angle), np.sin(angle), 0.25), 0.3, 0.1, green * 1.1, droop=0.3
            )
        )
    start = rng.uniform(0, 6)
    for index in range(int(rng.integers(2, 5))):
        angle, height = start + 2.6 * index, -length * (0.75 - 0.2 * index)
        direction = (np.cos(angle), np.sin(angle), 0.55)
        tint = green * rng.uniform(1.0, 1.35)

        def paint(u, v, points, tint=tint):
            return mix(tint * 1.25, tint, np.abs(2 * u - 1) * 3)

        parts.append(
            leaf((0, 0, height), direction, rng.uniform(0.36, 0.46), 0.24, paint, droop=0.35)
        )
    return join(*parts), [
        "a rose",
        f"a {name} rose",
        f"a {name} rose with a green stem and leaves",
        "a rose flower in bloom",
    ]


def daisy(rng, petal, centre) -> Mesh:
    """A flat flower facing +z of radius about 0.5: a ring of petals around a raised middle."""
    count = int(rng.integers(7, 12))
    parts = [ellipsoid((0, 0, 0.04), (0.17, 0.17, 0.1), centre, 20, 12)]
    for index in range(count):
        angle = 2 * np.pi * index / count
        blade = rounded_box(
            (0.32, 0, 0),
            (0.22, 0.95 / count + 0.04, 0.025),
            (1.0, 0.8),
            np.asarray(petal) * rng.uniform(0.94, 1.05),
            16,
            8,
        )
        parts.append(turn(turn(blade, (0, 1, 0), -0.2), (0, 0, 1), angle))
    return join(*parts)


def tulip_head(rng, colour) -> Mesh:
    """A closed cup of six petals of height about 1, standing on the origin."""
    parts = []
    for index in range(6):
        heading, inner = np.pi / 3 * index, 0.9 if index % 2 else 1.0

        def surface(u, v, heading=heading, inner=inner):
            across = 2 * u - 1
            radius = inner * 0.36 * np.sin(np.pi * np.clip(0.12 + 0.72 * v, 0, 1))
            angle = heading + 0.72 * across * np.sqrt(np.maximum(1 - v**2.5, 0))
            return radius * np.cos(angle), radius * np.sin(angle), 0.95 * v

        tint = np.asarray(colour) * rng.uniform(0.88, 1.06)
        parts.append(patch(surface, tint, 12, 14))
    return join(*parts)


def vase_of_flowers(rng):
    """A painted vase with stems, leaves and a bunch of flowers."""
    vase_name, glaze = pick(
        rng, "blue", "white", "light blue", "turquoise", "green", "red", "beige", "purple", "orange"
    )
    bloom_name, petal = pick(rng, "red", "pink", "yellow", "white", "purple", "orange", "blue")
    belly, neck = rng.uniform(0.24, 0.33), rng.uniform(0.10, 0.16)
    height, lip = rng.uniform(0.55, 0.75), rng.uniform(1.15, 1.7)
    stripe = np.asarray(COLOURS["white"]) if vase_name != "white" else jitter(rng, COLOURS["blue"])
    bands = rng.random() < 0.5

    def paint(u, v, points):
        level = points[..., 2] / height
        band = (np.abs(level - 0.45) < 0.05) | (np.abs(level - 0.6) < 0.02)
        return mix(glaze, stripe, (band & bands).astype(float))

    profile = [
        (0, 0),
        (0.55 * belly, 0),
        (belly, 0.38 * height),
        (neck, 0.85 * height),
        (neck * lip, height),
        (neck * lip * 0.85, height),
        (neck * 0.8, 0.85 * height),
        (0, 0.8 * height),
    ]
    parts = [lathe(profile, paint)]
    kind = str(rng.choice(["daisies", "roses", "tulips", "flowers"]))
    green, count = jitter(rng, (0.22, 0.52, 0.2)), int(rng.integers(5, 10))
    for index in range(count):
        angle = 2.39996 * index + rng.normal(0, 0.15)
        tilt = 0.62 * np.sqrt((index + 0.15) / count)
        length = rng.uniform(0.62, 0.78) * (1 - 0.12 * tilt)
        direction = np.array(
            [np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)]
        )
        foot = np.array([0, 0, 0.85 * height])
        head = foot + length * direction
        parts.append(
            tube(
                [foot, foot + 0.5 * length * (direction + np.array([0, 0, 0.12])), head],
                0.014,
                green,
                sides=8,
                rows=12,
            )
        )
        tint = (
            jitter(rng, petal)
            if kind != "flowers"
            else pick(rng, "red", "pink", "yellow", "white", "purple", "orange")[1]
        )
        if kind == "roses":
            flower, size = bloom(rng, tint, layers=4), 0.3
        elif kind == "tulips":
            flower, size = tulip_head(rng, tint), 0.26
        else:
            middle = (
                COLOURS["yellow"]
                if bloom_name != "yellow" or kind == "flowers"
                else COLOURS["brown"]
            )
            flower, size = daisy(rng, tint, middle), 0.36
        flower = turn(turn(stretch(flower, size), (0, 1, 0), tilt * 1.35), (0, 0, 1), angle)
        parts.append(move(flower, head))
    for index in range(int(rng.integers(5, 9))):
        angle, rise = 2.39996 * index + 0.9, rng.uniform(0.4, 1.4)
        direction = (np.cos(angle), np.sin(angle), rise)
        parts.append(
            leaf(
                (0, 0, 0.92 * height),
                direction,
                rng.uniform(0.3, 0.5),
                0.14,
                green * rng.uniform(0.85, 1.2),
                droop=0.3,
            )
        )
    flowers = f"{bloom_name} {kind}" if kind != "flowers" else "colourful flowers"
    return join(*parts), [
        "a vase with flowers",
        "a vase of flowers",
        f"{article(vase_name)} vase with {flowers}",
        "a bouquet of flowers in a vase",
    ]


def flower(rng):
    """A single flower in bloom facing up and forward on a stem with leaves."""
    name, petal = pick(rng, "red", "pink", "yellow", "white", "purple", "orange", "blue")
    green = jitter(rng, COLOURS["green"])
    tulip = rng.random() < 0.4
    stem = tube([(0, 0, -0.75), (0, 0.03, -0.3), (0, 0, 0.02)], 0.03, green)
    leaves = [
        leaf((0, 0, -0.7 + 0.12 * i), (np.cos(a), np.sin(a), 0.8), 0.5, 0.15, green, droop=0.3)
        for i, a in enumerate((0.9, -1.8))
    ]
    if tulip:
        return join(stretch(tulip_head(rng, petal), 0.5), stem, *leaves), [
            "a tulip",
            f"a {name} tulip",
        ]
    middle = COLOURS["brown"] if name == "yellow" else COLOURS["yellow"]
    head = turn(stretch(daisy(rng, petal, middle), 0.8), (0, 1, 0), rng.uniform(0.5, 1.2))
    kind = "sunflower" if name == "yellow" else f"{name} flower"
    return join(head, stem, *leaves), ["a flower", article(kind), f"{article(name)} daisy"]


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
    for index in range(22):
        angle, rise = 2.39996 * index, 0.4 + 2.2 * (1 - index / 22)
        parts.append(
            leaf(
                (0, 0, 0.26),
                (np.cos(angle), np.sin(angle), rise),
                0.42,
                0.09,
                green * rng.uniform(0.8, 1.2),
                droop=0.35,
            )
        )
    return join(*parts), ["a pineapple", "a ripe pineapple with green leaves"]


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
    for index in range(9):
        angle = 2.39996 * index
        parts.append(
            leaf(
                (0, 0, 0.25),
                (np.cos(angle), np.sin(angle), 2.2),
                0.42,
                0.12,
                green * rng.uniform(0.8, 1.2),
                droop=0.2,
            )
        )
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


def mushroom(rng):
    """A toadstool with white spots, or a brown mushroom."""
    name, cap = pick(rng, "red", "red", "brown", "light brown")
    stalk = lathe([(0, -0.5), (0.16, -0.5), (0.13, -0.2), (0.12, 0.08), (0, 0.1)], COLOURS["cream"])
    spots = golden_directions(40)[:18]

    def paint(u, v, points):
        unit = points - (0, 0, 0.02)
        unit = unit / (np.linalg.norm(unit, axis=-1, keepdims=True) + 1e-9)
        near = (unit @ spots.T).max(-1)
        inside = np.clip((near - 0.975) / 0.008, 0, 1) * (name == "red")
        return mix(mix(cap, COLOURS["white"], inside), COLOURS["cream"], (v < 0.22) * 1.0)

    top = lathe(
        [(0.0, 0.03), (0.4, 0.0), (0.45, 0.08), (0.34, 0.3), (0.16, 0.42), (0, 0.44)],
        paint,
        columns=96,
        rows=80,
    )
    spot = " with white spots" if name == "red" else ""
    return join(stalk, top), ["a mushroom", f"a {name} mushroom{spot}"]


def cactus(rng):
    """A ribbed cactus with arms in a pot."""
    green, pot_name = jitter(rng, (0.25, 0.55, 0.27)), "orange"
    pot = lathe(
        [(0, -0.5), (0.2, -0.5), (0.27, -0.2), (0.3, -0.2), (0.3, -0.13), (0, -0.15)],
        jitter(rng, (0.80, 0.42, 0.24)),
        sharp=True,
    )

    def paint(u, v, points):
        return mix(green * 0.7, green, np.abs(np.sin(8 * np.pi * u)) * 1.6)

    parts = [
        pot,
        tube(
            [(0, 0, -0.2), (0, 0, 0.2), (0, 0, 0.5), (0, 0, 0.56)],
            [0.15, 0.16, 0.13, 0.05],
            paint,
            sides=49,
        ),
    ]
    for side, base in ((-1, 0.05), (1, 0.18)):
        if rng.random() < 0.85:
            path = [
                (0, 0.1 * side, base),
                (0, 0.3 * side, base + 0.02),
                (0, 0.34 * side, base + 0.16),
                (0, 0.34 * side, base + 0.3),
            ]
            parts.append(tube(path, [0.07, 0.075, 0.075, 0.04], paint, sides=33))
    if rng.random() < 0.4:
        parts.append(
            move(stretch(daisy(rng, COLOURS["pink"], COLOURS["yellow"]), 0.22), (0, 0, 0.57))
        )
    return join(*parts), ["a cactus", f"a green cactus in an {pot_name} pot", "a potted cactus"]


def tree(rng):
    """A leafy tree or a fir."""
    bark = jitter(rng, COLOURS["brown"])
    if rng.random() < 0.45:
        green, parts = (
            jitter(rng, (0.13, 0.40, 0.20)),
            [tube([(0, 0, -0.6), (0, 0, -0.2), (0, 0, 0.1)], 0.06, bark)],
        )
        for index in range(4):
            base, wide = -0.35 + 0.24 * index, 0.38 - 0.075 * index
            parts.append(
                lathe(
                    [(0, base + 0.03), (wide, base), (0.02, base + 0.42), (0, base + 0.42)],
                    green * (0.9 + 0.06 * index),
                    sharp=True,
                    wave=lambda a, v: 1 + 0.05 * np.sin(9 * a),
                )
            )
        return join(*parts), ["a fir tree", "a tree", "a green pine tree"]
    name, crown = pick(rng, "green", "dark green", "light green", "orange", "pink")
    rough = ripples(rng, 3.0)
    parts = [tube([(0, 0, -0.6), (0, 0.01, -0.3), (0, 0, 0.1)], [0.09, 0.06, 0.05], bark)]
    for direction in golden_directions(11):
        ball = ellipsoid(
            direction * 0.2 + (0, 0, 0.22),
            rng.uniform(0.18, 0.25),
            lambda u, v, p: np.asarray(crown) * (1 + 0.14 * rough(p * 2))[..., None],
            28,
            18,
        )
        parts.append(ball)
    return join(*parts), ["a tree", f"a tree with {name} leaves"]


def potted_plant(rng):
    """Long leaves rising from a pot."""
    name, glaze = pick(rng, "white", "orange", "brown", "blue", "grey")
    green = jitter(rng, COLOURS["green"])
    pot = lathe([(0, 0), (0.18, 0), (0.24, 0.32), (0.2, 0.32), (0, 0.28)], glaze, sharp=True)
    parts = [pot]
    for index in range(int(rng.integers(10, 18))):
        angle, rise = 2.39996 * index, rng.uniform(0.6, 2.5)
        parts.append(
            leaf(
                (0, 0, 0.28),
                (np.cos(angle), np.sin(angle), rise),
                rng.uniform(0.4, 0.65),
                0.15,
                green * rng.uniform(0.75, 1.25),
                droop=0.45,
            )
        )
    return join(*parts), ["a potted plant", f"a green plant in {article(name)} pot", "a houseplant"]


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


MODELS = {
    "rose": rose,
    "vase with flowers": vase_of_flowers,
    "flower": flower,
    "apple": apple,
    "round fruit": round_fruit,
    "cherry": cherry,
    "banana": banana,
    "citrus": citrus,
    "pear": pear,
    "watermelon": watermelon,
    "pineapple": pineapple,
    "carrot": carrot,
    "pumpkin": pumpkin,
    "mushroom": mushroom,
    "cactus": cactus,
    "tree": tree,
    "potted plant": potted_plant,
    "grapes": grapes,
}
