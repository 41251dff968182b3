"""Assemblies that several families use: wheels, eyes, four-legged bodies, heads of flowers."""

import numpy as np

from jaxphys.library.shapes import (
    ball,
    cylinder,
    hull,
    lathe,
    leaf,
    limb,
    petal,
    plate,
    refined,
    spray,
    tube,
)
from jaxphys.library.solids import Parts, Solid

# fmt: off


def wheels(places, radius: float, width: float) -> Parts:
    """Wheels on axles along y, their centres at `places` (K, 3)."""
    b = 0.18 * radius
    tyre = cylinder(radius, width, bevel=b).at(z=-0.5 * width).turn("x", 90)
    hub = cylinder(0.55 * radius, 1.12 * width).at(z=-0.56 * width).turn("x", 90)
    return dict(wheels=tyre.copies(places), hubs=hub.copies(places))


def pairs(xs, y: float, z: float) -> list[tuple[float, float, float]]:
    """Places left and right at each of `xs`."""
    return [(x, side * y, z) for x in xs for side in (-1, 1)]


def eyes(x: float, y: float, z: float, radius: float) -> Solid:
    """A pair of eyes looking forward."""
    return ball(radius, fine=4).at(x, y, z).both()


def beast(length=0.9, girth=0.22, legs=0.4, leg=0.07, neck=0.25, lift=45.0, head=0.16, snout=0.14,
          muzzle=0.6, paws=True, droop=15.0) -> tuple[Parts, np.ndarray]:
    """A four-legged body along x, its feet on z = 0, and the centre (3,) of its head.

    `girth` is the barrel's radius, `lift` [degrees] the neck's slope, `snout` the length of the
    muzzle, `muzzle` its radius as a share of the head's, `droop` how far it points down.
    """
    half, z = 0.5 * length, legs + 0.75 * girth
    low, high = z - girth, z + girth
    body = hull([(-half, 0.1 * girth, z, z + 0.2 * girth),
            (-0.92 * half, 0.75 * girth, low + 0.25 * girth, high),
                 (-0.5 * half, 0.98 * girth, low, high), (0.3 * half, 0.95 * girth, low,
                     high - 0.05 * girth),
                 (0.85 * half, 0.8 * girth, low + 0.15 * girth, high), (half, 0.1 * girth, z,
                     z + 0.3 * girth)])
    rise = np.deg2rad(lift)
    root = np.array([0.72 * half, 0, z + 0.25 * girth])
    centre = root + (neck + 0.5 * head) * np.array([np.cos(rise), 0, np.sin(rise)])
    down = np.deg2rad(droop)
    tip = centre + (0.6 * head + snout) * np.array([np.cos(down), 0, -np.sin(down)])
    skull = [ball(1.05 * head, 0.9 * head, 0.95 * head).at(*centre),
             limb(root, centre, 0.72 * girth, 0.62 * head)]
    nose = limb(centre, tip, 0.75 * head, muzzle * head)
    places = [(x, s * 0.55 * girth) for x in (-0.72 * half, 0.66 * half) for s in (-1, 1)]
    thick = [limb((x, y, z - 0.3 * girth), (x, y, leg), 1.25 * leg, 0.85 * leg) for x, y in places]
    if paws:
        thick += [ball(1.25 * leg, leg, 0.7 * leg, fine=8).at(x + 0.3 * leg, y, 0.7 * leg) for x,
            y in places]
    return dict(body=[body, *skull], muzzle=nose, legs=thick), centre


def tail(x: float, z: float, length: float, radius: float, up: float = 0.6, tip=None) -> Solid:
    """A tail from the back of a body, curving up."""
    tip = 0.6 * radius if tip is None else tip
    path = [(x, 0, z), (x - 0.45 * length, 0, z + 0.2 * up * length),
        (x - 0.8 * length, 0, z + up * length)]
    return tube(path, [radius, 0.9 * radius, tip])


def ears(head: np.ndarray, radius: float, long: float, wide: float, out=35.0, back=10.0) -> Solid:
    """Pointed ears on top of a head of that radius."""
    ear = lathe([(0, 0), (wide, 0.02), (0.75 * wide, 0.5 * long), (0, long)]).scale(0.45, 1, 1)
    placed = ear.at(z=0.78 * radius).turn("x", -out).turn("y", -back)
    return placed.at(*head).both() if abs(head[1]) < 1e-9 else placed.at(*head)


def round_ears(head: np.ndarray, radius: float, size: float, out=0.75) -> Solid:
    """Round ears beside the top of a head."""
    x, _, z = head
    return ball(0.4 * size, size, size, fine=8).at(x, out * radius, z + 0.85 * radius).both()


def daisy(radius: float, count: int, wide: float = 0.3, heart: float = 0.34) -> Parts:
    """A flower's head facing +z: a ring of petals and a raised middle."""
    one = petal(radius, 2 * wide * radius, 0.12, 0.2)
    ring = spray(one, 360 / count * np.arange(count), 8)
    middle = ball(heart * radius, heart * radius, 0.55 * heart * radius).at(z=0.1 * radius)
    return dict(petals=ring, middle=middle)


def tulip_cup(radius: float, height: float) -> Parts:
    """A closed cup of petals standing on the origin."""
    cup = [(0, 0), (0.75 * radius, 0.15 * height), (radius, 0.45 * height),
        (0.72 * radius, 0.85 * height)]
    blade = ball(0.16 * radius, 0.62 * radius, 0.5 * height, fine=8).turn("y", -12)
    petals = blade.at(0.68 * radius, 0, 0.52 * height).around(6)
    return dict(petals=[lathe([*cup, (0.5 * radius, 0.8 * height), (0, 0.75 * height)]), petals])


def bloom(rng: np.random.Generator, radius: float) -> Parts:
    """A rose's head on the origin: cupped petals in a golden spiral, the outer ones open."""
    solids = []
    for layer in range(4):
        count, share = 3 + layer, layer / 3
        wide, long = (0.55 + 0.3 * share) * radius, (1.25 - 0.15 * share) * radius
        one = petal(long, 1.5 * wide, 0.05 + 0.1 * share, -0.35 + 0.75 * share)
        angles = 360 / count * np.arange(count) + 137 * layer + rng.normal(0, 6, count)
        place = np.stack([np.cos(np.deg2rad(angles)), np.sin(np.deg2rad(angles)), 0 * angles], -1)
        petals = spray(one, angles, 86 - 34 * share, place=0.12 * share * radius * place)

        def tone(u, v, p, darkest=0.66 + 0.2 * share):
            return darkest + 0.2 * v

        solids.append(petals.shade(tone))
    heart = lathe([(0, 0), (0.3 * radius, 0.1 * radius), (0.3 * radius, radius), (0, 1.1 * radius)])
    return dict(petals=[*solids, heart.shade(lambda u, v, p: 0.62 + 0.1 * np.sin(30 * v + 12 * u))])


def foliage(length: float, width: float, angles, rises, place=(0, 0, 0), droop=0.3,
    sizes=1.0) -> Solid:
    """Pointed leaves with a lighter rib."""
    one = leaf(length, width, droop).shade(lambda u, v,
        p: 1.12 - 0.4 * np.minimum(np.abs(p[:, 1]) / width * 2, 0.6))
    return spray(one, angles, rises, place=place, sizes=sizes)


def stalk(z: float, length: float = 0.16, radius: float = 0.02, lean: float = 0.05) -> Solid:
    """The stalk on top of a fruit, from height z."""
    return tube([(0, 0, z), (0.3 * lean, 0, z + 0.5 * length), (lean, 0, z + length)],
        [radius, 0.8 * radius, 1.2 * radius])


def gable(length: float, width: float, rise: float, over: float = 0.05) -> Solid:
    """A saddle roof along x standing on z = 0."""
    w = 0.5 * width + over
    return plate(refined([(w, -rise / 3), (0, 2 * rise / 3), (-w, -rise / 3)]),
        length + 2 * over).at(z=rise / 3)


def tiles(size: float = 16):
    """Rows of tiles or planks, for `shade`."""
    return lambda u, v, p: 1 - 0.16 * ((p[:, 0] * size + p[:, 2] * size) % 1 < 0.12) - 0.1 * ((p[:,
                2] * size) % 1 < 0.2)
