"""A ball that strikes a wall: how far it is pressed in, and how long it touches.

Hertz's contact, quasi-static (Johnson 1985, Contact Mechanics, section 11.4): for a ball of radius
R and mass m at speed v against a rigid plane, with E* = E / (1 - nu^2), the middle comes nearer by
d = (15 m v^2 / (16 E* sqrt(R)))^(2/5) at most, half of 2.94 d / v after it touched. Exact for small
d / R only; here it is a tenth, and the floor of the answer some hundredths.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.boundaries import Plane
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, discretise, steps_for
from jaxphys.problems.problem import Problem, relative_to


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Ball:
    """The ball, from its lowest point, which touches the wall z = 0 at the start.

    Attributes:
        radius: R [m]; speed: v [m/s].
        youngs: Young's modulus [Pa]; poisson: Poisson's ratio [1]; density: [kg/m^3].
    """

    radius: float = 1.0
    speed: float = 0.6
    youngs: float = 1e5
    poisson: float = 0.3
    density: float = 1000.0

    @property
    def wave_speed(self) -> float:
        """sqrt((lambda + 2 mu) / rho) [m/s]."""
        nu = self.poisson
        return (self.youngs * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / self.density) ** 0.5

    @property
    def approach(self) -> float:
        """d [m]."""
        mass = 4 / 3 * np.pi * self.radius**3 * self.density
        modulus = self.youngs / (1 - self.poisson**2)
        return (15 * mass * self.speed**2 / (16 * modulus * self.radius**0.5)) ** 0.4

    @property
    def contact_time(self) -> float:
        """2.94 d / v [s]."""
        return 2.94 * self.approach / self.speed

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] before anything touches."""
        return jnp.stack([X[0], X[1], X[2] - self.speed * t])


def striking(truth: Ball, cells: int, dtype=jnp.float64) -> Discretisation:
    """The ball with `cells` cells to its radius, eight particles each, until it turns back."""
    spacing = truth.radius / cells
    x = spacing / 2 * (np.arange(-2 * cells, 2 * cells) + 0.5)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[np.linalg.norm(points, axis=1) < truth.radius]
    points += [0.0, 0.0, truth.radius]
    # All of the ball's mass, whatever the lattice cuts off.
    volume = 4 / 3 * np.pi * truth.radius**3 / len(points)
    dt, steps = steps_for(truth.contact_time / 2, 0.35, spacing, truth.wave_speed + truth.speed)
    middle, floor = cells + 4, 3.0
    return discretise(
        truth,
        points,
        volume,
        law=NEO_HOOKEAN,
        poisson=truth.poisson,
        nodes=(2 * middle + 1, 2 * middle + 1, 2 * cells + 8),
        origin=(middle, middle, floor),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.approach,
        contacts=(Plane((0.0, 0.0, floor), (0.0, 0.0, 1.0), "separate", None),),
        staggered=False,
        dtype=dtype,
    )


def approach(problem: Discretisation, state: State) -> float:
    """By how much the ball's middle has come nearer to the wall [m]."""
    before = problem.truth.radius
    return before - float(np.average(problem.places(state)[2], weights=problem.volumes))


def _approach_error(problem: Discretisation, state: State) -> float:
    return relative_to(problem.truth.approach, approach(problem, state), state)


HERTZ_IMPACT = Problem(
    name="hertz",
    source="Hertz's impact (Johnson 1985, Contact Mechanics, section 11.4)",
    build=partial(striking, Ball()),
    ladder=(4, 6, 8, 12),
    order=None,
    floor=0.05,
    norm=_approach_error,
)
