"""One free particle that breathes: the time integration alone, without an error in space.

A particle that shares its nodes with no other sees an affine velocity field, which APIC transfers
exactly. What is left of MLS-MPM is F' = C F, C' = -4 tau(F) / (rho dx^2) (Hu et al. 2018, with the
force of that one particle). With F = exp(g) I and Hencky's law, tau = (2 mu + 3 lambda) g, this is
the harmonic oscillator g'' = -w^2 g at any amplitude: a closed form. Explicit steps are stable for
w dt < 2, that is dt < dx sqrt(rho / (2 mu + 3 lambda)) (Bai and Schroeder 2022).
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, Room, discretise, held_up_to
from jaxphys.problems.problem import Problem


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Particle:
    """The particle on a grid of the given spacing.

    Attributes:
        spacing: dx of the grid [m].
        youngs: Young's modulus [Pa].
        poisson: Poisson's ratio [1].
        density: reference density [kg/m^3].
        amplitude: largest logarithmic strain per axis [1].
    """

    spacing: float = 0.1
    youngs: float = 1000.0
    poisson: float = 0.3
    density: float = 1000.0
    amplitude: float = 0.1

    @property
    def angular_frequency(self) -> float:
        """w = 2 / dx sqrt((2 mu + 3 lambda) / rho) [rad/s]; 2 mu + 3 lambda = E / (1 - 2 nu)."""
        modulus = self.youngs / (1 - 2 * self.poisson)
        return 2 / self.spacing * (modulus / self.density) ** 0.5

    @property
    def period(self) -> float:
        """2 pi / w [s]."""
        return 2 * np.pi / self.angular_frequency

    @property
    def largest_stable_dt(self) -> float:
        """2 / w [s]."""
        return 2 / self.angular_frequency

    def log_stretch(self, t: Array) -> Array:
        """g(t) = amplitude cos(w t): F = exp(g) I."""
        return self.amplitude * jnp.cos(self.angular_frequency * t)

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] of the points of the particle: X exp(g(t)) from its middle."""
        return X * jnp.exp(self.log_stretch(t))


def breathing(
    particle: Particle,
    dt: float,
    steps: int,
    staggered: bool = True,
    room: Room | None = None,
    dtype=jnp.float64,
) -> Discretisation:
    """The particle alone on a small grid, not in the middle of a cell."""
    return discretise(
        particle,
        np.zeros((1, 3)),
        particle.spacing**3 / 8,
        law=HENCKY,
        poisson=particle.poisson,
        nodes=(7, 3, 3),
        origin=(3.3, 0.9, 1.2),
        spacing=particle.spacing,
        dt=dt,
        steps=steps,
        scale=particle.spacing,
        boundaries=(held_up_to(-1e5, dtype),),
        staggered=staggered,
        room=room,
        dtype=dtype,
    )


def log_stretch_of(state: State) -> float:
    """log F_11 of the particle, to compare with `Particle.log_stretch`."""
    return float(jnp.log(state.deformation[0, 0, 0]))


def _log_stretch_error(problem: Discretisation, state: State) -> float:
    truth = problem.truth
    expected = float(truth.log_stretch(problem.dt * problem.steps))
    return abs(log_stretch_of(state) - expected) / truth.amplitude


def _small(steps: int, dtype) -> Discretisation:
    particle = Particle(amplitude=1e-4)
    return breathing(particle, 1.3 * particle.period / steps, steps, dtype=dtype)


BREATHING_PARTICLE = Problem(
    name="particle",
    source="harmonic oscillator that one particle's APIC transfers are with Hencky's law",
    build=_small,
    ladder=(50, 100, 200),
    order=2,
    resolution="steps",
    norm=_log_stretch_error,
)
