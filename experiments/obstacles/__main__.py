"""Things that are pushed, gripped, struck, twisted and poured, without any trained prior.

    python -m experiments.obstacles pusher --out outputs/obstacles
    python -m experiments.obstacles all

The scenes are the JSON files beside this one; `jaxphys animate OBJECT --config FILE` runs them with
another object. `twist` and `grains` are after Newton's examples `mpm_beam_twist` and
`mpm_granular`. Takes some minutes a scene on two cores.
"""

import argparse
from pathlib import Path

from experiments.showcase import model_gaussians, small_sheet
from jaxphys import animate
from jaxphys.scene import read_scene

OBJECTS = {
    "pusher": "burger",
    "gripper": "apple",
    "cannonball": "strawberry",
    "twist": "baguette",
    "grains": "cube",
}


def main() -> None:
    """Runs the scenes named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", choices=[*OBJECTS, "all"])
    parser.add_argument("--out", type=Path, default=Path("outputs/obstacles"))
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in OBJECTS if options.scene == "all" else (options.scene,):
        scene = read_scene(Path(__file__).parent / f"{name}.json").scene
        thing = model_gaussians(OBJECTS[name], scene.objects[0].splats, options.seed)
        out = animate(scene, options.out / name, objects=(thing,), overwrite=True, progress=True)
        if options.sheets:
            small_sheet(out, options.sheets / f"{name}.jpg")


if __name__ == "__main__":
    main()
