"""A spinning elastic disc, which grows until its stress holds it together.

Steady rotation by w in plane strain: u(r) = rho w^2 r (1 + nu) (1 - 2 nu) / (8 E (1 - nu)) ((3 -
2 nu) R^2 - r^2) (Timoshenko and Goodier 1970, section 32, with the moduli of plane strain). It
starts in that state, and is judged by how much it has grown: of the rotation alone `vortex`
tells.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, Planar, discretise, steps_for
from jaxphys.problems.problem import Problem, relative_to
from jaxphys.problems.vortex import rings


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Disc:
    """The disc.

    Attributes:
        radius: R [m]; spin: w [rad/s]; turns: how far it turns.
        youngs: Young's modulus [Pa]; poisson: Poisson's ratio [1]; density: [kg/m^3].
    """

    radius: float = 1.0
    spin: float = 0.02
    turns: float = 0.02
    youngs: float = 1000.0
    poisson: float = 0.3
    density: float = 1000.0

    @property
    def wave_speed(self) -> float:
        """sqrt((lambda + 2 mu) / rho) [m/s]."""
        nu = self.poisson
        return (self.youngs * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / self.density) ** 0.5

    def growth(self, r: Array | np.ndarray):
        """u(r) / r."""
        nu = self.poisson
        stiffness = 8 * self.youngs * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        return self.density * self.spin**2 / stiffness * ((3 - 2 * nu) * self.radius**2 - r**2)

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m]."""
        grown = 1 + self.growth(jnp.sqrt(X[0] ** 2 + X[1] ** 2))
        cos, sin = jnp.cos(self.spin * t), jnp.sin(self.spin * t)
        return jnp.stack(
            [grown * (cos * X[0] - sin * X[1]), grown * (sin * X[0] + cos * X[1]), X[2]]
        )


def spinning(truth: Disc, cells: int, dtype=jnp.float64) -> Discretisation:
    """The disc with `cells` cells to its radius, in rings of particles."""
    spacing = truth.radius / cells
    points, areas = rings(0.0, truth.radius, spacing)
    duration = 2 * np.pi * truth.turns / truth.spin
    dt, steps = steps_for(duration, 0.4, spacing, truth.wave_speed + truth.spin * truth.radius)
    middle = cells + 4
    return discretise(
        truth,
        points,
        areas * spacing,
        law=NEO_HOOKEAN,
        poisson=truth.poisson,
        nodes=(2 * middle + 2, 2 * middle + 2, 3),
        origin=(middle + 0.1, middle - 0.3, 1.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.radius,
        boundaries=(Planar(2),),
        dtype=dtype,
    )


def grown(problem: Discretisation, state: State) -> tuple[float, float]:
    """(measured, exact) growth [m], the mean of u over the particles, weighted by volume and r."""
    truth, places = problem.truth, problem.places(state)
    rest = problem.spacing * (np.asarray(problem.exact)[:, : problem.count])
    rest = rest - problem.spacing * np.asarray(problem.origin)[:, None]
    exact = np.hypot(rest[0], rest[1])  # grown radii, which differ from r by 1e-4
    r = exact / (1 + truth.growth(exact))
    weights = problem.volumes * r
    measured = np.average(np.hypot(places[0], places[1]) - r, weights=weights)
    return float(measured), float(np.average(exact - r, weights=weights))


def _growth_error(problem: Discretisation, state: State) -> float:
    measured, exact = grown(problem, state)
    return relative_to(exact, measured, state)


SPINNING_DISC = Problem(
    name="spinning-disc",
    source="Timoshenko and Goodier (1970), Theory of Elasticity, section 32",
    # float32 does not see a growth of 1e-4 well.
    build=lambda cells, dtype: spinning(
        Disc(spin=0.02 if jnp.dtype(dtype) == jnp.float64 else 0.06), cells, dtype=dtype
    ),
    ladder=(4, 8, 16),
    order=None,
    floor=5e-4,
    norm=_growth_error,
)
