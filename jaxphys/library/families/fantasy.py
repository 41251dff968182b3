"""Fairy tales: dragon, ghost, treasure."""

import numpy as np

from jaxphys.library.families.common import (
    beast,
    ears,
    eyes,
)
from jaxphys.library.kinds import kind
from jaxphys.library.shapes import (
    ball,
    block,
    cone,
    cushion,
    cylinder,
    hull,
    lathe,
    limb,
    plate,
    polygon,
    refined,
    ring,
    rod,
    rounded,
    side_plate,
    smooth,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731, RUF005


@kind("dragon", "fantasy", also=("little dragon", "fairytale dragon"),
    colours=dict(skin="green|red|dark green", belly="yellow|cream|light green|orange",
        wings="=skin", spikes="yellow|orange|dark green", horns="cream|white", eyes="yellow|white",
        fire="orange|red"),
    sizes=dict(wings="small 0.75|1|large 1.3", tail="short 0.7|1|long 1.25",
        horns="short 0.7|1|long 1.6"),
    extras=dict(fire=0.2))
def dragon(o, rng):
    t, w = 0.55 * o.tail, o.wings
    spine = [(-0.2 - t, 0.2, 0.26), (-0.2 - 0.75 * t, 0.1, 0.1), (-0.3 - 0.25 * t, 0, 0.12),
        (-0.16, 0, 0.3), (0.06, 0, 0.4), (0.18, 0, 0.62), (0.17, 0, 0.84), (0.26, 0, 0.94)]
    body = tube(spine, [0.012, 0.05, 0.1, 0.22, 0.2, 0.12, 0.09, 0.09], sides=12)
    skull = [ball(0.14, 0.12, 0.12).at(0.27, 0, 0.95),
        hull([(0.28, 0.1, 0.86, 0.99), (0.44, 0.08, 0.87, 0.95), (0.54, 0.05, 0.88, 0.93)],
        square=2.4)]
    nostril = ball(0.03).at(0.51, 0.035, 0.93).both()
    leg = [ball(0.15, 0.09, 0.16).at(-0.14, 0.17, 0.2),
        ball(0.11, 0.075, 0.045).at(-0.04, 0.19, 0.045),
        limb((0.14, 0.14, 0.34), (0.2, 0.16, 0.06), 0.07, 0.055),
        ball(0.09, 0.065, 0.04).at(0.24, 0.16, 0.04)]
    outline = np.array([(0.0, 0.0), (0.1, 0.32), (0.3, 0.5), (0.52, 0.42), (0.66, 0.18), (0.5, 0.2),
        (0.4, 0.02), (0.3, 0.1), (0.18, -0.1), (0.1, 0.0)]) * w
    centre = np.array([0.3, 0.25]) * w
    wing = plate(refined(outline - centre, 4), 0.03).at(0, centre[0], centre[1]).turn("z",
        28).at(-0.04, 0.08, 0.48)
    bone = [tube([(0.01, 0, 0), (0.01, 0.1 * w, 0.32 * w), (0.01, 0.3 * w, 0.51 * w),
        (0.01, 0.53 * w, 0.42 * w)], [0.035, 0.03, 0.025, 0.012]).turn("z", 28).at(-0.04, 0.08,
        0.48)]
    path = smooth(np.array(spine), 80)
    at = np.linspace(6, 70, 13).astype(int)
    radius = np.interp(at / 79, [0, 0.2, 0.35, 0.5, 0.65, 0.8, 1],
        [0.02, 0.05, 0.1, 0.2, 0.18, 0.11, 0.09])
    slope = np.gradient(path, axis=0)[at]
    up = np.stack([-slope[:, 2], 0 * slope[:, 0], slope[:, 0]], -1)
    up /= np.linalg.norm(up, axis=1, keepdims=True) + 1e-9
    spikes = cone(0.045, 0.11).scale(1, 0.45, 1).copies(path[at] + 0.9 * radius[:, None] * up, up)
    horn = tube([(0.2, 0.06, 1.02), (0.14, 0.08, 1.1),
        (0.06 - 0.06 * o.horns, 0.1, 1.12 + 0.08 * o.horns)], [0.035, 0.028, 0.006])
    front = tube([(-0.02, 0, 0.2), (0.15, 0, 0.36), (0.245, 0, 0.6), (0.235, 0, 0.82)],
        [0.13, 0.13, 0.085, 0.06], flat=0.9)
    flames = [lathe([(0, 0), (0.05, 0.06), (0.1, 0.2), (0.06, 0.3), (0, 0.4)]).turn("y",
        95).at(0.53, 0, 0.89)]
    return dict(skin=[body, *skull, nostril, *(s.both() for s in leg)],
        belly=front.shade(lambda u, v, p: 1 - 0.15 * ((v * 16) % 1 < 0.25)),
        wings=[wing.both(), *(b.both() for b in bone)],
        spikes=[spikes, plate(refined([(0.07, 0), (0, 0.12), (-0.07, 0), (0, -0.05)], 3),
        0.03).at(-0.2 - t, 0.2, 0.3)], horns=horn.both(),
        eyes=ball(0.035).at(0.35, 0.085, 1.0).both(),
        black=ball(0.018).at(0.375, 0.1, 1.005).both(), fire=flames if o.fire else [])


@kind("unicorn", "fantasy",
    colours=dict(coat="white|pink|light blue", mane="pink|purple|light blue", tail="=mane",
        horn="golden|silver|yellow", muzzle="=coat", hooves="golden|silver|pink", legs="=coat",
        eyes="!black"),
    sizes=dict(horn="short 0.6|1|long 1.6", tail="short 0.6|1|long 1.3"))
def unicorn(o, rng):
    parts, head = beast(0.92, 0.2, 0.44, 0.058, 0.36, 58, 0.125, 0.16, 0.65, paws=False, droop=42)
    z = 0.44 + 0.15
    h = 0.3 * o.horn
    spiral = lambda u, v, p: 0.8 + 0.25 * (np.sin(2 * np.pi * u + 60 * p[:, 2]) > 0)
    mane = [ball(0.075, 0.06,
        0.075).at(*(head + np.array([-0.02 - 0.05 * k, 0.02 * (-1) ** k, 0.12 - 0.075 * k])))
        for k in range(7)]
    feet = cylinder(0.065, 0.08,
        0.055).copies([(-0.33, 0.11, 0), (-0.33, -0.11, 0), (0.3, 0.11, 0), (0.3, -0.11, 0)])
    return dict(coat=parts["body"], muzzle=parts["muzzle"], legs=parts["legs"], hooves=feet,
        mane=mane, tail=tube([(-0.42, 0, z + 0.1), (-0.58, 0, z + 0.1), (-0.62, 0, z - 0.12),
        (-0.56, 0, z - 0.36 * o.tail)], [0.04, 0.085, 0.075, 0.02]),
        horn=cone(0.035, h).shade(spiral).turn("y", 32).at(head[0] + 0.04, 0, head[2] + 0.1),
        ears=ears(head, 0.12, 0.12, 0.045, out=28),
        eyes=eyes(head[0] + 0.075, 0.095, head[2] + 0.02, 0.026))


@kind("ghost", "fantasy", also=("halloween ghost", "friendly ghost"),
    colours=dict(ghost="white|light blue|light grey", eyes="!black", mouth="!black"))
def ghost(o, rng):
    body = lathe([(0, -0.42), (0.38, -0.45), (0.33, -0.2), (0.28, 0.15), (0.2, 0.36), (0.1, 0.45),
        (0, 0.47)], waves=(7, 0.04))
    return dict(ghost=[body,
        tube([(0, 0.22, 0.08), (0.08, 0.36, 0.06), (0.14, 0.42, 0.16)],
        [0.09, 0.075, 0.045]).both()], eyes=ball(0.04, 0.05, 0.075).at(0.215, 0.09, 0.24).both(),
        mouth=ball(0.04, 0.045, 0.06).at(0.265, 0, 0.08))


@kind("jack-o'-lantern", "fantasy", also=("halloween pumpkin", "carved pumpkin"),
    colours=dict(skin="orange", face="!yellow", stalk="green|brown"))
def lantern(o, rng):
    n = 10
    a = np.linspace(0, 2 * np.pi, 8 * n, endpoint=False)
    r = 0.9 + 0.1 * np.abs(np.sin(0.5 * n * a))
    body = lathe([(0, -0.32), (0.25, -0.37), (0.47, -0.1), (0.47, 0.12), (0.25, 0.34), (0, 0.27)],
        outline=np.stack([r * np.cos(a), r * np.sin(a)], -1))

    def carved(u, v, p):
        y, z, front = np.abs(p[:, 1]), p[:, 2], p[:, 0] > 0.1
        eye = (z > 0.05) & (z < 0.2) & (np.abs(y - 0.17) < 0.085 * (0.2 - z) / 0.15)
        nose = (z > -0.04) & (z < 0.05) & (y < 0.05 * (0.05 - z) / 0.09)
        mouth = (np.abs(z + 0.17 - 0.9 * y**2) < 0.055) & (y < 0.28) & ~((np.abs(y - 0.1) < 0.03)
            & (z + 0.17 - 0.9 * y**2 > 0.0))
        return front & (eye | nose | mouth)

    return dict(skin=body.shade(lambda u, v,
        p: 0.8 + 0.22 * np.minimum(1, 1.6 * np.abs(np.sin(np.pi * n * u)))).coat("face", carved),
        stalk=tube([(0, 0, 0.24), (0, 0.02, 0.4), (0.05, 0.08, 0.48)], [0.08, 0.05, 0.05]))


@kind("treasure chest", "fantasy", also=("pirate chest", "chest of gold"),
    colours=dict(chest="wooden|brown|dark brown", bands="golden|dark grey|silver",
        lock="golden|silver", coins="!golden"),
    forms=dict(lid="open|closed"))
def treasure_chest(o, rng):
    a = np.linspace(0, np.pi, 12)
    arch = np.concatenate([np.stack([0.27 * np.cos(a), 0.2 * np.sin(a)], -1),
        [(-0.14, -0.0), (0.0, -0.0), (0.14, 0.0)]]) - (0, 0.08)
    lid = side_plate(arch, 0.84).at(z=0.08)
    strap = side_plate(arch * 1.06, 0.08).at(z=0.08)
    planks = lambda u, v, p: 1 - 0.25 * ((p[:, 2] * 9 + 0.02) % 1 < 0.12)
    top = [lid.shade(lambda u, v,
        p: 1 - 0.2 * ((p[:, 0] * 10) % 1 < 0.08))], [strap.at(y=0.3).both(), strap]
    move = (lambda s: s.at(x=0.27).turn("y", -70).at(-0.27, 0,
        0.36)) if o.lid == "open" else (lambda s: s.at(z=0.36))
    coins = cylinder(0.05, 0.02).copies(rng.uniform((-0.2, -0.34, 0.33), (0.22, 0.34, 0.42),
        (46, 3)), rng.normal(0, 0.5, (46, 3)) + (0, 0, 1))
    parts = dict(chest=[block(0.54, 0.84, 0.36).at(z=0.18).shade(planks),
        *(move(s) for s in top[0])],
        bands=[block(0.56, 0.08, 0.37).copies([(0, y, 0.185) for y in (-0.3, 0, 0.3)]),
        *(move(s) for s in top[1])], lock=[block(0.04, 0.12, 0.12, 0.02).at(0.28, 0, 0.31)],
        coins=[])
    if o.lid == "open":
        parts["coins"] = [coins, cushion(0.44, 0.74, 0.2, 2.6).at(0, 0, 0.3)]
        parts["red"] = ball(0.05).copies([(0.1, 0.1, 0.42), (-0.05, -0.2, 0.42)])
    return parts


@kind("cauldron", "fantasy", also=("witch's cauldron", "magic pot"),
    colours=dict(cauldron="black|dark grey", potion="green|purple|light green", bubbles="=potion",
        handles="grey|dark grey"))
def cauldron(o, rng):
    body = lathe([(0, 0.04), (0.25, 0.08), (0.43, 0.3), (0.38, 0.54), (0.35, 0.58), (0.41, 0.64),
        (0.38, 0.66), (0.32, 0.58), (0.36, 0.4), (0, 0.2)])
    spots = rng.uniform((-0.2, -0.2, 0.58), (0.2, 0.2, 0.64), (9, 3))
    return dict(cauldron=[body, limb((0.24, 0, 0.12), (0.3, 0, 0.0), 0.05).turn("z", 30).around(3)],
        potion=cylinder(0.35, 0.04).at(z=0.55),
        bubbles=ball(0.07).copies(spots, sizes=rng.uniform(0.5, 1.1, 9)),
        handles=ring(0.09, 0.025).turn("x", 90).turn("z", 90).at(0, 0.44, 0.45).both())


@kind("sword", "fantasy", also=("knight's sword", "long sword"),
    colours=dict(blade="silver|metal|golden", guard="golden|silver|dark grey",
        handle="brown|black|red|leather", pommel="=guard"),
    sizes=dict(blade="short 0.65|1|long 1.2"))
def sword(o, rng):
    b = 0.8 * o.blade
    line = refined([(0.055, 0.0), (0.05, 0.85 * b), (0, b), (-0.05, 0.85 * b), (-0.055, 0.0)], 4)
    return each(dict(blade=plate(line - (0, 0.5 * b), 0.035, puff=0.4).at(z=0.5 * b).shade(lambda u,
        v, p: 1 - 0.12 * (np.abs(p[:, 0]) < 0.012)),
        guard=tube([(0, -0.19, 0.03), (0, -0.1, 0), (0, 0.1, 0), (0, 0.19, 0.03)],
        [0.035, 0.03, 0.03, 0.035]),
        handle=rod((0, 0, 0), (0, 0, -0.2), 0.032).shade(lambda u, v,
        p: 0.8 + 0.25 * ((p[:, 2] * 28 + u) % 1 > 0.3)), pommel=ball(0.05).at(z=-0.23)),
        lambda s: s.turn("x", -30))


@kind("shield", "fantasy", also=("knight's shield",),
    colours=dict(shield="red|blue|green|purple|silver", rim="golden|silver",
        cross="white|golden|yellow"),
    forms=dict(style="crossed|plain|halved"))
def shield(o, rng):
    outline = rounded([(0.36, 0.42), (0, 0.44), (-0.36, 0.42), (-0.38, 0.1), (-0.28, -0.22),
        (0, -0.5), (0.28, -0.22), (0.38, 0.1)], 64)
    body = plate(outline * 0.93, 0.14, puff=0.7)
    if o.style == "crossed":
        body = body.coat("cross", lambda u, v,
            p: (np.abs(p[:, 0]) < 0.06) | (np.abs(p[:, 1] - 0.08) < 0.06))
    elif o.style == "halved":
        body = body.coat("cross", lambda u, v, p: p[:, 0] * (p[:, 1] - 0.05) > 0)
    return dict(shield=body,
        rim=tube(np.concatenate([outline, outline[:2]])[:, [0, 0, 1]] * (0, 1, 1), 0.035,
        sharp=True))


@kind("magic wand", "fantasy", also=("fairy wand",),
    colours=dict(star="yellow|golden|pink", stick="white|pink|black|purple",
        ribbons="pink|light blue|purple"),
    extras=dict(ribbons=0.5))
def wand(o, rng):
    tails = [tube([(0, 0, 0.22), (0.04, s * 0.1, 0.12), (0.0, s * 0.12, -0.05),
        (0.05, s * 0.2, -0.2)], 0.022, flat=0.4) for s in (-1, 1)]
    return each(dict(star=plate(polygon(5, 0.24, 0.11, np.pi / 2), 0.12, puff=0.8).at(z=0.42),
        stick=rod((0, 0, 0.3), (0, 0, -0.6), 0.026), ribbons=tails if o.ribbons else []),
        lambda s: s.turn("x", 14))


@kind("alien", "fantasy", also=("little green man", "space alien"),
    colours=dict(skin="green|light green|purple|blue", eyes="black", antennas="=skin",
        belly="light green|yellow"),
    counts=dict(eyes="1|2|3"))
def alien(o, rng):
    head = lathe([(0, 0.4), (0.12, 0.43), (0.29, 0.66), (0.26, 0.85), (0.1, 0.95), (0, 0.96)])
    y = {1: [0], 2: [-0.12, 0.12], 3: [-0.15, 0, 0.15]}[o.eyes]
    size = {1: 0.12, 2: 0.08, 3: 0.06}[o.eyes]
    look = [ball(0.05, size, 1.25 * size).at(0.26 - 1.2 * a * a, a, 0.7) for a in y]
    return dict(skin=[head, lathe([(0, 0), (0.13, 0.0), (0.17, 0.15), (0.09, 0.38), (0, 0.44)]),
        limb((0, 0.11, 0.33), (0.06, 0.28, 0.14), 0.045).both(),
        ball(0.05).at(0.07, 0.29, 0.12).both(),
        limb((0, 0.08, 0.05), (0, 0.1, -0.18), 0.055).both(),
        ball(0.1, 0.065, 0.045).at(0.04, 0.1, -0.19).both()],
        belly=ball(0.1, 0.11, 0.13).at(0.09, 0, 0.16), eyes=look,
        white=[ball(0.02, 0.02, 0.025).at(0.31 - 1.2 * a * a, a - 0.02, 0.75) for a in y],
        antennas=[tube([(0, 0.08, 0.93), (0, 0.12, 1.05), (0.02, 0.2, 1.1)], 0.014).both(),
        ball(0.035).at(0.02, 0.2, 1.1).both()],
        black=tube([(0.2, -0.06, 0.53), (0.215, 0, 0.515), (0.2, 0.06, 0.53)], 0.01))
