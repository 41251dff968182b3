"""Suite 'scaling': the step against the number of particles, and against the number of devices.

`python -m benchmarks run scaling --out FILE.jsonl`, then `python -m benchmarks.plot_scaling`.

Size: blocks of 16 thousand to 4 million particles on grids that fit them (a quarter more nodes a
side than the block has cells), on all cores, beside the peer. Strong: one block on 1, 2, ...
devices. Weak: as many particles on each device; beyond the number of cores devices take turns, so
that only the traffic between them means anything: `traffic_bytes` a step are counted in the
compiled program. Several devices either share the grid (method `jaxphys`: slabs, where they send
less) or each have the window as a whole (`jaxphys-window`).

`python -m benchmarks.scaling` prints that traffic alone, of 2, 4 and 8 devices: it compiles and
times nothing.
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


def in_loops(program: str) -> str:
    """What loops hold of a compiled program's text: a step, and not what a rollout does once."""
    bodies = set(re.findall(r"body=%?([\w.-]+)", program))
    blocks = re.split(r"\n(?=%|ENTRY)", program)
    return "\n".join(b for b in blocks if re.split(r"[ (]", b)[0].lstrip("%") in bodies)


def traffic(step: str, devices: int) -> int:
    """Bytes that a device sends to others in a compiled step's text, at most.

    What is passed on is sent once, by those who do. Adding up and collecting are counted as rings
    do them: each device sends all but its own part, and twice if every one is to have the sum.
    """
    share = (devices - 1) / devices
    times = {"all-reduce": 2 * share, "all-gather": share, "collective-permute": 0.0}
    sent = [0.0] * devices
    kinds = "|".join(times)
    for results, kind, rest in re.findall(rf"= (.*?) ({kinds})(?:-start)?\((.*)", step):
        size = 0
        for dtype, shape in re.findall(r"(f32|s32|f64|s64)\[([\d,]*)\]", results):
            size += math.prod(int(side) for side in shape.split(",") if side) * BYTES[dtype]
        pairs = re.search(r"source_target_pairs=\{(.*?)\}\}", rest)
        senders = [int(n) for n in re.findall(r"\{(\d+),", pairs[0])] if pairs else []
        for device in range(devices):
            sent[device] += size * (times[kind] + senders.count(device))
    return round(max(sent))


def prepare(cells: int, steps: int, devices: int | None, slabs: bool = True) -> Prepared:
    """Our solver on `devices` devices, None for all cores."""
    import jax

    start_devices(devices)
    run = forward(floating(cells), steps, devices, slabs=slabs)
    seconds = compiled(run)
    sent = traffic(in_loops(run.func.lower(*run.args).compile().as_text()), jax.device_count())
    return Prepared(
        lambda: jax.block_until_ready(run()),
        work=8 * cells**3 * steps,
        compile_seconds=seconds,
        extra={"steps": steps, "devices": jax.device_count(), "traffic_bytes": sent},
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
    for method, devices, slabs in (
        ("jaxphys-1-device", 1, False),
        ("jaxphys-window", 2, False),
        ("jaxphys", 2, True),
    ):
        run = partial(prepare, cells, 20, devices, slabs)
        found.append(Case("strong", method, run, counts, baseline=devices == 1))
    for devices, cells in (QUICK_WEAK if quick else WEAK).items():
        counts = {"particles": 8 * cells**3, "nodes": nodes_for(cells) ** 3}
        for method, slabs in (("jaxphys-window", False), ("jaxphys", True)):
            if devices > 1 or slabs:
                run = partial(prepare, cells, 10, devices, slabs)
                found.append(Case(f"weak-{devices}", method, run, counts, rounds=1))
    return found


def main() -> None:
    """Prints the traffic of weak scaling, both ways."""
    start_devices(max(WEAK))
    print("| devices | particles | the window on each, kB a device and step | slabs |")
    print("|---|---|---|---|")
    for devices, cells in WEAK.items():
        if devices == 1:
            continue
        sent = []
        for slabs in (False, True):
            run = forward(floating(cells), 2, devices, slabs=slabs)
            step = in_loops(run.func.lower(*run.args).compile().as_text())
            sent.append(f"{traffic(step, devices) / 1000:,.0f}")
        print(f"| {devices} | {8 * cells**3:,} | {' | '.join(sent)} |")


if __name__ == "__main__":
    main()
