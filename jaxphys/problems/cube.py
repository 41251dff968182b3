"""Axis-aligned displacement of a cube with free faces: stretch of 30 per cent on each axis.

The manufactured solution of Wallstedt and Guilkey (2008), "An evaluation of explicit time
integration schemes for use with the generalized interpolation material point method", J. Comput.
Phys. 227, with cosines for sines and Poisson's ratio 0: then every face is free of
traction, and the solution tests the bulk and not the boundary condition.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.problems.discrete import BodyForce, Discretisation, Room, discretise, steps_for
from jaxphys.problems.problem import Problem

PHASES = (0.0, 2.0 / 3.0, 4.0 / 3.0)
NEWTON_STEPS = 6


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cube:
    """The unit cube [0, 1]^3 m.

    Attributes:
        amplitude: A, largest displacement [m]; the largest strain is pi A.
        youngs: Young's modulus [Pa]; Poisson's ratio is 0.
        density: reference density [kg/m^3].
    """

    amplitude: float = 0.05
    youngs: float = 1e4
    density: float = 1000.0

    @property
    def wave_speed(self) -> float:
        """c = sqrt(E / rho) [m/s], also the rate of the motion per metre."""
        return (self.youngs / self.density) ** 0.5

    @property
    def period(self) -> float:
        """Time after which the motion repeats [s]."""
        return 2.0 / self.wave_speed

    def waves(self, t: Array) -> list[Array]:
        """A sin(pi (c t + phase_i)) [m] for each axis."""
        angle = jnp.pi * self.wave_speed * t
        return [self.amplitude * jnp.sin(angle + jnp.pi * phase) for phase in PHASES]

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m]: X_i + A cos(pi X_i) sin(pi (c t + phase_i))."""
        waves = self.waves(t)
        return jnp.stack([X[i] + waves[i] * jnp.cos(jnp.pi * X[i]) for i in range(3)])

    def body_acceleration(self, x: Array, t: Array) -> Array:
        """Body force per mass (3, ...) [m/s^2] at the current place x (3, ...) [m].

        pi^2 u_i (mu / rho (1 + 1 / F_ii^2) - c^2), for the neo-Hookean P = mu (F - F^-T), at the
        material point X_i that sits at x_i; each axis is solved for it by Newton's method.
        """
        stiffness = 0.5 * self.youngs / self.density
        components = []
        for axis, wave in enumerate(self.waves(t)):
            X = x[axis]
            for _ in range(NEWTON_STEPS):
                residual = X + wave * jnp.cos(jnp.pi * X) - x[axis]
                X = X - residual / (1 - wave * jnp.pi * jnp.sin(jnp.pi * X))
            stretch = 1 - wave * jnp.pi * jnp.sin(jnp.pi * X)
            u = wave * jnp.cos(jnp.pi * X)
            rate = stiffness * (1 + 1 / stretch**2) - self.wave_speed**2
            components.append(jnp.pi**2 * rate * u)
        return jnp.stack(components)


def free_cube(
    cube: Cube,
    cells: int,
    periods: float = 0.5,
    courant: float = 0.4,
    room: Room | None = None,
    dtype=jnp.float64,
) -> Discretisation:
    """The cube on cells of 1 / cells [m] with eight particles each, free on all faces."""
    spacing = 1.0 / cells
    dt, steps = steps_for(periods * cube.period, courant, spacing, cube.wave_speed)
    x = spacing / 2 * (np.arange(2 * cells) + 0.5)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    margin = 3 + int(np.ceil(cube.amplitude / spacing))
    origin = jnp.full(3, float(margin))
    force = BodyForce(cube, origin, jnp.asarray(spacing), jnp.ones(()))
    return discretise(
        cube,
        points,
        spacing**3 / 8,
        law=NEO_HOOKEAN,
        poisson=0.0,
        nodes=(cells + 2 * margin + 1,) * 3,
        origin=origin,
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=cube.amplitude,
        boundaries=(force,),
        room=room,
        dtype=dtype,
    )


def cube_room(cells: int) -> Room:
    """Room for the cube on this many cells, and so for all coarser levels, of 6 cells or more."""
    return Room((2 * cells) ** 3, (cells + 9 + cells // 10,) * 3)


FREE_CUBE = Problem(
    name="cube",
    source="manufactured, after Wallstedt and Guilkey (2008), J. Comput. Phys. 227",
    build=lambda cells, dtype: free_cube(Cube(), cells, dtype=dtype),
    ladder=(6, 12, 24),
    order=2,
)
