"""A block on an incline: it slides as Coulomb's law says, or stays.

With the plane level and gravity tilted by the angle a, a block that slides moves g (sin a - mu cos
a) t^2 / 2 along it, whatever it weighs or is made of; it stays where mu > tan a. It starts pressed
and sheared as its weight and the friction at its foot have it, for a block that gravity takes hold
of at once would swing, and slip whenever it is light.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.boundaries import Plane
from jaxphys.mpm.boundaries.contact import STIFFNESS
from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, discretise, steps_for
from jaxphys.problems.problem import Problem, relative_to


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Incline:
    """A cube of 1 m on a plane.

    Attributes:
        angle: of the incline [rad]; friction: Coulomb's coefficient.
        youngs: Young's modulus [Pa]; density: [kg/m^3]; gravity: [m/s^2].
        duration: [s].
    """

    angle: float = np.pi / 6
    friction: float = 0.3
    youngs: float = 1e6
    density: float = 1000.0
    gravity: float = 10.0
    duration: float = 0.5

    @property
    def pull(self) -> float:
        """Acceleration along the incline without friction [m/s^2]."""
        return self.gravity * np.sin(self.angle)

    @property
    def distance(self) -> float:
        """What the block has slid at the end [m]; 0 where it stays."""
        held = self.friction * self.gravity * np.cos(self.angle)
        return max(0.0, 0.5 * (self.pull - held) * self.duration**2)

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] at the start: the static strain of the load at its foot; the answer
        is `distance`, the only number that theory gives.
        """
        bent = self.density / self.youngs * (X[2] - X[2] ** 2 / 2)
        weight = self.gravity * jnp.cos(self.angle)
        rubs = jnp.minimum(self.gravity * jnp.sin(self.angle), self.friction * weight)
        # Poisson's ratio is 0: the shear modulus is half of Young's.
        return jnp.stack([X[0] + 2 * rubs * bent, X[1], X[2] - weight * bent]) + 0.0 * t


def block(truth: Incline, cells: int, dtype=jnp.float64) -> Discretisation:
    """The block on `cells` cells a side, eight particles each."""
    spacing = 1.0 / cells
    x = spacing / 2 * (np.arange(2 * cells) + 0.5)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    wave = (truth.youngs / truth.density) ** 0.5
    dt, steps = steps_for(truth.duration, 0.3, spacing, wave)
    origin = (3.2, 3.3, 3.4)
    # Contact bears the block where it gives way by so many cells: STIFFNESS M V / dx^2 a particle.
    weight = truth.density * truth.gravity * float(np.cos(truth.angle))
    sunk = 2 / STIFFNESS * weight / truth.youngs
    reach = int(np.ceil(0.5 * truth.pull * truth.duration**2 / spacing))
    return discretise(
        truth,
        points,
        spacing**3 / 8,
        law=HENCKY,
        poisson=0.0,
        nodes=(cells + reach + 8, cells + 8, cells + 8),
        origin=origin,
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=1.0,
        gravity=(truth.pull, 0.0, -truth.gravity * float(np.cos(truth.angle))),
        contacts=(
            Plane((0.0, 0.0, origin[2] + sunk), (0.0, 0.0, 1.0), "separate", truth.friction),
        ),
        dtype=dtype,
    )


def slid(problem: Discretisation, state: State) -> float:
    """How far the block's middle has moved along what it lies on [m]; its particles come first."""
    block = slice(0, 8 * round(1 / problem.spacing) ** 3)
    start, end = (problem.places(one)[0, block] for one in (problem.state, state))
    return float(np.mean(end) - np.mean(start))


def sliding_error(problem: Discretisation, state: State) -> float:
    """How far from Coulomb's distance the block slid, over that distance."""
    return relative_to(problem.truth.distance, slid(problem, state), state)


def sticking_error(problem: Discretisation, state: State) -> float:
    """What it moved over what it would have moved without friction."""
    free = 0.5 * problem.truth.pull * problem.truth.duration**2
    return relative_to(free, free + slid(problem, state), state)


SOURCE = "Coulomb's law of a rigid block"

SLIDING_BLOCK = Problem(
    name="sliding-block",
    source=SOURCE,
    build=partial(block, Incline()),
    ladder=(2, 4, 8),
    order=None,
    norm=sliding_error,
)
STICKING_BLOCK = Problem(
    name="sticking-block",
    source=SOURCE,
    build=partial(block, Incline(friction=0.8)),
    ladder=(2, 4, 8),
    order=None,
    norm=sticking_error,
)
