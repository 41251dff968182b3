"""A column of grains that is let go and runs out.

In a channel, between smooth side walls, a column of height H and length L beside a wall ends
(1 + k a) L from that wall for a = H / L up to about 2: k = 1.2 for sand and others (Lube, Huppert,
Sparks and Freundt 2005, Phys. Rev. E 72), 1.8 for glass beads (Lajeunesse, Monnier and Homsy 2005,
Phys. Fluids 17), 2.2 in simulations with the mu(I) rheology (Lagree, Staron and Popinet 2011, J.
Fluid Mech. 686). Their middle, 1.7, is the answer, and the distance to the others its floor.

The grains' angle is that of the slope they lie at, which is plane strain; the law's is that of
triaxial compression, where Drucker and Prager's cone is weaker.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.boundaries import Plane
from jaxphys.mpm.materials.plasticity import DRUCKER_PRAGER, triaxial_friction_angle
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, Planar, discretise, node_wall, steps_for
from jaxphys.problems.problem import Problem, relative_to

SLOPE, SPREAD = 1.7, 0.5


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Grains:
    """The column, x from the wall behind, z from the floor.

    Attributes:
        aspect: a, height over length; length: L [m].
        friction: of the grains, angle in plane strain [degrees].
        floor: Coulomb's coefficient of the floor.
        youngs: Young's modulus [Pa]; density: [kg/m^3]; gravity: [m/s^2].
    """

    aspect: float = 1.0
    length: float = 1.0
    friction: float = 30.0
    floor: float = 0.6
    youngs: float = 2e6
    density: float = 1600.0
    gravity: float = 10.0

    @property
    def height(self) -> float:
        """H [m]."""
        return self.aspect * self.length

    @property
    def triaxial(self) -> float:
        """The law's friction angle [degrees]."""
        return float(triaxial_friction_angle(np.asarray(self.friction)))

    @property
    def duration(self) -> float:
        """Until it has come to rest [s]: four times sqrt(H / g)."""
        return 4 * (self.height / self.gravity) ** 0.5

    @property
    def run_out(self) -> float:
        """How far the foot moves, over the length."""
        return SLOPE * self.aspect

    def motion(self, X: Array, t: Array) -> Array:
        """At rest; the answer is `run_out`."""
        return X + 0.0 * t


def grains(truth: Grains, cells: int, dtype=jnp.float64) -> Discretisation:
    """The column on `cells` cells to its length, four particles each, in one layer."""
    spacing = truth.length / cells
    part = spacing / 2
    x, z = (part * (np.arange(round(side / part)) + 0.5) for side in (truth.length, truth.height))
    points = np.stack(np.meshgrid(x, [0.0], z, indexing="ij"), axis=-1).reshape(-1, 3)
    wave = (1.35 * truth.youngs / truth.density) ** 0.5
    dt, steps = steps_for(truth.duration, 0.35, spacing, wave)
    reach = int(np.ceil(cells * (1.5 + 2.5 * truth.aspect)))
    return discretise(
        truth,
        points,
        spacing**3 / 4,
        law=DRUCKER_PRAGER,
        parameters={
            "youngs_modulus": truth.youngs,
            "poisson_ratio": 0.3,
            "friction_angle": truth.triaxial,
        },
        nodes=(reach + 8, 3, round(cells * truth.aspect) + 8),
        origin=(3.0, 1.0, 3.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.length,
        gravity=(0.0, 0.0, -truth.gravity),
        boundaries=(node_wall(0, 3.0, 1, "slip", dtype), Planar(1)),
        contacts=(Plane((0.0, 0.0, 3.0), (0.0, 0.0, 1.0), "separate", truth.floor),),
        dtype=dtype,
    )


def run_out(problem: Discretisation, state: State) -> float:
    """How far the foot has moved, over the length: where all but a hundredth of the grains are."""
    length = problem.truth.length
    return float(np.quantile(problem.places(state)[0], 0.99)) / length - 1


def _run_out_error(problem: Discretisation, state: State) -> float:
    return relative_to(problem.truth.run_out, run_out(problem, state), state)


_SOURCE = "Lube et al. (2005), Lajeunesse et al. (2005), Lagree et al. (2011)"


def _column(aspect: float) -> Problem:
    return Problem(
        name=f"grains-{aspect:g}",
        source=_SOURCE,
        build=partial(grains, Grains(aspect=aspect)),
        ladder=(6, 12, 24),
        order=None,
        floor=SPREAD / SLOPE,
        norm=_run_out_error,
    )


LOW_COLUMN, TALL_COLUMN = _column(1.0), _column(2.0)
