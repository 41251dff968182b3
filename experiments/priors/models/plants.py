"""Mushroom, cactus, trees and potted plant, and the list of everything that grows."""

import numpy as np

from . import flowers, fruit
from .palette import COLOURS, article, golden_directions, jitter, mix, pick, ripples
from .surfaces import ellipsoid, join, lathe, leaf, move, stretch, tube


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
            move(
                stretch(flowers.daisy(rng, COLOURS["pink"], COLOURS["yellow"]), 0.22), (0, 0, 0.57)
            )
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


MODELS = {
    "rose": flowers.rose,
    "vase with flowers": flowers.vase_of_flowers,
    "flower": flowers.flower,
    "apple": fruit.apple,
    "round fruit": fruit.round_fruit,
    "cherry": fruit.cherry,
    "banana": fruit.banana,
    "citrus": fruit.citrus,
    "pear": fruit.pear,
    "watermelon": fruit.watermelon,
    "pineapple": fruit.pineapple,
    "carrot": fruit.carrot,
    "pumpkin": fruit.pumpkin,
    "mushroom": mushroom,
    "cactus": cactus,
    "tree": tree,
    "potted plant": potted_plant,
    "grapes": fruit.grapes,
}
