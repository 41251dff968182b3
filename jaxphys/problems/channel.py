"""Flow between two plates: a Newtonian fluid that starts to flow, and a Bingham fluid that does.

Half of the channel, from a wall at x = 0 that holds the fluid to the middle at x = h, where a free
surface bears no shear, as symmetry asks. The flow is along y and the same at every y, so that one
line of particles across the channel holds it, as long as it moves by much less than a cell: all
forces here are small, and both problems scale. Nothing moves across the channel, which is imposed,
for the line has no neighbours whose shear would balance its own.

Newton's fluid under a body acceleration G that begins at t = 0 (Batchelor 1967, section 4.3):
u = G / (2 nu) x (2 h - x) - sum_k A_k sin(k x) exp(-nu k^2 t), k = (n + 1/2) pi / h,
A_k = 2 G / (nu h k^3). Bingham's, steady: with the stress rho G (h - x) above the yield stress only
for x < X = h - tau_y / (rho G), u = (G (h x - x^2 / 2) - tau_y x / rho) / nu there and constant
beyond.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.materials.fluid import FLUID
from jaxphys.mpm.materials.viscoplasticity import HERSCHEL_BULKLEY
from jaxphys.problems.bar import line_points
from jaxphys.problems.discrete import Discretisation, Planar, discretise, held_up_to, steps_for
from jaxphys.problems.problem import Problem

TERMS = 40
COURANT, VISCOUS = 0.4, 0.1  # shares of dx / c and of dx^2 / nu


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Poiseuille:
    """Start-up of Newtonian flow in half a channel.

    Attributes:
        half: h, half the distance of the plates [m].
        viscosity: [Pa s]; density: [kg/m^3]; bulk: modulus [Pa].
        push: G, body acceleration along y [m/s^2].
    """

    half: float = 1.0
    viscosity: float = 1.0
    density: float = 1.0
    bulk: float = 100.0
    push: float = 1e-4

    @property
    def kinematic(self) -> float:
        """nu [m^2/s]."""
        return self.viscosity / self.density

    @property
    def duration(self) -> float:
        """Until much of the way to steady flow [s]."""
        return 0.5 * self.half**2 / self.kinematic

    def travelled(self, x: Array, t: Array) -> Array:
        """How far the fluid at x [m] has moved along y after t [s], [m]."""
        nu, h = self.kinematic, self.half
        k = (jnp.arange(TERMS) + 0.5).reshape(-1, *[1] * jnp.ndim(x)) * jnp.pi / h
        steady = self.push / (2 * nu) * x * (2 * h - x) * t
        decay = (1 - jnp.exp(-nu * k**2 * t)) / (nu * k**2)
        return steady - jnp.sum(2 * self.push / (nu * h * k**3) * jnp.sin(k * x) * decay, axis=0)

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m]; at rest before t = 0."""
        return jnp.stack([X[0], X[1] + self.travelled(X[0], jnp.maximum(t, 0.0)), X[2]])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Bingham:
    """Steady flow of a Bingham fluid in half a channel.

    Attributes:
        half: h [m]; density: [kg/m^3].
        viscosity: plastic viscosity [Pa s].
        yield_stress: in shear [Pa].
        push: G [m/s^2].
        shear, bulk: elastic moduli [Pa].
        duration: [s].
    """

    half: float = 1.0
    density: float = 1.0
    viscosity: float = 0.1
    yield_stress: float = 0.5e-4
    push: float = 1e-4
    shear: float = 1.0
    bulk: float = 2.0
    duration: float = 2.0

    @property
    def sheared(self) -> float:
        """X, up to where it is sheared [m]."""
        return self.half - self.yield_stress / (self.density * self.push)

    def speed(self, x: Array) -> Array:
        """u(x) [m/s]."""
        x = jnp.clip(x, 0.0, self.sheared)
        nu = self.viscosity / self.density
        stress = self.push * (self.half * x - x**2 / 2) - self.yield_stress / self.density * x
        return stress / nu

    def elastic(self, x: Array) -> Array:
        """What it has sheared elastically along y [m]: the stress over the shear modulus."""
        return self.density * self.push * (self.half * x - x**2 / 2) / self.shear

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m]."""
        y = X[1] + self.speed(X[0]) * t + self.elastic(X[0])
        return jnp.stack([X[0], y, X[2]])


def poiseuille(truth: Poiseuille, cells: int, dtype=jnp.float64) -> Discretisation:
    """The fluid from rest, two particles a cell."""
    spacing = truth.half / cells
    parameters = {"bulk_modulus": truth.bulk, "viscosity": truth.viscosity}
    speed = (truth.bulk / truth.density) ** 0.5 + COURANT / VISCOUS * truth.kinematic / spacing
    scale = float(truth.travelled(jnp.asarray(truth.half), jnp.asarray(truth.duration)))
    return _across(truth, FLUID, cells, spacing, speed, parameters, scale, dtype)


def bingham(truth: Bingham, cells: int, dtype=jnp.float64) -> Discretisation:
    """The fluid in its steady flow, two particles a cell."""
    parameters = {
        "bulk_modulus": truth.bulk,
        "shear_modulus": truth.shear,
        "shear_yield_stress": truth.yield_stress,
        "consistency": truth.viscosity,
        "flow_index": 1.0,
    }
    speed = ((truth.bulk + 4 / 3 * truth.shear) / truth.density) ** 0.5
    scale = float(truth.speed(jnp.asarray(truth.half))) * truth.duration
    spacing = truth.half / cells
    return _across(truth, HERSCHEL_BULKLEY, cells, spacing, speed, parameters, scale, dtype)


def _across(truth, law, cells, spacing, speed, parameters, scale, dtype) -> Discretisation:
    dt, steps = steps_for(truth.duration, COURANT, spacing, speed)
    return discretise(
        truth,
        line_points(0.0, cells, spacing),
        spacing**3 / 2,
        law=law,
        parameters=parameters,
        nodes=(cells + 7, 3, 3),
        origin=(3.0, 1.0, 1.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=scale,
        gravity=(0.0, truth.push, 0.0),
        boundaries=(held_up_to(3.0, dtype), Planar(0)),
        dtype=dtype,
    )


def _larger(dtype) -> float:
    """float32 sees no shear of 1e-5: there forces are a hundred times as large."""
    return 1.0 if jnp.dtype(dtype) == jnp.float64 else 100.0


POISEUILLE = Problem(
    name="poiseuille",
    source="start-up of flow between plates (Batchelor 1967, section 4.3)",
    build=lambda cells, dtype: poiseuille(
        Poiseuille(push=1e-4 * _larger(dtype)), cells, dtype=dtype
    ),
    ladder=(4, 8, 16, 32),
    order=2,
)
BINGHAM = Problem(
    name="bingham",
    source="steady flow of Bingham's fluid between plates (Bird, Dai and Yarusso 1983)",
    build=lambda cells, dtype: bingham(
        Bingham(push=1e-4 * _larger(dtype), yield_stress=0.5e-4 * _larger(dtype)),
        cells,
        dtype=dtype,
    ),
    ladder=(4, 8, 16, 32),
    # Beside the wall it flows by 30 % too fast on 16 cells.
    order=None,
)
