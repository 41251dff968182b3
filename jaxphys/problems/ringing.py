"""A cube that rings freely at large strain: no forces, no boundaries, no manufactured anything.

With Poisson's ratio 0 the neo-Hookean P = mu (F - F^-T) lets each axis of a cube go its own way:
rho u_tt = d/dX mu (F - 1 / F), F = 1 + u_X, with P = 0 at both ends. From rest in place, with
velocities V cos(pi X), u stays a sum of cosines, which a spectral scheme follows to rounding until
the wave steepens. So the reference is another method's, solved here, and any solver that knows this
law can be asked for the same motion. Hencky's law, P = E log(F) / F, leaves the axes alone as well.
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY, NEO_HOOKEAN
from jaxphys.problems.discrete import Discretisation, discretise, steps_for
from jaxphys.problems.problem import Problem

MODES, STEPS = 48, 2000


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Ringing:
    """The unit cube [0, 1]^3 m.

    Attributes:
        speed: V over the speed of sound: the largest strain is about as large.
        youngs: Young's modulus [Pa]; Poisson's ratio is 0; density: [kg/m^3].
        phases: how much of V each axis has.
        hencky: whether the law is Hencky's instead of neo-Hookean.
    """

    speed: float = 0.15
    youngs: float = 1e4
    density: float = 1000.0
    phases: tuple[float, float, float] = (1.0, 0.7, -0.5)
    hencky: bool = field(default=False, metadata={"static": True})

    @property
    def wave_speed(self) -> float:
        """c = sqrt(E / rho) [m/s]."""
        return (self.youngs / self.density) ** 0.5

    @property
    def duration(self) -> float:
        """About five eighths of a period [s], where nothing is at rest or back in place."""
        return 1.25 / self.wave_speed

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] at the start; afterwards `displacements` knows."""
        speed = self.speed * self.wave_speed
        return jnp.stack(
            [X[i] + t * speed * self.phases[i] * jnp.cos(jnp.pi * X[i]) for i in range(3)]
        )


@lru_cache(maxsize=16)
def cosines(
    strain: float, time: float, modes: int = MODES, steps: int = STEPS, hencky: bool = False
) -> np.ndarray:
    """Coefficients (modes,) of u = sum a_k cos(k pi X) at `time`, in units of c = 1, from u = 0 and
    velocities `strain` cos(pi X): Galerkin in cosines with a quadrature three times as fine,
    classical Runge-Kutta in time.
    """
    k = np.pi * np.arange(modes)
    nodes = (np.arange(3 * modes) + 0.5) / (3 * modes)
    slopes = -k[:, None] * np.sin(k[:, None] * nodes)  # of the modes, at the nodes
    norm = np.where(np.arange(modes) == 0, 1.0, 0.5)

    def acceleration(a: np.ndarray) -> np.ndarray:
        F = 1 + a @ slopes
        stress = np.log(F) / F if hencky else 0.5 * (F - 1 / F)  # mu = E / 2
        return -(slopes @ stress) / len(nodes) / norm

    a, v = np.zeros(modes), np.zeros(modes)
    v[1] = strain
    dt = time / steps
    for _ in range(steps):
        k1, l1 = v, acceleration(a)
        k2, l2 = v + dt / 2 * l1, acceleration(a + dt / 2 * k1)
        k3, l3 = v + dt / 2 * l2, acceleration(a + dt / 2 * k2)
        k4, l4 = v + dt * l3, acceleration(a + dt * k3)
        a = a + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        v = v + dt / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
    return a


def displacements(truth: Ringing, X: np.ndarray, **accuracy) -> np.ndarray:
    """u (3, N) [m] at the end, of the points that rest at X (3, N) [m]."""
    k = np.pi * np.arange(accuracy.get("modes", MODES))
    time = truth.duration * truth.wave_speed
    accuracy["hencky"] = truth.hencky
    return np.stack(
        [
            cosines(truth.speed * share, time, **accuracy) @ np.cos(k[:, None] * x)
            for share, x in zip(truth.phases, X, strict=True)
        ]
    )


def ringing(
    truth: Ringing, cells: int, per_axis: int = 2, courant: float = 0.4, dtype=jnp.float64, **more
) -> Discretisation:
    """The cube on cells of 1 / cells [m] with `per_axis**3` particles each.

    more: as for `discretise`: transfer, staggered.
    """
    spacing = 1.0 / cells
    dt, steps = steps_for(truth.duration, courant, spacing, truth.wave_speed)
    x = spacing / per_axis * (np.arange(per_axis * cells) + 0.5)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    margin = 4 + int(np.ceil(0.5 * truth.speed / spacing))
    moved = displacements(truth, points.T)
    problem = discretise(
        truth,
        points,
        (spacing / per_axis) ** 3,
        law=HENCKY if truth.hencky else NEO_HOOKEAN,
        poisson=0.0,
        nodes=(cells + 2 * margin + 1,) * 3,
        origin=(margin + 0.0,) * 3,
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=float(np.sqrt(np.mean(np.sum(moved**2, axis=0)))),
        dtype=dtype,
        **more,
    )
    exact = (points.T + moved) / spacing + np.asarray(problem.origin)[:, None]
    return replace(problem, exact=jnp.asarray(exact))


RINGING_CUBE = Problem(
    name="ringing-cube",
    source="nonlinear standing wave of a neo-Hookean bar along each axis, by a spectral scheme",
    build=lambda cells, dtype: ringing(Ringing(), cells, dtype=dtype),
    ladder=(6, 9, 12, 18),
    order=2,
)
