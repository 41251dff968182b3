"""Order in memory: particles that share nodes should be neighbours there."""

import numpy as np

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.transfer.kernels import QUADRATIC, Kernel


def cell_order(position, grid: Grid, segments=None, kernel: Kernel = QUADRATIC) -> np.ndarray:
    """The order (N,) int64 that sorts particles by grid cell, each segment within itself.

    position: (N, 3) [m]; segments: as in `Config`, default one of all particles; kernel: of the
    transfers. Stable. Transfers of sorted particles are about twice as fast from some 100,000
    particles on; a body that deforms stays nearly sorted, so that it is enough to order it once,
    before the state is made: `position[order]`, and so with everything that is per particle.
    `inverse_order` leads back.
    """
    position = np.asarray(position)
    cells = np.floor(position / grid.spacing - kernel.reach).astype(np.int64)
    nx, ny, nz = grid.shape
    cells = np.clip(cells, 0, np.array([nx, ny, nz]) - kernel.width)
    key = (cells[:, 0] * ny + cells[:, 1]) * nz + cells[:, 2]
    runs = [(0, len(position))] if segments is None else [run[-2:] for run in segments]
    parts = [start + np.argsort(key[start:stop], kind="stable") for start, stop in runs]
    return np.concatenate(parts)


def inverse_order(order: np.ndarray) -> np.ndarray:
    """The order that undoes `order`: `x[order][inverse_order(order)]` is `x`."""
    inverse = np.empty_like(order)
    inverse[order] = np.arange(len(order))
    return inverse
