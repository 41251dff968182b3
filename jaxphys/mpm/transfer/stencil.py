"""Where the nodes of each particle are, with their weights."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.transfer.kernels import QUADRATIC, Kernel

Shape = tuple[int, int, int]


class Window(NamedTuple):
    """The part of a grid that is computed. Static.

    shape: its nodes per axis; spacing: between nodes [m]; grid_shape: nodes of the whole grid;
    kernel: of the particles in it. Its first node, the origin (3,) int32, is a number and not a
    part of the program.
    """

    shape: Shape
    spacing: float
    grid_shape: Shape
    kernel: Kernel = QUADRATIC

    @property
    def nodes(self) -> int:
        """How many nodes it has."""
        x, y, z = self.shape
        return x * y * z


class Stencil(NamedTuple):
    """Where the nodes of each particle are. Arrays (axis, node 0 to width - 1, N)."""

    row: Array  # (N,) int32, row number of the first node
    weight: Array  # w_k(x)
    moment: Array  # w_k(x) (x_k - x_p) [m]
    slope: Array  # derivative of w_k by x_p [1/m]
    distance: Array  # x_k - x_p [m]


def stencil(window: Window, origin: Array, position: Array, field: Array | None = None) -> Stencil:
    """The stencils of particles (3, N) [m]; those outside of the window are clamped to it.

    field: (N,) int32, in which of several fields of the window, one after the other, each
    particle's rows are; None where there is one.
    """
    shape, spacing, grid_shape, kernel = window
    base = kernel.base_node(position, spacing, grid_shape)
    # Clamped for the sake of a particle outside the grid: flagged elsewhere, it must not throw its
    # neighbours about with weights of any size.
    offset = jnp.clip(
        position / spacing - base.astype(position.dtype), kernel.reach, kernel.reach + 1
    )
    local = base
    if shape != grid_shape:
        last = jnp.array(shape, dtype=jnp.int32)[:, None] - kernel.width
        local = jnp.clip(base - origin[:, None], 0, last)
    row = (local[0] * shape[1] + local[1]) * shape[2] + local[2]
    if field is not None:
        row = row + field * window.nodes
    weight, slope, distance = kernel.weights(offset)
    distance = distance * spacing
    return Stencil(row, weight, weight * distance, slope / spacing, distance)
