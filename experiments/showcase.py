"""The materials, each on an object it suits, without any trained prior.

    python -m experiments.showcase jelly --out outputs/showcase
    python -m experiments.showcase all --sheets docs/figures

Takes minutes a material on two cores. Writes what `jaxphys
animate` writes, and with `--sheets` copies each contact sheet there.
"""

import argparse
import dataclasses
import shutil
from pathlib import Path

import numpy as np

from jaxphys import animate, default_scene
from jaxphys.gaussians import Gaussians, gaussians_from_mesh
from jaxphys.gaussians.mesh import Mesh
from jaxphys.library import build

OBJECTS = {
    "jelly": "strawberry",
    "elastic": "burger",
    "metal": "can",
    "sand": "ice cream",
    "fracture": "sponge",
    "water": "apple",
    "cream": "cupcake",
    "toothpaste": "egg",
    "plasticine": "teddy bear",
    "snow": "snowman",
    "wet-sand": "castle",
    "memory-foam": "pillow",
    "muscle": "egg",
}


def model_gaussians(name: str, count: int, seed: int) -> Gaussians:
    """A parametric model as Gaussians: its vertex colours, no texture."""
    corners, colours = build(name, seed).model.triangles()
    faces = len(corners)
    mesh = Mesh(
        triangles=corners,
        colours=np.concatenate([colours, np.ones((faces, 3, 1))], axis=-1),
        uvs=np.zeros((faces, 3, 2)),
        textures=(),
        texture=np.full(faces, -1),
        cutoff=np.full(faces, -1.0),
    )
    return gaussians_from_mesh(mesh, count, seed)


def main() -> None:
    """Runs the scenes named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("material", choices=[*OBJECTS, "all"])
    parser.add_argument("--out", type=Path, default=Path("outputs/showcase"))
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--height", type=int, default=540)
    parser.add_argument("--splats", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for material in OBJECTS if options.material == "all" else (options.material,):
        scene = dataclasses.replace(
            default_scene(material),
            frames=options.frames,
            width=options.width,
            height=options.height,
        )
        thing = model_gaussians(OBJECTS[material], options.splats, options.seed)
        out = animate(
            scene, options.out / material, objects=(thing,), overwrite=True, progress=True
        )
        if options.sheets:
            options.sheets.mkdir(parents=True, exist_ok=True)
            shutil.copy(out / "contact_sheet.png", options.sheets / f"{material}.png")


if __name__ == "__main__":
    main()
