"""Suite 'drawing': pictures over devices, each core one, against one after the other on one.

`sides` are several pictures side by side, one on each device, as a film has them; `rows` is one
picture, whose rows of tiles they share. The picture is `ball` of suite 'render' with 30,000 splats.
"""

import time
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp

from benchmarks.case import Case, Prepared
from benchmarks.mpm import start_devices
from benchmarks.render import HEIGHT, WIDTH, ball_camera, ball_splats, picture, picture_gradient
from jaxphys.core.ensemble import over_devices
from jaxphys.render import Settings, next_capacity, required_pairs

PROGRAMS = {"forward": picture, "value-and-gradient": picture_gradient}


def side_by_side(one):
    """`one` of (splats, camera) for several cameras, stacked."""
    return jax.jit(lambda s, c: over_devices(lambda camera: one(s, camera), in_turn=True)(c))


def prepare(kind: str, program: str, spread: bool, count: int, width: int, height: int) -> Prepared:
    """`kind` of drawing, over all devices if `spread`; a unit of work is a picture."""
    start_devices()
    devices = jax.device_count()
    splats, camera = ball_splats(count), ball_camera(width, height)
    sides = kind == "sides"
    settings = Settings() if sides or not spread else replace(Settings(), devices=devices)
    room = next_capacity(int(1.15 * int(required_pairs(splats, camera, settings))))
    one = PROGRAMS[program](settings, room)
    drawn = devices if sides and spread else 1
    if drawn > 1:
        camera = jax.tree.map(lambda x: jnp.stack([x] * drawn), camera)
        one = side_by_side(one)
    start = time.perf_counter()
    compiled = one.lower(splats, camera).compile()
    seconds = time.perf_counter() - start
    return Prepared(
        lambda: jax.block_until_ready(compiled(splats, camera)),
        work=drawn,
        compile_seconds=seconds,
        extra={"devices": devices if spread else 1},
    )


def cases(quick: bool) -> list[Case]:
    """Side by side and by rows, forward and gradient, each beside one device."""
    count, width, height = (2_000, 160, 90) if quick else (30_000, WIDTH, HEIGHT)
    size = {"splats": count, "width": width, "height": height}

    def case(kind: str, program: str, spread: bool) -> Case:
        task = partial(prepare, kind, program, spread, count, width, height)
        method = "jaxphys" if spread else "one device"
        return Case(f"{kind}-{program}", method, task, size, baseline=not spread)

    return [
        case(kind, program, spread)
        for kind in ("sides", "rows")
        for program in PROGRAMS
        for spread in (True, False)
    ]
