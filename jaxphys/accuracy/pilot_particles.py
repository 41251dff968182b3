"""Coarse particles for a pilot: an object whose skin has no more of them than a coarse grid needs.

A run has one particle for every Gaussian of an object, however coarse its grid, and most of a
pilot's would lie in the skin. All Gaussians within a cell of some pitch become one particle, of
their volume, at their middle. A point of the skin moves with the particle of its cell, x + F (X -
X_particle), so that motions on several grids can be compared point by point.
"""

from typing import NamedTuple

import numpy as np

from jaxphys.gaussians.gaussians import from_points
from jaxphys.scene.place import Placed

GREY = np.full(3, 0.5)


class Coarse(NamedTuple):
    """An object of fewer particles.

    Attributes:
        placed: the object, its skin one grey Gaussian for each cell; filled as it was.
        owner: which of these each Gaussian of the object belongs to, (K,).
        offset: from that one to the Gaussian, at rest, (K, 3) [m].
    """

    placed: Placed
    owner: np.ndarray
    offset: np.ndarray


def coarser(placed: Placed, pitch: float) -> Coarse:
    """`placed` with one Gaussian for each cell of side `pitch` [m] that holds any.

    Cells are laid about the object's own middle, so that the pilot is the same at every place.
    """
    skin = np.asarray(placed.moving.means, np.float64)
    volumes = np.asarray(placed.volumes, np.float64)
    middle = (skin.min(axis=0) + skin.max(axis=0)) / 2
    cells = np.floor((skin - middle) / pitch).astype(np.int64)
    _, owner, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    owner = owner.reshape(-1)
    own = volumes[: len(skin)]
    total = np.bincount(owner, own)
    # A cell of Gaussians without volume keeps their middle all the same.
    weights = np.where(total[owner] > 0, own, 1.0)
    whole = np.where(total > 0, total, counts)
    points = np.stack(
        [np.bincount(owner, weights * skin[:, axis]) / whole for axis in range(3)], axis=1
    )
    moving = from_points(points.astype(placed.moving.means.dtype), GREY, pitch / 2)
    made = placed._replace(moving=moving, volumes=np.concatenate([total, volumes[len(skin) :]]))
    return Coarse(made, owner, skin - np.asarray(moving.means, np.float64)[owner])


def carried(position: np.ndarray, deformation: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Places (M, 3) [m] of points that lay `offset` (M, 3) [m] away from particles, which are at
    `position` (M, 3) [m] now, deformed by `deformation` (M, 3, 3).
    """
    return position + np.einsum("mij,mj->mi", deformation, offset)
