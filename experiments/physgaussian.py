"""PhysGaussian's six example configurations, on stand-ins, at a coarse grid.

    python -m experiments.physgaussian --out outputs/physgaussian --sheets docs/figures

Each is read from `tests/data/physgaussian`, changed by `COARSE` alone, and run as `jaxphys animate
MODEL_FOLDER --config FILE` runs it; under a minute each on two cores. docs/physgaussian.md has what
they show.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from PIL import Image

from experiments.physgaussian_models import MODELS, stand_in, write_model
from jaxphys import animate, load, read_scene

CONFIGS = Path(__file__).parent.parent / "tests" / "data" / "physgaussian"
# What makes a run short: fewer cells, longer steps and fewer, wider spaced pictures.
COARSE: dict[str, dict[str, Any]] = {
    "ficus": {"n_grid": 30, "substep_dt": 1.25e-4, "frame_num": 20, "frame_dt": 0.05},
    "pillow2sofa": {"n_grid": 40, "substep_dt": 4e-3, "frame_num": 24, "frame_dt": 0.12},
    "plane": {"n_grid": 40, "substep_dt": 1e-3, "frame_num": 24, "frame_dt": 0.1},
    "tear_bread": {"n_grid": 50, "substep_dt": 5e-4, "frame_num": 24, "frame_dt": 0.12},
    "vasedeck": {"n_grid": 36, "substep_dt": 1e-3, "frame_num": 17, "frame_dt": 0.06},
    "wolf": {"n_grid": 26, "substep_dt": 1.5e-4, "frame_num": 20, "frame_dt": 0.12},
}
LARGEST_SHEET = 150_000  # bytes


def coarse(name: str) -> dict[str, Any]:
    """The configuration called `name`, made short."""
    config = json.loads((CONFIGS / f"{name}.json").read_text()) | COARSE[name]
    if "particle_filling" in config:
        # Two cells of the filling for one of the grid, as densely filled as before.
        config["particle_filling"] |= {
            "n_grid": 2 * config["n_grid"], "max_partciels_per_cell": 1,
            "density_threshold": 1.0, "search_threshold": 0.5,
        }  # fmt: skip
    if name == "ficus":
        # The force is for each particle. A stand-in has far fewer and heavier ones than a capture.
        config["boundary_conditions"][1] |= {"force": [-70.0, 0.0, 0.0]}
    return config


def run(name: str, out: Path) -> Path:
    """Writes a model and a configuration into `out`, animates them; returns the run's folder."""
    config = coarse(name)
    model = write_model(out / "models" / name, stand_in(name, config))
    path = out / "configs" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(config, indent=1))
    loaded = read_scene(path, model)
    for note in loaded.notes:
        print(f"{name}: {note}")
    return animate(
        loaded.scene, out / "runs" / name, objects=(load(model),), overwrite=True, progress=True
    )


def small(sheet: Path, out: Path) -> None:
    """A contact sheet as a .png with a palette, below `LARGEST_SHEET`."""
    picture = Image.open(sheet).convert("RGB")
    width = min(picture.width, 1280)
    while True:
        made = picture.resize((width, picture.height * width // picture.width), Image.LANCZOS)
        made.quantize(96).save(out, optimize=True)
        if out.stat().st_size < LARGEST_SHEET:
            return
        width = int(0.9 * width)


def main() -> None:
    """Runs the examples named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", choices=MODELS)
    parser.add_argument("--out", type=Path, default=Path("outputs/physgaussian"))
    parser.add_argument("--sheets", type=Path)
    options = parser.parse_args()
    for name in options.names or MODELS:
        made = run(name, options.out)
        if options.sheets:
            options.sheets.mkdir(parents=True, exist_ok=True)
            small(made / "contact_sheet.png", options.sheets / f"physgaussian_{name}.png")


if __name__ == "__main__":
    main()
