"""A capture of a parametric model, reconstructed, and how like it is on pictures held out.

    python -m experiments.reconstruction --out outputs/reconstruction [--kind strawberry]

112 pictures from all around, 12 of them held out, in the layout of NeRF's synthetic scenes; then
`jaxphys reconstruct` on it.
"""

import argparse
import json
import math
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from PIL import Image

from jaxphys.gaussians import to_splats
from jaxphys.guidance.library import library_object
from jaxphys.pipeline.reconstruct import reconstruct
from jaxphys.render import look_at, position, render

FIELD, DISTANCE = math.radians(30), 2.4


def write_capture(folder: Path, kind: str, splats: int, side: int, count: int, held: int) -> None:
    """Pictures of a model and where they were taken from."""
    gaussians, _ = library_object(kind, 0, splats)
    (folder / "shots").mkdir(parents=True)
    frames = []
    turn = math.pi * (3 - math.sqrt(5))
    for index in range(count):
        rise = math.asin(0.9 * (1 - 2 * (index + 0.5) / count))
        flat, azimuth = math.cos(rise), index * turn
        eye = DISTANCE * np.array(
            [flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(rise)]
        )
        camera = look_at(eye, np.zeros(3), field_of_view=FIELD, width=side, height=side)
        image = render(to_splats(gaussians, position(camera)), camera, background=0.0)
        alpha = jnp.clip(image.alpha, 0, 1)[..., None]
        colour = jnp.clip(image.colour / jnp.maximum(alpha, 1e-3), 0, 1)
        both = np.asarray(jnp.concatenate([colour, alpha], axis=-1))
        Image.fromarray((255 * both + 0.5).astype(np.uint8)).save(
            folder / "shots" / f"{index:03d}.png"
        )
        matrix = np.eye(4)
        matrix[:3, :3] = np.asarray(camera.rotation).T @ np.diag([1.0, -1.0, -1.0])
        matrix[:3, 3] = eye
        frames.append({"file_path": f"shots/{index:03d}", "transform_matrix": matrix.tolist()})
    # Those held out are spread among the others.
    step = count // held
    for name, chosen in (
        ("train", [f for i, f in enumerate(frames) if i % step or i >= step * held]),
        ("test", [f for i, f in enumerate(frames) if i % step == 0 and i < step * held]),
    ):
        told = {"camera_angle_x": FIELD, "frames": chosen}
        (folder / f"transforms_{name}.json").write_text(json.dumps(told))


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--kind", default="a strawberry")
    parser.add_argument("--side", type=int, default=200)
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--splats", type=int, default=10_000)
    options = parser.parse_args()
    capture = options.out / "capture"
    if not capture.exists():
        write_capture(capture, options.kind, 20_000, options.side, 112, 12)
    found = reconstruct(
        capture,
        options.out / "made",
        steps=options.steps,
        splats=options.splats,
        progress=True,
    )
    seconds = json.loads((options.out / "made" / "timing.json").read_text())["stages"]
    print(json.dumps(found | {"seconds": seconds}))


if __name__ == "__main__":
    main()
