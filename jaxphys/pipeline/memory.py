"""How much memory a run takes at its peak, and whether there is that much: before it is asked for.

Sizes are counted from the scene; how often arrays of a size exist at once was measured as the peak
of fresh processes (`docs/performance.md`, memory).
"""

import os
from collections.abc import Mapping
from pathlib import Path

import jax
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import Gaussians, opacities
from jaxphys.mpm.loop.chunks import cuts
from jaxphys.mpm.loop.window import windowed
from jaxphys.pipeline.film import drawn_at_once
from jaxphys.scene.build import Built
from jaxphys.scene.scene import Scene

PROGRAM = 800 * 2**20  # interpreter, libraries, and what the compiler needs
STATES = 4  # copies of a state and its parameters: whole, in chunks, of two frames
NODES = 3  # copies of the rows of the grid: before and after a pass, and their velocities
SPLAT = 1500  # bytes a splat while it is drawn: deformed, projected, and its pairs sorted
CARRIED = 48  # bytes of a Gaussian in a frame that is kept: where it is, and F
PIXEL = 32
REMEDIES = {
    "state and parameters": "fewer particles",
    "grid": "a larger spacing or a smaller domain",
    "transfers": "fewer particles",
    "motion": "fewer frames",
    "splats": "fewer Gaussians",
    "pictures": "smaller pictures",
}


def expected(scene: Scene, built: Built) -> dict[str, int]:
    """Bytes at the peak of a run, by what they hold."""
    simulation, look = built
    config = simulation.config
    placement, transfer = config.placement, config.transfer
    row, stencil = 4 * config.columns, transfer.spline.width**3
    chunk = max(into.size for into in cuts(config.runs, placement))
    rows = windowed(config, simulation.state).rows
    arrays = jax.tree.leaves((simulation.state, simulation.model))
    moving = look.gaussians.count
    drawn = moving + sum(one.count for one, _ in look.solids)
    drawn += 0 if look.still is None else look.still.count
    return {
        "program": PROGRAM,
        "state and parameters": STATES * sum(leaf.nbytes for leaf in arrays),
        "grid": NODES * row * rows * placement.devices,
        "transfers": stencil * row * placement.devices * chunk,
        "motion": CARRIED * moving * scene.frames,
        "splats": SPLAT * drawn * drawn_at_once(scene.frames),
        "pictures": PIXEL * scene.width * scene.height * drawn_at_once(scene.frames),
    }


def at_least(scene: Scene, objects: tuple[Gaussians, ...]) -> dict[str, int]:
    """What a run takes of memory even if nothing is filled and all matter stays where it is, from
    the scene and its Gaussians alone: nothing is made for it.
    """
    at_once, moving, drawn = drawn_at_once(scene.frames), 0, 0
    for thing, gaussians in zip(scene.objects, objects, strict=False):
        if thing.crop:
            continue  # how much of it is background is not known yet
        seen = int(np.sum(np.asarray(opacities(gaussians)) >= thing.opacity_threshold))
        drawn += seen
        moving += seen if thing.area is None else 0
    return {
        "motion": CARRIED * moving * scene.frames,
        "splats": SPLAT * drawn * at_once,
        "pictures": PIXEL * scene.width * scene.height * at_once,
    }


def room() -> int | None:
    """Bytes of memory that this process has or could have, of the machine and of its group; None
    where the system does not tell.
    """
    found = []
    try:
        own = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                found.append(int(line.split()[1]) * 1024 + own)
        folder = Path("/sys/fs/cgroup")
        most = (folder / "memory.max").read_text().strip()
        if most != "max":
            found.append(int(most) - int((folder / "memory.current").read_text()) + own)
    except (OSError, ValueError):
        pass  # told otherwise on this system, or not at all
    return min(found) if found else None


def require_room(needed: Mapping[str, int], free: int | None) -> None:
    """Refuses what does not fit; nothing is held against a room that is not known.

    Args:
        needed: bytes by what they hold, of `expected` or `at_least`.
        free: of `room`.

    Raises:
        InputError: with the numbers and what would take less.
    """
    total = sum(needed.values())
    if free is None or total <= free:
        return
    largest = sorted(needed, key=lambda name: -needed[name])[:2]
    parts = ", ".join(f"{name} {needed[name] / 1e9:.3g}" for name in largest)
    remedies = ", ".join(dict.fromkeys(REMEDIES[name] for name in largest if name in REMEDIES))
    raise InputError(
        f"the run needs about {total / 1e9:.3g} GB of memory (most of it {parts}), but there are "
        f"{free / 1e9:.3g}: take {remedies or 'a machine with more'}"
    )
