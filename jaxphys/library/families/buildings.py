"""Buildings and what stands beside them; the door faces +x."""

import numpy as np

from jaxphys.library.families.common import (
    gable,
    tiles,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import ripples
from jaxphys.library.patterns import (
    below,
    mottled,
    panes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cone,
    cylinder,
    lathe,
    oblong,
    plate,
    refined,
    ring,
    rod,
)
from jaxphys.library.solids import Solid

# fmt: off
# ruff: noqa: E731


def door(x: float, y: float, width: float, height: float, z: float = 0.0) -> Solid:
    return block(0.03, width, height).at(x, y, z + 0.5 * height)


def battlements(radius: float, z: float, count: int, size: float) -> Solid:
    return block(0.6 * size, size, size).at(radius, 0, z + 0.5 * size).around(count)


@kind("house", "buildings", also=("cottage", "small house", "home"),
    colours=dict(walls="white|cream|yellow|light blue|brick", roof="red|brown|dark grey",
        door="brown|red|blue|green", windows="light blue|dark blue", chimney="brick|grey",
        frames="!white"),
    sizes=dict(roof="flat 0.6|1|steep 1.5", chimney="short 0.7|1|tall 1.7"),
    counts=dict(floors="1|2"),
    extras=dict(chimney=0.7))
def house(o, rng):
    w, h, rise = 0.7, 0.3 * o.floors + 0.08, 0.34 * o.roof
    body = block(0.6, w, h).at(z=0.5 * h)
    front = plate(refined([(0.5 * w, -rise / 3), (0, 2 * rise / 3), (-0.5 * w, -rise / 3)]),
        0.6).at(z=h + rise / 3)
    spots = [(0.3, y, 0.2 + 0.3 * k) for k in range(o.floors) for y in ((-0.22,
        0.22) if k == 0 else (-0.22, 0, 0.22))]
    side = [(x, 0.35, 0.2 + 0.3 * k) for k in range(o.floors) for x in (-0.15, 0.15)]
    pane, rim = block(0.03, 0.12, 0.13), block(0.02, 0.15, 0.16)
    return dict(walls=[body, front], roof=gable(0.6, w, rise * 1.12).at(z=h - 0.01).shade(tiles()),
        door=door(0.3, 0, 0.14, 0.25),
        windows=[pane.copies(spots), pane.turn("z", 90).copies(side).both()],
        frames=[rim.copies(spots), rim.turn("z", 90).copies(side).both()],
        chimney=block(0.1, 0.1, 0.3 * o.chimney).at(-0.12, 0.2,
        h + 0.62 * rise + 0.05 * o.chimney) if o.chimney else [],
        golden=ball(0.012).at(0.32, 0.05, 0.12))


@kind("barn", "buildings", also=("red barn", "farm barn"),
    colours=dict(walls="red|brown", roof="dark grey|grey|brown", door="white|red", trim="white"))
def barn(o, rng):
    arch = refined([(0.36, -0.3), (0.36, 0.08), (0.25, 0.27), (0, 0.36), (-0.25, 0.27),
        (-0.36, 0.08), (-0.36, -0.3)])
    body = plate(arch, 0.84).at(z=0.3).coat("trim", lambda u, v,
        p: (np.abs(v - 0.5) > 0.17) & (np.abs(v - 0.5) < 0.2))
    lid = plate(arch * (1.13, 1.12), 0.76).coat("walls", below("y", -0.02)).at(z=0.3)
    cross = lambda u, v, p: (np.abs(np.abs(p[:, 1] / 0.16) - np.abs(p[:, 2] / 0.17))
        < 0.13) | (np.abs(p[:, 1]) > 0.14) | (np.abs(p[:, 2]) > 0.15)
    return dict(walls=body.shade(lambda u, v, p: 1 - 0.08 * ((p[:, 0] * 14) % 1 < 0.1)), roof=lid,
        door=block(0.03, 0.34, 0.36).at(0.42, 0, 0.18).coat("walls", lambda u, v,
        p: ~cross(u, v, p)), trim=block(0.02, 0.14, 0.14).at(0.42, 0, 0.5))


@kind("castle", "buildings", also=("fortress", "fairytale castle"),
    colours=dict(walls="stone|light grey|grey|beige", roofs="blue|red|purple", gate="brown|wooden",
        flags="red|yellow|blue", windows="!dark grey"),
    counts=dict(towers="2|3|4"))
def castle(o, rng):
    h = 0.55 * rng.uniform(0.9, 1.1)
    places = [(0.3, 0.34), (0.3, -0.34), (-0.3, 0.34), (-0.3, -0.34)][: o.towers]
    spots = [(x, y, 0) for x, y in places]
    body = [block(0.56, 0.62, 0.34).at(z=0.17), block(0.3, 0.34, 0.62).at(-0.05, 0, 0.31)]
    tower = [cylinder(0.13, h).copies(spots),
        cylinder(0.15, 0.07).copies([(x, y, h - 0.02) for x, y in places])]
    teeth = [block(0.06, 0.06, 0.06).copies([(0.27, y, 0.37) for y in np.linspace(-0.24, 0.24, 5)]),
        block(0.06, 0.06, 0.06).copies([(-0.05 + x, y, 0.65) for x,
        y in ((0.12, 0.14), (0.12, -0.14), (-0.12, 0.14), (-0.12, -0.14), (0.12, 0), (-0.12, 0),
        (0, 0.14), (0, -0.14))])]
    wall = [s.shade(lambda u, v,
        p: 1 - 0.1 * (((p[:, 2] * 18) % 1 < 0.12)
        | ((p[:, 1] * 11 + 0.5 * np.floor(p[:, 2] * 18)) % 1 < 0.08))) for s in (*body, *tower)]
    tops = [(x, y, h + 0.05) for x, y in places]
    return dict(walls=[*wall, *teeth], roofs=[cone(0.17, 0.3).copies(tops)],
        gate=[block(0.05, 0.17, 0.17).at(0.28, 0, 0.085),
        cylinder(0.085, 0.05).turn("y", 90).at(0.255, 0, 0.17)],
        flags=[block(0.01, 0.12, 0.07).copies([(x, y + 0.07, z + 0.39) for x, y, z in tops])],
        brown=rod((0, 0, 0.28), (0, 0, 0.43), 0.01).copies(tops),
        windows=[block(0.03, 0.04,
        0.1).copies([(x + 0.12 * np.sign(x), y, 0.62 * h) for x, y in places]),
        block(0.03, 0.05, 0.1).copies([(0.1, y, 0.5) for y in (-0.08, 0.08)])], towers=[])


@kind("lighthouse", "buildings",
    colours=dict(tower="white|red", stripes="red|blue|black", lamp="yellow",
        roof="red|black|dark grey", rock="stone|grey", door="brown|red", gallery="dark grey"),
    forms=dict(height="short 0.75|1|tall 1.25", style="*striped|plain"))
def lighthouse(o, rng):
    h = 0.95 * o.height
    tower = cylinder(0.17, h, 0.11).at(z=0.1)
    n = int(rng.integers(5, 8))
    if o.style == "striped":
        tower = tower.coat("stripes", lambda u, v, p: np.floor(p[:, 2] / h * n) % 2)
    rough = ripples(rng, 3)
    stone = lathe([(0, -0.08), (0.42, -0.08), (0.36, 0.04), (0.25, 0.12), (0, 0.14)],
        waves=(7, 0.08)).shade(mottled(rough, 0.1))
    t = 0.1 + h
    return dict(tower=tower, rock=stone,
        gallery=[cylinder(0.16, 0.03).at(z=t), ring(0.155, 0.01).at(z=t + 0.09),
        rod((0.155, 0, t), (0.155, 0, t + 0.09), 0.008).around(10),
        *[rod((0.085 * np.cos(a), 0.085 * np.sin(a), t),
        (0.085 * np.cos(a), 0.085 * np.sin(a), t + 0.16),
        0.012) for a in np.pi / 3 * np.arange(6)]], lamp=cylinder(0.08, 0.16).at(z=t + 0.02),
        roof=[cone(0.13, 0.14).at(z=t + 0.17), ball(0.025).at(z=t + 0.32)],
        door=block(0.03, 0.1, 0.18, 0.0).at(0.165, 0, 0.2), light=[],
        **{"dark blue": block(0.03, 0.05,
        0.08).copies([(0.15, 0, 0.1 + 0.45 * h), (0.135, 0, 0.1 + 0.72 * h)])})


@kind("windmill", "buildings", also=("dutch windmill",),
    colours=dict(tower="white|brick|beige|brown", cap="brown|red|dark grey",
        blades="white|wooden|brown", door="brown|green|blue", windows="light blue"),
    sizes=dict(blades="short 0.75|1|long 1.2"))
def windmill(o, rng):
    long = 0.46 * o.blades
    sail = [block(0.015, 0.13, long).at(0, 0.055, 0.06 + 0.5 * long).coat("brown", lambda u, v,
        p: ((p[:, 2] * 17) % 1 < 0.16) | ((p[:, 1] * 15) % 1 < 0.16)),
        block(0.03, 0.03, long + 0.05).at(0, 0, 0.5 * long)]
    turned = [s.turn("x", 20).around(4, "x").at(0.26, 0, 0.68) for s in sail]
    return dict(tower=lathe([(0, 0), (0.27, 0), (0.17, 0.62), (0, 0.62)], sharp=True),
        cap=lathe([(0, 0.6), (0.2, 0.6), (0.19, 0.66), (0.1, 0.78), (0, 0.8)]), blades=turned,
        door=block(0.05, 0.12, 0.2).at(0.25, 0, 0.1),
        windows=block(0.05, 0.08, 0.08).copies([(0.21, 0, 0.33), (0.185, 0, 0.48)]),
        brown=rod((0.1, 0, 0.68), (0.28, 0, 0.68), 0.03))


@kind("church", "buildings", also=("chapel",),
    colours=dict(walls="white|stone|beige|brick", roof="brown|red|dark grey", cross="golden|black",
        door="brown", windows="light blue|purple"),
    sizes=dict(tower="short 0.8|1|tall 1.25"))
def church(o, rng):
    t = 0.62 * o.tower
    glass = block(0.1, 0.03, 0.2, 0.02).copies([(x, 0.22, 0.22) for x in (-0.4, -0.2, 0.0)]).both()
    return dict(walls=[block(0.72, 0.42, 0.36).at(-0.15, 0, 0.18),
        plate(refined([(0.21, -0.09), (0, 0.18), (-0.21, -0.09)]), 0.72).at(-0.15, 0, 0.45),
        block(0.24, 0.24, t).at(0.28, 0, 0.5 * t)],
        roof=[gable(0.72, 0.42, 0.3, 0.03).at(-0.15, 0, 0.35).shade(tiles()),
        lathe([(0, 0), (1, 0), (0, 0.38)], sharp=True, outline=oblong(0.27, 0.27)).at(0.28, 0, t)],
        cross=[block(0.02, 0.025, 0.16).at(0.28, 0, t + 0.44),
        block(0.02, 0.1, 0.025).at(0.28, 0, t + 0.46)],
        door=[block(0.03, 0.11, 0.17).at(0.4, 0, 0.085),
        cylinder(0.055, 0.03).turn("y", 90).at(0.385, 0, 0.17)],
        windows=[glass, cylinder(0.05, 0.03).turn("y", 90).at(0.385, 0, 0.42)], tower=[])


@kind("skyscraper", "buildings", also=("office tower", "tall building"),
    colours=dict(walls="grey|light grey|light blue|dark grey|beige",
        windows="dark blue|light blue|yellow", top="=walls"),
    forms=dict(height="short 0.7|1|tall 1.3"))
def skyscraper(o, rng):
    h = 1.0 * o.height
    glass = panes("y", "z", 12, 14, 0.62)
    other = panes("x", "z", 12, 14, 0.62)
    where = lambda u, v, p: (glass(u, v, p) & (np.abs(p[:, 0]) > 0.98 * p[:, 0].max()) | other(u, v,
        p) & (np.abs(p[:, 1]) > 0.98 * p[:, 1].max()))
    tiers = [block(0.42, 0.42, 0.55 * h).at(z=0.275 * h), block(0.34, 0.34, 0.3 * h).at(z=0.7 * h),
        block(0.25, 0.25, 0.15 * h).at(z=0.925 * h)]
    return dict(walls=[s.coat("windows", where) for s in tiers],
        top=[rod((0, 0, h), (0, 0, 1.18 * h), 0.02, 0.006), block(0.12, 0.12, 0.04).at(z=1.01 * h)])
