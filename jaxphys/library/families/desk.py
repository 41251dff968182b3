"""What lies on a desk or in a drawer."""

import numpy as np

from jaxphys.library.families.common import (
    ears,
    eyes,
    pairs,
)
from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    above,
    either,
    stripes,
    within,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cone,
    cylinder,
    helix,
    lathe,
    limb,
    oblong,
    plate,
    polygon,
    refined,
    ring,
    rod,
    sheet,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731


@kind("book", "household", also=("hardcover book", "closed book"),
    colours=dict(cover="red|blue|green|brown|purple", pages="!cream", title="golden|white"),
    forms=dict(thickness="thin 0.5|1|thick 1.8"))
def book(o, rng):
    t = 0.16 * o.thickness
    cover = [block(0.03, 0.68, 0.96).at(0.5 * t), block(0.03, 0.68, 0.96).at(-0.5 * t),
        block(t + 0.03, 0.03, 0.96).at(0, -0.34)]
    lines = either(within(z=(0.2, 0.3), y=(-0.2, 0.22), x=(0, 1)),
        within(z=(-0.34, -0.3), y=(-0.12, 0.14), x=(0, 1)), lambda u, v,
        p: (np.abs(np.abs(p[:, 1]) - 0.28) < 0.012) & (p[:,
        0] > 0) & (np.abs(p[:, 2]) < 0.42) | (np.abs(np.abs(p[:, 2]) - 0.42) < 0.012) & (p[:,
        0] > 0) & (np.abs(p[:, 1]) < 0.28))
    return each(dict(cover=[cover[0].coat("title", lines), *cover[1:]],
        pages=block(t, 0.64, 0.92).at(0, 0.0).shade(lambda u, v,
        p: 1 - 0.1 * ((p[:, 0] * 60) % 1 < 0.4))), lambda s: s.turn("z", 25).turn("x", -8))


@kind("open book", "household",
    colours=dict(pages="white|cream", cover="red|blue|brown|green", text="!dark grey"))
def open_book(o, rng):
    page = sheet(lambda u, v: np.stack([0.66 * (u - 0.5), 0.5 * v,
        0.03 + 0.13 * np.sin(np.pi * np.clip(v, 0, 1) ** 0.6) * (1 - 0.3 * v)], -1), 0.06)
    text = lambda u, v, p: ((p[:, 0] * 20) % 1 < 0.35) & (np.abs(p[:, 0]) < 0.25) & (p[:,
        1] > 0.08) & (p[:, 1] < 0.44) & (u < 0.5)
    other = lambda u, v, p: text(u, v, p)
    return each(dict(pages=[page.coat("text", other).both()],
        cover=[block(0.7, 1.04, 0.03).at(z=-0.0)]), lambda s: s.turn("y", 30))


@kind("pencil", "household",
    colours=dict(body="yellow|red|blue|green", eraser="pink", tip="!beige", lead="black|red|blue",
        band="silver|golden"),
    sizes=dict(eraser="small 0.7|1|large 1.5"))
def pencil(o, rng):
    e = 0.06 * o.eraser
    hexagon = lathe([(0, 0), (1, 0), (1, 0.75), (0, 0.75)], sharp=True,
        outline=polygon(6, 0.055)).shade(lambda u, v, p: 0.9 + 0.12 * (np.floor(u * 6) % 2))
    point = cone(0.054, 0.17).turn("x", 180).coat("lead", above("z", 0.115))
    return each(dict(body=hexagon, tip=point, band=cylinder(0.056, 0.07).at(z=0.75),
        eraser=cylinder(0.054, e, bevel=0.012).at(z=0.82)), lambda s: s.at(z=-0.4).turn("x", 40))


@kind("pen", "household", also=("ballpoint pen",),
    colours=dict(body="blue|black|red|green", cap="=body", clip="silver|golden", tip="silver"))
def pen(o, rng):
    return each(dict(body=lathe([(0, -0.4), (0.018, -0.4), (0.04, -0.3), (0.045, 0.1), (0, 0.1)],
        sharp=True), cap=lathe([(0, 0.06), (0.052, 0.06), (0.048, 0.42), (0.03, 0.45), (0, 0.45)],
        sharp=True), clip=[block(0.02, 0.025, 0.28).at(0.06, 0, 0.27),
        ring(0.05, 0.012).at(z=0.07)], tip=cone(0.016, 0.06).turn("x", 180).at(z=-0.39)),
        lambda s: s.turn("x", 42))


@kind("key", "household", also=("old key", "door key"),
    colours=dict(key="golden|silver|copper|dark grey"),
    sizes=dict(shaft="short 0.7|1|long 1.25"),
    counts=dict(teeth="1|2|3"))
def key(o, rng):
    s = 0.66 * o.shaft
    teeth = [block(0.05, 0.13, 0.05).at(0, 0.09, -s + 0.03 + 0.1 * k) for k in range(o.teeth)]
    return each(dict(key=[ring(0.14, 0.045).turn("y", 90).scale(0.7, 1.15, 1).at(z=0.16),
        rod((0, 0, 0.03), (0, 0, -s), 0.038),
        ring(0.04, 0.022).copies([(0, 0, -0.02), (0, 0, -0.08)]), *teeth], shaft=[], teeth=[]),
        lambda x: x.turn("x", -35))


@kind("padlock", "household", also=("lock",),
    colours=dict(body="golden|silver|red|blue", shackle="silver|metal"))
def padlock(o, rng):
    a = np.linspace(0, np.pi, 9)
    bow = np.concatenate([[(0, 0.18, 0.1)],
        np.stack([0 * a, 0.18 * np.cos(a), 0.3 + 0.2 * np.sin(a)], -1), [(0, -0.18, 0.1)]])
    return dict(body=block(0.24, 0.56, 0.46, 0.06).at(z=-0.02), shackle=tube(bow, 0.05),
        black=[cylinder(0.055, 0.02).turn("y", 90).at(0.115, 0, 0.0),
        block(0.02, 0.045, 0.14).at(0.125, 0, -0.07)])


@kind("suitcase", "household", also=("travel suitcase", "luggage"),
    colours=dict(case="brown|leather|red|blue|turquoise", straps="dark brown|beige",
        handle="=straps", locks="golden|silver"))
def suitcase(o, rng):
    return dict(case=block(0.32, 0.96, 0.64, 0.05).at(z=0.32).coat("black", lambda u, v,
        p: np.abs(p[:, 0]) < 0.007),
        straps=[block(0.34, 0.08, 0.66, 0.02).at(0, 0.26, 0.32).both(),
        block(0.335, 0.06, 0.66).at(0, 0.45, 0.32).both()],
        handle=tube([(0, -0.13, 0.63), (0, -0.11, 0.73), (0, 0.11, 0.73), (0, 0.13, 0.63)], 0.028),
        locks=block(0.08, 0.1, 0.05).at(0.12, 0.26, 0.65).both())


@kind("gift box", "household", also=("present", "wrapped gift", "gift"),
    colours=dict(box="red|blue|green|white|purple", ribbon="golden|white|red|pink",
        pattern="white|yellow"),
    forms=dict(height="flat 0.55|1|tall 1.5", style="plain|striped|dotted"))
def gift(o, rng):
    h = 0.62 * o.height
    body = block(0.7, 0.7, h).at(z=0.5 * h)
    if o.style == "striped":
        body = body.coat("pattern", stripes(9, "y", 0.35))
    elif o.style == "dotted":
        body = body.coat("pattern", lambda u, v,
            p: (np.hypot((p[:, 0] * 7 + p[:, 1] * 7) % 1 - 0.5, (p[:, 2] * 7) % 1 - 0.5) < 0.24))
    bow = [tube([(0, 0, 0), (0, 0.12, 0.2), (0, 0.3, 0.2), (0, 0.28, 0.06), (0, 0, 0)], 0.055,
        flat=0.5).at(z=h + 0.03).both(),
        tube([(0, 0, 0), (0.12, 0, 0.2), (0.3, 0, 0.18), (0.27, 0, 0.05), (0, 0, 0)], 0.055,
        flat=0.5).at(z=h + 0.03).both("x"), ball(0.07).at(z=h + 0.06)]
    return dict(box=[body, block(0.74, 0.74, 0.15).at(z=h - 0.06)],
        ribbon=[block(0.12, 0.76, h + 0.04).at(z=0.5 * h),
        block(0.76, 0.12, h + 0.04).at(z=0.5 * h), *bow])


@kind("mailbox", "household", also=("post box", "letter box"),
    colours=dict(box="red|blue|silver|yellow", flag="red|yellow", post="wooden|brown|white"))
def mailbox(o, rng):
    arch = refined([(0.17, -0.14), (0.17, 0.1), (0.12, 0.2), (0, 0.25), (-0.12, 0.2), (-0.17, 0.1),
        (-0.17, -0.14)])
    return each(dict(box=plate(arch, 0.62).at(0.06, 0, 0.86).coat("dark grey", lambda u, v,
        p: (p[:, 2] > 0.305) & (np.abs(np.hypot(p[:, 0], p[:, 1] * 0.8) - 0.12) < 0.012)),
        flag=[block(0.04, 0.02, 0.22).at(0.1, 0.18, 0.95),
        block(0.13, 0.02, 0.09).at(0.15, 0.185, 1.02)], post=block(0.1, 0.1, 0.75).at(z=0.37),
        silver=ball(0.02).at(0.38, 0, 0.97)), lambda s: s.turn("z", 20))


@kind("envelope", "household", also=("letter",),
    colours=dict(paper="white|cream|light blue|yellow", seal="red|golden"),
    forms=dict(style="sealed|plain"))
def envelope(o, rng):
    line = lambda u, v, p: (np.abs(p[:,
        1] - 0.33 + 0.62 * (0.5 - np.abs(p[:, 0]))) < 0.012) | (np.abs(p[:,
        1] + 0.33 - 0.55 * (0.5 - np.abs(p[:, 0]))) < 0.01) & (p[:, 1] < 0.02)
    return each(dict(paper=plate(oblong(1.0, 0.66), 0.05).shade(lambda u, v,
        p: 1 - 0.35 * (line(u, v, p) & (p[:, 2] > 0))),
        seal=cylinder(0.08, 0.03, bevel=0.01).turn("y", 90).at(0.02, 0,
        0.03) if o.style == "sealed" else []), lambda s: s.turn("y", -15))


@kind("piggy bank", "household", also=("coin bank", "pig money box"),
    colours=dict(body="pink|white|blue", coin="golden", slot="!black", nose="=body"),
    extras=dict(coin=0.5))
def piggy_bank(o, rng):
    return dict(body=[ball(0.42, 0.34, 0.33).at(z=0.42),
        ears(np.array([0.26, 0, 0.62]), 0.14, 0.16, 0.08, out=35, back=-20),
        limb((0, 0, 0.2), (0, 0, 0.05), 0.09).copies(pairs((-0.2, 0.2), 0.18, 0)),
        helix(0.05, 0.12, 1.4, 0.02).turn("y", -80).at(-0.4, 0, 0.48)],
        nose=cylinder(0.12, 0.08, bevel=0.02).turn("y", 90).at(0.4, 0, 0.42),
        slot=block(0.2, 0.035, 0.02).at(-0.03, 0, 0.748),
        black=[eyes(0.33, 0.15, 0.53, 0.03), ball(0.02, 0.025, 0.04).at(0.475, 0.04, 0.42).both()],
        coin=cylinder(0.1, 0.025).turn("x", 90).at(-0.03, 0.012, 0.82) if o.coin else [])


@kind("crayon", "household", also=("wax crayon",),
    colours=dict(wax="red|blue|green|yellow|orange|purple", wrapper="=wax", lines="!black"))
def crayon(o, rng):
    band = lambda u, v, p: (np.abs(np.abs(p[:, 2] - 0.02) - 0.3) < 0.015) | (np.abs(p[:,
        2] - 0.02) < 0.13) & (np.abs(u - 0.5) < 0.13) & ((p[:, 2] * 20) % 1 < 0.6)
    return each(dict(wax=lathe([(0, -0.5), (0.09, -0.5), (0.09, 0.36), (0.045, 0.4), (0.025, 0.54),
        (0, 0.54)], sharp=True), wrapper=cylinder(0.098, 0.72).at(z=-0.34).coat("lines", lambda u,
        v, p: band(u, v, p - (0, 0, 0.34))).shade(lambda u, v, p: 0.85)), lambda s: s.turn("x", 42))


@kind("spool of thread", "household", also=("thread spool", "reel of thread"),
    colours=dict(thread="red|blue|green|yellow|pink|purple", spool="wooden|beige", needle="silver"),
    extras=dict(needle=0.4))
def spool(o, rng):
    return dict(thread=lathe([(0, -0.28), (0.27, -0.28), (0.3, 0), (0.27, 0.28),
        (0, 0.28)]).shade(lambda u, v,
        p: 0.88 + 0.14 * (np.sin(150 * p[:, 2] + 3 * np.sin(2 * np.pi * u)) > 0)),
        spool=lathe([(0, 0), (0.37, 0), (0.37, 0.06), (0.2, 0.14), (0, 0.14)], sharp=True).turn("x",
        180).at(z=0.42).joined(lathe([(0, 0), (0.37, 0), (0.37, 0.06), (0.2, 0.14), (0, 0.14)],
        sharp=True).at(z=-0.42)), black=cylinder(0.07, 0.01).at(z=0.415),
        needle=rod((0.33, -0.35, 0.25), (0.3, 0.32, -0.3), 0.016, 0.004) if o.needle else [])
