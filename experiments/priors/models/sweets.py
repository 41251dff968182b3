"""Strawberry, ice cream, pancakes and other sweet things."""

import numpy as np

from .palette import COLOURS, golden_directions, jitter, mix, pick, ripples
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
    torus,
    tube,
    turn,
)


def berry_crown(rng, top: float, reach: float, count: int) -> Mesh:
    """Pointed green sepals around the top of a fruit, and a short stalk."""
    green = jitter(rng, COLOURS["green"])
    parts = []
    for index in range(count):
        angle = 2 * np.pi * (index + 0.3 * rng.random()) / count
        direction = (np.cos(angle), np.sin(angle), rng.uniform(0.15, 0.45))
        shade = green * rng.uniform(0.85, 1.15)
        length = reach * rng.uniform(0.85, 1.15)
        parts.append(leaf((0, 0, top), direction, length, 0.42 * length, shade, droop=0.55))
    bend = rng.normal(0, 0.05, 2)
    parts.append(
        tube([(0, 0, top - 0.02), (*bend * 0.4, top + 0.08), (*bend, top + 0.16)], 0.025, green)
    )
    return join(*parts)


def strawberry(rng):
    """A heart-shaped red fruit with yellow seeds in a spiral, a crown of sepals and a stalk."""
    name, red = pick(rng, "red", "red", "dark red")
    wide, waist = rng.uniform(0.36, 0.45), rng.uniform(0.68, 0.84)
    profile = np.array(
        [
            (0, -0.5),
            (0.11, -0.46),
            (waist * wide, -0.22),
            (wide, 0.12),
            (0.82 * wide, 0.3),
            (0.3 * wide, 0.36),
            (0, 0.34),
        ]
    )
    pale = jitter(rng, (0.95, 0.62, 0.50))
    tip = mix(red, pale, np.array(0.15 * rng.random()))

    def paint(u, v, points):
        return mix(
            mix(tip, red, (points[..., 2] + 0.5) / 0.4), pale, (points[..., 2] - 0.27) / 0.16
        )

    body = lathe(profile, paint)
    seed_colour = jitter(rng, (0.97, 0.82, 0.42))
    seeds, count = [], int(rng.integers(95, 140))
    for direction in golden_directions(count):
        # The radius of the fruit at this height gives the seed its place.
        height = -0.47 + 0.4 * (direction[2] + 1)
        if height > 0.27:
            continue
        at = body.vertices[np.argmin(np.abs(body.vertices[:, 2] - height))]
        radius = np.hypot(at[0], at[1])
        heading = direction[:2] / np.linalg.norm(direction[:2])
        place = (*(heading * radius * 1.0), height)
        seeds.append(ellipsoid(place, (0.016, 0.016, 0.026), seed_colour, 7, 6))
    crown = berry_crown(rng, 0.34, 0.85 * wide, int(rng.integers(6, 9)))
    fruit = join(body, *seeds, crown)
    lean = rng.normal(0, 0.08, 2)
    fruit = turn(turn(fruit, (1, 0, 0), lean[0]), (0, 1, 0), lean[1])
    return fruit, [
        "a strawberry",
        f"a ripe {name} strawberry with green leaves",
        "a fresh strawberry, red fruit with small yellow seeds",
    ]


FLAVOURS = {
    "strawberry": (0.97, 0.60, 0.68),
    "vanilla": (0.99, 0.93, 0.74),
    "chocolate": (0.42, 0.25, 0.16),
    "mint": (0.66, 0.90, 0.76),
    "lemon": (0.99, 0.92, 0.48),
    "blueberry": (0.58, 0.50, 0.82),
}


def scoop(rng, centre, radius: float, colour) -> Mesh:
    """A rough ball of ice cream with a ragged skirt where the scoop has pressed it."""
    rough, skirt = ripples(rng, 2.4 / radius * 0.25), rng.uniform(0, 2 * np.pi, 3)

    def surface(u, v):
        longitude, latitude = 2 * np.pi * u, np.pi * (0.93 * v + 0.07 - 0.5)
        frill = np.exp(-(((latitude + 0.62) / 0.22) ** 2))
        lobes = (
            0.12
            + 0.06 * np.sin(7 * longitude + skirt[0])
            + 0.05 * np.sin(11 * longitude + skirt[1])
        )
        unit = np.stack(
            [
                np.cos(longitude) * np.cos(latitude),
                np.sin(longitude) * np.cos(latitude),
                np.sin(latitude),
            ],
            -1,
        )
        size = radius * (1 + 0.018 * rough(unit * radius) + frill * lobes)
        return tuple(np.moveaxis(np.asarray(centre) + size[..., None] * unit, -1, 0))

    def paint(u, v, points):
        return np.asarray(colour) * (1 + 0.05 * rough(points * 1.7))[..., None]

    return patch(surface, paint, 72, 40)


def ice_cream(rng):
    """A waffle cone with one to three scoops, sometimes with sprinkles, a cherry or a wafer."""
    count = int(rng.choice([1, 1, 2, 2, 3]))
    flavours = [str(rng.choice(list(FLAVOURS))) for _ in range(count)]
    height, radius = rng.uniform(0.85, 1.1), 0.3
    wafer = jitter(rng, (0.87, 0.62, 0.31))

    def waffle(u, v, points):
        grid = np.minimum(np.abs((8 * u + 5 * v) % 1 - 0.5), np.abs((8 * u - 5 * v) % 1 - 0.5))
        return mix(wafer * 0.68, wafer, grid * 5)

    cone = lathe(
        [
            (0.0, -height),
            (0.025, -height),
            (radius * 0.98, 0),
            (radius * 1.02, 0.03),
            (radius * 0.9, 0.03),
        ],
        waffle,
        sharp=True,
        columns=97,
        rows=80,
    )
    parts, level = [cone], 0.14
    for index, flavour in enumerate(flavours):
        size = 0.34 * 0.93**index
        offset = rng.normal(0, 0.015, 2) if index else (0, 0)
        parts.append(scoop(rng, (*offset, level), size, jitter(rng, FLAVOURS[flavour])))
        level += 1.32 * size
    crown = level - 1.32 * size + 0.98 * size
    extras = ""
    choice = rng.random()
    if choice < 0.25:
        cherry = jitter(rng, COLOURS["red"])
        parts.append(ellipsoid((0, 0, crown + 0.06), 0.085, cherry))
        parts.append(
            tube(
                [(0, 0, crown + 0.13), (0.02, 0.03, crown + 0.2), (0.06, 0.05, crown + 0.26)],
                0.012,
                COLOURS["green"],
            )
        )
        extras = " with a cherry on top"
    elif choice < 0.5:
        top = level - 1.32 * size
        for direction in golden_directions(90)[:36]:
            tint = COLOURS[str(rng.choice(["red", "yellow", "blue", "green", "pink", "white"]))]
            place = direction * size * 1.01
            grain = turn(
                ellipsoid((0, 0, 0), (0.035, 0.012, 0.012), tint, 8, 6),
                direction,
                rng.uniform(0, 3),
            )
            parts.append(move(grain, (place[0], place[1], place[2] + top)))
        extras = " with sprinkles"
    scoops = {1: "one scoop", 2: "two scoops", 3: "three scoops"}[count]
    return join(*parts), [
        "an ice-cream",
        "ice cream",
        f"an ice cream cone with {scoops}{extras}",
        f"{' and '.join(dict.fromkeys(flavours))} ice cream in a waffle cone",
    ]


def pancakes(rng):
    """A stack of round golden pancakes with butter and syrup running over the edge."""
    count = int(rng.integers(3, 7))
    golden, crust = jitter(rng, (0.93, 0.74, 0.42)), jitter(rng, (0.73, 0.44, 0.18))
    parts, level = [], 0.0
    for _ in range(count):
        thick, wide = rng.uniform(0.05, 0.065), rng.uniform(0.46, 0.5)
        blot = ripples(rng, 2.5)

        def paint(u, v, points, blot=blot):
            face = np.abs(v - 0.5) * 2
            return mix(golden, crust * (1 + 0.06 * blot(points))[..., None], (face - 0.22) / 0.14)

        centre = (*rng.normal(0, 0.02, 2), level + thick)
        parts.append(rounded_box(centre, (wide, wide, thick), (1.0, 0.45), paint, 64, 32))
        level += 1.9 * thick
    extras = []
    if rng.random() < 0.85:
        syrup = jitter(rng, (0.50, 0.22, 0.06))
        lobes, phase = rng.integers(5, 8), rng.uniform(0, 6, 2)

        def flow(u, v):
            angle = 2 * np.pi * u
            reach = (
                0.40 + 0.14 * np.sin(lobes * angle + phase[0]) + 0.05 * np.sin(3 * angle + phase[1])
            )
            radius = v * reach
            over = np.maximum(radius - 0.47, 0)
            ring = np.where(over > 0, 0.505, radius)
            height = level + 0.012 - 3.2 * over - 0.02 * np.clip((radius - 0.42) / 0.05, 0, 1)
            return ring * np.cos(angle), ring * np.sin(angle), height

        parts.append(patch(flow, syrup, 96, 40))
        extras.append("syrup")
    if rng.random() < 0.85:
        butter = rounded_box(
            (0, 0, level + 0.045), (0.11, 0.11, 0.045), 0.25, jitter(rng, (0.99, 0.90, 0.48))
        )
        parts.append(turn(butter, (0, 0, 1), rng.uniform(0, 1.5)))
        extras.append("butter")
    if rng.random() < 0.25:
        for _ in range(5):
            angle, radius = rng.uniform(0, 6.28), rng.uniform(0.18, 0.32)
            place = (radius * np.cos(angle), radius * np.sin(angle), level + 0.055)
            parts.append(ellipsoid(place, 0.055, jitter(rng, (0.25, 0.22, 0.55)), 14, 10))
        extras.append("blueberries")
    if rng.random() < 0.4:
        parts.append(
            lathe(
                [(0, -0.05), (0.4, -0.05), (0.68, 0.02), (0.66, 0.03), (0.4, -0.01), (0, -0.01)],
                jitter(rng, COLOURS["white"]),
                sharp=True,
            )
        )
        extras.append("a plate")
    with_extras = f" with {' and '.join(extras)}" if extras else ""
    return join(*parts), [
        "a stack of pancakes",
        "pancakes",
        f"a stack of golden pancakes{with_extras}",
        f"{['three', 'four', 'five', 'six'][count - 3]} fluffy pancakes{with_extras}",
    ]


def donut(rng):
    """A ring of dough under icing with a wavy edge and sprinkles."""
    name, icing = pick(rng, "pink", "dark brown", "white", "light blue", "yellow")
    dough, phase = jitter(rng, (0.86, 0.62, 0.34)), rng.uniform(0, 6, 2)
    base = torus((0, 0, 0), 0.31, 0.19, dough, squash=0.8)

    def glaze(u, v):
        angle = 2 * np.pi * u
        edge = 0.12 * np.sin(6 * angle + phase[0]) + 0.08 * np.sin(11 * angle + phase[1])
        around = np.pi * (v - 0.04) * 1.08 + (edge * np.abs(2 * v - 1) ** 3) * np.sign(2 * v - 1)
        radius, height = 0.31 + 0.2 * np.cos(around), 0.8 * 0.205 * np.sin(around) + 0.012
        return radius * np.cos(angle), radius * np.sin(angle), height

    parts = [base, patch(glaze, icing, 96, 28)]
    for _ in range(46):
        angle, around = rng.uniform(0, 6.28), rng.uniform(0.6, 2.5)
        radius, height = 0.31 + 0.2 * np.cos(around), 0.17 * np.sin(around) + 0.014
        tint = COLOURS[str(rng.choice(["red", "yellow", "blue", "green", "white", "orange"]))]
        grain = turn(
            ellipsoid((0, 0, 0), (0.028, 0.011, 0.011), tint, 8, 6), (0, 0, 1), rng.uniform(0, 3)
        )
        parts.append(move(grain, (radius * np.cos(angle), radius * np.sin(angle), height)))
    tilt = turn(join(*parts), (0, 1, 0), rng.choice([0, np.pi / 2, np.pi / 4]))
    flavour = {"dark brown": "chocolate"}.get(name, name)
    return tilt, ["a donut", "a doughnut", f"a donut with {flavour} icing and sprinkles"]


def cake(rng):
    """A round layered cake with icing drips, berries or candles."""
    name, icing = pick(rng, "pink", "white", "dark brown", "light blue", "cream")
    sponge, radius, height = jitter(rng, (0.88, 0.68, 0.40)), 0.42, rng.uniform(0.3, 0.45)

    def layers(u, v, points):
        band = np.abs((points[..., 2] / height * 3) % 1 - 0.5)
        return mix(icing, sponge, (band - 0.08) / 0.08)

    parts = [
        lathe([(0, 0), (radius, 0), (radius, height), (0, height)], layers, sharp=True, rows=90)
    ]
    phase = rng.uniform(0, 6, 2)

    def drip(u, v):
        angle = 2 * np.pi * u
        length = 0.1 + 0.05 * np.sin(9 * angle + phase[0]) + 0.03 * np.sin(14 * angle + phase[1])
        s = v * (radius + length + 0.02)
        ring = np.minimum(s, radius + 0.015)
        return (
            ring * np.cos(angle),
            ring * np.sin(angle),
            height + 0.02 - np.maximum(s - radius - 0.015, 0),
        )

    parts.append(patch(drip, icing, 110, 60))
    candles = rng.random() < 0.5
    count = int(rng.integers(4, 8))
    for index in range(count):
        angle = 2 * np.pi * index / count
        x, y = 0.28 * np.cos(angle), 0.28 * np.sin(angle)
        if candles:
            stick = jitter(
                rng, COLOURS[str(rng.choice(["red", "blue", "yellow", "green", "pink"]))]
            )
            parts.append(
                tube([(x, y, height), (x, y, height + 0.1), (x, y, height + 0.2)], 0.02, stick)
            )
            parts.append(
                ellipsoid((x, y, height + 0.24), (0.02, 0.02, 0.045), (1.0, 0.72, 0.2), 10, 8)
            )
        else:
            parts.append(
                ellipsoid((x, y, height + 0.07), 0.065, jitter(rng, COLOURS["red"]), 16, 12)
            )
    topping = "candles" if candles else "cherries"
    return join(*parts), [
        "a cake",
        "a birthday cake" if candles else "a cherry cake",
        f"a cake with {'chocolate' if name == 'dark brown' else name} icing and {topping}",
    ]


def cupcake(rng):
    """A fluted paper cup with a swirl of cream."""
    name, cream = pick(rng, "pink", "white", "dark brown", "light blue", "yellow")
    paper_name, paper = pick(rng, "red", "blue", "yellow", "turquoise", "brown")
    cup = lathe(
        [(0, 0), (0.24, 0), (0.34, 0.34), (0.0, 0.34)],
        lambda u, v, p: mix(paper, paper * 0.7, 0.5 + 0.5 * np.sin(2 * np.pi * 22 * u)),
        sharp=True,
        columns=133,
        wave=lambda angle, v: 1 + 0.025 * np.sin(22 * angle),
    )

    def swirl(u, v):
        angle = 2 * np.pi * u
        ridge = 1 + 0.13 * np.sin(5 * angle + 12 * v)
        radius = 0.4 * (1 - v) ** 0.75 * ridge
        return radius * np.cos(angle), radius * np.sin(angle), 0.32 + 0.5 * v

    parts = [cup, patch(swirl, cream, 90, 40)]
    if rng.random() < 0.6:
        parts.append(ellipsoid((0, 0, 0.86), 0.075, jitter(rng, COLOURS["red"])))
    flavour = {"dark brown": "chocolate"}.get(name, name)
    return join(*parts), ["a cupcake", f"a cupcake with {flavour} cream in a {paper_name} cup"]


def lollipop(rng):
    """A round swirled candy on a stick."""
    name, tint = pick(rng, "red", "pink", "green", "blue", "purple", "orange")

    def spiral(u, v, points):
        angle, radius = (
            np.arctan2(points[..., 2], points[..., 1]),
            np.hypot(points[..., 1], points[..., 2]),
        )
        return mix(tint, COLOURS["white"], 0.5 + 3 * np.sin(3 * angle + 16 * radius))

    disc = stretch(ellipsoid((0, 0, 0), 0.4, spiral, 96, 72), (0.25, 1, 1))
    stick = tube([(0, 0, -0.35), (0, 0, -0.7), (0, 0, -1.05)], 0.03, COLOURS["white"])
    return join(disc, stick), ["a lollipop", f"a {name} and white lollipop", "a candy on a stick"]


MODELS = {
    "strawberry": strawberry,
    "ice cream": ice_cream,
    "pancakes": pancakes,
    "donut": donut,
    "cake": cake,
    "cupcake": cupcake,
    "lollipop": lollipop,
}
