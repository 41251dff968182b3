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

import numpy as np

from benchmarks.case import Case, Prepared

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


def prepare(frames: int, width: int, height: int, splats: int) -> Prepared:
    """A jelly strawberry. The compilation cache is off: a first run counts."""
    os.environ.pop("JAX_COMPILATION_CACHE_DIR", None)
    from jaxphys import animate, build, default_scene
    from jaxphys.gaussians import gaussians_from_mesh

    scene = dataclasses.replace(default_scene("jelly"), frames=frames, width=width, height=height)
    thing = gaussians_from_mesh(fruit(), splats, 0)
    folder = tempfile.TemporaryDirectory()
    out = Path(folder.name) / "run"

    def found() -> dict[str, object]:
        timing = json.loads((out / "timing.json").read_text())
        particles = build(scene, thing).simulation.config.particles
        return {"stages": timing["stages"], "compile": timing["compile"], "particles": particles}

    return Prepared(
        lambda: animate(scene, out, objects=(thing,)),
        work=frames,
        once=True,
        extra={"frames": frames},
        found=found,
    )


def cases(quick: bool) -> list[Case]:
    """One whole run."""
    numbers = (4, 320, 180, 4_000) if quick else (48, 1958, 1090, 20_000)
    frames, width, height, splats = numbers
    size = {"width": width, "height": height, "splats": splats}
    return [Case("jelly", "jaxphys", partial(prepare, frames, width, height, splats), size)]
