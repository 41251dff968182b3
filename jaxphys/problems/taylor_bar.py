"""Taylor's bar: a copper rod that strikes a rigid wall and stays shorter and thicker.

32.4 mm long, 6.4 mm thick, 227 m/s; von Mises with linear hardening, 400 MPa and 100 MPa. Codes
agree on a final length of 21.3 to 21.5 mm (Kamoulakos 1990, Commun. Appl. Numer. Methods 6, and
those after it); the foot spreads to 6.9 to 7.2 mm.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.boundaries import Plane
from jaxphys.mpm.materials.plasticity import VON_MISES
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, discretise, steps_for
from jaxphys.problems.problem import Problem, relative_to

FINAL_LENGTH, SPREAD = 21.4e-3, 0.1e-3  # [m]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Rod:
    """The rod, from its foot at z = 0.

    Attributes:
        length, radius: [m]; speed: [m/s]; duration: [s].
        youngs: Young's modulus [Pa]; poisson: Poisson's ratio [1]; density: [kg/m^3].
        yield_stress: uniaxial [Pa]; hardening: its growth with plastic strain [Pa].
    """

    length: float = 32.4e-3
    radius: float = 3.2e-3
    speed: float = 227.0
    duration: float = 80e-6
    youngs: float = 117e9
    poisson: float = 0.35
    density: float = 8930.0
    yield_stress: float = 400e6
    hardening: float = 100e6

    @property
    def wave_speed(self) -> float:
        """sqrt((lambda + 2 mu) / rho) [m/s]."""
        nu = self.poisson
        return (self.youngs * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / self.density) ** 0.5

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] before anything touches."""
        return jnp.stack([X[0], X[1], X[2] - self.speed * t])


def rod(truth: Rod, cells: int, dtype=jnp.float64) -> Discretisation:
    """The rod with `cells` cells to its radius, eight particles each."""
    spacing = truth.radius / cells
    part = spacing / 2
    x = part * (np.arange(-2 * cells, 2 * cells) + 0.5)
    z = part * (np.arange(round(truth.length / part)) + 0.5)
    points = np.stack(np.meshgrid(x, x, z, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[np.hypot(points[:, 0], points[:, 1]) < truth.radius]
    volume = np.pi * truth.radius**2 * truth.length / len(points)
    dt, steps = steps_for(truth.duration, 0.4, spacing, truth.wave_speed + truth.speed)
    middle, floor = int(np.ceil(2.6 * cells)) + 3, 3.0
    return discretise(
        truth,
        points,
        volume,
        law=VON_MISES,
        parameters={
            "youngs_modulus": truth.youngs,
            "poisson_ratio": truth.poisson,
            "yield_stress": truth.yield_stress,
            "hardening": truth.hardening,
        },
        nodes=(2 * middle + 1, 2 * middle + 1, round(truth.length / spacing) + 8),
        origin=(middle, middle, floor),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.length,
        contacts=(Plane((0.0, 0.0, floor), (0.0, 0.0, 1.0), "separate", None),),
        staggered=False,
        dtype=dtype,
    )


def size(problem: Discretisation, state: State) -> tuple[float, float]:
    """Length of the rod and radius of its foot [m]; both end half a particle beyond the last."""
    places = problem.places(state)
    half = 0.25 * problem.spacing
    return float(np.ptp(places[2])) + 2 * half, float(np.hypot(places[0], places[1]).max()) + half


def _length_error(problem: Discretisation, state: State) -> float:
    return relative_to(FINAL_LENGTH, size(problem, state)[0], state)


TAYLOR_BAR = Problem(
    name="taylor-bar",
    source="copper rod at 227 m/s (Kamoulakos 1990, and codes after it)",
    build=partial(rod, Rod()),
    ladder=(2, 3, 4),
    order=None,
    floor=SPREAD / FINAL_LENGTH,
    norm=_length_error,
)
