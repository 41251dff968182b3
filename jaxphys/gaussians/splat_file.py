"""Gaussians as `.splat` files, the small format of web viewers: 32 bytes a Gaussian, no header."""

import os

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path
from jaxphys.core.rotations import normalise_quaternion
from jaxphys.gaussians.gaussians import Gaussians, opacities, require_finite, scales
from jaxphys.gaussians.harmonics import dc_to_rgb

RECORD = np.dtype(
    [("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quaternion", "u1", 4)]
)


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
