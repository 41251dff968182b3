"""Observations in files: arrays in .npz, which hold no code.

    tracks  positions (T, M, 3), times (T,); particles (M,), seen (T, M)
    points  points (sum of M_t, 3), counts (T,), times (T,)
    images  frames (C, T, H, W, 3) or (T, H, W, 3), times (T,), and the cameras
    masks   frames (C, T, H, W) or (T, H, W), times (T,), and the cameras

Frames are in [0, 1], or whole numbers up to 255. Cameras are camera_rotation (C, 3, 3),
camera_translation (C, 3) [m], camera_focal (C, 2), camera_centre (C, 2) [pixels], as `Camera` has
them; without the first axis for one.
"""

import os
import zipfile
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.files import atomic_path
from jaxphys.core.reading import reading
from jaxphys.fitting.observed import Images, Masks, Observed, Points, Tracks
from jaxphys.render.camera import Camera

LARGEST_FILE = 16 * 2**30
CAMERA = ("rotation", "translation", "focal", "centre")


def read_arrays(path: str | os.PathLike) -> dict[str, np.ndarray]:
    """The arrays of an .npz file.

    Raises:
        InputError: it is none, or holds something else than arrays.
    """
    with reading(path, LARGEST_FILE):
        try:
            with np.load(path, allow_pickle=False) as file:
                if not isinstance(file, np.lib.npyio.NpzFile):
                    raise InputError("is one array; give several by name, as numpy.savez does")
                return {name: file[name] for name in file.files}
        except (ValueError, zipfile.BadZipFile, EOFError, KeyError) as error:
            raise InputError(f"is no .npz file of arrays ({error})") from None


def read_tracks(path: str | os.PathLike, **options) -> Tracks:
    """`Tracks` from a file. Options, here and below, are those of the class, such as `noise`."""
    arrays = read_arrays(path)
    with reading(path):
        positions, times = _named(arrays, "positions", "times")
        return Tracks(positions, times, arrays.get("particles"), arrays.get("seen"), **options)


def read_points(path: str | os.PathLike, **options) -> Points:
    """`Points` from a file."""
    arrays = read_arrays(path)
    with reading(path):
        points, counts, times = _named(arrays, "points", "counts", "times")
        if counts.ndim != 1 or counts.dtype.kind not in "iu" or counts.sum() != len(points):
            raise InputError(f"counts: must be (T,) whole numbers that add up to {len(points)}")
        clouds = np.split(points, np.cumsum(counts)[:-1])
        return Points(clouds, times, arrays.get("particles"), **options)


def read_images(path: str | os.PathLike, **options) -> Images:
    """`Images` from a file."""
    return _read_seen(Images, path, options)


def read_masks(path: str | os.PathLike, **options) -> Masks:
    """`Masks` from a file."""
    return _read_seen(Masks, path, options)


def _read_seen(kind, path, options):
    arrays = read_arrays(path)
    with reading(path):
        frames, times = _named(arrays, "frames", "times")
        parts = _named(arrays, *(f"camera_{name}" for name in CAMERA))
        if frames.dtype.kind in "iu":
            frames = frames.astype(np.float32) / 255
        one = parts[0].ndim == 2
        height, width = frames.shape[1 if one else 2 :][:2] if frames.ndim > 2 else (0, 0)
        if one:
            return kind(frames, _camera(parts, width, height), times, **options)
        if len({len(part) for part in parts}) != 1:
            raise InputError("camera_*: must have one entry for each camera")
        cameras = [_camera([p[i] for p in parts], width, height) for i in range(len(parts[0]))]
        return kind(frames, cameras, times, **options)


def _camera(parts, width: int, height: int) -> Camera:
    shapes = ((3, 3), (3,), (2,), (2,))
    for name, part, shape in zip(CAMERA, parts, shapes, strict=True):
        if part.shape != shape or not np.all(np.isfinite(part)):
            raise InputError(f"camera_{name}: must be finite, of shape {shape} for each camera")
    rotation, translation, focal, centre = (jnp.asarray(part, jnp.float32) for part in parts)
    return Camera(rotation, translation, focal, centre, width, height)


def _named(arrays: Mapping[str, np.ndarray], *names: str) -> list[np.ndarray]:
    for name in names:
        if name not in arrays:
            raise InputError(f"the array {name!r} is missing; {nearest(name, arrays)}")
    return [arrays[name] for name in names]


def write_observed(path: str | os.PathLike, observed: Observed) -> None:
    """Writes an observation as the readers above want it."""
    times = np.asarray(observed.times)
    match observed:
        case Tracks():
            arrays: dict[str, Any] = {"positions": observed.positions, "times": times}
            for name in ("particles", "seen"):
                if getattr(observed, name) is not None:
                    arrays[name] = getattr(observed, name)
        case Points():
            counts = np.array([len(cloud) for cloud in observed.clouds])
            points = np.concatenate([np.asarray(cloud) for cloud in observed.clouds])
            arrays = {"points": points, "counts": counts, "times": times}
            if observed.particles is not None:
                arrays["particles"] = observed.particles
        case Images() | Masks():
            views = observed.views
            arrays = {"frames": observed.pictures, "times": times}
            for name in CAMERA:
                arrays[f"camera_{name}"] = np.stack([np.asarray(getattr(v, name)) for v in views])
        case _:
            raise InputError(f"{observed.name}: has no form as a file")
    with atomic_path(path) as aside, open(aside, "wb") as file:
        np.savez_compressed(file, **arrays)
