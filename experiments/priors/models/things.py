"""Can, microphone, sponge, guitar and teddy bear."""

import numpy as np
from scipy.spatial import cKDTree

from .palette import COLOURS, article, jitter, mix, pick, ripples
from .surfaces import box, ellipsoid, extrude, join, lathe, move, rounded_box, smooth, tube, turn


def can(rng):
    """A drinks can with a coloured label, or a ribbed food tin with a paper label."""
    metal = jitter(rng, COLOURS["silver"], 0.02)
    name, label = pick(
        rng, "red", "blue", "green", "orange", "yellow", "purple", "pink", "turquoise", "black"
    )
    second = np.asarray(COLOURS["white"]) if rng.random() < 0.7 else pick(rng)[1]
    start, style = rng.uniform(0, 6), int(rng.integers(0, 4))

    def design(u, level):
        if style == 0:
            return np.abs(level - 0.5 - 0.16 * np.sin(2 * np.pi * u * 2 + start)) < 0.07
        if style == 1:
            return (np.abs(level - 0.3) < 0.04) | (np.abs(level - 0.7) < 0.04)
        if style == 2:
            return ((u * 2 + start) % 1 - 0.5) ** 2 * 6 + (level - 0.5) ** 2 * 6 < 0.35
        return np.abs((u * 4 + 0.9 * level + start) % 1 - 0.5) < 0.13

    soda = rng.random() < 0.65
    if soda:
        radius, height = 0.26, rng.uniform(0.9, 1.0)
        profile = [
            (0, 0.02),
            (0.19, 0.02),
            (0.2, 0),
            (radius, 0.07),
            (radius, height - 0.1),
            (0.215, height - 0.02),
            (0.22, height),
            (0.2, height),
            (0.19, height - 0.025),
            (0, height - 0.025),
        ]
        low, high = 0.06, height - 0.09

        def paint(u, v, points):
            inside = (
                (points[..., 2] > low)
                & (points[..., 2] < high)
                & (np.hypot(points[..., 0], points[..., 1]) > 0.2)
            )
            level = (points[..., 2] - low) / (high - low)
            return mix(
                metal, mix(label, second, design(u, level).astype(float)), inside.astype(float)
            )

        body = lathe(profile, paint, sharp=True, columns=97, rows=120)
        hole = rounded_box(
            (0.09, 0, height - 0.024), (0.06, 0.075, 0.006), (1.0, 0.5), (0.08, 0.08, 0.09), 20, 8
        )
        tab = rounded_box(
            (-0.02, 0, height - 0.006), (0.09, 0.045, 0.008), (0.8, 0.5), metal * 0.78, 20, 8
        )
        captions = [
            "a can",
            "a soda can",
            f"{article(name)} soda can",
            f"{article(name)} aluminium drink can",
        ]
        return join(body, hole, tab), captions
    radius, height = rng.uniform(0.34, 0.4), rng.uniform(0.75, 1.0)
    profile = [
        (0, 0.03),
        (radius * 0.93, 0.03),
        (radius * 0.95, 0),
        (radius * 1.03, 0.01),
        (radius, 0.05),
        (radius, height - 0.05),
        (radius * 1.03, height - 0.01),
        (radius * 0.96, height),
        (radius * 0.94, height - 0.03),
        (0, height - 0.03),
    ]

    def paint_tin(u, v, points):
        level = points[..., 2] / height
        inside = (
            (level > 0.1)
            & (level < 0.9)
            & (np.hypot(points[..., 0], points[..., 1]) > 0.95 * radius)
        )
        ring = 0.9 + 0.1 * np.cos(60 * np.hypot(points[..., 0], points[..., 1]))
        return mix(
            metal * ring[..., None],
            mix(label, second, design(u, level).astype(float)),
            inside.astype(float),
        )

    return lathe(profile, paint_tin, sharp=True, columns=97, rows=120), [
        "a can",
        "a tin can",
        f"a tin can with {article(name)} label",
        "canned food",
    ]


def microphone(rng):
    """A hand microphone with a wire-mesh ball, upright or on a round stand."""
    name, grip = pick(rng, "black", "black", "black", "silver", "red", "golden", "blue")
    mesh_grey, ring = jitter(rng, (0.66, 0.67, 0.70), 0.03), jitter(rng, (0.30, 0.30, 0.32), 0.02)
    size = rng.uniform(0.19, 0.23)

    def wire(u, v, points):
        grid = np.maximum(np.cos(2 * np.pi * 18 * u), np.cos(2 * np.pi * 12 * v))
        return mix(mesh_grey * 0.55, mesh_grey, (grid + 0.1) * 1.2)

    head = ellipsoid((0, 0, 0.42), (size, size, size * rng.uniform(1.0, 1.15)), wire, 145, 97)
    band = lathe([(0, 0.40), (size * 1.05, 0.40), (size * 1.05, 0.45), (0, 0.45)], ring, sharp=True)
    collar = lathe(
        [(0, 0.16), (0.1, 0.16), (size * 0.93, 0.31), (0, 0.31)], ring * 1.25, sharp=True
    )
    handle = lathe(
        [(0, -0.62), (0.07, -0.62), (0.08, -0.58), (0.115, 0.17), (0, 0.17)], grip, sharp=True
    )
    switch = rounded_box((0.1, 0, -0.02), (0.02, 0.022, 0.05), 0.4, COLOURS["silver"], 14, 10)
    whole = join(head, band, collar, handle, switch)
    if rng.random() < 0.25:
        whole = turn(move(whole, (0, 0, 0.15)), (0, 1, 0), 0.35)
        pole = tube([(-0.05, 0, -1.0), (-0.05, 0, -0.6), (-0.08, 0, -0.25)], 0.03, ring)
        base = lathe(
            [(0, -1.06), (0.34, -1.06), (0.32, -1.0), (0, -0.98)], COLOURS["black"], sharp=True
        )
        return join(whole, pole, base), [
            "a microphone",
            "a microphone on a stand",
            f"a {name} microphone on a stand",
        ]
    lean = rng.normal(0, 0.12, 2)
    whole = turn(turn(whole, (1, 0, 0), lean[0]), (0, 1, 0), lean[1])
    return whole, [
        "a microphone",
        f"a {name} microphone",
        "a singer's microphone with a metal mesh head",
    ]


def sponge(rng):
    """A porous kitchen sponge, some with a green scouring side; the broad side faces +x."""
    name, foam = pick(
        rng, "yellow", "yellow", "yellow", "pink", "light blue", "orange", "light green"
    )
    half = np.array([rng.uniform(0.14, 0.2), 0.5, rng.uniform(0.28, 0.34)])
    scourer = rng.random() < 0.5
    pad, rough = jitter(rng, (0.18, 0.46, 0.22)), ripples(rng, 12.0)
    count = 260
    pores = rng.uniform(-half, half, (count, 3))
    axis, side = rng.choice([0, 0, 1, 2, 2], count), rng.choice([-1, 1], count)
    pores[np.arange(count), axis] = side * half[axis]
    sizes = rng.uniform(0.010, 0.034, count) * rng.choice([1, 1, 1.5], count)

    tree = cKDTree(pores)

    def depth(points):
        distance, index = tree.query(points, k=5)
        return np.clip(1.3 - (distance / sizes[index]).min(-1), 0, 1)

    def paint(u, v, points):
        colour = mix(foam, np.asarray(foam) * 0.62, depth(points) * 2.5)
        if not scourer:
            return colour
        felt = pad * (1 + 0.12 * rough(points))[..., None]
        return mix(colour, felt, (points[..., 2] > 0.62 * half[2]).astype(float))

    block = box((0, 0, 0), half, paint, divisions=90)
    # Soft edges: points near a corner are drawn in a little.
    excess = np.maximum(np.abs(block.vertices) / half - 0.82, 0) / 0.18
    block = block._replace(
        vertices=block.vertices * (1 - 0.02 * np.maximum((excess**2).sum(1) - 1, 0))[:, None]
    )
    flat = rng.random() < 0.5
    extra = " with a green scouring pad" if scourer else ""
    return turn(block, (0, 1, 0), np.pi / 2) if flat else block, [
        "a sponge",
        f"{article(name)} sponge",
        f"{article(name)} kitchen sponge with holes{extra}",
    ]


def guitar(rng):
    """An acoustic or electric guitar standing upright, strings to the front."""
    acoustic = rng.random() < 0.6
    if acoustic:
        name, wood = pick(rng, "light brown", "orange", "brown", "golden", "red")
        right = [
            (0.0, -0.5),
            (0.2, -0.48),
            (0.33, -0.32),
            (0.34, -0.18),
            (0.235, 0.02),
            (0.25, 0.15),
            (0.2, 0.28),
            (0.08, 0.33),
            (0.0, 0.33),
        ]
    else:
        name, wood = pick(rng, "red", "black", "blue", "white", "orange", "turquoise")
        right = [
            (0.0, -0.48),
            (0.16, -0.47),
            (0.28, -0.34),
            (0.28, -0.2),
            (0.2, -0.04),
            (0.22, 0.12),
            (0.26, 0.24),
            (0.18, 0.22),
            (0.08, 0.12),
            (0.0, 0.12),
        ]
    half = smooth(right, 60)
    left = half[::-1] * (-1, 1)
    if not acoustic:
        left = smooth(
            [
                (0.0, 0.12),
                (-0.08, 0.14),
                (-0.2, 0.34),
                (-0.28, 0.34),
                (-0.22, 0.1),
                (-0.2, -0.04),
                (-0.28, -0.2),
                (-0.28, -0.34),
                (-0.16, -0.47),
                (0.0, -0.48),
            ],
            60,
        )
    outline = np.concatenate([half[:-1], left[:-1]])
    thick = 0.2 if acoustic else 0.1
    dark = jitter(rng, (0.26, 0.14, 0.08), 0.02)
    plate = COLOURS["white"] if name != "white" else COLOURS["black"]

    def paint(u, v, points):
        front = points[..., 0] > 0.3 * thick
        y, z = points[..., 1], points[..., 2]
        if acoustic:
            hole, rim = np.hypot(y, z - 0.06) < 0.09, np.hypot(y, z - 0.06) < 0.115
            colour = mix(mix(wood, dark, (v > 0.965) * 1.0), dark * 0.9, (front & rim) * 0.7)
            return mix(mix(colour, dark, (~front) * 0.45), (0.05, 0.04, 0.03), (front & hole) * 1.0)
        guard = front & (np.hypot((y + 0.04) / 0.75, z + 0.02) < 0.2)
        return mix(wood, plate, guard * 1.0)

    body = extrude(outline, thick, paint, puff=0.15 if acoustic else 0.3, rows=48)
    face = 0.5 * thick
    neck_colour = jitter(rng, (0.42, 0.25, 0.13), 0.02)
    top = 0.78
    parts = [
        body,
        box((face, 0, 0.5 * (top + 0.1)), (0.028, 0.042, 0.5 * (top - 0.1)), neck_colour),
        box((face + 0.03, 0, 0.5 * (top + 0.1)), (0.006, 0.04, 0.5 * (top - 0.1)), dark),
        extrude(
            [
                (0.0, 0.17),
                (-0.085, 0.16),
                (-0.07, 0.0),
                (-0.045, -0.16),
                (0.045, -0.16),
                (0.07, 0.0),
                (0.085, 0.16),
            ],
            0.05,
            dark if acoustic else wood,
        ),
        box((face + 0.012, 0, -0.2), (0.02, 0.12, 0.022), dark if acoustic else COLOURS["silver"]),
    ]
    parts[3] = move(parts[3], (face, 0, top + 0.12))
    for fret in np.linspace(0.2, top - 0.05, 7):
        parts.append(box((face + 0.037, 0, fret), (0.002, 0.038, 0.004), COLOURS["silver"]))
    for string in np.linspace(-0.028, 0.028, 6):
        parts.append(
            box(
                (face + 0.042, string, 0.5 * (top - 0.2)),
                (0.002, 0.0016, 0.5 * (top + 0.2)),
                (0.8, 0.76, 0.66),
            )
        )
    for side in (-1, 1):
        for level in (0.03, 0.11, 0.19):
            parts.append(
                ellipsoid((face, 0.095 * side, top + level), 0.022, COLOURS["silver"], 10, 8)
            )
    if not acoustic:
        for level in (-0.1, 0.04):
            parts.append(box((face + 0.012, 0, level), (0.014, 0.075, 0.022), (0.12, 0.12, 0.13)))
    kind = "acoustic" if acoustic else "electric"
    shade = "wooden" if acoustic and name != "red" else name
    return join(*parts), ["a guitar", f"an {kind} guitar", f"{article(shade)} {kind} guitar"]


def teddy_bear(rng):
    """A sitting plush bear with a muzzle, ears, paw pads and often a bow tie, facing +x."""
    name, fur = pick(rng, "brown", "light brown", "light brown", "golden", "beige", "white", "pink")
    pale = mix(fur, (1.0, 0.93, 0.80), np.array(0.55))
    fuzz = ripples(rng, 7.0)

    def plush(colour):
        return lambda u, v, p: np.asarray(colour) * (1 + 0.05 * fuzz(p))[..., None]

    head = rng.uniform(0.27, 0.31)
    parts = [
        ellipsoid((0, 0, 0), (0.27, 0.29, 0.33), plush(fur), 48, 32),
        ellipsoid((0.12, 0, -0.02), (0.18, 0.2, 0.24), plush(pale), 40, 28),
        ellipsoid((0.02, 0, 0.5), (head * 0.94, head * 1.08, head), plush(fur), 48, 32),
        ellipsoid((0.02 + head * 0.8, 0, 0.44), (0.12, 0.14, 0.11), plush(pale), 32, 20),
        ellipsoid(
            (0.02 + head * 0.8 + 0.105, 0, 0.485), (0.035, 0.05, 0.035), (0.1, 0.07, 0.06), 16, 12
        ),
        tube(
            [
                (head * 0.8 + 0.12, -0.05, 0.385),
                (head * 0.8 + 0.135, 0, 0.405),
                (head * 0.8 + 0.12, 0.05, 0.385),
            ],
            0.01,
            (0.15, 0.1, 0.08),
            sides=8,
            rows=12,
        ),
    ]
    for side in (-1, 1):
        parts += [
            ellipsoid(
                (0, 0.23 * side, 0.5 + 0.88 * head), (0.07, 0.115, 0.115), plush(fur), 28, 18
            ),
            ellipsoid(
                (0.04, 0.23 * side, 0.5 + 0.88 * head), (0.05, 0.075, 0.075), plush(pale), 24, 16
            ),
            ellipsoid((0.02 + head * 0.82, 0.115 * side, 0.56), 0.034, (0.06, 0.05, 0.05), 14, 10),
            turn(
                ellipsoid((0.06, 0.34 * side, 0.02), (0.11, 0.11, 0.25), plush(fur), 32, 20),
                (1, 0, 0),
                0.28 * side,
            ),
            ellipsoid((0.27, 0.2 * side, -0.27), (0.26, 0.13, 0.13), plush(fur), 36, 20),
            ellipsoid((0.47, 0.22 * side, -0.25), (0.09, 0.14, 0.15), plush(fur), 28, 20),
            ellipsoid((0.53, 0.22 * side, -0.25), (0.045, 0.09, 0.1), plush(pale), 24, 16),
        ]
    captions = ["a teddy bear", f"{article(name)} teddy bear", "a plush teddy bear toy"]
    if rng.random() < 0.55:
        ribbon_name, ribbon = pick(rng, "red", "blue", "green", "purple", "yellow")
        for side in (-1, 1):
            parts.append(ellipsoid((0.25, 0.1 * side, 0.25), (0.045, 0.1, 0.065), ribbon, 20, 12))
        parts.append(ellipsoid((0.28, 0, 0.25), 0.042, np.asarray(ribbon) * 0.85, 14, 10))
        captions.append(f"{article(name)} teddy bear with {article(ribbon_name)} bow tie")
    return join(*parts), captions


MODELS = {
    "can": can,
    "microphone": microphone,
    "sponge": sponge,
    "guitar": guitar,
    "teddy bear": teddy_bear,
}
