"""Suite 'headline': the paper's table row, from Gaussians to video, from a cold start.

The paper takes 1.7 minutes a video of 1958 x 1090 on an RTX 3090. Here: a strawberry of each of the
paper's five materials in its default scene, 48 frames of that size; `jaxphys animate` in a process
of its own, so that starting, compiling (its cache off), simulating, drawing and encoding count.

Method `before` is the same command of another checkout, whose folder JAXPHYS_BEFORE names: it is
run in turn with this one, from this environment.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.case import Case, Prepared
from benchmarks.worker import commit

MATERIALS = ("jelly", "elastic", "metal", "sand", "fracture")
BEFORE = "JAXPHYS_BEFORE"
# Radius and height of a strawberry, from its tip to the end of its stalk.
PROFILE = (
    (0, -0.5), (0.11, -0.46), (0.31, -0.22), (0.41, 0.12), (0.33, 0.3), (0.12, 0.36),
    (0.03, 0.36), (0.03, 0.5), (0, 0.5),
)  # fmt: skip
AROUND = 48
RED, GREEN = (0.8, 0.1, 0.1), (0.2, 0.55, 0.15)


def fruit():
    """A strawberry's body as a mesh: the profile turned about z, red, and green above."""
    from jaxphys.gaussians.mesh import Mesh

    radius, height = np.array(PROFILE).T
    angle = 2 * np.pi * np.arange(AROUND + 1) / AROUND
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    points = np.stack([x, y, np.broadcast_to(height[:, None], x.shape)], axis=-1)
    # Outwards: around, then up.
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    sides = np.stack([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)], axis=2)
    triangles = sides.reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(*np.moveaxis(np.diff(triangles, axis=1), 1, 0)), axis=1)
    triangles = triangles[area > 0]  # at the ends of the axis half of them are flat
    faces = len(triangles)
    colours = np.where(triangles[..., 2:] > 0.32, GREEN, RED)
    return Mesh(
        triangles=triangles,
        colours=np.concatenate([colours, np.ones((faces, 3, 1))], axis=-1),
        uvs=np.zeros((faces, 3, 2)),
        textures=(),
        texture=np.full(faces, -1),
        cutoff=np.full(faces, -1.0),
    )


def prepare(
    material: str, frames: int, width: int, height: int, splats: int, checkout: str
) -> Prepared:
    """The film of a strawberry of this material, by the jaxphys that lies in `checkout`."""
    from jaxphys.gaussians import gaussians_from_mesh
    from jaxphys.gaussians.ply import write_ply

    if not (Path(checkout) / "jaxphys").is_dir():  # what is installed would run instead
        raise FileNotFoundError(f"{BEFORE}: {checkout} has no folder jaxphys; name a checkout")
    folder = tempfile.TemporaryDirectory()
    thing, out = Path(folder.name) / "strawberry.ply", Path(folder.name) / "run"
    write_ply(thing, gaussians_from_mesh(fruit(), splats, 0))
    command = [sys.executable, "-m", "jaxphys", "animate", thing, "--material", material]
    command += ["--frames", frames, "--width", width, "--height", height, "--out", out]
    environment = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    environment["PYTHONPATH"] = checkout

    def call() -> None:
        words = [str(word) for word in command]
        done = subprocess.run(
            words, cwd=folder.name, env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(done.stderr.strip().splitlines()[-1])

    def found() -> dict[str, object]:
        timing = json.loads((out / "timing.json").read_text())
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return {
            "stages": timing["stages"],
            "compile": timing["compile"],
            "commit": commit(checkout),
            "cpu_seconds": used.ru_utime + used.ru_stime,
            "peak_bytes": used.ru_maxrss * 1024,
        }

    return Prepared(call, work=frames, once=True, extra={"frames": frames}, found=found)


def cases(quick: bool) -> list[Case]:
    """One whole run a material; --quick: small, and jelly alone."""
    numbers = (4, 320, 180, 4_000) if quick else (48, 1958, 1090, 20_000)
    size = dict(zip(("frames", "width", "height", "splats"), numbers, strict=True))
    checkouts = {"jaxphys": str(Path(__file__).parents[1])}
    if BEFORE in os.environ:
        checkouts["before"] = str(Path(os.environ[BEFORE]).resolve())
    return [
        Case(
            material,
            method,
            partial(prepare, material, *numbers, checkout),
            size,
            baseline=method == "before",
        )
        for material in MATERIALS[: 1 if quick else None]
        for method, checkout in checkouts.items()
    ]
