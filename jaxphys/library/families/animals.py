"""Animals on four legs."""

import numpy as np

from jaxphys.library.families.common import (
    beast,
    ears,
    eyes,
    pairs,
    round_ears,
    tail,
)
from jaxphys.library.kinds import kind
from jaxphys.library.palette import golden_directions, ripples
from jaxphys.library.patterns import (
    below,
    near,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    cushion,
    cylinder,
    helix,
    hull,
    lathe,
    limb,
    ring,
    rod,
    tube,
)

# fmt: off
# ruff: noqa: E731, RUF005


@kind("cat", "animals", also=("kitten", "kitty"),
    colours=dict(fur="orange|grey|black|white|light brown", muzzle="white", ears="=fur",
        tail="=fur", paws="=fur", eyes="green|yellow", nose="pink", stripes="dark brown|dark grey"),
    sizes=dict(tail="short 0.55|1|long 1.4", ears="small 0.75|1|large 1.5"),
    forms=dict(style="plain|striped"))
def cat(o, rng):
    body = lathe([(0, 0), (0.3, 0), (0.33, 0.18), (0.24, 0.48), (0.16, 0.66),
        (0, 0.72)]).scale(1.05, 0.85, 1)
    head = np.array([0.1, 0, 0.84])
    skull = ball(0.23, 0.26, 0.22).at(*head)
    coat = stripes(11, "z", 0.4) if o.style == "striped" else None
    torso = [s.coat("stripes", coat) if coat else s for s in (body, skull)]
    whiskers = rod((0.3, 0.06, 0.8), (0.29, 0.3, 0.82), 0.006).both()
    path = [(-0.25, 0, 0.06), (-0.42, 0.15, 0.06), (-0.4, 0.3, 0.1),
        (-0.25, 0.36, 0.2 + 0.2 * o.tail)]
    return dict(fur=[*torso, limb((0.2, 0.12, 0.5), (0.28, 0.12, 0.07), 0.085, 0.065).both(),
        ball(0.2, 0.12, 0.2).at(-0.05, 0.24, 0.2).both()],
        muzzle=ball(0.08, 0.09, 0.065).at(0.29, 0, 0.79),
        nose=ball(0.03, fine=4).at(0.365, 0, 0.815),
        ears=ears(head, 0.22, 0.2 * o.ears, 0.09 * o.ears), eyes=eyes(0.29, 0.1, 0.89, 0.042),
        black=ball(0.02, 0.012, 0.03, fine=4).at(0.325, 0.1, 0.89).both(), white=whiskers,
        paws=ball(0.11, 0.075, 0.06).at(0.33, 0.12, 0.05).both(),
        tail=tube([(p[0] * 1.1, p[1], p[2]) for p in path], [0.06, 0.06, 0.055, 0.045]))


@kind("dog", "animals", also=("puppy", "pup"),
    colours=dict(fur="brown|light brown|white|black|golden", muzzle="=fur", ears="dark brown|brown",
        tail="=fur", legs="=fur", collar="red|blue", eyes="!black", nose="!black",
        spots="dark brown|black"),
    sizes=dict(ears="short 0.6|1|long 1.6", tail="short 0.5|1|long 1.5",
        legs="short 0.55|1|long 1.4"),
    forms=dict(style="plain|spotted"),
    extras=dict(collar=0.6))
def dog(o, rng):
    parts, head = beast(0.85, 0.19, 0.34 * o.legs, 0.065, 0.16, 52, 0.17, 0.12, 0.55)
    if o.style == "spotted":
        parts["body"] = [parts["body"][0].coat("spots",
            near(rng.uniform((-0.4, -0.2, 0.3), (0.4, 0.2, 0.8), (14, 3)), 0.085)),
            *parts["body"][1:]]
    flap = ball(0.035, 0.05, 0.13 * o.ears).turn("x", 14).at(head[0] - 0.03, 0.17,
        head[2] + 0.06 - 0.1 * o.ears)
    neck = head + (-0.13, 0, -0.16)
    return dict(fur=parts["body"], muzzle=parts["muzzle"], legs=parts["legs"], ears=flap.both(),
        tail=tail(-0.38, head[2] - 0.3, 0.34 * o.tail, 0.045, 0.9),
        collar=[ring(0.135, 0.028).turn("y", 42).at(*neck)] if o.collar else [],
        eyes=eyes(head[0] + 0.125, 0.08, head[2] + 0.06, 0.028),
        nose=ball(0.042, 0.05, 0.036).at(head[0] + 0.3, 0, head[2] - 0.02))


@kind("horse", "animals", also=("pony",),
    colours=dict(coat="brown|dark brown|white|black|light brown", muzzle="=coat",
        mane="black|dark brown|cream", tail="=mane", legs="=coat", hooves="!dark grey",
        saddle="leather|red", eyes="!black"),
    sizes=dict(tail="short 0.6|1|long 1.3", legs="short 0.7|1|long 1.2"),
    extras=dict(saddle=0.3))
def horse(o, rng):
    parts, head = beast(1.0, 0.2, 0.52 * o.legs, 0.055, 0.42, 55, 0.12, 0.2, 0.62, paws=False,
        droop=48)
    z = 0.52 * o.legs + 0.15
    mane = [limb((0.36 - 0.02 * k, 0, z + 0.2 + 0.075 * k),
        (0.3 + 0.012 * k, 0, z + 0.16 + 0.07 * k), 0.05) for k in range(6)]
    mane = [m.at(x=0.047 * k) for k, m in enumerate(mane)]
    seat = [cushion(0.28, 0.34, 0.1, 3).at(-0.02, 0, z + 0.2),
        cushion(0.18, 0.44, 0.26, 3).at(-0.02, 0, z + 0.08)]
    feet = [cylinder(0.06, 0.07, 0.05).at(x, y) for x,
        y in [(-0.36, 0.11), (-0.36, -0.11), (0.33, 0.11), (0.33, -0.11)]]
    return dict(coat=parts["body"], muzzle=parts["muzzle"], legs=parts["legs"], hooves=feet,
        mane=mane, tail=tube([(-0.45, 0, z + 0.12), (-0.6, 0, z + 0.05),
        (-0.63, 0, z - 0.3 * o.tail)], [0.04, 0.07, 0.03]),
        ears=ears(head, 0.12, 0.12, 0.04, out=22),
        eyes=eyes(head[0] + 0.07, 0.09, head[2] + 0.02, 0.022), saddle=seat if o.saddle else [])


@kind("cow", "animals", also=("dairy cow",),
    colours=dict(hide="white|brown|black", spots="black|brown", muzzle="pink", legs="=hide",
        horns="cream", udder="pink", ears="=hide", hooves="!dark grey", eyes="!black"),
    sizes=dict(horns="short 0.7|1|long 1.8"),
    forms=dict(style="*spotted|plain"))
def cow(o, rng):
    parts, head = beast(1.05, 0.27, 0.36, 0.07, 0.16, 28, 0.17, 0.12, 0.7, paws=False, droop=30)
    spots = near(rng.uniform((-0.5, -0.3, 0.3), (0.5, 0.3, 0.9), (11, 3)), 0.16)
    body = [s.coat("spots", spots) if o.style == "spotted" else s
        for s in parts["body"][:1]] + parts["body"][1:]
    horn = tube([(0, 0.08, 0.14), (0, 0.16, 0.18),
        (0.03, 0.17 + 0.03 * o.horns, 0.2 + 0.1 * o.horns)], [0.035, 0.03, 0.008])
    feet = cylinder(0.075, 0.07, 0.065).copies(pairs((-0.38, 0.35), 0.148, 0))
    return dict(hide=body, muzzle=parts["muzzle"], legs=parts["legs"], hooves=feet,
        horns=horn.at(*head).both(),
        ears=ball(0.04, 0.11, 0.055).turn("x", -15).at(head[0] - 0.03, 0.22, head[2] + 0.07).both(),
        udder=ball(0.13, 0.12, 0.1).at(-0.22, 0, 0.3),
        eyes=eyes(head[0] + 0.12, 0.09, head[2] + 0.06, 0.028),
        tail=tube([(-0.5, 0, 0.66), (-0.58, 0, 0.6), (-0.57, 0, 0.28)], [0.03, 0.025, 0.045]))


@kind("pig", "animals", also=("piglet",),
    colours=dict(skin="pink|flesh", snout="=skin", ears="=skin", legs="=skin", tail="=skin",
        eyes="!black"),
    forms=dict(girth="thin 0.75|1|fat 1.3"))
def pig(o, rng):
    g = 0.27 * o.girth
    parts, head = beast(0.9, g, 0.2, 0.075, 0.06, 20, 0.2, 0.08, 0.55, droop=8)
    disc = cylinder(0.11, 0.05, bevel=0.015).turn("y", 90).at(head[0] + 0.21, 0, head[2] - 0.03)

    curl = helix(0.05, 0.14, 1.6, 0.02).turn("y", -80).at(-0.44, 0, 0.42)
    return dict(skin=[*parts["body"], parts["muzzle"]], legs=parts["legs"],
        snout=disc.coat("dark red", lambda u, v,
        p: np.minimum(np.hypot(p[:, 0], p[:, 1] - 0.04),
        np.hypot(p[:, 0], p[:, 1] + 0.04)) < 0.022),
        ears=ears(head, 0.19, 0.17, 0.09, out=32, back=-25), tail=curl,
        eyes=eyes(head[0] + 0.15, 0.09, head[2] + 0.07, 0.027))


@kind("sheep", "animals", also=("lamb",),
    colours=dict(wool="white|cream", face="black|dark grey|beige", legs="=face", ears="=face",
        eyes="white"))
def sheep(o, rng):
    curls = golden_directions(70)
    fleece = ball(0.11, fine=4).copies(curls * (0.42, 0.29, 0.27) + (0, 0, 0.55))
    head = np.array([0.5, 0, 0.72])
    legs = limb((0, 0, 0.4), (0, 0, 0.04), 0.065).copies(pairs((-0.24, 0.24), 0.15, 0))
    tuft = ball(0.07, fine=4).copies(head + (-0.04, 0, 0.13) + 0.09 * golden_directions(12))
    return dict(wool=[ball(0.43, 0.3, 0.28).at(z=0.55), fleece, tuft], legs=legs,
        face=[limb(head + (-0.1, 0, 0.02), head + (0.12, 0, -0.1), 0.13, 0.09)],
        ears=ball(0.035, 0.1, 0.05).turn("x", -20).at(0.44, 0.19, 0.74).both(),
        eyes=eyes(0.6, 0.075, 0.75, 0.025))


@kind("elephant", "animals",
    colours=dict(skin="grey|light grey", ears="=skin", trunk="=skin", tusks="white|cream",
        legs="=skin", eyes="!black"),
    sizes=dict(ears="small 0.65|1|large 1.35", trunk="short 0.7|1|long 1.3",
        tusks="short 0.6|1|long 1.8"))
def elephant(o, rng):
    parts, head = beast(0.95, 0.32, 0.3, 0.115, 0.1, 25, 0.24, 0.0, 0.4)
    x, z = head[0], head[2]
    nose = tube([(x + 0.15, 0, z), (x + 0.33, 0, z - 0.15), (x + 0.34, 0, z - 0.36 * o.trunk),
        (x + 0.46, 0, z - 0.46 * o.trunk)], [0.13, 0.1, 0.075, 0.055])
    flap = cushion(0.07, 0.36 * o.ears, 0.42 * o.ears, 2.6).turn("z", 28).at(x - 0.1,
        0.24 + 0.1 * o.ears, z + 0.04)
    tusk = tube([(x + 0.18, 0.11, z - 0.12), (x + 0.28, 0.12, z - 0.22),
        (x + 0.3 + 0.1 * o.tusks, 0.12, z - 0.22)], [0.035, 0.03, 0.01])
    return dict(skin=parts["body"], legs=parts["legs"], trunk=nose, ears=flap.both(),
        tusks=tusk.both(), eyes=eyes(x + 0.19, 0.12, z + 0.07, 0.025),
        tail=tail(-0.46, z - 0.12, 0.2, 0.025, -1.2))


@kind("giraffe", "animals",
    colours=dict(coat="yellow|golden", spots="brown|dark brown", muzzle="=coat", legs="=coat",
        mane="brown", horns="brown", eyes="!black"),
    sizes=dict(neck="short 0.6|1|long 1.25"))
def giraffe(o, rng):
    parts, head = beast(0.7, 0.17, 0.62, 0.045, 0.85 * o.neck, 70, 0.09, 0.12, 0.6, paws=False,
        droop=25)
    spots = near(rng.uniform((-0.36, -0.2, 0.58), (0.4, 0.2, 0.95), (60, 3)), 0.06)
    neck = rng.uniform((-0.14, -0.14, 0), (0.14, 0.14, 1), (45, 3))
    body = [parts["body"][0].coat("spots", spots), parts["body"][1],
        parts["body"][2].coat("spots", near(neck, 0.055))]
    horn = limb((-0.02, 0.035, 0.06), (-0.04, 0.04, 0.16), 0.014, 0.022)
    mane = rod((0.2, 0, 0.88), head + (-0.09, 0, 0.02), 0.025)
    return dict(coat=body, muzzle=parts["muzzle"], legs=parts["legs"], horns=horn.at(*head).both(),
        mane=mane, ears=ears(head, 0.09, 0.09, 0.035, out=60),
        eyes=eyes(head[0] + 0.06, 0.065, head[2] + 0.02, 0.018),
        tail=tail(-0.33, 0.78, 0.3, 0.02, -0.8, 0.03))


@kind("lion", "animals",
    colours=dict(coat="golden|light brown", mane="brown|dark brown", muzzle="cream", tail="=coat",
        legs="=coat", nose="!dark brown", eyes="!black"),
    sizes=dict(mane="small 0.75|1|large 1.25"))
def lion(o, rng):
    parts, head = beast(0.95, 0.2, 0.36, 0.075, 0.12, 48, 0.17, 0.06, 0.6)
    x, z = head[0], head[2]
    hair = golden_directions(60)
    tuft = ball(0.085, fine=4).copies((hair * (0.14, 0.25 * o.mane, 0.26 * o.mane)) + (x - 0.1, 0,
        z - 0.02))
    end = tail(-0.44, 0.55, 0.45, 0.03, 0.5)
    return dict(coat=parts["body"], muzzle=parts["muzzle"], legs=parts["legs"], tail=end,
        mane=[tuft, ball(0.15, 0.27 * o.mane, 0.28 * o.mane).at(x - 0.1, 0, z - 0.02),
        ball(0.06, fine=4).at(-0.8, 0, 0.78)], ears=round_ears(head, 0.18, 0.06),
        eyes=eyes(x + 0.15, 0.07, z + 0.05, 0.025),
        nose=ball(0.035, 0.05, 0.03).at(x + 0.24, 0, z + 0.01))


@kind("tiger", "animals",
    colours=dict(coat="orange", stripes="black", muzzle="white", legs="=coat", ears="=coat",
        tail="=coat", nose="!dark brown", eyes="yellow|green"))
def tiger(o, rng):
    parts, head = beast(1.0, 0.19, 0.34, 0.075, 0.12, 40, 0.16, 0.06, 0.6)
    wave = ripples(rng, 2.0)
    lines = lambda u, v, p: np.sin(38 * p[:, 0] + 2.5 * wave(p)) > 0.45
    rings = lambda u, v, p: np.sin(34 * p[:, 2] + 1.5 * wave(p)) > 0.5
    return dict(coat=[parts["body"][0].coat("stripes", lines),
        parts["body"][1].coat("stripes", rings), parts["body"][2].coat("stripes", rings)],
        muzzle=parts["muzzle"], legs=[s.coat("stripes", rings) for s in parts["legs"]],
        tail=tail(-0.46, 0.5, 0.5, 0.04, 0.7, 0.035).coat("stripes", lambda u, v,
        p: np.sin(60 * v) > 0.4), ears=round_ears(head, 0.16, 0.06),
        eyes=eyes(head[0] + 0.14, 0.07, head[2] + 0.05, 0.027),
        nose=ball(0.03, 0.045, 0.028).at(head[0] + 0.225, 0, head[2] + 0.01))


@kind("bear", "animals", also=("brown bear", "grizzly bear"),
    colours=dict(fur="brown|dark brown", muzzle="light brown", legs="=fur", ears="=fur",
        nose="!black", eyes="!black"))
def bear(o, rng):
    parts, head = beast(1.0, 0.3, 0.26, 0.11, 0.1, 25, 0.21, 0.1, 0.5)
    hump = ball(0.26, 0.24, 0.2).at(0.18, 0, 0.62)
    return dict(fur=[*parts["body"], hump], muzzle=parts["muzzle"], legs=parts["legs"],
        ears=round_ears(head, 0.2, 0.07), tail=ball(0.06).at(-0.48, 0, 0.55),
        eyes=eyes(head[0] + 0.18, 0.08, head[2] + 0.06, 0.024),
        nose=ball(0.045, 0.055, 0.04).at(head[0] + 0.3, 0, head[2] - 0.02))


@kind("rabbit", "animals", also=("bunny", "hare"),
    colours=dict(fur="white|grey|light brown", ears="=fur", tail="white", nose="pink",
        eyes="!black"),
    sizes=dict(ears="short 0.6|1|long 1.4"))
def rabbit(o, rng):
    head = np.array([0.2, 0, 0.6])
    ear = ball(0.04, 0.07, 0.24 * o.ears).at(z=0.24 * o.ears).turn("x", -12).turn("y", -8).at(0.14,
        0.08, 0.74)
    return dict(fur=[ball(0.36, 0.27, 0.3).at(-0.06, 0, 0.3), ball(0.19, 0.18, 0.18).at(*head),
        ball(0.17, 0.1, 0.17).at(-0.12, 0.22, 0.2).both(),
        limb((0.2, 0.1, 0.3), (0.26, 0.1, 0.06), 0.075, 0.055).both(),
        ball(0.17, 0.08, 0.06).at(0.02, 0.22, 0.06).both()], ears=ear.both(),
        tail=ball(0.1).at(-0.42, 0, 0.26), nose=ball(0.03, 0.035, 0.025).at(0.385, 0, 0.62),
        eyes=eyes(0.33, 0.11, 0.66, 0.033))


@kind("mouse", "animals", also=("little mouse", "rat"),
    colours=dict(fur="grey|white|light brown", ears="pink", tail="pink", nose="pink",
        eyes="!black"),
    sizes=dict(ears="small 0.7|1|large 1.35", tail="short 0.5|1|long 1.4"))
def mouse(o, rng):
    body = hull([(-0.35, 0.05, 0.1, 0.2), (-0.25, 0.22, 0, 0.4), (0.05, 0.22, 0, 0.42),
        (0.3, 0.13, 0.08, 0.34), (0.5, 0.02, 0.16, 0.2)])
    t = 0.6 * o.tail
    return dict(fur=[body, ball(0.07, 0.05, 0.035).at(0.18, 0.13, 0.03).both(),
        ball(0.1, 0.05, 0.04).at(-0.15, 0.17, 0.03).both()],
        ears=ball(0.03, 0.13 * o.ears, 0.13 * o.ears).turn("z", 20).at(0.18, 0.17, 0.42).both(),
        nose=ball(0.035).at(0.5, 0, 0.19),
        tail=tube([(-0.33, 0, 0.12), (-0.33 - 0.4 * t, 0.1, 0.04), (-0.33 - t, -0.08, 0.1)],
        [0.03, 0.022, 0.01]), eyes=eyes(0.35, 0.085, 0.26, 0.03))


@kind("fox", "animals",
    colours=dict(fur="orange", muzzle="white", ears="=fur", tail="=fur", legs="dark brown|black",
        nose="!black", eyes="!black", tip="white"),
    sizes=dict(tail="small 0.7|1|large 1.3"))
def fox(o, rng):
    parts, head = beast(0.8, 0.16, 0.32, 0.05, 0.14, 45, 0.14, 0.13, 0.3)
    brush = hull([(-0.95, 0.01, 0.62, 0.66), (-0.8, 0.1, 0.5, 0.72), (-0.6, 0.1, 0.4, 0.6),
        (-0.36, 0.03, 0.4, 0.46)]).at(0.36, 0, -0.43).scale(o.tail).at(-0.36, 0, 0.45)
    return dict(fur=parts["body"], muzzle=parts["muzzle"], legs=parts["legs"],
        ears=ears(head, 0.13, 0.18, 0.075, out=28), tail=brush.coat("tip", below("x", -0.82)),
        eyes=eyes(head[0] + 0.11, 0.07, head[2] + 0.04, 0.022),
        nose=ball(0.028).at(head[0] + 0.245, 0, head[2] - 0.05))


@kind("deer", "animals", also=("stag", "reindeer"),
    colours=dict(coat="light brown|brown", muzzle="=coat", legs="=coat", antlers="beige|cream",
        nose="black", eyes="!black", tail="white"),
    sizes=dict(antlers="small 0.6|1|large 1.4"))
def deer(o, rng):
    parts, head = beast(0.85, 0.17, 0.5, 0.042, 0.32, 60, 0.105, 0.13, 0.5, paws=False, droop=30)
    a = 0.3 * o.antlers
    beam = [(0, 0.04, 0.08), (-0.2 * a, 0.4 * a, 0.08 + 0.6 * a),
        (0.1 * a, 0.7 * a, 0.08 + 1.3 * a)]
    horns = [tube(beam, [0.022, 0.018, 0.008]),
        rod((-0.12 * a, 0.3 * a, 0.08 + 0.45 * a), (0.4 * a, 0.4 * a, 0.08 + 0.8 * a), 0.014,
        0.006), rod((-0.1 * a, 0.5 * a, 0.08 + 0.8 * a), (-0.4 * a, 0.55 * a, 0.08 + 1.2 * a),
        0.014, 0.006)]
    return dict(coat=parts["body"], muzzle=parts["muzzle"], legs=parts["legs"],
        antlers=[h.at(*head).both() for h in horns], ears=ears(head, 0.1, 0.12, 0.04, out=70),
        tail=ball(0.05, 0.04, 0.07).at(-0.43, 0, 0.7),
        eyes=eyes(head[0] + 0.07, 0.075, head[2] + 0.02, 0.02),
        nose=ball(0.03).at(head[0] + 0.2, 0, head[2] - 0.1))


@kind("zebra", "animals",
    colours=dict(coat="white", stripes="black", muzzle="black|dark grey", legs="=coat",
        mane="black", tail="black", eyes="!black"))
def zebra(o, rng):
    parts, head = beast(0.95, 0.2, 0.46, 0.055, 0.36, 52, 0.115, 0.18, 0.6, paws=False, droop=45)
    wave = ripples(rng, 1.5)
    lines = lambda u, v, p: np.sin(48 * p[:, 0] + 1.2 * wave(p)) > 0.1
    rings = lambda u, v, p: np.sin(52 * p[:, 2]) > 0.15
    mane = rod((0.36, 0, 0.86), head + (-0.1, 0, 0.1), 0.05, 0.045)
    return dict(coat=[parts["body"][0].coat("stripes", lines),
        *(s.coat("stripes", rings) for s in parts["body"][1:])], muzzle=parts["muzzle"],
        legs=[s.coat("stripes", rings) for s in parts["legs"]], mane=mane,
        ears=ears(head, 0.11, 0.12, 0.045, out=25),
        tail=tube([(-0.44, 0, 0.66), (-0.56, 0, 0.58), (-0.57, 0, 0.3)], [0.03, 0.03, 0.04]),
        eyes=eyes(head[0] + 0.07, 0.085, head[2] + 0.02, 0.02))


@kind("camel", "animals",
    colours=dict(coat="light brown|beige|straw", muzzle="=coat", legs="=coat", saddle="red",
        eyes="!black"),
    counts=dict(humps="1|2"),
    extras=dict(saddle=0.25))
def camel(o, rng):
    parts, head = beast(0.95, 0.2, 0.52, 0.05, 0.42, 60, 0.105, 0.13, 0.6, droop=15)
    xs = [0] if o.humps == 1 else [-0.22, 0.16]
    hump = [ball(0.18, 0.14, 0.24).at(x, 0, 0.86) for x in xs]
    cover = [ball(0.2, 0.17, 0.2).at(xs[0], 0, 0.84).coat("yellow",
        stripes(14, "z", 0.4))] if o.saddle else []
    return dict(coat=[*parts["body"], limb((0.35, 0, 0.62), (0.5, 0, 0.78), 0.13, 0.09)],
        humps=hump, muzzle=parts["muzzle"], legs=parts["legs"], saddle=cover,
        ears=ears(head, 0.1, 0.07, 0.03, out=50), tail=tail(-0.45, 0.66, 0.25, 0.025, -1.0),
        eyes=eyes(head[0] + 0.07, 0.08, head[2] + 0.03, 0.02))
