"""Taylor and Green's vortex, which viscosity brings to rest.

One cell of the pattern in a square box whose walls let the fluid slide: u = U sin(k x) cos(k y),
v = -U cos(k x) sin(k y), k = pi / L, decays by exp(-2 nu k^2 t), the pressure aside (Taylor and
Green 1937). The walls of the box are lines of the pattern through which nothing flows and along
which no shear acts, so that the box needs no periodicity. Slow: the fluid moves by a small part of
a cell, and inertia by convection plays no part.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.fluid import FLUID
from jaxphys.problems.channel import COURANT, VISCOUS
from jaxphys.problems.discrete import Discretisation, Planar, discretise, node_wall, steps_for
from jaxphys.problems.problem import Problem


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TaylorGreen:
    """One cell of the vortex.

    Attributes:
        side: L [m]; speed: U [m/s].
        viscosity: [Pa s]; density: [kg/m^3]; bulk: modulus [Pa].
        duration: [s].
    """

    side: float = 1.0
    speed: float = 1e-5
    viscosity: float = 0.05
    density: float = 1.0
    bulk: float = 10.0
    duration: float = 1.0

    @property
    def rate(self) -> float:
        """2 nu k^2 [1/s]."""
        return 2 * self.viscosity / self.density * (np.pi / self.side) ** 2

    def travelled(self, t: Array) -> Array:
        """How far what begins at 1 m/s has come [m]."""
        return (1 - jnp.exp(-self.rate * t)) / self.rate

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m], to first order in the displacement."""
        k = np.pi / self.side
        far = self.speed * self.travelled(t)
        x = X[0] + far * jnp.sin(k * X[0]) * jnp.cos(k * X[1])
        y = X[1] - far * jnp.cos(k * X[0]) * jnp.sin(k * X[1])
        return jnp.stack([x, y, X[2]])


def taylor_green(truth: TaylorGreen, cells: int, dtype=jnp.float64) -> Discretisation:
    """The box on `cells` cells a side, four particles each, in one layer."""
    spacing = truth.side / cells
    x = spacing / 2 * (np.arange(2 * cells) + 0.5)
    points = np.stack(np.meshgrid(x, x, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    sound = (truth.bulk / truth.density) ** 0.5
    speed = sound + COURANT / VISCOUS * truth.viscosity / truth.density / spacing
    dt, steps = steps_for(truth.duration, COURANT, spacing, speed)
    walls = tuple(
        node_wall(axis, coordinate, side, "slip", dtype)
        for axis in (0, 1)
        for coordinate, side in ((3.0, 1), (3.0 + cells, -1))
    )
    return discretise(
        truth,
        points,
        spacing**3 / 4,
        law=FLUID,
        parameters={"bulk_modulus": truth.bulk, "viscosity": truth.viscosity},
        nodes=(cells + 7, cells + 7, 3),
        origin=(3.0, 3.0, 1.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.speed * float(truth.travelled(jnp.asarray(truth.duration))),
        boundaries=(*walls, Planar(2)),
        dtype=dtype,
    )


TAYLOR_GREEN = Problem(
    name="taylor-green",
    source="Taylor and Green (1937), Proc. R. Soc. A 158",
    build=lambda cells, dtype: taylor_green(
        TaylorGreen(speed=1e-5 if jnp.dtype(dtype) == jnp.float64 else 1e-3), cells, dtype=dtype
    ),
    ladder=(4, 8, 16, 32),
    order=2,
)
