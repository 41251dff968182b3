"""Suite 'headline': the paper's table row, from Gaussians to video, from a cold start.

The paper takes 1.7 minutes a video of 1958 x 1090 on an RTX 3090. Here: jelly, 48 frames of that
size, at least 30,000 particles; simulate, render and encode, compiling included.
"""

import dataclasses
import json
import os
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.case import Case, Prepared


def prepare(frames: int, width: int, height: int, splats: int) -> Prepared:
    """The jelly strawberry of the showcase. The compilation cache is off: a first run counts."""
    os.environ.pop("JAX_COMPILATION_CACHE_DIR", None)
    from experiments.showcase import model_gaussians
    from jaxphys import animate, build, default_scene

    scene = dataclasses.replace(default_scene("jelly"), frames=frames, width=width, height=height)
    thing = model_gaussians("strawberry", splats, 0)
    folder = tempfile.TemporaryDirectory()
    out = Path(folder.name) / "run"
    extra: dict[str, object] = {"frames": frames}

    def call() -> None:
        animate(scene, out, objects=(thing,))
        timing = json.loads((out / "timing.json").read_text())
        extra.update(stages=timing["stages"], compile=timing["compile"])
        extra["particles"] = build(scene, thing).simulation.config.particles

    return Prepared(call, work=frames, once=True, extra=extra)


def cases(quick: bool) -> list[Case]:
    """One whole run."""
    numbers = (4, 320, 180, 4_000) if quick else (48, 1958, 1090, 20_000)
    frames, width, height, splats = numbers
    size = {"width": width, "height": height, "splats": splats}
    return [Case("jelly", "jaxphys", partial(prepare, frames, width, height, splats), size)]
