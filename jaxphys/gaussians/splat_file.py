"""Gaussians as `.splat` files, the small format of web viewers: 32 bytes a Gaussian, no header."""

import os

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.fields import LARGEST
from jaxphys.core.files import atomic_path
from jaxphys.core.reading import reading
from jaxphys.core.rotations import normalise_quaternion
from jaxphys.gaussians.gaussians import (
    Gaussians,
    from_points,
    opacities,
    require_finite,
    scales,
)
from jaxphys.gaussians.harmonics import dc_to_rgb

RECORD = np.dtype(
    [("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quaternion", "u1", 4)]
)

LARGEST_FILE = 4 * 2**30


def write_splat(path: str | os.PathLike, gaussians: Gaussians) -> None:
    """Writes `gaussians` to `path`, whole or not at all; equal values give equal bytes.

    A record is position and linear scale as float32, colour and opacity as bytes, and the unit
    quaternion w, x, y, z as bytes `128 q + 128`. Only the constant part of the colour is kept.
    Viewers that draw while they load want the important splats first: records are sorted by
    opacity times volume, largest first, equal ones in the order given.

    Raises:
        InputError: a value is not finite, or does not fit float32.
    """
    require_finite(gaussians, str(path))
    opacity, scale = np.asarray(opacities(gaussians)), np.asarray(scales(gaussians))
    order = np.argsort(
        -opacity.astype(np.float64) * scale.astype(np.float64).prod(1), kind="stable"
    )
    rgba = np.concatenate([dc_to_rgb(gaussians.harmonics[:, 0]), opacity[:, None]], axis=1)
    quaternions = np.asarray(normalise_quaternion(gaussians.quaternions))
    record = np.empty(gaussians.count, RECORD)
    with np.errstate(over="ignore"):
        record["mean"] = np.asarray(gaussians.means)[order]
    if not np.isfinite(record["mean"]).all():
        raise InputError(f"{path}: a position is beyond float32, the type of .splat; rescale it")
    record["scale"] = scale[order]
    record["rgba"] = np.rint(255 * np.clip(rgba[order], 0, 1))
    record["quaternion"] = np.clip(np.rint(128 * quaternions[order] + 128), 0, 255)
    with atomic_path(path) as aside:
        aside.write_bytes(record.tobytes())


def read_splat(path: str | os.PathLike) -> Gaussians:
    """Gaussians from the .splat file at `path`, float32, of degree 0.

    Raises:
        InputError: the file is missing, cut off, empty, or holds values that are not finite.
    """
    with reading(path, LARGEST_FILE) as path:
        data = path.read_bytes()
        if not data or len(data) % RECORD.itemsize:
            raise InputError(
                f"{len(data)} bytes are no whole number of Gaussians of {RECORD.itemsize}; the file"
                " is cut off or no .splat"
            )
        record = np.frombuffer(data, RECORD)
        for name, least in (("mean", -LARGEST), ("scale", 0)):
            bad = ~((record[name] >= least) & (record[name] <= LARGEST)).all(axis=1)
            if bad.any():
                raise InputError(
                    f"the {name} of {bad.sum()} of {bad.size} Gaussians (first: {np.argmax(bad)})"
                    f" is not within {least:g} and {LARGEST:g}; export it again"
                )
        rgba = record["rgba"] / 255
        return from_points(
            jnp.asarray(record["mean"], jnp.float32),
            rgba[:, :3],
            record["scale"],
            opacity=rgba[:, 3],
            quaternions=(record["quaternion"].astype(np.float32) - 128) / 128,
        )
