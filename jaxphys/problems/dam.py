"""A dam that breaks: water that was held leaves, and its middle moves as its momentum says.

Ritter (1892): the front runs with 2 sqrt(g H), and the depth between it and the wave that eats
into the reservoir is (2 sqrt(g H) - x / t)^2 / (9 g). As long as that wave has not reached the wall
behind, the only force along the floor is this wall's, rho g H^2 / 2 for each metre of width, so
that the middle of all water has moved by g H t^2 / (4 L). That holds whatever the depth does, and
is what is judged; the front itself leads or lags by friction and by where it is said to be.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.fluid import INVISCID
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, Planar, discretise, node_wall, steps_for
from jaxphys.problems.problem import Problem, relative_to


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Dam:
    """Water in a corner, x from the wall behind, z from the floor.

    Attributes:
        height: H [m]; length: L [m].
        density: [kg/m^3]; bulk: modulus [Pa]; gravity: [m/s^2].
    """

    height: float = 1.0
    length: float = 4.0
    density: float = 1000.0
    bulk: float = 1e6
    gravity: float = 10.0

    @property
    def duration(self) -> float:
        """Half of the time that the wave takes to the wall [s]."""
        return 0.5 * self.length / (self.gravity * self.height) ** 0.5

    @property
    def moved(self) -> float:
        """By how much the water's middle has moved along the floor at the end [m]."""
        return self.gravity * self.height * self.duration**2 / (4 * self.length)

    @property
    def front(self) -> float:
        """How far Ritter's front has run at the end [m]."""
        return 2 * (self.gravity * self.height) ** 0.5 * self.duration

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] at the start: pressed together by its own weight."""
        weight = self.density * self.gravity / self.bulk
        return jnp.stack([X[0], X[1], X[2] - weight * (self.height * X[2] - X[2] ** 2 / 2)]) + 0 * t


def dam(truth: Dam, cells: int, dtype=jnp.float64) -> Discretisation:
    """The water on `cells` cells to its height, four particles each, in one layer."""
    spacing = truth.height / cells
    part = spacing / 2
    x, z = (part * (np.arange(round(side / part)) + 0.5) for side in (truth.length, truth.height))
    points = np.stack(np.meshgrid(x, [0.0], z, indexing="ij"), axis=-1).reshape(-1, 3)
    speed = (truth.bulk / truth.density) ** 0.5
    dt, steps = steps_for(truth.duration, 0.3, spacing, speed)
    walls = tuple(node_wall(axis, 3.0, 1, "slip", dtype) for axis in (0, 2))
    reach = int(np.ceil((truth.length + 1.2 * truth.front) / spacing))
    return discretise(
        truth,
        points,
        spacing**3 / 4,
        law=INVISCID,
        parameters={"bulk_modulus": truth.bulk},
        nodes=(reach + 8, 3, cells + 8),
        origin=(3.0, 1.0, 3.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.length,
        gravity=(0.0, 0.0, -truth.gravity),
        boundaries=(*walls, Planar(1)),
        dtype=dtype,
    )


def moved(problem: Discretisation, state: State) -> float:
    """By how much the water's middle has moved along the floor [m]."""
    return float(np.mean(problem.places(state)[0])) - problem.truth.length / 2


def front(problem: Discretisation, state: State) -> float:
    """How far the foremost hundredth of the water has run [m]."""
    return float(np.quantile(problem.places(state)[0], 0.99)) - problem.truth.length


def _moved_error(problem: Discretisation, state: State) -> float:
    return relative_to(problem.truth.moved, moved(problem, state), state)


DAM_BREAK = Problem(
    name="dam-break",
    source="momentum of Ritter's dam break (1892, Z. Ver. Dtsch. Ing. 36)",
    build=partial(dam, Dam()),
    ladder=(4, 8, 16),
    order=None,
    floor=0.02,
    norm=_moved_error,
)
