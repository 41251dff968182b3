"""From a world with z up, which is ours, to one with y up and back; both are right-handed."""

import jax.numpy as jnp
import numpy as np

from jaxphys.gaussians.gaussians import Gaussians, transform

# (x, y, z) -> (x, z, -y): what is in front here, towards -y, comes towards the viewer, +z, there.
TO_Y_UP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.float64)


def to_y_up(gaussians: Gaussians) -> Gaussians:
    """The same with y up: centres, axes and harmonics are turned."""
    return transform(gaussians, jnp.asarray(TO_Y_UP))


def to_z_up(gaussians: Gaussians) -> Gaussians:
    """What `to_y_up` turned, as it was."""
    return transform(gaussians, jnp.asarray(TO_Y_UP.T))
