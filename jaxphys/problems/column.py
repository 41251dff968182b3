"""A column under gravity that is switched on at once: bounces about the static solution.

Linear elasticity of a column that does not widen, fixed at its foot, x = 0, and free at x = H;
gravity points to -x. Static: sigma(x) = -rho g (H - x), u(x) = -(rho g / M) (H x - x^2 / 2). Sudden
gravity: twice the static displacement and stress at half the period 4 H / c.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.problems.bar import line_points
from jaxphys.problems.discrete import Discretisation, Room, discretise, held_up_to, steps_for
from jaxphys.problems.problem import Problem


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Column:
    """The column.

    Attributes:
        height: H [m].
        youngs: Young's modulus [Pa]; with Poisson's ratio 0, also the modulus M of the wave.
        density: reference density [kg/m^3].
        gravity: g, downwards [m/s^2]: small, for the theory is linear.
    """

    height: float = 1.0
    youngs: float = 1e6
    density: float = 1000.0
    gravity: float = 1e-3

    @property
    def wave_speed(self) -> float:
        """c = sqrt(M / rho) [m/s]."""
        return (self.youngs / self.density) ** 0.5

    @property
    def period(self) -> float:
        """4 H / c [s]."""
        return 4 * self.height / self.wave_speed

    def static_displacement(self, x: Array | float) -> Array | float:
        """u(x) [m] of the column at rest."""
        weight = self.density * self.gravity
        return -weight / self.youngs * (self.height * x - x**2 / 2)

    def static_stress(self, x: Array) -> Array:
        """sigma(x) [Pa] of the column at rest."""
        return -self.density * self.gravity * (self.height - x)

    def displacement(self, x: Array, t: Array) -> Array:
        """u(x, t) [m] after gravity appears at t = 0 on the unstrained column; 0 <= t <= period.

        Free fall, g t^2 / 2, except where the waves that leave the fixed end at t = 0 have arrived;
        each carries <t - path / c>^2 g / 2 and changes sign at the fixed end (d'Alembert, images).
        """
        c, H = self.wave_speed, self.height

        def ramp(path):
            return 0.5 * jnp.maximum(t - path / c, 0.0) ** 2

        waves = ramp(x) + ramp(2 * H - x) - ramp(2 * H + x) - ramp(4 * H - x)
        # Not clamped at t < 0: velocities that start half a step early are a step of gravity away
        # from those half a step later.
        return -self.gravity * (0.5 * t**2 - waves)

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] at time t [s] of the points that rest at X (3, ...) [m]."""
        return jnp.stack([X[0] + self.displacement(X[0], t), X[1], X[2]])


def sudden_column(
    column: Column,
    cells: int,
    courant: float = 0.5,
    periods: float = 0.5,
    room: Room | None = None,
    dtype=jnp.float64,
) -> Discretisation:
    """The column on nodes that are held by a sticky half-space, from the moment gravity appears."""
    spacing = column.height / cells
    dt, steps = steps_for(periods * column.period, courant, spacing, column.wave_speed)
    return discretise(
        column,
        line_points(0.0, cells, spacing),
        spacing**3 / 2,
        law=HENCKY,
        poisson=0.0,
        nodes=(cells + 7, 3, 3),
        origin=(3, 1, 1),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=-float(column.static_displacement(column.height)),
        gravity=(-column.gravity, 0.0, 0.0),
        boundaries=(held_up_to(3.0, dtype),),
        room=room,
        dtype=dtype,
    )


SUDDEN_COLUMN = Problem(
    name="sudden-column",
    source="d'Alembert's solution of a column under gravity that is switched on at once",
    # float32 does not see the displacement that 1e-3 m/s^2 makes.
    build=lambda cells, dtype: sudden_column(
        Column(gravity=1e-3 if jnp.dtype(dtype) == jnp.float64 else 1.0), cells, dtype=dtype
    ),
    ladder=(8, 16, 32, 64),
    order=1,
)
