"""Rose, vase with flowers, single flower, and the heads that they are made of."""

import numpy as np

from .palette import COLOURS, article, jitter, mix, pick
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
