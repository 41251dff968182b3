"""Two equal bars that meet: they touch for as long as a wave takes to run to and fro, and part with
their velocities exchanged.

The closed form of an elastic collision (Goldsmith 1960, Impact, section 2.2): from the touch on, a
wave runs through each bar that takes its speed away; when the waves are back from the free ends,
after 2 L / c, both bars are without strain and move apart with the speed they came with. Where they
share a velocity field on the grid they are one continuum as long as they share a node, and cling;
with a field each (`mpm.meeting`) they part.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.state import State
from jaxphys.problems.bar import line_points
from jaxphys.problems.discrete import Discretisation, discretise, steps_for
from jaxphys.problems.problem import Problem, relative_to


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Bars:
    """Two bars end to end, that touch at x = 0 at the start.

    Attributes:
        length: of each [m]; speed: of each, towards the other [m/s].
        youngs: Young's modulus [Pa]; Poisson's ratio is 0; density: [kg/m^3].
    """

    length: float = 1.0
    speed: float = 0.1
    youngs: float = 1000.0
    density: float = 1000.0

    @property
    def wave_speed(self) -> float:
        """c [m/s]."""
        return (self.youngs / self.density) ** 0.5

    @property
    def duration(self) -> float:
        """Until long after they part [s]."""
        return 6 * self.length / self.wave_speed

    @property
    def parted(self) -> float:
        """By how much each bar's middle is further out at the end than at the start [m]: inwards
        at half the way, and out again.
        """
        # Its momentum falls and rises evenly while they touch, so that the middle is back as they
        # part.
        return self.speed * (self.duration - 2 * self.length / self.wave_speed)

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] before they touch."""
        return jnp.stack([X[0] - jnp.sign(X[0]) * self.speed * t, X[1], X[2]])


def meeting(truth: Bars, cells: int, dtype=jnp.float64, *, contact: bool = False) -> Discretisation:
    """Two lines of `cells` cells each, two particles a cell; contact: a velocity field each."""
    spacing = truth.length / cells
    dt, steps = steps_for(truth.duration, 0.5, spacing, truth.wave_speed + truth.speed)
    room = int(np.ceil(truth.parted / spacing)) + 3
    points = line_points(-truth.length, 2 * cells, spacing)
    return discretise(
        truth,
        points,
        spacing**3 / 2,
        law=HENCKY,
        poisson=0.0,
        nodes=(2 * cells + 2 * room + 2, 3, 3),
        origin=(cells + room, 1.0, 1.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.parted,
        staggered=False,
        objects=(points[:, 0] > 0).astype(int) if contact else None,
        dtype=dtype,
    )


def parted(problem: Discretisation, state: State) -> float:
    """By how much the bars' middles are further out than at the start [m]."""
    x = problem.places(state)[0]
    half = len(x) // 2
    return float(x[half:].mean() - x[:half].mean()) / 2 - problem.truth.length / 2


def _parted_error(problem: Discretisation, state: State) -> float:
    return relative_to(problem.truth.parted, parted(problem, state), state)


_SOURCE = "elastic collision of equal bars (Goldsmith 1960, Impact, section 2.2)"

PARTING_BARS = Problem(
    name="parting-bars",
    source=_SOURCE,
    build=lambda cells, dtype: meeting(Bars(), cells, dtype=dtype, contact=True),
    ladder=(8, 16, 32, 64),
    order=None,
    norm=_parted_error,
)
COLLIDING_BARS = Problem(
    name="colliding-bars",
    source=_SOURCE,
    build=lambda cells, dtype: meeting(Bars(), cells, dtype=dtype),
    ladder=(8, 16, 32, 64),
    order=None,
    norm=_parted_error,
)
