"""Which part of the grid a frame computes."""

import math
from dataclasses import replace

import jax
import numpy as np

from jaxphys.mpm.state import Config, State

# A node costs about a hundredth of a particle, and several devices send it to each other: where the
# grid has so many for each particle, a part of it is worth another program.
WORTH = 2
GROWTH, MARGIN = 1.1, 2  # room for what a frame adds: a share of the span, and nodes
MULTIPLE = 4  # few different windows, since each is compiled


@jax.jit(static_argnames="config")
def _span(config: Config, position):
    base = config.kernel.base_node(position, config.grid.spacing, config.grid.shape)
    return base.max(axis=1) - base.min(axis=1)


def windowed(config: Config, state: State) -> Config:
    """`config` with a window that has room for the particles of `state` and some motion, or with
    none where that would be no gain. What it is depends on the state alone. Runs on the host.
    """
    nodes = math.prod(config.grid.shape)
    if nodes < WORTH * config.particles:
        return replace(config, window=None)
    span = np.asarray(_span(replace(config, window=None), state.position))
    wanted = (
        np.ceil((GROWTH * span + config.kernel.width + MARGIN) / MULTIPLE).astype(int) * MULTIPLE
    )
    shape = np.minimum(wanted, config.grid.shape)
    if 2 * math.prod(shape.tolist()) > nodes:
        return replace(config, window=None)
    x, y, z = shape.tolist()
    return replace(config, window=(x, y, z))
