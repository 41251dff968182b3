"""The materials, each on an object it suits, without any trained prior: in its default scene, or
in an event of its own (`experiments.events`) where that tells more.

    python -m experiments.showcase jelly --out outputs/showcase
    python -m experiments.showcase all --sheets docs/figures

Takes minutes a material on two cores. Writes what `jaxphys
animate` writes, and with `--sheets` a small JPEG of each contact sheet there.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np
from PIL import Image

from experiments.events import EVENTS
from jaxphys import animate, default_scene
from jaxphys.gaussians import Gaussians, gaussians_from_mesh
from jaxphys.gaussians.mesh import Mesh
from jaxphys.library import build

SHEET = 1280  # pixels across
# Of each material what shows it, and the seed that gives it a colour that goes with it.
OBJECTS = {
    "jelly": ("strawberry", 0),
    "elastic": ("burger", 0),
    "metal": ("can", 0),
    "sand": ("ice cream", 0),
    "fracture": ("sponge", 0),
    "water": ("cube", 1),
    "cream": ("cupcake", 0),
    "toothpaste": ("egg", 0),
    "plasticine": ("teddy bear", 0),
    "snow": ("ball", 0),
    "wet-sand": ("castle", 0),
    "memory-foam": ("cube", 0),
    "muscle": ("heart", 3),
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


def small_sheet(out: Path, path: Path) -> None:
    """A run's contact sheet as a JPEG of some 50 kB."""
    with Image.open(out / "contact_sheet.png") as sheet:
        height = round(sheet.height * SHEET / sheet.width)
        path.parent.mkdir(parents=True, exist_ok=True)
        sheet.convert("RGB").resize((SHEET, height)).save(path, quality=85)


def main() -> None:
    """Runs the scenes named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("material", choices=[*OBJECTS, "all"])
    parser.add_argument("--out", type=Path, default=Path("outputs/showcase"))
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--frames", type=int, help="over the scene's own time")
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--height", type=int, default=540)
    parser.add_argument("--splats", type=int, default=20_000)
    parser.add_argument("--spacing", type=float, help="of the grid [m]")
    parser.add_argument("--seed", type=int, help="another one of the object's kind")
    options = parser.parse_args()
    for material in OBJECTS if options.material == "all" else (options.material,):
        spacing = {} if options.spacing is None else {"spacing": options.spacing}
        if material in EVENTS:
            event = EVENTS[material](**spacing)
            scene, objects = event.scene, event.objects()
        else:
            scene = default_scene(material, **spacing)
            kind, seed = OBJECTS[material]
            seed = seed if options.seed is None else options.seed
            objects = (model_gaussians(kind, options.splats, seed),)
        frames = options.frames or scene.frames
        scene = dataclasses.replace(
            scene,
            frames=frames,
            fps=scene.fps * frames / scene.frames,
            width=options.width,
            height=options.height,
        )
        out = animate(scene, options.out / material, objects=objects, overwrite=True, progress=True)
        if options.sheets:
            small_sheet(out, options.sheets / f"{material}.jpg")


if __name__ == "__main__":
    main()
