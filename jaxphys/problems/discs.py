"""Two elastic discs that collide head on, across the grid's axes, and part (Sulsky, Chen and
Schreyer 1994, section 5.2).

By symmetry either disc meets the other as it would a wall without friction where they touch. How
fast it comes back follows from that: elastic as it is, part of its energy stays as vibration.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, Planar, discretise, steps_for
from jaxphys.problems.problem import Problem, relative_to
from jaxphys.problems.vortex import rings

DIAGONAL = np.array([1.0, 1.0, 0.0])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Discs:
    """Two discs in plane strain, on the diagonal of a square, with the origin in its middle.

    Attributes:
        radius: of each [m]; offset: of their middles along x and y [m].
        speed: of each, along x and along y, towards the other [m/s].
        youngs: Young's modulus [Pa]; poisson: Poisson's ratio; density: [kg/m^3].
        duration: [s].
    """

    radius: float = 0.2
    offset: float = 0.3
    speed: float = 0.1
    youngs: float = 1000.0
    poisson: float = 0.3
    density: float = 1000.0
    duration: float = 3.6

    @property
    def wave_speed(self) -> float:
        """Of compression [m/s]."""
        nu = self.poisson
        return (self.youngs * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / self.density) ** 0.5

    @property
    def touch(self) -> float:
        """When they touch [s]."""
        return (self.offset - self.radius / 2**0.5) / self.speed

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] before they touch."""
        moved = jnp.sign(X[0] + X[1]) * self.speed * t
        return jnp.stack([X[0] - moved, X[1] - moved, X[2]])


def colliding(
    truth: Discs, cells: int, dtype=jnp.float64, *, contact: bool = True
) -> Discretisation:
    """Both discs, with `cells` cells to a radius; contact: with a velocity field each."""
    spacing = truth.radius / cells
    points, areas = rings(0.0, truth.radius, spacing)
    places = np.concatenate([points + side * truth.offset * DIAGONAL for side in (-1, 1)])
    dt, steps = steps_for(truth.duration, 0.4, spacing, truth.wave_speed + 2 * truth.speed)
    middle = int(np.ceil((truth.offset + truth.radius) / spacing)) + 3
    return discretise(
        truth,
        places,
        np.tile(areas, 2) * spacing,
        law=NEO_HOOKEAN,
        poisson=truth.poisson,
        nodes=(2 * middle + 1, 2 * middle + 1, 3),
        origin=(middle + 0.1, middle - 0.2, 1.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.radius,
        boundaries=(Planar(2),),
        objects=np.repeat([0, 1], len(points)) if contact else None,
        staggered=False,
        dtype=dtype,
    )


def returned(problem: Discretisation, state: State) -> float:
    """Speed at which the discs' middles move apart, over that at which they came."""
    count = problem.count // 2
    mass = np.asarray(problem.model.mass)[:count]
    speed = problem.spacing * np.asarray(state.velocity, np.float64)[:2, : 2 * count].sum(axis=0)
    apart = np.average(speed[count:], weights=mass) - np.average(speed[:count], weights=mass)
    return float(apart) / (4 * problem.truth.speed)


# Of a disc that meets a plane without friction, by contact at particles, with 4, 8 and 16 cells to
# the radius: 0.8927, 0.9087, 0.9116; extrapolated, and right to the last step.
RETURNED, FLOOR = 0.912, 0.003


def _returned_error(problem: Discretisation, state: State) -> float:
    return relative_to(RETURNED, returned(problem, state), state)


COLLIDING_DISCS = Problem(
    name="colliding-discs",
    source="Sulsky, Chen and Schreyer (1994), section 5.2; a disc against a wall",
    build=partial(colliding, Discs()),
    ladder=(4, 8, 16),
    order=None,
    floor=FLOOR,
    norm=_returned_error,
)
