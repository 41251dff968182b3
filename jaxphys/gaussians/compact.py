"""Densification by compactness: a Gaussian in each gap between neighbours.

GSGEN (Chen et al. 2024, and its released code) adds it to densification by gradients. Works on the
host: it is asked a few times in a run.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError
from jaxphys.gaussians.density import DensityUpdate
from jaxphys.gaussians.gaussians import Gaussians, covariances, select


@dataclass(frozen=True)
class CompactConfig:
    """What counts as a gap.

    Attributes:
        neighbours: each Gaussian is held against so many, the nearest.
        reach: standard deviations at which a Gaussian ends, along the line to its neighbour. GSGEN
            shrinks all Gaussians to two thirds and takes three, which is the same test.
    """

    neighbours: int = 3
    reach: float = 2.0

    def __post_init__(self):
        if self.neighbours < 1 or not self.reach > 0:
            raise InputError(
                f"neighbours = {self.neighbours}, reach = {self.reach}: at least 1, and above 0"
            )


def close_gaps(
    gaussians: Gaussians, alive: Array, config: CompactConfig = CompactConfig()
) -> DensityUpdate:
    """Puts a round Gaussian in the middle of each gap, as wide as the gap at `reach`, with the
    colour, opacity and rotation of one of the two. The widest gaps come first while there is room.

    Args:
        gaussians: N slots. Their values must be known: not for use inside jit.
        alive: mask (N,) of those in use.
    """
    living = np.asarray(alive)
    used, free = np.flatnonzero(living), np.flatnonzero(~living)
    first, centre, gap = _gaps(gaussians, used, config)
    served = min(len(gap), len(free))
    slots, parents = free[:served], first[:served]
    source = np.arange(gaussians.count, dtype=np.int32)
    source[slots] = parents
    fresh = ~living
    now = select(gaussians, jnp.asarray(source))
    sizes = np.log(gap[:served] / (2 * config.reach))[:, None]
    dtype = now.means.dtype
    filled = Gaussians(
        now.means.at[slots].set(jnp.asarray(centre[:served], dtype)),
        now.log_scales.at[slots].set(jnp.asarray(np.repeat(sizes, 3, 1), dtype)),
        now.quaternions,
        now.opacity_logits,
        now.harmonics,
    )
    return DensityUpdate(
        filled,
        jnp.asarray(alive).at[slots].set(True),
        jnp.asarray(source),
        jnp.asarray(fresh),
        jnp.asarray(len(gap) - served),
    )


def _gaps(
    gaussians: Gaussians, used: np.ndarray, config: CompactConfig
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each gap between two of the slots `used`, widest first: one of its slots, its middle
    (M, 3) and its width (M,)."""
    points = np.asarray(gaussians.means, np.float64)[used]
    near = min(config.neighbours + 1, len(points))
    if near < 2:
        return used[:0], np.zeros((0, 3)), np.zeros(0)
    others = cKDTree(points).query(points, k=near)[1]
    pairs = np.stack([np.repeat(np.arange(len(points)), near), others.reshape(-1)], 1)
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)  # each once
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    ahead = points[pairs[:, 1]] - points[pairs[:, 0]]
    distance = np.linalg.norm(ahead, axis=1)
    pairs, ahead, distance = (a[distance > 0] for a in (pairs, ahead, distance))
    ahead = ahead / distance[:, None]
    shapes = np.asarray(covariances(gaussians), np.float64)[used]
    spread = np.einsum("pi,peij,pj->pe", ahead, shapes[pairs], ahead)
    radius = config.reach * np.sqrt(np.maximum(spread, 0))
    gap = distance - radius.sum(1)
    order = np.argsort(-gap, kind="stable")
    order = order[gap[order] > 0]
    middle = points[pairs[:, 0]] + (radius[:, :1] + 0.5 * gap[:, None]) * ahead
    return used[pairs[order, 0]], middle[order], gap[order]
