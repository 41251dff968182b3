"""Writes the averaged weights of a training run into the package, as float16, with their facts.

    python -m experiments.priors.export point_prior --run RUN --data PREPARED
    python -m experiments.priors.export pixel_prior --run RUN --data PREPARED

The manifest then holds what the run was: data, steps, seed, held-out error by noise level, command.
"""

import argparse
import json
import tempfile
from dataclasses import asdict
from pathlib import Path

import numpy as np
from flax import nnx
from safetensors.numpy import save_file

from experiments.priors.training import averaged, config_of, lines_of
from jaxphys import weights
from jaxphys.guidance.bundled.latent_prior import LatentPrior, LatentPriorConfig
from jaxphys.guidance.bundled.pixel_prior import PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.bundled.shape_autoencoder import AutoencoderConfig, ShapeAutoencoder
from jaxphys.library import KINDS as KINDS_DRAWN
from jaxphys.networks.parameters import named_parameters

KINDS = {
    "point_prior": (PointPrior, PointPriorConfig, "train_points"),
    "pixel_prior": (PixelPrior, PixelPriorConfig, "train_pixels"),
    "shape_autoencoder": (ShapeAutoencoder, AutoencoderConfig, "train_autoencoder"),
    "latent_prior": (LatentPrior, LatentPriorConfig, "train_latents"),
}
LICENCE = "Apache-2.0; trained on CC0, CC-BY 3.0 and MIT data, see the attribution file"
DATA = (
    "parametric models of jaxphys/library, Debian sweethome3d-furniture 1.8 (CC0, CC-BY),"
    " @lobehub/fluent-emoji-3d 1.1.0 (MIT; pixel prior only)"
)


def samples_seen(lines: list[dict], step: int) -> int:
    """Samples drawn in `step` steps by a run whose pieces may have had different batch sizes."""
    pieces = [(line["start"], line["options"]["batch"]) for line in lines if "start" in line]
    ends = [start for start, _ in pieces[1:]] + [step]
    return sum((end - start) * batch for (start, batch), end in zip(pieces, ends, strict=True))


def pieces(lines: list[dict], step: int) -> list[dict]:
    """First step and settings of each piece of a run, where one of them changes."""
    found: list[dict] = []
    for line in lines:
        if "start" in line and line["start"] < step:
            given = line["options"]
            settings = {k: given[k] for k in ("batch", "learning_rate", "points") if k in given}
            if not found or any(found[-1][key] != value for key, value in settings.items()):
                found.append({"start": line["start"], **settings})
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=sorted(KINDS))
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--folder", type=Path, default=weights.FOLDER)
    options = parser.parse_args()
    kind, config_type, script = KINDS[options.name]
    lines, config = lines_of(options.run), config_of(options.run, config_type)
    module = nnx.eval_shape(lambda: kind(config, rngs=nnx.Rngs(0)))
    arrays, step = averaged(options.run, named_parameters(module))
    trained = [line["options"] for line in lines if "options" in line][-1]
    reports = [line for line in lines if "held_out" in line and line["step"] <= step]
    if not reports:
        raise SystemExit(f"{options.run}: no held-out error was measured yet; train on")
    flags = " ".join(
        f"--{key.replace('_', '-')} {trained[key]}"
        for key in ("batch", "learning_rate", "seed", "points")
        if key in trained
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "weights.safetensors"
        # Half precision keeps three bits more than bfloat16, and weights need no more range.
        save_file({n: np.asarray(a, np.float16) for n, a in arrays.items()}, path)
        entry = weights.register(
            options.name,
            path,
            options.folder,
            licence=LICENCE,
            data=DATA,
            records=json.loads((options.data / "summary.json").read_text()),
            command=f"python -m experiments.priors.{script} --data PREPARED --run RUN {flags}",
            config=asdict(config),
            steps=step,
            samples=samples_seen(lines, step),
            pieces=pieces(lines, step),
            seed=trained["seed"],
            held_out_step=reports[-1]["step"],
            **{key: value for key, value in reports[-1].items() if key.startswith("held_out")},
            kinds=sorted(KINDS_DRAWN),
        )
    print(json.dumps(entry, indent=2))


if __name__ == "__main__":
    main()
