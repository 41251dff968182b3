"""Burger, nigiri and other savoury food."""

import numpy as np

from .palette import COLOURS, golden_directions, jitter, mix, pick, ripples
from .surfaces import box, ellipsoid, join, lathe, leaf, move, patch, rounded_box, tube, turn


def burger(rng):
    """Bun, lettuce, tomato, cheese with drooping corners, patty, and a domed top bun with
    sesame.
    """
    bread, pale = jitter(rng, (0.85, 0.53, 0.21)), jitter(rng, (0.96, 0.82, 0.55))
    wide = 0.46
    crown_height = rng.uniform(0.26, 0.34)

    def crust(u, v, points):
        return mix(pale, bread, v * 4)

    parts, level = [], 0.0
    parts.append(
        lathe(
            [(0, 0), (wide * 0.9, 0), (wide, 0.06), (wide * 0.98, 0.13), (0, 0.13)],
            lambda u, v, p: mix(bread, pale, (p[..., 2] - 0.09) / 0.04),
        )
    )
    level = 0.13
    named = []

    def frill(height, amplitude, colour, reach):
        phase = rng.uniform(0, 6, 2)

        def surface(u, v):
            angle = 2 * np.pi * u
            wave = np.sin(13 * angle + phase[0]) + 0.6 * np.sin(7 * angle + phase[1])
            radius = v * reach * (1 + 0.03 * np.sin(5 * angle + phase[1]))
            z = height + amplitude * wave * v**4 - 0.03 * v**4
            return radius * np.cos(angle), radius * np.sin(angle), z

        def paint(u, v, points):
            return mix(colour * 0.85, colour * 1.15, v**6)

        return patch(surface, paint, 150, 14)

    def patty():
        nonlocal level
        meat, rough = jitter(rng, (0.36, 0.19, 0.11), 0.02), ripples(rng, 4.0)
        disc = rounded_box(
            (0, 0, level + 0.065),
            (wide * 1.02, wide * 1.02, 0.065),
            (1.0, 0.4),
            lambda u, v, p: meat * (1 + 0.14 * rough(p))[..., None],
            80,
            30,
        )
        disc = disc._replace(
            vertices=disc.vertices * (1 + 0.012 * rough(disc.vertices * 1.3))[:, None]
        )
        parts.append(disc)
        level += 0.125

    def cheese():
        nonlocal level
        yellow = jitter(rng, (0.99, 0.74, 0.13))
        reach = wide * 0.98

        def surface(u, v):
            x, y = reach * (2 * u - 1), reach * (2 * v - 1)
            droop = np.maximum(np.hypot(x, y) - wide * 0.98, 0)
            return (
                x - 0.45 * droop * np.sign(x),
                y - 0.45 * droop * np.sign(y),
                level + 0.012 - 0.75 * droop,
            )

        parts.append(turn(patch(surface, yellow, 40, 40), (0, 0, 1), rng.uniform(0, 1.5)))
        level += 0.02
        named.append("cheese")

    def tomato():
        nonlocal level
        red = jitter(rng, (0.86, 0.16, 0.10))
        for index in range(3):
            angle = 2.1 * index + rng.uniform(0, 0.4)
            place = (0.21 * np.cos(angle), 0.21 * np.sin(angle), level + 0.025)
            parts.append(rounded_box(place, (0.25, 0.25, 0.026), (1.0, 0.5), red, 40, 12))
        level += 0.05
        named.append("tomato")

    if rng.random() < 0.5:
        parts.append(frill(level + 0.03, 0.022, jitter(rng, (0.42, 0.74, 0.22)), wide * 1.12))
        level += 0.035
    patty()
    cheese()
    if rng.random() < 0.25:
        patty()
        cheese()
    if rng.random() < 0.7:
        tomato()
    parts.append(frill(level + 0.03, 0.024, jitter(rng, (0.42, 0.74, 0.22)), wide * 1.15))
    named.append("lettuce")
    level += 0.045
    top = level
    parts.append(
        lathe(
            [
                (0, top),
                (wide * 0.97, top),
                (wide * 1.03, top + 0.07),
                (wide * 0.85, top + 0.62 * crown_height),
                (wide * 0.45, top + 0.94 * crown_height),
                (0, top + crown_height),
            ],
            lambda u, v, p: mix(pale, bread, (p[..., 2] - top) / 0.06),
        )
    )
    seed = jitter(rng, (0.99, 0.93, 0.76))
    for direction in golden_directions(110)[:46]:
        ring = np.hypot(direction[0], direction[1])
        place = (
            direction[0] * wide * 0.98,
            direction[1] * wide * 0.98,
            top + 0.012 + crown_height * (1 - ring**2.6) ** 0.62,
        )
        grain = ellipsoid((0, 0, 0), (0.022, 0.014, 0.012), seed, 8, 6)
        parts.append(move(turn(grain, (0, 0, 1), rng.uniform(0, 3)), place))
    return join(*parts), [
        "a burger",
        "a hamburger",
        f"a hamburger with {', '.join(dict.fromkeys(named))} and a sesame bun",
        "a cheeseburger",
    ]


def nigiri(rng):
    """A slice of orange salmon with white stripes draped over a pillow of rice; the long side faces
    +x.
    """
    long, wide, high = 0.5, rng.uniform(0.21, 0.25), rng.uniform(0.17, 0.2)
    rice, salmon = jitter(rng, (0.96, 0.95, 0.91), 0.015), jitter(rng, (0.97, 0.47, 0.22))
    fat = mix(salmon, (1.0, 0.88, 0.78), np.array(0.8))
    parts = [rounded_box((0, 0, 0), (wide, long * 0.94, high), (0.55, 0.6), rice * 0.93, 64, 40)]
    for direction in golden_directions(420):
        ring = np.sign(direction) * np.abs(direction) ** 0.6
        place = ring * (wide, long * 0.94, high)
        grain = ellipsoid((0, 0, 0), (0.016, 0.034, 0.014), rice * rng.uniform(0.95, 1.04), 8, 6)
        grain = turn(turn(grain, (0, 0, 1), rng.uniform(0, 3)), (1, 0, 0), rng.uniform(-0.6, 0.6))
        parts.append(move(grain, place))
    stripes, slant, bend = rng.uniform(6.0, 8.5), rng.uniform(0.5, 1.0), rng.uniform(0, 6)
    thick = rng.uniform(0.05, 0.07)

    def paint(u, v, points):
        along = points[..., 1] / long + slant * np.abs(points[..., 0] / wide + 0.25)
        line = np.cos(np.pi * (stripes * along + 0.4 * np.sin(3 * points[..., 1] + bend)))
        return mix(salmon, fat, (line - 0.72) / 0.2)

    def slab(level):
        def surface(u, v):
            across, along = 2 * u - 1, 2 * v - 1
            width = (wide + 0.01 + 0.5 * level) * (1 - 0.12 * along**2)
            x, y = width * np.sin(1.25 * across) / np.sin(1.25), (long * 1.0 + 0.5 * level) * along
            drop = 0.13 * np.abs(across) ** 2.6 + 0.11 * np.abs(along) ** 4
            return x, y, high + 0.03 + level - drop + 0.008 * np.sin(9 * along + bend)

        return surface

    top, bottom = slab(thick), slab(0.0)

    def edge(u, v):
        # Once around the rim of the square of parameters, from the upper face to the lower one.
        side, at = np.floor(np.minimum(u * 4, 3.999)), (u * 4) % 1
        at = np.where(u >= 1, 1.0, at)
        a = np.select(
            [side == 0, side == 1, side == 2, side == 3], [at, 1 + 0 * at, 1 - at, 0 * at]
        )
        b = np.select(
            [side == 0, side == 1, side == 2, side == 3], [0 * at, at, 1 + 0 * at, 1 - at]
        )
        above, below = np.stack(top(a, b)), np.stack(bottom(a, b))
        return tuple(above * (1 - v) + below * v)

    parts += [patch(top, paint, 64, 120), patch(bottom, salmon, 20, 20), patch(edge, paint, 161, 4)]
    return join(*parts), [
        "a salmon nigiri",
        "salmon nigiri",
        "a piece of salmon nigiri sushi, orange fish on white rice",
        "salmon sushi on rice",
    ]


def hot_dog(rng):
    """A sausage in a split bun under a wave of mustard."""
    bread, meat = jitter(rng, (0.87, 0.60, 0.28)), jitter(rng, (0.68, 0.25, 0.14))
    name, sauce = pick(rng, "yellow", "red")
    halves = [
        rounded_box((0.13 * s, 0, 0), (0.15, 0.5, 0.14), (0.6, 0.8), bread, 48, 28) for s in (-1, 1)
    ]
    sausage = tube(
        [(0, -0.6, 0.1), (0, -0.52, 0.12), (0, 0, 0.13), (0, 0.52, 0.12), (0, 0.6, 0.1)],
        [0.05, 0.1, 0.105, 0.1, 0.05],
        meat,
        rows=50,
    )
    along = np.linspace(-0.5, 0.5, 34)
    wave = np.stack([0.05 * np.sin(26 * along), along, 0.235 + 0 * along], -1)
    return join(*halves, sausage, tube(wave, 0.02, sauce, rows=160)), [
        "a hot dog",
        f"a hot dog with {'mustard' if name == 'yellow' else 'ketchup'}",
    ]


def pizza(rng):
    """A slice of pizza with pepperoni lying with its tip to the front."""
    crust, cheese = jitter(rng, (0.80, 0.55, 0.27)), jitter(rng, (0.98, 0.79, 0.32))

    def face(u, v):
        angle, radius = (u - 0.5) * 0.8, v
        return 0.5 - radius * np.cos(angle), radius * np.sin(angle), 0.03 + 0 * u

    blot = ripples(rng, 3.0)
    parts = [
        patch(face, lambda u, v, p: mix(cheese, (0.86, 0.35, 0.12), 0.3 * blot(p)), 40, 60),
        patch(lambda u, v: (*face(u, v)[:2], -0.02 + 0 * u), crust, 20, 20),
    ]
    for angle in (-0.4, 0.4):
        parts.append(
            patch(
                lambda u, v, a=angle: (0.5 - u * np.cos(a), u * np.sin(a), -0.02 + 0.05 * v),
                crust,
                20,
                3,
            )
        )
    bend = np.linspace(-0.43, 0.43, 12)
    parts.append(
        tube(np.stack([0.5 - np.cos(bend), np.sin(bend), 0.03 + 0 * bend], -1), 0.065, crust)
    )
    for distance, angle in (
        (0.35, 0.0),
        (0.58, 0.2),
        (0.62, -0.22),
        (0.84, 0.05),
        (0.85, -0.3),
        (0.84, 0.32),
    ):
        place = (0.5 - distance * np.cos(angle), distance * np.sin(angle), 0.036)
        parts.append(
            rounded_box(
                place, (0.085, 0.085, 0.015), (1.0, 0.4), jitter(rng, (0.74, 0.16, 0.10)), 24, 8
            )
        )
        if rng.random() < 0.4:
            parts.append(
                leaf(
                    (place[0], place[1], 0.05),
                    (rng.normal(), rng.normal(), 0.1),
                    0.1,
                    0.06,
                    COLOURS["green"],
                )
            )
    whole = turn(join(*parts), (0, 1, 0), rng.choice([0.0, -0.5]))
    return whole, ["a slice of pizza", "a pizza", "a pizza slice with pepperoni and cheese"]


def egg(rng):
    """A fried egg or a whole one."""
    if rng.random() < 0.5:
        phase = rng.uniform(0, 6, 2)

        def white(u, v):
            angle = 2 * np.pi * u
            radius = v * (
                0.45 + 0.04 * np.sin(3 * angle + phase[0]) + 0.03 * np.sin(5 * angle + phase[1])
            )
            return radius * np.cos(angle), radius * np.sin(angle), 0.05 * (1 - v**6)

        yolk = ellipsoid((0.02, 0.03, 0.06), (0.17, 0.17, 0.11), jitter(rng, (0.99, 0.70, 0.10)))
        return join(patch(white, COLOURS["white"], 64, 24), yolk), [
            "a fried egg",
            "a fried egg with a yellow yolk",
        ]
    name, shell = pick(rng, "white", "beige", "light brown")
    body = lathe(
        [(0, -0.5), (0.28, -0.36), (0.37, -0.1), (0.3, 0.22), (0.15, 0.43), (0, 0.5)], shell
    )
    return body, ["an egg", f"a {name} egg"]


def bread(rng):
    """A loaf with scored cuts."""
    crust = jitter(rng, (0.78, 0.48, 0.20))

    def paint(u, v, points):
        line = np.cos(2 * np.pi * (3.2 * points[..., 1] + 0.8 * points[..., 0]))
        return mix(crust, (0.97, 0.86, 0.62), (line - 0.8) / 0.1 * (points[..., 2] > 0.06))

    return rounded_box((0, 0, 0), (0.22, 0.5, 0.18), (0.8, 0.8), paint, 96, 64), [
        "a loaf of bread",
        "bread",
    ]


def cheese(rng):
    """A yellow wedge with holes."""
    yellow = jitter(rng, (0.99, 0.80, 0.26))
    holes = rng.uniform([-0.5, -0.4, -0.3], [0.5, 0.4, 0.3], (26, 3))
    sizes = rng.uniform(0.04, 0.09, 26)

    def paint(u, v, points):
        gap = (np.linalg.norm(points[..., None, :] - holes, axis=-1) - sizes).min(-1)
        return mix(yellow * 0.72, yellow, 0.5 + gap / 0.012)

    def roof(z):
        return lambda u, v: (-0.5 + u, (v - 0.5) * 0.85 * u, z + 0 * u)

    walls = [
        patch(lambda u, v, s=s: (-0.5 + u, s * 0.425 * u, 0.3 * (2 * v - 1)), paint, 60, 40)
        for s in (-1, 1)
    ]
    back = patch(lambda u, v: (0.5 + 0 * u, 0.425 * (2 * u - 1), 0.3 * (2 * v - 1)), paint, 50, 40)
    return join(patch(roof(0.3), paint, 60, 50), patch(roof(-0.3), yellow, 4, 4), *walls, back), [
        "a piece of cheese",
        "a wedge of yellow cheese with holes",
    ]


def maki(rng):
    """A sushi roll: rice in a dark sheet with a coloured middle."""
    _, filling = pick(rng, "orange", "green", "red", "yellow")
    rice, speck = COLOURS["white"], ripples(rng, 9.0)
    side = lathe([(0.38, -0.22), (0.4, 0.22)], jitter(rng, (0.10, 0.16, 0.12), 0.01), sharp=True)

    def face(u, v, points):
        return mix(
            filling, np.asarray(rice) * (1 + 0.06 * speck(points))[..., None], (v - 0.38) / 0.04
        )

    lids = [
        patch(
            lambda u, v, z=z: (
                0.39 * v * np.cos(2 * np.pi * u),
                0.39 * v * np.sin(2 * np.pi * u),
                z + 0 * u,
            ),
            face,
            48,
            40,
        )
        for z in (-0.22, 0.22)
    ]
    return join(side, *lids), ["a sushi roll", "maki sushi with rice and seaweed", "a maki roll"]


def sandwich(rng):
    """Two slices of bread around lettuce, ham and cheese."""
    crumb = jitter(rng, (0.96, 0.86, 0.62))
    layers = [
        ("crumb", crumb, 0.08),
        ("green", (0.45, 0.75, 0.25), 0.03),
        ("ham", (0.95, 0.62, 0.60), 0.04),
        ("cheese", (0.99, 0.78, 0.2), 0.03),
        ("crumb", crumb, 0.08),
    ]
    parts, level = [], 0.0
    for kind, colour, half in layers:
        reach = 0.4 if kind == "crumb" else 0.42
        parts.append(
            rounded_box(
                (0, 0, level + half),
                (reach, reach, half),
                (0.25, 0.35),
                jitter(rng, colour),
                48,
                14,
            )
        )
        level += 2 * half
    return join(*parts), ["a sandwich", "a sandwich with ham, cheese and lettuce"]


def fries(rng):
    """A red paper box of yellow chips."""
    red = jitter(rng, COLOURS["red"])
    parts = [box((0, 0, 0), (0.14, 0.26, 0.3), red)]
    for _ in range(26):
        x, y = rng.uniform(-0.1, 0.1), rng.uniform(-0.22, 0.22)
        chip = box((0, 0, 0), (0.032, 0.032, 0.26), jitter(rng, (0.98, 0.80, 0.30)))
        chip = turn(turn(chip, (1, 0, 0), rng.normal(0, 0.12)), (0, 1, 0), rng.normal(0, 0.08))
        parts.append(move(chip, (x, y, 0.3 + rng.uniform(-0.05, 0.12))))
    return join(*parts), ["french fries", "french fries in a red box"]


MODELS = {
    "burger": burger,
    "salmon nigiri": nigiri,
    "hot dog": hot_dog,
    "pizza": pizza,
    "egg": egg,
    "bread": bread,
    "cheese": cheese,
    "sushi roll": maki,
    "sandwich": sandwich,
    "fries": fries,
}
