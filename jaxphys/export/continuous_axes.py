"""Gaussians whose axes go on from frame to frame, for players that interpolate between them."""

from collections.abc import Iterator
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from jaxphys.core.ellipsoid_axes import nearest_axes, unit
from jaxphys.export.frames import Frames, NumberedGaussians
from jaxphys.gaussians.gaussians import Gaussians


def continuous_axes(frames: Frames) -> Iterator[NumberedGaussians]:
    """The frames with axes that go on from one to the next; what is drawn stays the same.

    Turns of more than about 45 degrees between two frames may go the other way round.
    """
    previous: np.ndarray | None = None
    for frame in frames:
        gaussians = frame.gaussians
        quaternions = unit(np.asarray(gaussians.quaternions, np.float64))
        if previous is not None and previous.shape == quaternions.shape:
            scales = np.asarray(gaussians.log_scales, np.float64)
            quaternions, scales = nearest_axes(previous, quaternions, scales)
            gaussians = _with_axes(gaussians, quaternions, scales)
        previous = quaternions
        yield frame._replace(gaussians=gaussians)


def _with_axes(gaussians: Gaussians, quaternions: np.ndarray, log_scales: np.ndarray) -> Gaussians:
    dtype = gaussians.means.dtype
    return replace(
        gaussians,
        quaternions=jnp.asarray(quaternions, dtype),
        log_scales=jnp.asarray(log_scales, dtype),
    )
