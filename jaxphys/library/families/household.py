"""Things of the household and the desk; their front faces +x."""

import numpy as np

from jaxphys.library.kinds import kind
from jaxphys.library.patterns import (
    above,
    also,
    between,
    patterned,
    sectors,
    stripes,
)
from jaxphys.library.shapes import (
    ball,
    block,
    cylinder,
    handle,
    lathe,
    limb,
    oblong,
    plate,
    polygon,
    ring,
    rod,
    rounded,
    slab,
    tube,
)
from jaxphys.library.solids import each

# fmt: off
# ruff: noqa: E731


@kind("bottle", "household", also=("wine bottle", "glass bottle"),
    colours=dict(glass="green|brown|dark green|blue|white", label="white|cream|red|yellow",
        cap="red|golden|black|white"),
    sizes=dict(neck="short 0.6|1|long 1.5"),
    forms=dict(width="thin 0.75|1|wide 1.35"),
    extras=dict(label=0.8))
def bottle(o, rng):
    w, n = 0.17 * o.width, 0.28 * o.neck
    body = lathe([(0, 0), (w, 0.02), (w, 0.5), (0.9 * w, 0.58), (0.06, 0.66),
        (0.055, 0.66 + 0.85 * n), (0.07, 0.66 + 0.86 * n), (0.07, 0.66 + n), (0, 0.66 + n)])
    return dict(glass=body.coat("label", between("z", 0.14, 0.42)) if o.label else body,
        cap=cylinder(0.072, 0.08, bevel=0.01).at(z=0.62 + n))


@kind("can", "household", also=("tin can", "soda can", "drinks can"),
    colours=dict(label="red|blue|green|orange|silver", lid="silver", stripe="white|yellow"),
    forms=dict(height="short 0.75|1|tall 1.3", style="plain|striped"))
def can(o, rng):
    h, r = 0.8 * o.height, 0.25
    body = lathe([(0, 0), (0.8 * r, 0), (r, 0.05), (r, h - 0.07), (0.82 * r, h),
        (0.78 * r, h - 0.015), (0, h - 0.015)], sharp=True)
    body = body.coat("lid", lambda u, v, p: (p[:, 2] < 0.045) | (p[:, 2] > h - 0.065))
    if o.style == "striped":
        wave = lambda u, v, p: np.abs(p[:, 2] - 0.5 * h - 0.1 * np.sin(2 * np.pi * u + 1)) < 0.07
        body = body.coat("stripe", wave)
    tab = [ball(0.08, 0.05, 0.012).at(0.04, 0, h), ball(0.03, 0.025, 0.014).at(0.0, 0, h)]
    return dict(label=body, lid=tab)


@kind("jar", "household", also=("jam jar", "jar of jam"),
    colours=dict(jam="red|orange|purple|golden", lid="golden|red|white|blue", label="white|cream"),
    extras=dict(label=0.6))
def jar(o, rng):
    body = lathe([(0, 0), (0.26, 0.01), (0.29, 0.06), (0.29, 0.45), (0.23, 0.54), (0, 0.54)])
    return dict(jam=body.coat("label",
        also(between("z", 0.13, 0.38), above("x", 0.1))) if o.label else body,
        lid=cylinder(0.25, 0.12, bevel=0.015).at(z=0.54).shade(lambda u, v,
        p: 1 - 0.12 * ((u * 40) % 1 < 0.4)))


@kind("candle", "household", also=("burning candle",),
    colours=dict(wax="white|red|cream|blue|pink", flame="!orange", saucer="golden|white|silver",
        stripes="golden|white"),
    forms=dict(height="short 0.6|1|tall 1.4", style="plain|striped"),
    extras=dict(saucer=0.7))
def candle(o, rng):
    r, h = rng.uniform(0.09, 0.14), 0.55 * o.height
    body = lathe([(0, 0.02), (r, 0.02), (r, h), (0.8 * r, h - 0.012), (0, h - 0.03)], sharp=True)
    if o.style == "striped":
        body = body.coat("stripes", lambda u, v, p: (p[:, 2] * 9 + u) % 1 < 0.35)
    drips = [limb((r * np.cos(a), r * np.sin(a), h - 0.01), (r * np.cos(a), r * np.sin(a), h - d),
        0.022) for a, d in zip(rng.uniform(0, 6, 4), rng.uniform(0.08, 0.25, 4), strict=True)]
    return dict(wax=[body, *drips], black=rod((0, 0, h - 0.03), (0.005, 0, h + 0.06), 0.012),
        flame=lathe([(0, h + 0.03), (0.05, h + 0.09), (0.03, h + 0.17), (0, h + 0.24)]),
        yellow=lathe([(0, h + 0.025), (0.052, h + 0.08), (0, h + 0.12)]),
        saucer=[lathe([(0, 0), (0.2, 0), (0.3, 0.06), (0.27, 0.06), (0.18, 0.02), (0, 0.02)]),
        ring(0.06, 0.018).turn("x", 90).at(0, 0.33, 0.05)] if o.saucer else [])


@kind("sponge", "household", also=("kitchen sponge", "cleaning sponge"),
    colours=dict(sponge="yellow|orange|pink", pad="green|blue"),
    extras=dict(pad=0.55))
def sponge(o, rng):
    body = block(0.62, 1.0, 0.36, 0.06)
    spots = rng.uniform((-0.31, -0.5, -0.18), (0.31, 0.5, 0.18), (240, 3))
    sizes = rng.uniform(0.015, 0.045, 240)
    dark = lambda u, v, p: 1 - 0.32 * ((np.sqrt(((p[:, None] - spots) ** 2).sum(-1)) - sizes).min(1)
        < 0)
    return dict(sponge=body.shade(dark),
        pad=block(0.63, 1.01, 0.1, 0.03).at(z=-0.22) if o.pad else [])


@kind("mirror", "household", also=("hand mirror",),
    colours=dict(frame="golden|pink|silver|wooden|white", glass="!glass", handle="=frame"),
    sizes=dict(handle="short 0.6|1|long 1.4"))
def mirror(o, rng):
    h = 0.42 * o.handle
    return each(dict(frame=[ring(0.3, 0.045).turn("y", 90).scale(0.9, 1, 1.15),
        ball(0.05).copies([(0, 0, 0.37)])],
        glass=plate(polygon(28, 0.3), 0.04).scale(1, 1, 1.15).coat("white", lambda u, v,
        p: np.abs(p[:, 0] + p[:, 1] - 0.1) < 0.035),
        handle=lathe([(0, -0.36), (0.035, -0.36), (0.03, -0.42), (0.05, -0.36 - 0.6 * h),
        (0.04, -0.36 - h), (0, -0.38 - h)])), lambda s: s.turn("x", 15))


@kind("umbrella", "household", also=("open umbrella", "parasol"),
    colours=dict(canopy="red|blue|yellow|purple|black", panels="white|yellow|light blue",
        handle="brown|wooden|black"),
    forms=dict(style="plain|striped"),
    sizes=dict(handle="short 0.7|1|long 1.3"))
def umbrella(o, rng):
    n = 8
    a = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    rim = 0.5 * (1 - 0.06 * np.abs(np.sin(0.5 * n * a)))
    top = lathe([(0, 0.27), (0.4, 0.22), (0.8, 0.08), (1.0, -0.06), (0.97, -0.06), (0.78, 0.05),
        (0.38, 0.19), (0, 0.24)],
        outline=np.stack([rim * np.cos(a), rim * np.sin(a)], -1)).shade(lambda u, v,
        p: 1 - 0.12 * (np.abs((u * n) % 1 - 0.5) > 0.47))
    h = 0.75 * o.handle
    hook = tube([(0, 0, 0.2), (0, 0, -0.3 * h), (0, 0, -0.82 * h), (0, 0.05, -h), (0, 0.14, -h),
        (0, 0.17, -0.84 * h)], 0.02)
    return dict(canopy=top.coat("panels", sectors(n // 2)) if o.style == "striped" else top,
        handle=[hook, rod((0, 0, 0.24), (0, 0, 0.36), 0.015)])


@kind("toothbrush", "household",
    colours=dict(handle="blue|red|green|pink|orange", bristles="white", tips="=handle"))
def toothbrush(o, rng):
    y = [-0.028, 0, 0.028]
    tuft = cylinder(0.013, 0.11)
    hair = tuft.turn("y", 90).copies([(0.02, a, 0.34 + 0.032 * k) for k in range(6) for a in y])
    return each(dict(handle=tube([(0, 0, -0.5), (0.0, 0, -0.3), (0.02, 0, -0.05), (0, 0, 0.18),
        (0, 0, 0.34), (0, 0, 0.54)], [0.045, 0.055, 0.045, 0.025, 0.05, 0.045], flat=0.6),
        bristles=hair.coat("tips", lambda u, v, p: p[:, 2] > 0.075)),
        lambda s: s.turn("z", 65).turn("x", 30))


@kind("comb", "household", also=("hair comb",), colours=dict(comb="pink|brown|blue|red|black"))
def comb(o, rng):
    y = np.linspace(-0.46, 0.46, 14)
    return each(dict(comb=[block(0.05, 1.0, 0.14, 0.02).at(z=0.1),
        block(0.03, 0.026, 0.24, 0.0).copies([(0, a, -0.06) for a in y[1:-1]]),
        block(0.045, 0.04, 0.26).copies([(0, y[0], -0.06), (0, y[-1], -0.06)])]),
        lambda s: s.turn("x", 15))


@kind("toilet", "household",
    colours=dict(bowl="white|light blue|pink", seat="=bowl", tank="=bowl", lever="silver|golden"))
def toilet(o, rng):
    a = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    oval = np.stack([0.3 * np.cos(a), 0.22 * np.sin(a)], -1)
    return dict(bowl=[lathe([(0, 0), (0.62, 0), (0.5, 0.1), (0.6, 0.2), (1.0, 0.36), (1.0, 0.4),
        (0.8, 0.4), (0.5, 0.28), (0, 0.22)], outline=oval).at(0.12),
        block(0.26, 0.3, 0.36, 0.04).at(-0.18, 0, 0.2)],
        seat=[lathe([(0.7, 0), (1.05, 0), (1.05, 0.035), (0.7, 0.035), (0.7, 0)], sharp=True,
        outline=oval).at(0.12, 0, 0.4),
        lathe([(0, 0), (1.03, 0), (1.03, 0.03), (0, 0.04)], outline=oval).turn("y", -82).at(-0.15,
        0, 0.72)], tank=[block(0.2, 0.5, 0.36, 0.04).at(-0.3, 0, 0.6),
        block(0.23, 0.53, 0.05, 0.02).at(-0.3, 0, 0.8)],
        lever=limb((-0.19, 0.16, 0.68), (-0.19, 0.25, 0.67), 0.018),
        **{"light blue": cylinder(0.12, 0.02).at(0.12, 0, 0.27)})


@kind("bathtub", "household", also=("bath", "bath tub"),
    colours=dict(tub="white|pink|light blue|red", inside="white", feet="golden|silver",
        taps="silver|golden", water="light blue", foam="!white"),
    extras=dict(water=0.6))
def bathtub(o, rng):
    line = oblong(0.98, 0.52, 0.24)
    tub = lathe([(0, 0.08), (0.7, 0.08), (0.9, 0.16), (0.98, 0.42), (1.05, 0.45), (1.03, 0.47),
        (0.93, 0.45), (0.85, 0.2), (0, 0.15)], outline=line)
    return each(dict(tub=tub.coat("inside", lambda u, v, p: v > 0.585),
        feet=ball(0.06, 0.06, 0.08).at(0.3, 0.16, 0.06).both("x").both("y"),
        taps=[tube([(-0.5, 0, 0.44), (-0.5, 0, 0.62), (-0.4, 0, 0.65), (-0.36, 0, 0.58)], 0.025),
        ball(0.035).at(-0.5, 0.07, 0.54).both()],
        water=slab(0.92 * line, 0.02).at(z=0.4) if o.water else [],
        foam=ball(0.07).copies([(0.2 + 0.1 * np.cos(k * 2.4) * (k % 3),
        0.1 * np.sin(k * 2.4) * (k % 3) * 0.8, 0.42) for k in range(12)]) if o.water else []),
        lambda s: s.turn("z", 65))


@kind("pillow", "household", also=("cushion", "throw pillow"),
    colours=dict(fabric="white|red|blue|yellow|purple|green", pattern="white|golden|dark blue",
        tassels="golden|white"),
    forms=dict(style="plain|striped|dotted"),
    extras=dict(tassels=0.3))
def pillow(o, rng):
    corners = rounded([(0.5, 0.5), (0, 0.44), (-0.5, 0.5), (-0.44, 0), (-0.5, -0.5), (0, -0.44),
        (0.5, -0.5), (0.44, 0)], 72)
    body = plate(corners, 0.42, puff=1.0)
    if o.style == "striped":
        body = body.coat("pattern", stripes(7, "y", 0.5))
    elif o.style == "dotted":
        body = body.coat("pattern", lambda u, v,
            p: np.hypot((p[:, 0] * 6) % 1 - 0.5, (p[:, 1] * 6) % 1 - 0.5) < 0.25)
    return each(dict(fabric=body,
        tassels=[limb((0, 0.47, 0.47), (0, 0.56, 0.56), 0.03,
        0.045).both("y").both("z")] if o.tassels else []), lambda s: s.turn("y", -25))


@kind("basket", "household", also=("wicker basket", "picnic basket"),
    colours=dict(basket="light brown|straw|brown", handle="=basket", ribbon="red|pink|blue"),
    sizes=dict(handle="low 0.65|1|tall 1.35"),
    extras=dict(ribbon=0.35))
def basket(o, rng):
    weave = lambda u, v, p: 0.78 + 0.24 * (np.sin(2 * np.pi * 22 * u) * np.sin(75 * p[:, 2]) > 0)
    body = lathe([(0, 0), (0.3, 0), (0.42, 0.34), (0.38, 0.34), (0.28, 0.03), (0, 0.03)],
        sharp=True).shade(weave)
    a = np.linspace(0, np.pi, 11)
    arc = tube(np.stack([0 * a, 0.4 * np.cos(a), 0.32 + 0.48 * o.handle * np.sin(a)], -1),
        0.03).shade(lambda u, v, p: 0.85 + 0.2 * (np.sin(110 * v + 6 * u) > 0))
    z = 0.32 + 0.48 * o.handle
    bow = [ball(0.035, 0.09, 0.06).turn("x", -20).at(0.02, 0.09, z + 0.02).both(),
        ball(0.045).at(0.03, 0, z)]
    return dict(basket=[body,
        ring(0.41, 0.035).at(z=0.34).shade(lambda u, v,
        p: 0.85 + 0.2 * (np.sin(2 * np.pi * 40 * u + 6 * v) > 0))], handle=arc,
        ribbon=bow if o.ribbon else [])


@kind("vase", "household", also=("ceramic vase", "flower vase without flowers"),
    colours=dict(vase="white|blue|turquoise|orange|black", pattern="blue|white|golden",
        handles="=vase"),
    sizes=dict(neck="short 0.6|1|long 1.5"),
    forms=dict(width="thin 0.7|1|wide 1.35", style="plain|striped|dotted"),
    extras=dict(handles=0.25))
def vase(o, rng):
    w, n = 0.28 * o.width, 0.3 * o.neck
    body = lathe([(0, 0), (0.55 * w, 0), (w, 0.3), (0.8 * w, 0.5), (0.35 * w, 0.6 + 0.3 * n),
        (0.36 * w, 0.6 + 0.8 * n), (0.55 * w, 0.6 + n), (0.47 * w, 0.6 + n),
        (0.28 * w, 0.6 + 0.7 * n), (0, 0.6)])
    return dict(vase=patterned(body, o.style),
        handles=handle((0, 0.36 * w, 0.6 + 0.6 * n), (0, 0.85 * w, 0.42), 0.13,
        0.03).both() if o.handles else [])


@kind("trash can", "household", also=("rubbish bin", "garbage can", "dustbin"),
    colours=dict(can="silver|green|grey|blue|black", lid="=can", handle="=can"))
def trash_can(o, rng):
    rib = lambda u, v, p: 0.86 + 0.14 * np.cos(2 * np.pi * 24 * u)
    return dict(can=[cylinder(0.3, 0.75, 0.36).shade(rib), ring(0.335, 0.02).copies([(0, 0, 0.25)]),
        ring(0.355, 0.02).at(z=0.5)],
        lid=[lathe([(0, 0.74), (0.4, 0.74), (0.4, 0.79), (0.2, 0.88), (0, 0.9)]),
        tube([(0, -0.1, 0.86), (0, -0.08, 0.96), (0, 0.08, 0.96), (0, 0.1, 0.86)], 0.02)],
        handle=handle((0, 0.34, 0.62), (0, 0.33, 0.46), 0.09, 0.02).both())
