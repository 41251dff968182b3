"""Things of the household and the desk; their front faces +x."""

import numpy as np

from experiments.priors.models.families.common import (
    ears,
    eyes,
    pairs,
)
from experiments.priors.models.kinds import kind
from experiments.priors.models.palette import ripples
from experiments.priors.models.patterns import (
    above,
    also,
    between,
    either,
    mottled,
    patterned,
    sectors,
    stripes,
    within,
)
from experiments.priors.models.shapes import (
    ball,
    block,
    cone,
    cushion,
    cylinder,
    handle,
    helix,
    hull,
    lathe,
    limb,
    oblong,
    plate,
    polygon,
    refined,
    ring,
    rod,
    rounded,
    sheet,
    slab,
    tube,
)
from experiments.priors.models.solids import each, together

# fmt: off


@kind("bottle", "household", also=("wine bottle", "glass bottle"), colours=dict(glass="green|brown|dark green|blue|white", label="white|cream|red|yellow", cap="red|golden|black|white"), sizes=dict(neck="short 0.6|1|long 1.5"), forms=dict(width="thin 0.75|1|wide 1.35"), extras=dict(label=0.8))
def bottle(o, rng):
    w, n = 0.17 * o.width, 0.28 * o.neck
    body = lathe([(0, 0), (w, 0.02), (w, 0.5), (0.9 * w, 0.58), (0.06, 0.66), (0.055, 0.66 + 0.85 * n), (0.07, 0.66 + 0.86 * n), (0.07, 0.66 + n), (0, 0.66 + n)])
    return dict(glass=body.coat("label", between("z", 0.14, 0.42)) if o.label else body, cap=cylinder(0.072, 0.08, bevel=0.01).at(z=0.62 + n))


@kind("can", "household", also=("tin can", "soda can", "drinks can"), colours=dict(label="red|blue|green|orange|silver", lid="silver", stripe="white|yellow"), forms=dict(height="short 0.75|1|tall 1.3", style="plain|striped"))
def can(o, rng):
    h, r = 0.8 * o.height, 0.25
    body = lathe([(0, 0), (0.8 * r, 0), (r, 0.05), (r, h - 0.07), (0.82 * r, h), (0.78 * r, h - 0.015), (0, h - 0.015)], sharp=True)
    body = body.coat("lid", lambda u, v, p: (p[:, 2] < 0.045) | (p[:, 2] > h - 0.065))
    if o.style == "striped":
        wave = lambda u, v, p: np.abs(p[:, 2] - 0.5 * h - 0.1 * np.sin(2 * np.pi * u + 1)) < 0.07  # noqa: E731
        body = body.coat("stripe", wave)
    tab = [ball(0.08, 0.05, 0.012).at(0.04, 0, h), ball(0.03, 0.025, 0.014).at(0.0, 0, h)]
    return dict(label=body, lid=tab)


@kind("jar", "household", also=("jam jar", "jar of jam"), colours=dict(jam="red|orange|purple|golden", lid="golden|red|white|blue", label="white|cream"), extras=dict(label=0.6))
def jar(o, rng):
    body = lathe([(0, 0), (0.26, 0.01), (0.29, 0.06), (0.29, 0.45), (0.23, 0.54), (0, 0.54)])
    return dict(jam=body.coat("label", also(between("z", 0.13, 0.38), above("x", 0.1))) if o.label else body, lid=cylinder(0.25, 0.12, bevel=0.015).at(z=0.54).shade(lambda u, v, p: 1 - 0.12 * ((u * 40) % 1 < 0.4)))


@kind("candle", "household", also=("burning candle",), colours=dict(wax="white|red|cream|blue|pink", flame="!orange", saucer="golden|white|silver", stripes="golden|white"), forms=dict(height="short 0.6|1|tall 1.4", style="plain|striped"), extras=dict(saucer=0.7))
def candle(o, rng):
    r, h = rng.uniform(0.09, 0.14), 0.55 * o.height
    body = lathe([(0, 0.02), (r, 0.02), (r, h), (0.8 * r, h - 0.012), (0, h - 0.03)], sharp=True)
    if o.style == "striped":
        body = body.coat("stripes", lambda u, v, p: (p[:, 2] * 9 + u) % 1 < 0.35)
    drips = [limb((r * np.cos(a), r * np.sin(a), h - 0.01), (r * np.cos(a), r * np.sin(a), h - d), 0.022) for a, d in zip(rng.uniform(0, 6, 4), rng.uniform(0.08, 0.25, 4), strict=True)]
    return dict(wax=[body, *drips], black=rod((0, 0, h - 0.03), (0.005, 0, h + 0.06), 0.012), flame=lathe([(0, h + 0.03), (0.05, h + 0.09), (0.03, h + 0.17), (0, h + 0.24)]), yellow=lathe([(0, h + 0.025), (0.052, h + 0.08), (0, h + 0.12)]), saucer=[lathe([(0, 0), (0.2, 0), (0.3, 0.06), (0.27, 0.06), (0.18, 0.02), (0, 0.02)]), ring(0.06, 0.018).turn("x", 90).at(0, 0.33, 0.05)] if o.saucer else [])


@kind("sponge", "household", also=("kitchen sponge", "cleaning sponge"), colours=dict(sponge="yellow|orange|pink", pad="green|blue", holes="!golden"), extras=dict(pad=0.55))
def sponge(o, rng):
    body = block(0.62, 1.0, 0.36, 0.06)
    spots = rng.uniform((-0.31, -0.5, -0.18), (0.31, 0.5, 0.18), (240, 3))
    sizes = rng.uniform(0.015, 0.045, 240)
    dark = lambda u, v, p: 1 - 0.32 * ((np.sqrt(((p[:, None] - spots) ** 2).sum(-1)) - sizes).min(1) < 0)  # noqa: E731
    return dict(sponge=body.shade(dark), pad=block(0.63, 1.01, 0.1, 0.03).at(z=-0.22) if o.pad else [])


@kind("book", "household", also=("hardcover book", "closed book"), colours=dict(cover="red|blue|green|brown|purple", pages="!cream", title="golden|white"), forms=dict(thickness="thin 0.5|1|thick 1.8"))
def book(o, rng):
    t = 0.16 * o.thickness
    cover = [block(0.03, 0.68, 0.96).at(0.5 * t), block(0.03, 0.68, 0.96).at(-0.5 * t), block(t + 0.03, 0.03, 0.96).at(0, -0.34)]
    lines = either(within(z=(0.2, 0.3), y=(-0.2, 0.22), x=(0, 1)), within(z=(-0.34, -0.3), y=(-0.12, 0.14), x=(0, 1)), lambda u, v, p: (np.abs(np.abs(p[:, 1]) - 0.28) < 0.012) & (p[:, 0] > 0) & (np.abs(p[:, 2]) < 0.42) | (np.abs(np.abs(p[:, 2]) - 0.42) < 0.012) & (p[:, 0] > 0) & (np.abs(p[:, 1]) < 0.28))
    return each(dict(cover=[cover[0].coat("title", lines), *cover[1:]], pages=block(t, 0.64, 0.92).at(0, 0.0).shade(lambda u, v, p: 1 - 0.1 * ((p[:, 0] * 60) % 1 < 0.4))), lambda s: s.turn("z", 25).turn("x", -8))


@kind("open book", "household", colours=dict(pages="white|cream", cover="red|blue|brown|green", text="!dark grey"))
def open_book(o, rng):
    page = sheet(lambda u, v: np.stack([0.66 * (u - 0.5), 0.5 * v, 0.03 + 0.13 * np.sin(np.pi * np.clip(v, 0, 1) ** 0.6) * (1 - 0.3 * v)], -1), 0.06)
    text = lambda u, v, p: ((p[:, 0] * 20) % 1 < 0.35) & (np.abs(p[:, 0]) < 0.25) & (p[:, 1] > 0.08) & (p[:, 1] < 0.44) & (u < 0.5)  # noqa: E731
    other = lambda u, v, p: text(u, v, p)  # noqa: E731
    return each(dict(pages=[page.coat("text", other).both()], cover=[block(0.7, 1.04, 0.03).at(z=-0.0)]), lambda s: s.turn("y", 30))


@kind("pencil", "household", colours=dict(body="yellow|red|blue|green", eraser="pink", tip="!beige", lead="black|red|blue", band="silver|golden"), sizes=dict(eraser="small 0.7|1|large 1.5"))
def pencil(o, rng):
    e = 0.06 * o.eraser
    hexagon = lathe([(0, 0), (1, 0), (1, 0.75), (0, 0.75)], sharp=True, outline=polygon(6, 0.055)).shade(lambda u, v, p: 0.9 + 0.12 * (np.floor(u * 6) % 2))
    point = cone(0.054, 0.17).turn("x", 180).coat("lead", above("z", 0.115))
    return each(dict(body=hexagon, tip=point, band=cylinder(0.056, 0.07).at(z=0.75), eraser=cylinder(0.054, e, bevel=0.012).at(z=0.82)), lambda s: s.at(z=-0.4).turn("x", 40))


@kind("pen", "household", also=("ballpoint pen",), colours=dict(body="blue|black|red|green", cap="=body", clip="silver|golden", tip="silver"))
def pen(o, rng):
    return each(dict(body=lathe([(0, -0.4), (0.018, -0.4), (0.04, -0.3), (0.045, 0.1), (0, 0.1)], sharp=True), cap=lathe([(0, 0.06), (0.052, 0.06), (0.048, 0.42), (0.03, 0.45), (0, 0.45)], sharp=True), clip=[block(0.02, 0.025, 0.28).at(0.06, 0, 0.27), ring(0.05, 0.012).at(z=0.07)], tip=cone(0.016, 0.06).turn("x", 180).at(z=-0.39)), lambda s: s.turn("x", 42))


@kind("key", "household", also=("old key", "door key"), colours=dict(key="golden|silver|copper|dark grey"), sizes=dict(shaft="short 0.7|1|long 1.25"), counts=dict(teeth="1|2|3"))
def key(o, rng):
    s = 0.66 * o.shaft
    teeth = [block(0.05, 0.13, 0.05).at(0, 0.09, -s + 0.03 + 0.1 * k) for k in range(o.teeth)]
    return each(dict(key=[ring(0.14, 0.045).turn("y", 90).scale(0.7, 1.15, 1).at(z=0.16), rod((0, 0, 0.03), (0, 0, -s), 0.038), ring(0.04, 0.022).copies([(0, 0, -0.02), (0, 0, -0.08)]), *teeth], shaft=[], teeth=[]), lambda x: x.turn("x", -35))


@kind("padlock", "household", also=("lock",), colours=dict(body="golden|silver|red|blue", shackle="silver|metal"))
def padlock(o, rng):
    a = np.linspace(0, np.pi, 9)
    bow = np.concatenate([[(0, 0.18, 0.1)], np.stack([0 * a, 0.18 * np.cos(a), 0.3 + 0.2 * np.sin(a)], -1), [(0, -0.18, 0.1)]])
    return dict(body=block(0.24, 0.56, 0.46, 0.06).at(z=-0.02), shackle=tube(bow, 0.05), black=[cylinder(0.055, 0.02).turn("y", 90).at(0.115, 0, 0.0), block(0.02, 0.045, 0.14).at(0.125, 0, -0.07)])


@kind("phone", "household", also=("smartphone", "mobile phone", "cell phone"), colours=dict(body="black|white|silver|red|blue", screen="!light blue", buttons="=body"))
def phone(o, rng):
    icons = lambda u, v, p: (np.abs((p[:, 1] * 9.5) % 1 - 0.5) < 0.27) & (np.abs((p[:, 2] * 9.5 + 0.3) % 1 - 0.5) < 0.27) & (p[:, 0] > 0)  # noqa: E731
    face = block(0.02, 0.43, 0.86, 0.0).at(0.04)
    return each(dict(body=plate(oblong(0.5, 1.0, 0.08), 0.08, edge=0.015), screen=face.coat("white", lambda u, v, p: icons(u, v, p) & (p[:, 2] < 0.25)).coat("blue", lambda u, v, p: icons(u, v, p) & (np.sin(40 * p[:, 1] + 25 * p[:, 2]) > 0.2)), buttons=block(0.03, 0.02, 0.12).at(0, 0.255, 0.2), black=cylinder(0.045, 0.02).turn("y", -90).at(-0.04, 0.14, 0.38)), lambda s: s.turn("y", -10).turn("z", 15))


@kind("telephone", "household", also=("old telephone", "rotary phone"), colours=dict(body="red|black|green|cream", receiver="=body", dial="white|cream", holes="!black"))
def telephone(o, rng):
    base = lathe([(0, 0), (1, 0), (0.97, 0.1), (0.6, 0.3), (0, 0.32)], outline=oblong(0.56, 0.66, 0.12))
    k = np.deg2rad(36 * np.arange(10))
    holes = cylinder(0.025, 0.02).copies(np.stack([0.095 * np.cos(k), 0.095 * np.sin(k), 0 * k + 0.03], -1))
    dial = [s.turn("y", 42).at(0.2, 0, 0.2) for s in (cylinder(0.14, 0.04), holes)]
    bar = tube([(0, -0.3, 0.4), (0, -0.2, 0.46), (0, 0, 0.49), (0, 0.2, 0.46), (0, 0.3, 0.4)], 0.05)
    return dict(body=[base, block(0.07, 0.34, 0.1, 0.02).at(-0.03, 0, 0.36)], receiver=[bar, lathe([(0, 0), (0.1, 0), (0.08, 0.1), (0, 0.1)]).at(0, 0.32, 0.32).both()], dial=dial[0], holes=dial[1])


@kind("laptop", "household", also=("notebook computer", "laptop computer"), colours=dict(body="silver|dark grey|white|black", screen="!light blue", keys="!black"))
def laptop(o, rng):
    lid = [block(0.03, 1.0, 0.66, 0.01).at(z=0.33), block(0.01, 0.92, 0.56).at(0.016, 0, 0.34).coat("blue", lambda u, v, p: p[:, 2] < 0.12 * np.sin(5 * p[:, 1]) - 0.05)]
    lid = [s.turn("y", -18).at(-0.33) for s in lid]
    return dict(body=[block(0.66, 1.0, 0.05, 0.02), lid[0], block(0.18, 0.3, 0.01).at(0.22, 0, 0.025).shade(lambda u, v, p: 0.88)], screen=lid[1], keys=block(0.055, 0.068, 0.02).copies([(x, y, 0.025) for x in (-0.22, -0.145, -0.07, 0.005) for y in np.linspace(-0.4, 0.4, 11)]))


@kind("computer", "household", also=("desktop computer", "computer monitor", "old computer"), colours=dict(case="beige|white|black|silver", screen="!dark blue", keyboard="=case", keys="!light grey"))
def computer(o, rng):
    return dict(case=[block(0.1, 0.76, 0.54, 0.03).at(-0.1, 0, 0.52), hull([(-0.4, 0.2, 0.34, 0.66), (-0.14, 0.35, 0.27, 0.76)], square=6), block(0.3, 0.3, 0.16, 0.03, 0.6).at(-0.16, 0, 0.17), block(0.44, 0.6, 0.07, 0.02).at(-0.14, 0, 0.06)], screen=block(0.02, 0.62, 0.4).at(-0.045, 0, 0.54).coat("light green", lambda u, v, p: ((p[:, 2] * 19) % 1 < 0.35) & (p[:, 1] < 0.15 * np.sin(40 * np.floor(p[:, 2] * 19)) + 0.1) & (np.abs(p[:, 2]) < 0.15) & (p[:, 1] > -0.26)), keyboard=block(0.24, 0.72, 0.05, 0.015).at(0.36, 0, 0.03), keys=block(0.045, 0.05, 0.03).copies([(x, y, 0.055) for x in (0.28, 0.34, 0.4, 0.45) for y in np.linspace(-0.31, 0.31, 11)]))


@kind("television", "household", also=("tv", "old television", "tv set"), colours=dict(case="wooden|brown|red|orange|black", screen="!light blue", knobs="silver|golden", legs="black|brown", antenna="silver"))
def television(o, rng):
    rods = [rod((-0.05, 0, 0.66), (-0.08, s * 0.26, 1.0), 0.01) for s in (-1, 1)]
    return dict(case=block(0.4, 0.9, 0.6, 0.05).at(z=0.37), screen=cushion(0.08, 0.58, 0.46, 4).at(0.19, -0.1, 0.37).coat("white", lambda u, v, p: (p[:, 1] + p[:, 2] > 0.22) & (p[:, 1] + p[:, 2] < 0.3)), knobs=[cylinder(0.05, 0.05, 0.04).turn("y", 90).copies([(0.2, 0.33, 0.53), (0.2, 0.33, 0.39)])], **{"dark grey": block(0.02, 0.13, 0.012).copies([(0.2, 0.33, z) for z in (0.18, 0.21, 0.24, 0.27)])}, legs=rod((0.12, 0.34, 0.1), (0.17, 0.42, -0.12), 0.03, 0.018).both("y").both("x"), antenna=[*rods, ball(0.06).at(-0.05, 0, 0.67)])


@kind("radio", "household", also=("old radio", "portable radio"), colours=dict(case="wooden|red|turquoise|cream|brown", speaker="!beige", knobs="golden|silver|black", handle="=case", antenna="silver"), extras=dict(handle=0.6, antenna=0.6))
def radio(o, rng):
    mesh = cylinder(0.19, 0.03).turn("y", 90)
    return dict(case=block(0.26, 1.0, 0.56, 0.05).at(z=0.28), speaker=mesh.shade(lambda u, v, p: 0.75 + 0.25 * ((p[:, 0] * 26) % 1 < 0.55)).at(0.115, -0.24, 0.28), cream=block(0.02, 0.38, 0.14).at(0.13, 0.22, 0.4).coat("red", lambda u, v, p: np.abs(p[:, 1] - 0.04) < 0.012).coat("black", lambda u, v, p: (np.abs(p[:, 2] + 0.03) < 0.012) & ((p[:, 1] * 22) % 1 < 0.4)), knobs=cylinder(0.06, 0.06, 0.05).turn("y", 90).copies([(0.12, 0.1, 0.16), (0.12, 0.32, 0.16)]), handle=tube([(0, -0.36, 0.52), (0, -0.34, 0.68), (0, 0, 0.72), (0, 0.34, 0.68), (0, 0.36, 0.52)], 0.025) if o.handle else [], antenna=rod((-0.08, 0.42, 0.55), (-0.08, 0.62, 1.0), 0.012) if o.antenna else [])


@kind("camera", "household", also=("photo camera",), colours=dict(body="black|silver|brown|red", top="silver|black", lens="black|dark grey", glass="!light blue", button="red|silver"), sizes=dict(lens="short 0.6|1|long 1.8"))
def camera(o, rng):
    long = 0.26 * o.lens
    return dict(body=block(0.28, 0.9, 0.42, 0.05).at(z=0.23).shade(mottled(ripples(rng, 24), 0.05)), top=[block(0.27, 0.9, 0.12, 0.03).at(z=0.5), block(0.22, 0.28, 0.14, 0.03, 0.8).at(0, 0, 0.6), cylinder(0.07, 0.07).at(0, -0.32, 0.55)], lens=[lathe([(0.0, 0), (0.2, 0), (0.2, 0.4 * long), (0.17, 0.45 * long), (0.17, long), (0.14, long), (0.1, long - 0.05), (0, long - 0.05)], sharp=True).turn("y", 90).at(0.12, 0, 0.25)], glass=ball(0.03, 0.11, 0.11).at(0.08 + long, 0, 0.25), button=cylinder(0.04, 0.05).at(0, 0.32, 0.55), cream=block(0.02, 0.13, 0.08).at(0.14, 0.3, 0.48))


@kind("clock", "household", also=("wall clock", "round clock"), colours=dict(rim="red|blue|brown|golden|black|white", face="white|cream", hands="black|red", marks="!black"))
def clock(o, rng):
    k = np.deg2rad(30 * np.arange(12))
    marks = [block(0.02, 0.025, 0.08).turn("x", -30 * i).at(0.055, 0.36 * np.sin(a), 0.36 * np.cos(a)) for i, a in enumerate(k)]
    a, b = rng.uniform(0, 360, 2)
    return dict(rim=ring(0.45, 0.055).turn("y", 90), face=cylinder(0.44, 0.05).turn("y", 90), marks=marks, hands=[block(0.02, 0.035, 0.22).at(0.065, 0, 0.1).turn("x", a), block(0.02, 0.025, 0.34).at(0.07, 0, 0.15).turn("x", b), cylinder(0.035, 0.04).turn("y", 90).at(0.05)])


@kind("alarm clock", "household", colours=dict(body="red|blue|yellow|turquoise|golden", face="white", bells="=body", hands="black", feet="silver|golden"))
def alarm_clock(o, rng):
    k = np.deg2rad(30 * np.arange(12))
    marks = [block(0.02, 0.02, 0.06).turn("x", -30 * i).at(0.15, 0.26 * np.sin(a), 0.26 * np.cos(a)) for i, a in enumerate(k)]
    bell = lathe([(0.15, 0), (0.16, 0.01), (0.12, 0.1), (0, 0.14)]).turn("x", -32).at(0, 0.2, 0.33)
    return dict(body=cylinder(0.36, 0.26, bevel=0.04).at(z=-0.13).turn("y", 90), face=cylinder(0.31, 0.03).turn("y", 90).at(0.115), black=marks, hands=[block(0.02, 0.03, 0.15).at(0.155, 0, 0.07).turn("x", 60), block(0.02, 0.022, 0.24).at(0.16, 0, 0.11).turn("x", -40)], bells=bell.both(), feet=[limb((0, 0.2, -0.28), (0, 0.28, -0.43), 0.035).both(), tube([(0, 0.06, 0.5), (0, 0.05, 0.6), (0, -0.05, 0.6), (0, -0.06, 0.5)], 0.02), rod((0, 0, 0.34), (0, 0, 0.52), 0.02)])


@kind("hourglass", "household", also=("sand timer", "egg timer"), colours=dict(frame="wooden|golden|brown|black", sand="golden|straw|red|blue", glass="!glass"))
def hourglass(o, rng):
    bulb = lathe([(0, -0.4), (0.2, -0.4), (0.23, -0.25), (0.13, -0.08), (0.035, 0), (0.13, 0.08), (0.23, 0.25), (0.2, 0.4), (0, 0.4)])
    level = rng.uniform(0.15, 0.25)
    return dict(glass=bulb.coat("sand", lambda u, v, p: (p[:, 2] < -level) | (p[:, 2] > 0) & (p[:, 2] < 0.3 - level)), frame=[cylinder(0.3, 0.06, bevel=0.015).copies([(0, 0, 0.4), (0, 0, -0.46)]), rod((0.25, 0, -0.42), (0.25, 0, 0.42), 0.025).turn("z", 30).around(3)])


@kind("light bulb", "household", also=("lightbulb", "bulb"), colours=dict(glass="cream|yellow|white", base="silver|golden", tip="!black"))
def light_bulb(o, rng):
    return dict(glass=lathe([(0, -0.12), (0.13, -0.12), (0.15, 0.0), (0.28, 0.24), (0.29, 0.4), (0.2, 0.57), (0, 0.63)]), base=lathe([(0, -0.36), (0.1, -0.36), (0.13, -0.33), (0.13, -0.1), (0, -0.1)]).shade(lambda u, v, p: 0.72 + 0.28 * (((p[:, 2] + 0.02 * u) * 17) % 1 > 0.4)), tip=cone(0.08, 0.06).turn("x", 180).at(z=-0.35))


@kind("globe", "household", also=("world globe", "earth globe"), colours=dict(sea="blue|light blue|turquoise", land="green|beige|light green", stand="wooden|golden|brown", ice="!white"))
def globe(o, rng):
    wave = ripples(rng, 1.1, 10)
    a = np.linspace(-1.3, 1.3, 11) - 0.4
    arm = tube(np.stack([0 * a, 0.44 * np.cos(a), 0.44 * np.sin(a)], -1), 0.022)
    return dict(sea=ball(0.4, fine=12).coat("land", lambda u, v, p: (wave(p) - 0.25) * 8).coat("ice", lambda u, v, p: np.abs(p[:, 2]) > 0.36).turn("x", -23), stand=[arm, rod((0, -0.17, 0.4), (0, 0.17, -0.4), 0.012), rod((0, 0.1, -0.42), (0, 0, -0.62), 0.03), lathe([(0, -0.68), (0.26, -0.68), (0.24, -0.64), (0.05, -0.58), (0, -0.58)])])


@kind("mirror", "household", also=("hand mirror",), colours=dict(frame="golden|pink|silver|wooden|white", glass="!glass", handle="=frame"), sizes=dict(handle="short 0.6|1|long 1.4"))
def mirror(o, rng):
    h = 0.42 * o.handle
    return each(dict(frame=[ring(0.3, 0.045).turn("y", 90).scale(0.9, 1, 1.15), ball(0.05).copies([(0, 0, 0.37)])], glass=plate(polygon(28, 0.3), 0.04).scale(1, 1, 1.15).coat("white", lambda u, v, p: np.abs(p[:, 0] + p[:, 1] - 0.1) < 0.035), handle=lathe([(0, -0.36), (0.035, -0.36), (0.03, -0.42), (0.05, -0.36 - 0.6 * h), (0.04, -0.36 - h), (0, -0.38 - h)])), lambda s: s.turn("x", 15))


@kind("umbrella", "household", also=("open umbrella", "parasol"), colours=dict(canopy="red|blue|yellow|purple|black", panels="white|yellow|light blue", handle="brown|wooden|black"), forms=dict(style="plain|striped"), sizes=dict(handle="short 0.7|1|long 1.3"))
def umbrella(o, rng):
    n = 8
    a = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    rim = 0.5 * (1 - 0.06 * np.abs(np.sin(0.5 * n * a)))
    top = lathe([(0, 0.27), (0.4, 0.22), (0.8, 0.08), (1.0, -0.06), (0.97, -0.06), (0.78, 0.05), (0.38, 0.19), (0, 0.24)], outline=np.stack([rim * np.cos(a), rim * np.sin(a)], -1)).shade(lambda u, v, p: 1 - 0.12 * (np.abs((u * n) % 1 - 0.5) > 0.47))
    h = 0.75 * o.handle
    hook = tube([(0, 0, 0.2), (0, 0, -0.3 * h), (0, 0, -0.82 * h), (0, 0.05, -h), (0, 0.14, -h), (0, 0.17, -0.84 * h)], 0.02)
    return dict(canopy=top.coat("panels", sectors(n // 2)) if o.style == "striped" else top, handle=[hook, rod((0, 0, 0.24), (0, 0, 0.36), 0.015)])


@kind("suitcase", "household", also=("travel suitcase", "luggage"), colours=dict(case="brown|leather|red|blue|turquoise", straps="dark brown|beige", handle="=straps", locks="golden|silver", stickers="yellow|white"))
def suitcase(o, rng):
    return dict(case=block(0.32, 0.96, 0.64, 0.05).at(z=0.32).coat("black", lambda u, v, p: np.abs(p[:, 0]) < 0.007), straps=[block(0.34, 0.08, 0.66, 0.02).at(0, 0.26, 0.32).both(), block(0.335, 0.06, 0.66).at(0, 0.45, 0.32).both()], handle=tube([(0, -0.13, 0.63), (0, -0.11, 0.73), (0, 0.11, 0.73), (0, 0.13, 0.63)], 0.028), locks=block(0.08, 0.1, 0.05).at(0.12, 0.26, 0.65).both())


@kind("toothbrush", "household", colours=dict(handle="blue|red|green|pink|orange", bristles="white", tips="=handle"), forms=dict(style="plain|two-coloured"))
def toothbrush(o, rng):
    y = [-0.028, 0, 0.028]
    tuft = cylinder(0.013, 0.11)
    hair = tuft.turn("y", 90).copies([(0.02, a, 0.34 + 0.032 * k) for k in range(6) for a in y])
    return each(dict(handle=tube([(0, 0, -0.5), (0.0, 0, -0.3), (0.02, 0, -0.05), (0, 0, 0.18), (0, 0, 0.34), (0, 0, 0.54)], [0.045, 0.055, 0.045, 0.025, 0.05, 0.045], flat=0.6), bristles=hair.coat("tips", lambda u, v, p: p[:, 2] > 0.075)), lambda s: s.turn("z", 65).turn("x", 30))


@kind("comb", "household", also=("hair comb",), colours=dict(comb="black|brown|pink|blue|red"))
def comb(o, rng):
    y = np.linspace(-0.46, 0.46, 14)
    return each(dict(comb=[block(0.05, 1.0, 0.14, 0.02).at(z=0.1), block(0.03, 0.026, 0.24, 0.0).copies([(0, a, -0.06) for a in y[1:-1]]), block(0.045, 0.04, 0.26).copies([(0, y[0], -0.06), (0, y[-1], -0.06)])]), lambda s: s.turn("x", 15))


@kind("toilet", "household", colours=dict(bowl="white|light blue|pink", seat="=bowl", tank="=bowl", lever="silver|golden"))
def toilet(o, rng):
    a = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    oval = np.stack([0.3 * np.cos(a), 0.22 * np.sin(a)], -1)
    return dict(bowl=[lathe([(0, 0), (0.62, 0), (0.5, 0.1), (0.6, 0.2), (1.0, 0.36), (1.0, 0.4), (0.8, 0.4), (0.5, 0.28), (0, 0.22)], outline=oval).at(0.12), block(0.26, 0.3, 0.36, 0.04).at(-0.18, 0, 0.2)], seat=[lathe([(0.7, 0), (1.05, 0), (1.05, 0.035), (0.7, 0.035), (0.7, 0)], sharp=True, outline=oval).at(0.12, 0, 0.4), lathe([(0, 0), (1.03, 0), (1.03, 0.03), (0, 0.04)], outline=oval).turn("y", -82).at(-0.15, 0, 0.72)], tank=[block(0.2, 0.5, 0.36, 0.04).at(-0.3, 0, 0.6), block(0.23, 0.53, 0.05, 0.02).at(-0.3, 0, 0.8)], lever=limb((-0.19, 0.16, 0.68), (-0.19, 0.25, 0.67), 0.018), **{"light blue": cylinder(0.12, 0.02).at(0.12, 0, 0.27)})


@kind("bathtub", "household", also=("bath", "bath tub"), colours=dict(tub="white|pink|light blue|red", inside="white", feet="golden|silver", taps="silver|golden", water="light blue", foam="!white"), extras=dict(water=0.6))
def bathtub(o, rng):
    line = oblong(0.98, 0.52, 0.24)
    tub = lathe([(0, 0.08), (0.7, 0.08), (0.9, 0.16), (0.98, 0.42), (1.05, 0.45), (1.03, 0.47), (0.93, 0.45), (0.85, 0.2), (0, 0.15)], outline=line)
    return each(dict(tub=tub.coat("inside", lambda u, v, p: v > 0.585), feet=ball(0.06, 0.06, 0.08).at(0.3, 0.16, 0.06).both("x").both("y"), taps=[tube([(-0.5, 0, 0.44), (-0.5, 0, 0.62), (-0.4, 0, 0.65), (-0.36, 0, 0.58)], 0.025), ball(0.035).at(-0.5, 0.07, 0.54).both()], water=slab(0.92 * line, 0.02).at(z=0.4) if o.water else [], foam=ball(0.07).copies([(0.2 + 0.1 * np.cos(k * 2.4) * (k % 3), 0.1 * np.sin(k * 2.4) * (k % 3) * 0.8, 0.42) for k in range(12)]) if o.water else []), lambda s: s.turn("z", 65))


@kind("pillow", "household", also=("cushion", "throw pillow"), colours=dict(fabric="white|red|blue|yellow|purple|green", pattern="white|golden|dark blue", tassels="golden|white"), forms=dict(style="plain|striped|dotted"), extras=dict(tassels=0.3))
def pillow(o, rng):
    corners = rounded([(0.5, 0.5), (0, 0.44), (-0.5, 0.5), (-0.44, 0), (-0.5, -0.5), (0, -0.44), (0.5, -0.5), (0.44, 0)], 72)
    body = plate(corners, 0.42, puff=1.0)
    if o.style == "striped":
        body = body.coat("pattern", stripes(7, "y", 0.5))
    elif o.style == "dotted":
        body = body.coat("pattern", lambda u, v, p: np.hypot((p[:, 0] * 6) % 1 - 0.5, (p[:, 1] * 6) % 1 - 0.5) < 0.25)
    return each(dict(fabric=body, tassels=[limb((0, 0.47, 0.47), (0, 0.56, 0.56), 0.03, 0.045).both("y").both("z")] if o.tassels else []), lambda s: s.turn("y", -25))


@kind("basket", "household", also=("wicker basket", "picnic basket"), colours=dict(basket="light brown|straw|brown", handle="=basket", ribbon="red|pink|blue"), sizes=dict(handle="low 0.65|1|tall 1.35"), extras=dict(ribbon=0.35))
def basket(o, rng):
    weave = lambda u, v, p: 0.78 + 0.24 * (np.sin(2 * np.pi * 22 * u) * np.sin(75 * p[:, 2]) > 0)  # noqa: E731
    body = lathe([(0, 0), (0.3, 0), (0.42, 0.34), (0.38, 0.34), (0.28, 0.03), (0, 0.03)], sharp=True).shade(weave)
    a = np.linspace(0, np.pi, 11)
    arc = tube(np.stack([0 * a, 0.4 * np.cos(a), 0.32 + 0.48 * o.handle * np.sin(a)], -1), 0.03).shade(lambda u, v, p: 0.85 + 0.2 * (np.sin(110 * v + 6 * u) > 0))
    z = 0.32 + 0.48 * o.handle
    bow = [ball(0.035, 0.09, 0.06).turn("x", -20).at(0.02, 0.09, z + 0.02).both(), ball(0.045).at(0.03, 0, z)]
    return dict(basket=[body, ring(0.41, 0.035).at(z=0.34).shade(lambda u, v, p: 0.85 + 0.2 * (np.sin(2 * np.pi * 40 * u + 6 * v) > 0))], handle=arc, ribbon=bow if o.ribbon else [])


@kind("gift box", "household", also=("present", "wrapped gift", "gift"), colours=dict(box="red|blue|green|white|purple", ribbon="golden|white|red|pink", pattern="white|yellow"), forms=dict(height="flat 0.55|1|tall 1.5", style="plain|striped|dotted"))
def gift(o, rng):
    h = 0.62 * o.height
    body = block(0.7, 0.7, h).at(z=0.5 * h)
    if o.style == "striped":
        body = body.coat("pattern", stripes(9, "y", 0.35))
    elif o.style == "dotted":
        body = body.coat("pattern", lambda u, v, p: (np.hypot((p[:, 0] * 7 + p[:, 1] * 7) % 1 - 0.5, (p[:, 2] * 7) % 1 - 0.5) < 0.24))
    loop = ring(0.11, 0.04, 1.0).scale(1, 1, 1.6).turn("x", 90).scale(1.0, 1, 0.75).at(0, 0, 0)
    bow = [tube([(0, 0, 0), (0, 0.12, 0.2), (0, 0.3, 0.2), (0, 0.28, 0.06), (0, 0, 0)], 0.055, flat=0.5).at(z=h + 0.03).both(), tube([(0, 0, 0), (0.12, 0, 0.2), (0.3, 0, 0.18), (0.27, 0, 0.05), (0, 0, 0)], 0.055, flat=0.5).at(z=h + 0.03).both("x"), ball(0.07).at(z=h + 0.06)]
    del loop
    return dict(box=[body, block(0.74, 0.74, 0.15).at(z=h - 0.06)], ribbon=[block(0.12, 0.76, h + 0.04).at(z=0.5 * h), block(0.76, 0.12, h + 0.04).at(z=0.5 * h), *bow])


@kind("vase", "household", also=("ceramic vase", "flower vase without flowers"), colours=dict(vase="white|blue|turquoise|orange|black", pattern="blue|white|golden", handles="=vase"), sizes=dict(neck="short 0.6|1|long 1.5"), forms=dict(width="thin 0.7|1|wide 1.35", style="plain|striped|dotted"), extras=dict(handles=0.25))
def vase(o, rng):
    w, n = 0.28 * o.width, 0.3 * o.neck
    body = lathe([(0, 0), (0.55 * w, 0), (w, 0.3), (0.8 * w, 0.5), (0.35 * w, 0.6 + 0.3 * n), (0.36 * w, 0.6 + 0.8 * n), (0.55 * w, 0.6 + n), (0.47 * w, 0.6 + n), (0.28 * w, 0.6 + 0.7 * n), (0, 0.6)])
    return dict(vase=patterned(body, o.style), handles=handle((0, 0.36 * w, 0.6 + 0.6 * n), (0, 0.85 * w, 0.42), 0.13, 0.03).both() if o.handles else [])


@kind("trash can", "household", also=("rubbish bin", "garbage can", "dustbin"), colours=dict(can="silver|green|grey|blue|black", lid="=can", handle="=can"), extras=dict(open=0.0))
def trash_can(o, rng):
    rib = lambda u, v, p: 0.86 + 0.14 * np.cos(2 * np.pi * 24 * u)  # noqa: E731
    return dict(can=[cylinder(0.3, 0.75, 0.36).shade(rib), ring(0.335, 0.02).copies([(0, 0, 0.25)]), ring(0.355, 0.02).at(z=0.5)], lid=[lathe([(0, 0.74), (0.4, 0.74), (0.4, 0.79), (0.2, 0.88), (0, 0.9)]), tube([(0, -0.1, 0.86), (0, -0.08, 0.96), (0, 0.08, 0.96), (0, 0.1, 0.86)], 0.02)], handle=handle((0, 0.34, 0.62), (0, 0.33, 0.46), 0.09, 0.02).both())


@kind("mailbox", "household", also=("post box", "letter box"), colours=dict(box="red|blue|silver|yellow", flag="red|yellow", post="wooden|brown|white"))
def mailbox(o, rng):
    arch = refined([(0.17, -0.14), (0.17, 0.1), (0.12, 0.2), (0, 0.25), (-0.12, 0.2), (-0.17, 0.1), (-0.17, -0.14)])
    return each(dict(box=plate(arch, 0.62).at(0.06, 0, 0.86).coat("dark grey", lambda u, v, p: (p[:, 2] > 0.305) & (np.abs(np.hypot(p[:, 0], p[:, 1] * 0.8) - 0.12) < 0.012)), flag=[block(0.04, 0.02, 0.22).at(0.1, 0.18, 0.95), block(0.13, 0.02, 0.09).at(0.15, 0.185, 1.02)], post=block(0.1, 0.1, 0.75).at(z=0.37), silver=ball(0.02).at(0.38, 0, 0.97)), lambda s: s.turn("z", 20))


@kind("envelope", "household", also=("letter",), colours=dict(paper="white|cream|light blue|yellow", seal="red|golden"), forms=dict(style="sealed|plain"))
def envelope(o, rng):
    line = lambda u, v, p: (np.abs(p[:, 1] - 0.33 + 0.62 * (0.5 - np.abs(p[:, 0]))) < 0.012) | (np.abs(p[:, 1] + 0.33 - 0.55 * (0.5 - np.abs(p[:, 0]))) < 0.01) & (p[:, 1] < 0.02)  # noqa: E731
    return each(dict(paper=plate(oblong(1.0, 0.66), 0.05).shade(lambda u, v, p: 1 - 0.35 * (line(u, v, p) & (p[:, 2] > 0))), seal=cylinder(0.08, 0.03, bevel=0.01).turn("y", 90).at(0.02, 0, 0.03) if o.style == "sealed" else []), lambda s: s.turn("y", -15))


@kind("telescope", "household", also=("spyglass",), colours=dict(tube="golden|white|blue|copper", rings="silver|brown|black", tripod="wooden|black|brown", lens="!light blue"))
def telescope(o, rng):
    body = [cylinder(0.1, 0.45).at(z=0.12), cylinder(0.075, 0.35).at(z=-0.2), cylinder(0.05, 0.14).at(z=-0.32)]
    bands = [ring(0.1, 0.018).copies([(0, 0, 0.56), (0, 0, 0.14)]), ring(0.075, 0.016).at(z=-0.19), ring(0.05, 0.014).at(z=-0.32)]
    tilt = lambda s: s.turn("y", 62).turn("z", 60).at(0, 0, 0.72)  # noqa: E731
    return dict(tube=[tilt(s) for s in body], rings=[tilt(s) for s in bands], lens=tilt(ball(0.085, 0.085, 0.02).at(z=0.57)), tripod=[rod((0.03, 0, 0.68), (0.3, 0, 0), 0.024).around(3), ball(0.055).at(z=0.68)])


@kind("headphones", "household", also=("headset",), colours=dict(band="black|white|red|blue", pads="black|dark grey", cups="=band"))
def headphones(o, rng):
    a = np.linspace(-0.15, np.pi + 0.15, 13)
    arc = tube(np.stack([0 * a, 0.38 * np.cos(a), 0.42 * np.sin(a)], -1), 0.045, flat=0.9)
    return dict(band=arc, cups=cylinder(0.17, 0.09, 0.14).turn("x", -90).at(0, 0.38, -0.14).both(), pads=[ring(0.12, 0.05).turn("x", 90).at(0, 0.345, -0.14).both(), tube(np.stack([0 * a[3:10], 0.36 * np.cos(a[3:10]), 0.4 * np.sin(a[3:10])], -1), 0.05)])


@kind("fan", "household", also=("electric fan", "table fan"), colours=dict(blades="light blue|white|blue|silver", cage="silver|white|black", stand="white|black|blue"), counts=dict(blades="3|4|5"))
def fan(o, rng):
    n = int(o.blades)
    blade = ball(0.02, 0.11, 0.15).turn("z", 22).at(0, 0.03, 0.19)
    cage = [ring(0.37, 0.016).turn("y", 90).at(x) for x in (-0.06, 0.08)] + [ring(0.2, 0.008).turn("y", 90).at(0.1)]
    wires = tube([(0.1, 0, 0.06), (0.11, 0, 0.2), (0.08, 0, 0.37), (-0.06, 0, 0.37)], 0.008, sides=6).around(16, "x")
    parts = dict(blades=[blade.turn("x", 360 / n * k) for k in range(n)], cage=[*cage, wires, cylinder(0.07, 0.04).turn("y", 90).at(0.08)])
    return together(each(parts, lambda s: s.at(z=0.72)), dict(stand=[rod((-0.12, 0, 0.05), (-0.12, 0, 0.72), 0.03), limb((-0.2, 0, 0.72), (0.02, 0, 0.72), 0.08), lathe([(0, 0), (0.24, 0), (0.2, 0.05), (0, 0.07)]).at(-0.08)]))


@kind("piggy bank", "household", also=("coin bank", "pig money box"), colours=dict(body="pink|white|blue", coin="golden", slot="!black", nose="=body"), extras=dict(coin=0.5))
def piggy_bank(o, rng):
    return dict(body=[ball(0.42, 0.34, 0.33).at(z=0.42), ears(np.array([0.26, 0, 0.62]), 0.14, 0.16, 0.08, out=35, back=-20), limb((0, 0, 0.2), (0, 0, 0.05), 0.09).copies(pairs((-0.2, 0.2), 0.18, 0)), helix(0.05, 0.12, 1.4, 0.02).turn("y", -80).at(-0.4, 0, 0.48)], nose=cylinder(0.12, 0.08, bevel=0.02).turn("y", 90).at(0.4, 0, 0.42), slot=block(0.2, 0.035, 0.02).at(-0.03, 0, 0.748), black=[eyes(0.33, 0.15, 0.53, 0.03), ball(0.02, 0.025, 0.04).at(0.475, 0.04, 0.42).both()], coin=cylinder(0.1, 0.025).turn("x", 90).at(-0.03, 0.012, 0.82) if o.coin else [])


@kind("crayon", "household", also=("wax crayon",), colours=dict(wax="red|blue|green|yellow|orange|purple", wrapper="=wax", lines="!black"))
def crayon(o, rng):
    band = lambda u, v, p: (np.abs(np.abs(p[:, 2] - 0.02) - 0.3) < 0.015) | (np.abs(p[:, 2] - 0.02) < 0.13) & (np.abs(u - 0.5) < 0.13) & ((p[:, 2] * 20) % 1 < 0.6)  # noqa: E731
    return each(dict(wax=lathe([(0, -0.5), (0.09, -0.5), (0.09, 0.36), (0.045, 0.4), (0.025, 0.54), (0, 0.54)], sharp=True), wrapper=cylinder(0.098, 0.72).at(z=-0.34).coat("lines", lambda u, v, p: band(u, v, p - (0, 0, 0.34))).shade(lambda u, v, p: 0.85)), lambda s: s.turn("x", 42))


@kind("spool of thread", "household", also=("thread spool", "reel of thread"), colours=dict(thread="red|blue|green|yellow|pink|purple", spool="wooden|beige", needle="silver"), extras=dict(needle=0.4))
def spool(o, rng):
    return dict(thread=lathe([(0, -0.28), (0.27, -0.28), (0.3, 0), (0.27, 0.28), (0, 0.28)]).shade(lambda u, v, p: 0.88 + 0.14 * (np.sin(150 * p[:, 2] + 3 * np.sin(2 * np.pi * u)) > 0)), spool=lathe([(0, 0), (0.37, 0), (0.37, 0.06), (0.2, 0.14), (0, 0.14)], sharp=True).turn("x", 180).at(z=0.42).joined(lathe([(0, 0), (0.37, 0), (0.37, 0.06), (0.2, 0.14), (0, 0.14)], sharp=True).at(z=-0.42)), black=cylinder(0.07, 0.01).at(z=0.415), needle=rod((0.33, -0.35, 0.25), (0.3, 0.32, -0.3), 0.016, 0.004) if o.needle else [])
