"""One file in, one file or a folder of pictures out: meshes to splats, splats to pictures."""

import os
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from jaxphys.core.checkpoints import fingerprint
from jaxphys.core.errors import InputError
from jaxphys.core.fields import SEED, between, check_number
from jaxphys.core.files import output_file
from jaxphys.core.run_folder import run_folder
from jaxphys.gaussians.gaussians import Gaussians, opacities, scales, to_splats
from jaxphys.gaussians.ply import write_ply
from jaxphys.gaussians.splat_file import write_splat
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.pipeline.video import write_picture
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import render
from jaxphys.scene.scene import MOST_SPLATS, View
from jaxphys.scene.source import load


def splat_mesh(
    mesh: str | os.PathLike,
    out: str | os.PathLike,
    *,
    count: int,
    seed: int,
    overwrite: bool = False,
) -> None:
    """Writes a mesh as `count` Gaussians to a .ply or .splat file.

    Raises:
        InputError: the mesh cannot be read, `out` has another ending, or is there and `overwrite`
            is not given.
    """
    writers = {".ply": write_ply, ".splat": write_splat}
    out = Path(out)
    if out.suffix.lower() not in writers:
        raise InputError(f"--out {out}: must end in .ply or .splat")
    check_number("--count", count, between(1, MOST_SPLATS))
    check_number("--seed", seed, SEED)
    output_file(out, overwrite=overwrite, inputs=(mesh,))
    writers[out.suffix.lower()](out, load(Path(mesh), count=count, seed=seed))


def outline(gaussians: Gaussians) -> np.ndarray:
    """Points (M, 3) that bound what is seen: centres, and two standard deviations to each side."""
    seen = np.asarray(opacities(gaussians)) > 0.05
    if not seen.any():
        seen[:] = True
    means = np.asarray(gaussians.means)[seen]
    size = 2 * np.asarray(scales(gaussians)).max(axis=1)[seen]
    size = np.minimum(size, np.quantile(size, 0.99))[:, None]
    return np.concatenate([means + sign * size * axis for axis in np.eye(3) for sign in (1, -1)])


def render_file(
    file: str | os.PathLike,
    out: str | os.PathLike,
    view: View,
    *,
    width: int,
    height: int,
    views: int,
    background: tuple[float, float, float],
    overwrite: bool = False,
) -> None:
    """Draws a .ply of splats to a .png file, or as `views` pictures of a full turn to a directory.

    Raises:
        InputError: the file cannot be read, a number is out of range, or `out` cannot be written
            (see `output_file` and `run_folder`).
    """
    check_number("--width", width, between(1, 8192))
    check_number("--height", height, between(1, 8192))
    check_number("--views", views, between(1, 10_000))
    for value in background:
        check_number("--background", value, between(0, 1))
    gaussians = load(Path(file))
    out = Path(out)
    single = out.suffix.lower() == ".png"
    if not single and out.suffix:
        raise InputError(f"--out {out}: must end in .png, or name a directory")
    count = 1 if single else views
    turning = view if single else replace(view, turn=360 / views)
    cameras = frame_cameras(turning, [outline(gaussians)] * count, 1.0, width, height)
    pictures = (_picture(gaussians, camera, background) for camera in cameras)
    if single:
        write_picture(output_file(out, overwrite=overwrite), next(pictures))
        return
    request = fingerprint(b"render", repr((turning, width, height, background)).encode(), gaussians)
    names = [f"{index:04d}.png" for index in range(views)]
    with run_folder(out, request, names, inputs=(Path(file),), overwrite=overwrite) as folder:
        for name, pixels in zip(names, pictures, strict=True):
            write_picture(folder.file(name), pixels)


def _picture(gaussians: Gaussians, camera: Camera, background: tuple) -> np.ndarray:
    """(H, W, 3) uint8."""
    splats = to_splats(gaussians, position(camera))
    image = render(splats, camera, background=jnp.asarray(background, jnp.float32))
    return np.asarray(jnp.round(255 * jnp.clip(image.colour, 0, 1)).astype(jnp.uint8))
