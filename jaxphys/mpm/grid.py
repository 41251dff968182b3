"""The background grid: nodes at multiples of a spacing, from the origin."""

from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.transfer.kernels import Kernel


@dataclass(frozen=True)
class Grid:
    """A regular grid whose node (i, j, k) sits at `spacing * (i, j, k)`.

    shape: nodes per axis, each at least 3, as many as a quadratic B-spline touches.
    spacing: distance between neighbouring nodes [m], positive.
    The domain is `[0, (shape - 1) * spacing]`, from the first node to the last. Particles
    must stay where all nodes exist that their kernel reaches, `lower <= x < upper`: half a cell
    from the ends with quadratic B-splines, one cell with cubic ones.
    """

    shape: tuple[int, int, int]
    spacing: float

    def __post_init__(self):
        if len(self.shape) != 3 or min(self.shape) < 3:
            raise InputError(
                f"Grid.shape is {self.shape}: give three node counts, each at least 3."
            )
        if not 0 < self.spacing < float("inf"):
            raise InputError(f"Grid.spacing is {self.spacing}: give a positive length in metres.")

    @property
    def extent(self) -> tuple[float, float, float]:
        """Coordinates of the last node [m]: the domain's upper ends."""
        x, y, z = ((n - 1) * self.spacing for n in self.shape)
        return x, y, z

    def lower(self, kernel: Kernel) -> float:
        """Least coordinate a particle may have on any axis [m]."""
        return kernel.reach * self.spacing

    def upper(self, kernel: Kernel) -> tuple[float, float, float]:
        """Coordinates that particles must stay below, per axis [m]."""
        x, y, z = ((n - 1 - kernel.reach) * self.spacing for n in self.shape)
        return x, y, z


def node_coordinates(
    shape: tuple[int, int, int], spacing: float, origin: Array, dtype
) -> tuple[Array, Array, Array]:
    """Node coordinates [m] of a window of `shape` nodes that starts at node `origin` (3,) int.

    Three arrays of shapes (nx, 1, 1), (1, ny, 1), (1, 1, nz), which broadcast over the window.
    """
    coordinates = []
    for axis, count in enumerate(shape):
        line = (jnp.arange(count) + origin[axis]).astype(dtype) * spacing
        coordinates.append(line.reshape([-1 if a == axis else 1 for a in range(3)]))
    x, y, z = coordinates
    return x, y, z
