"""Furniture and lamps; the seat or the doors face +x."""

from itertools import pairwise

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    sectors,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cushion,
    cylinder,
    lathe,
    limb,
    oblong,
    ring,
    rod,
    slab,
    tube,
)
from jaxphys.library.solids import Solid

# fmt: off

WOOD = "wooden|brown|light brown|white"


def legs_at(x: float, y: float, height: float, radius: float, splay: float = 0.0,
        square: bool = False) -> Solid:
    """Four legs from z = 0 up to `height`, at plus and minus x and y."""
    one = [rod((x + splay, y + splay, 0), (x, y, height), 0.8 * radius,
        radius)] if not square else [block(2 * radius, 2 * radius, height).at(x, y, 0.5 * height)]
    return one[0].both("y").both("x")


@kind("chair", "furniture", also=("wooden chair", "dining chair"),
    colours=dict(seat=WOOD, back="=seat", legs="=seat", cushion="red|blue|green"),
    sizes=dict(legs="short 0.6|1|long 1.4", back="low 0.7|1|tall 1.35"),
    counts=dict(slats="2|3|4|5"),
    extras=dict(cushion=0.25))
def chair(o, rng):
    z, b = 0.42 * o.legs, 0.46 * o.back
    posts = rod((-0.2, 0.19, z), (-0.26, 0.19, z + b), 0.026).both()
    slats = rod((-0.2, 0, z), (-0.255, 0, z + b - 0.04),
        0.017).copies([(0, y, 0) for y in np.linspace(-0.15, 0.15, o.slats + 2)[1:-1]])
    return dict(seat=block(0.46, 0.46, 0.05, 0.03).at(z=z),
        back=[posts, slats, block(0.04, 0.46, 0.1, 0.02).turn("y", -7).at(-0.255, 0, z + b)],
        legs=[legs_at(0.19, 0.19, z, 0.026, 0.02),
        rod((-0.2, 0.2, 0.4 * z), (0.2, 0.2, 0.4 * z), 0.014).both()],
        cushion=cushion(0.42, 0.42, 0.09, 3).at(z=z + 0.05) if o.cushion else [], slats=[])


@kind("stool", "furniture", also=("bar stool", "round stool"),
    colours=dict(seat="wooden|red|black|brown", legs="wooden|silver|black"),
    counts=dict(legs="3|4"),
    forms=dict(height="low 0.65|1|tall 1.35"))
def stool(o, rng):
    n, z = o.legs, 0.7 * o.height
    return dict(seat=cylinder(0.24, 0.07, bevel=0.02).at(z=z),
        legs=[rod((0.24, 0, 0), (0.14, 0, z), 0.024, 0.03).turn("z", 45).around(n),
        ring(0.2, 0.014).at(z=0.32 * z)])


@kind("table", "furniture", also=("dining table", "wooden table"),
    colours=dict(top=WOOD, legs="=top", tablecloth="white|red|light blue"),
    sizes=dict(legs="short 0.6|1|long 1.3"),
    forms=dict(shape="plain|round|long"),
    extras=dict(tablecloth=0.2))
def table(o, rng):
    z = 0.5 * o.legs
    x, y = (0.36, 0.36) if o.shape == "round" else (0.32, 0.66) if o.shape == "long" else (0.32,
        0.48)
    top = cylinder(1.3 * x, 0.05, bevel=0.01) if o.shape == "round" else block(2 * x, 2 * y, 0.05,
        0.02).at(z=0.025)
    k = 0.66 if o.shape == "round" else 0.86
    cloth = (slab(1.02 * oblong(2 * x, 2 * y, 0.03), 0.2,
        top=0.985).at(z=z - 0.03) if o.shape != "round" else cylinder(1.36 * x, 0.2,
        1.32 * x).at(z=z - 0.13)) if o.tablecloth else None
    return dict(top=top.at(z=z),
        legs=[legs_at(k * x, k * y, z, 0.032, 0.01, square=o.shape != "round")],
        tablecloth=[cloth] if cloth else [])


@kind("desk", "furniture", also=("writing desk", "office desk"),
    colours=dict(top=WOOD, drawers="=top", handles="golden|black|silver", legs="=top"),
    counts=dict(drawers="2|3|4"))
def desk(o, rng):
    n = o.drawers
    z = np.linspace(0.1, 0.5, n + 1)
    fronts = [block(0.02, 0.28, 0.36 / n).at(0.24, 0.3, 0.5 * (a + b) - 0.02) for a,
        b in pairwise(z)]
    knobs = ball(0.022).copies([(0.26, 0.3, 0.5 * (a + b) - 0.02) for a, b in pairwise(z)])
    return dict(top=[block(0.52, 1.0, 0.05, 0.01).at(z=0.56),
        block(0.46, 0.34, 0.47).at(0, 0.3, 0.3)],
        drawers=[s.shade(lambda u, v, p: 0.86) for s in fronts], handles=knobs,
        legs=[block(0.05, 0.05, 0.54).copies([(x, -0.46, 0.27) for x in (-0.22, 0.22)]),
        block(0.44, 0.02, 0.3).at(0, -0.46, 0.4),
        block(0.05, 0.05, 0.1).copies([(x, y, 0.05) for x in (-0.2, 0.2) for y in (0.16, 0.44)])])


@kind("sofa", "furniture", also=("couch", "settee"),
    colours=dict(upholstery="red|blue|grey|brown|green", cushions="=upholstery", legs="brown|black",
        pillows="yellow|white|orange"),
    counts=dict(cushions="2|3"),
    extras=dict(pillows=0.4))
def sofa(o, rng):
    n = o.cushions
    w = 0.72 / n
    y = (np.arange(n) + 0.5) * w - 0.36
    seat = block(0.36, w - 0.01, 0.13, 0.04).copies([(0.04, a, 0.27) for a in y])
    back = block(0.13, w - 0.01, 0.28, 0.05).turn("y", -8).copies([(-0.15, a, 0.44) for a in y])
    return dict(upholstery=[block(0.46, 0.96, 0.14, 0.03).at(0, 0, 0.15),
        block(0.12, 0.92, 0.5, 0.05).at(-0.22, 0, 0.34),
        block(0.46, 0.13, 0.36, 0.06).at(0, 0.43, 0.25).both()], cushions=[seat, back],
        legs=legs_at(0.17, 0.4, 0.1, 0.03),
        pillows=cushion(0.1, 0.24, 0.24, 3).turn("y", -18).at(-0.03, 0.26,
        0.42).both() if o.pillows else [])


@kind("armchair", "furniture", also=("easy chair", "club chair"),
    colours=dict(upholstery="leather|red|green|blue|grey", cushion="=upholstery",
        legs="brown|black"),
    sizes=dict(back="low 0.75|1|tall 1.35"))
def armchair(o, rng):
    b = 0.5 * o.back
    return dict(upholstery=[block(0.5, 0.5, 0.2, 0.04).at(0.02, 0, 0.2),
        block(0.16, 0.56, b, 0.07).turn("y", -8).at(-0.22, 0, 0.22 + 0.5 * b),
        block(0.52, 0.14, 0.34, 0.06).at(0.03, 0.3, 0.28).both()],
        cushion=block(0.44, 0.44, 0.12, 0.05).at(0.07, 0, 0.34),
        legs=legs_at(0.22, 0.26, 0.11, 0.03))


@kind("rocking chair", "furniture",
    colours=dict(frame=WOOD, seat="=frame", rockers="=frame", cushion="red|green|blue"),
    extras=dict(cushion=0.3))
def rocking_chair(o, rng):
    a = np.linspace(-0.5, 0.5, 7)
    rocker = tube(np.stack([a, 0 * a + 0.22, 0.5 * a**2 + 0.03], -1), 0.028).both()
    z = 0.42
    back = [rod((-0.2, 0.2, z), (-0.36, 0.2, z + 0.55), 0.026).both(),
        rod((-0.2, 0, z), (-0.34, 0, z + 0.5),
        0.016).copies([(0, y, 0) for y in (-0.13, -0.045, 0.045, 0.13)]),
        block(0.04, 0.48, 0.1, 0.02).turn("y", -16).at(-0.35, 0, z + 0.54)]
    return dict(frame=[*back, rod((0.18, 0.2, 0.04), (0.18, 0.2, z + 0.22), 0.024).both(),
        rod((-0.24, 0.21, 0.05), (-0.2, 0.2, z), 0.024).both(),
        rod((0.22, 0.22, z + 0.22), (-0.26, 0.22, z + 0.22), 0.026).both()],
        seat=block(0.46, 0.46, 0.05, 0.03).at(0, 0, z), rockers=rocker,
        cushion=cushion(0.4, 0.4, 0.1, 3).at(0, 0, z + 0.05) if o.cushion else [])


@kind("bed", "furniture",
    colours=dict(blanket="blue|red|light blue|green|pink", frame=WOOD, pillows="white",
        sheet="white", pattern="white|yellow"),
    counts=dict(pillows="1|2"),
    sizes=dict(headboard="low 0.7|1|tall 1.4"),
    forms=dict(style="plain|striped"))
def bed(o, rng):
    w = 0.5 if o.pillows == 1 else 0.72
    cover = block(0.66, w + 0.03, 0.13, 0.03).at(0.13, 0, 0.24)
    if o.style == "striped":
        cover = cover.coat("pattern", stripes(11, "x", 0.4))
    y = [0.0] if o.pillows == 1 else [-0.18, 0.18]
    h = 0.5 * o.headboard
    return dict(frame=[block(0.98, w, 0.12).at(z=0.12),
        block(0.05, w + 0.06, h, 0.02).at(-0.5, 0, 0.5 * h),
        block(0.05, w + 0.06, 0.26, 0.02).at(0.49, 0, 0.13)],
        sheet=block(0.94, w - 0.01, 0.13, 0.03).at(0, 0, 0.22), blanket=cover,
        pillows=cushion(0.22, 0.3, 0.12, 2.8).copies([(-0.34, a, 0.31) for a in y]))


@kind("bookshelf", "furniture", also=("bookcase", "shelf with books"),
    colours=dict(shelf=WOOD, books="red|blue|green|brown"),
    counts=dict(shelves="3|4|5"))
def bookshelf(o, rng):
    n = o.shelves
    h = 1.0
    step = (h - 0.04) / n
    parts = dict(shelf=[block(0.26, 0.03, h).at(0, 0.3, 0.5 * h).both(),
        block(0.26, 0.6, 0.03).copies([(0, 0, 0.02 + step * k) for k in range(n + 1)]),
        block(0.02, 0.6, h).at(-0.12, 0, 0.5 * h)], shelves=[], books=[])
    names = ("books", "yellow", "white", "dark blue", "books", "dark red", "light blue")
    for k in range(n):
        y = -0.28
        while y < 0.2:
            t, tall = rng.uniform(0.03, 0.06), rng.uniform(0.6, 0.9) * (step - 0.03)
            parts.setdefault(names[rng.integers(0, 7)],
                []).append(block(0.18, t - 0.004, tall).at(0.01, y + 0.5 * t,
                0.035 + step * k + 0.5 * tall))
            y += t
            if rng.random() < 0.06:
                y += 0.12
    return parts


@kind("wardrobe", "furniture", also=("closet", "cupboard"),
    colours=dict(body=WOOD, doors="=body", handles="golden|black|silver"),
    counts=dict(doors="2|3"))
def wardrobe(o, rng):
    n = o.doors
    w = 0.66 / n
    y = (np.arange(n) + 0.5) * w - 0.33
    return dict(body=[block(0.34, 0.7, 0.98, 0.01).at(z=0.55),
        block(0.38, 0.74, 0.05, 0.01).at(z=1.05), block(0.36, 0.72, 0.06).at(z=0.05)],
        doors=block(0.03, w - 0.015, 0.86).shade(lambda u, v,
        p: 0.9 - 0.13 * ((np.abs(np.abs(p[:, 1]) / w - 0.36) < 0.025) & (np.abs(p[:, 2]) < 0.38)
        | (np.abs(np.abs(p[:, 2]) - 0.37) < 0.012))).copies([(0.17, a, 0.56) for a in y]),
        handles=limb((0.2, 0, 0.5), (0.2, 0, 0.62),
        0.014).copies([(0, a + s * 0.35 * w, 0) for a, s in zip(y, (1, -1, -1), strict=False)]))


@kind("bench", "furniture", also=("park bench", "wooden bench"),
    colours=dict(planks="wooden|brown|green", legs="black|dark grey|stone"),
    counts=dict(planks="2|3|4"))
def bench(o, rng):
    n = o.planks
    seat = block(0.28 / n, 1.0,
        0.03).copies([(0.17 - 0.32 * (k + 0.5) / n, 0, 0.36) for k in range(n)])
    back = block(0.03, 1.0, 0.22 / n).turn("y",
        -12).copies([(-0.2 - 0.05 * k / n, 0, 0.46 + 0.28 * k / n) for k in range(n)])
    side = [rod((0.14, 0.4, 0), (0.14, 0.4, 0.34), 0.028),
        rod((-0.16, 0.4, 0), (-0.16, 0.4, 0.36), 0.028),
        rod((-0.17, 0.4, 0.34), (-0.27, 0.4, 0.74), 0.026),
        rod((-0.18, 0.4, 0.34), (0.17, 0.4, 0.34), 0.024),
        tube([(0.14, 0.44, 0.34), (0.15, 0.44, 0.5), (0.0, 0.44, 0.53), (-0.22, 0.44, 0.53)],
        0.024)]
    return dict(planks=[seat, back], legs=[s.both() for s in side])


@kind("lamp", "furniture", also=("table lamp", "desk lamp with a shade"),
    colours=dict(shade="cream|red|yellow|light blue|green|white",
        stand="brown|golden|black|silver|blue", bulb="!cream", pattern="white|red"),
    sizes=dict(shade="small 0.75|1|large 1.3", stand="short 0.7|1|tall 1.35"),
    forms=dict(style="plain|striped"))
def lamp(o, rng):
    h, s = 0.55 * o.stand, o.shade
    stand = lathe([(0, 0), (0.18, 0), (0.17, 0.04), (0.04, 0.07), (0.085, 0.4 * h), (0.03, 0.7 * h),
        (0.02, h + 0.05), (0, h + 0.05)])
    hood = lathe([(0.3 * s, 0), (0.165 * s, 0.4 * s), (0.15 * s, 0.4 * s), (0.28 * s, 0),
        (0.3 * s, 0)], sharp=True).at(z=h - 0.06)
    return dict(shade=hood.coat("pattern", sectors(12, 0.5)) if o.style == "striped" else hood,
        stand=stand, bulb=ball(0.07).at(z=h + 0.1))


@kind("floor lamp", "furniture", also=("standing lamp",),
    colours=dict(shade="white|cream|yellow|red|orange", stand="black|silver|golden|wooden"),
    sizes=dict(shade="small 0.75|1|large 1.3"))
def floor_lamp(o, rng):
    s = o.shade
    return dict(shade=lathe([(0.2 * s, 0.82), (0.13 * s, 1.08), (0.12 * s, 1.08), (0.19 * s, 0.82),
        (0.2 * s, 0.82)], sharp=True),
        stand=[lathe([(0, 0), (0.17, 0), (0.16, 0.03), (0.03, 0.05), (0, 0.05)]),
        rod((0, 0, 0.03), (0, 0, 1.0), 0.018)], cream=ball(0.05).at(z=0.93))


@kind("desk lamp", "furniture", also=("reading lamp", "anglepoise lamp"),
    colours=dict(head="red|black|white|blue|yellow", arm="=head", base="=head", bulb="!cream"))
def desk_lamp(o, rng):
    hood = lathe([(0.15, 0), (0.07, 0.16), (0.035, 0.22), (0.0, 0.22), (0.03, 0.17), (0.13, 0),
        (0.15, 0)], sharp=True).turn("y", 32).at(0.33, 0, 0.62)
    return dict(head=hood, arm=[rod((-0.05, 0, 0.04), (-0.25, 0, 0.42), 0.02),
        rod((-0.25, 0, 0.42), (0.22, 0, 0.8), 0.018),
        ball(0.035).copies([(-0.25, 0, 0.42), (-0.05, 0, 0.05), (0.22, 0, 0.8)])],
        base=cylinder(0.2, 0.05, 0.17).at(-0.05), bulb=ball(0.055).at(0.36, 0, 0.66))
