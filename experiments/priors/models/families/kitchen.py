"""What a meal is cooked in and eaten from: teapot, mug, pan, knife."""

import numpy as np

from experiments.priors.models.kinds import kind
from experiments.priors.models.patterns import (
    patterned,
)
from experiments.priors.models.shapes import (
    ball,
    bend,
    cylinder,
    handle,
    lathe,
    tube,
)

CHINA = "white|light blue|cream|light green"


@kind(
    "teapot",
    "kitchen",
    also=("tea pot", "china teapot"),
    colours=dict(
        body=CHINA, lid="=body", knob="=lid", handle="=body", spout="=body", pattern="light blue|red"
    ),
    sizes=dict(spout="short 0.6|1|long 1.75", handle="small 0.7|1|large 1.3"),
    forms=dict(height="flat 0.75|1|tall 1.35", style="plain|striped|dotted"),
)
def teapot(o, rng):
    h = 0.36 * o.height
    body = lathe(
        [(0, -h), (0.25, -h), (0.3, -0.9 * h), (0.46, -0.1 * h), (0.4, 0.5 * h), (0.2, 0.93 * h), (0, h)]
    )
    reach = 0.3 * o.spout
    spout = bend((0, -0.36, -0.45 * h), (0, -0.36 - 0.95 * reach, -0.5 * h), (0, -0.42 - reach, 0.75 * h))
    lid = lathe([(0, 0.85 * h), (0.24, 0.85 * h), (0.22, 0.98 * h), (0.1, 1.16 * h), (0, 1.2 * h)])
    loop = handle((0, 0.3, 0.62 * h), (0, 0.4, -0.4 * h), 0.28 * o.handle, 0.05)
    return dict(
        body=patterned(body, o.style),
        lid=lid,
        knob=ball(0.07).at(z=1.3 * h),
        handle=loop,
        spout=tube(spout, np.linspace(0.14, 0.055, 7)),
    )


@kind(
    "mug",
    "kitchen",
    also=("coffee mug", "cup", "coffee cup"),
    colours=dict(body="white|red|blue|yellow|light blue", handle="=body", coffee="dark brown", pattern="red|blue"),
    sizes=dict(handle="small 0.7|1|large 1.35"),
    forms=dict(height="short 0.75|1|tall 1.45", style="plain|striped|dotted"),
    extras=dict(coffee=0.4),
)
def mug(o, rng):
    r, h = 0.32, 0.68 * o.height
    cup = lathe(
        [(0, 0), (0.92 * r, 0), (r, 0.05), (r, h), (0.87 * r, h), (0.85 * r, 0.07), (0, 0.06)], sharp=True
    )
    loop = handle((0, 0.9 * r, 0.8 * h), (0, 0.9 * r, 0.2 * h), 0.27 * o.handle, 0.05)
    coffee = cylinder(0.86 * r, 0.02).at(z=0.86 * h)
    return dict(body=patterned(cup, o.style, h), handle=loop, coffee=[coffee] if o.coffee else [])


@kind(
    "pan",
    "kitchen",
    also=("frying pan", "skillet"),
    colours=dict(body="black|dark grey|metal", handle="black|wooden|brown"),
    sizes=dict(handle="short 0.65|1|long 1.4"),
    forms=dict(depth="shallow 0.7|1|deep 1.8"),
)
def pan(o, rng):
    h = 0.12 * o.depth
    body = lathe([(0, 0), (0.36, 0), (0.45, h), (0.42, h), (0.34, 0.03), (0, 0.03)], sharp=True)
    grip = tube([(0.4, 0, 0.8 * h), (0.6, 0, h + 0.03), (0.45 + 0.5 * o.handle, 0, h + 0.06)], [0.03, 0.045, 0.05], flat=0.55)
    return dict(body=body, handle=grip)
