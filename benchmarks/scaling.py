"""Suite 'scaling': the step against the number of particles, and against the number of devices.

`python -m benchmarks run scaling --out FILE.jsonl`, then `python -m benchmarks.plot_scaling`.

Size: blocks of 16 thousand to 4 million particles on grids that fit them (a quarter more nodes a
side than the block has cells), on all cores, beside the peer. Strong: one block on 1, 2, ...
devices. Weak: as many particles on each device; beyond the number of cores devices take turns, so
that only the traffic between them means anything: `traffic_bytes` a step are counted in the
compiled program.
"""

import math
import re
from functools import partial

from benchmarks.case import Case, Prepared
from benchmarks.mpm import block_case, compiled, forward, start_devices

# name: (cells a side of the block, steps in a call)
SIZES = {"16k": (12, 60), "64k": (20, 30), "262k": (32, 20), "1M": (50, 20), "4M": (80, 10)}
QUICK_SIZES = {"4k": (8, 30)}
STRONG = 32
WEAK = {1: 20, 2: 25, 4: 32, 8: 40}  # devices: cells a side, 64 thousand particles each
QUICK_WEAK = {1: 8, 2: 10}
BYTES = {"f32": 4, "s32": 4, "f64": 8, "s64": 8}


def nodes_for(cells: int) -> int:
    """Nodes a side of a grid that fits a block."""
    return cells + max(8, cells // 4)


def floating(cells: int) -> dict:
    """A block without gravity: the peer goes on from call to call, and would fall off its grid."""
    return block_case(cells, nodes_for(cells)) | {"gravity": (0.0, 0.0, 0.0)}


def traffic(program: str) -> int:
    """Bytes that a device gives to the others in all reductions of a compiled program's text, each
    counted once however often it runs: of a loop, those of a step.
    """
    total = 0
    for results in re.findall(r"= (.*?) all-reduce(?:-start)?\(", program):
        for dtype, shape in re.findall(r"(f32|s32|f64|s64)\[([\d,]*)\]", results):
            sides = [int(side) for side in shape.split(",") if side]
            total += math.prod(sides) * BYTES[dtype]
    return total


def prepare(cells: int, steps: int, devices: int | None) -> Prepared:
    """Our solver on `devices` devices, None for all cores."""
    import jax

    start_devices(devices)
    run = forward(floating(cells), steps, devices)
    seconds = compiled(run)
    text = run.func.lower(*run.args).compile().as_text()
    return Prepared(
        lambda: jax.block_until_ready(run()),
        work=8 * cells**3 * steps,
        compile_seconds=seconds,
        extra={"steps": steps, "devices": jax.device_count(), "traffic_bytes": traffic(text)},
    )


def prepare_peer(cells: int, steps: int) -> Prepared:
    """Taichi's CPU backend on two threads."""
    from benchmarks.peers.taichi_mpm import build

    advance, _ = build(floating(cells))
    return Prepared(lambda: advance(steps), work=8 * cells**3 * steps, extra={"steps": steps})


def cases(quick: bool) -> list[Case]:
    """Sizes, then devices."""
    found = []
    for name, (cells, steps) in (QUICK_SIZES if quick else SIZES).items():
        counts = {"particles": 8 * cells**3, "nodes": nodes_for(cells) ** 3}
        found.append(Case(f"size-{name}", "jaxphys", partial(prepare, cells, steps, None), counts))
        peer = partial(prepare_peer, cells, steps)
        found.append(Case(f"size-{name}", "taichi", peer, counts))
    cells = 8 if quick else STRONG
    counts = {"particles": 8 * cells**3, "nodes": nodes_for(cells) ** 3}
    for devices in (1, 2):
        method = "jaxphys" if devices == 2 else "jaxphys-1-device"
        run = partial(prepare, cells, 20, devices)
        found.append(Case("strong", method, run, counts, baseline=devices == 1))
    for devices, cells in (QUICK_WEAK if quick else WEAK).items():
        counts = {"particles": 8 * cells**3, "nodes": nodes_for(cells) ** 3}
        run = partial(prepare, cells, 10, devices)
        found.append(Case(f"weak-{devices}", "jaxphys", run, counts, rounds=1))
    return found
