"""What writers take: frames of Gaussians, and their numbers as plain arrays."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from jaxphys.core.ellipsoid_axes import unit
from jaxphys.core.errors import InputError
from jaxphys.core.fields import LARGEST
from jaxphys.gaussians.gaussians import LOG_SCALE_LIMIT, Gaussians, require_finite


class NumberedGaussians(NamedTuple):
    """One frame of a motion.

    Attributes:
        number: of the frame in its run, from 0.
        gaussians: as they are then.
    """

    number: int
    gaussians: Gaussians


Frames = Iterable[NumberedGaussians]


class Plain(NamedTuple):
    """N Gaussians as float64 arrays of numpy.

    Attributes:
        means: (N, 3) [m].
        log_scales: (N, 3), logarithms of the standard deviations in metres.
        quaternions: (N, 4) w, x, y, z of unit length; zero ones are no rotation.
        opacities: (N,) in [0, 1].
        harmonics: (N, K, 3).
    """

    means: np.ndarray
    log_scales: np.ndarray
    quaternions: np.ndarray
    opacities: np.ndarray
    harmonics: np.ndarray


def plain(gaussians: Gaussians, source: str) -> Plain:
    """The numbers of `gaussians`; `source` is for messages.

    Raises:
        InputError: there are none, or a value is not finite or too large for a file.
    """
    if not gaussians.count:
        raise InputError(f"{source}: there are no Gaussians to write")
    require_finite(gaussians, source)
    means, log_scales, quaternions, logits, harmonics = (
        np.asarray(values, np.float64)
        for values in (
            gaussians.means,
            gaussians.log_scales,
            gaussians.quaternions,
            gaussians.opacity_logits,
            gaussians.harmonics,
        )
    )
    for name, values in (("position", means), ("colour", harmonics)):
        if np.abs(values).max() > LARGEST:
            raise InputError(f"{source}: a {name} is beyond {LARGEST:g}; rescale it")
    return Plain(
        means,
        np.clip(log_scales, -LOG_SCALE_LIMIT, LOG_SCALE_LIMIT),
        unit(quaternions),
        1 / (1 + np.exp(-np.clip(logits, -50, 50))),
        harmonics,
    )
