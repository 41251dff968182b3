"""How many steps the default scenes take: equal ones, and steps that adapt.

python -m experiments.steps [--spacing 0.0625] [--frames 24] [--materials jelly sand ...]

With the objects of `experiments.showcase`. Steps do not depend on the machine, and nothing is
timed. Prints a table in Markdown.
"""

import argparse
from dataclasses import replace
from itertools import islice

import jaxphys
from experiments.showcase import OBJECTS, model_gaussians
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.mpm.stepping import Adaptive, Fixed
from jaxphys.pipeline.frames import frames
from jaxphys.scene.scene import Scene


def steps_taken(scene: Scene, thing: Gaussians) -> int:
    """Of all frames of a scene.

    Raises:
        SimulationError: the scene does not reach its end.
    """
    simulation, _ = jaxphys.build(scene, thing)
    *_, last = islice(frames(simulation), scene.frames)
    return last.metrics["steps"]


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m experiments.steps", description=__doc__)
    parser.add_argument("--spacing", type=float, default=1 / 16, help="of the grid [m]")
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--materials", nargs="*", default=list(OBJECTS))
    options = parser.parse_args()
    print("| material | equal steps | steps that adapt | of equal ones |")
    print("|---|---|---|---|")
    for name in options.materials:
        thing = model_gaussians(OBJECTS[name], 4000, 0)
        scene = jaxphys.default_scene(name, spacing=options.spacing)
        scene = replace(scene, frames=options.frames)
        equal, adapted = (
            steps_taken(replace(scene, stepping=stepping), thing)
            for stepping in (Fixed(), Adaptive())
        )
        print(f"| {name} | {equal} | {adapted} | {adapted / equal:.3f} |", flush=True)


if __name__ == "__main__":
    main()
