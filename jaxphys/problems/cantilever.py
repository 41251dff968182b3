"""A cantilever that swings in its first mode, by little.

Euler and Bernoulli's beam of length L and thickness h in plane strain: w(x, t) = a f(x) sin(w1 t),
w1 = (1.8751 / L)^2 h sqrt(E' / (12 rho)), E' = E / (1 - nu^2). Shear and rotary inertia, which it
leaves out, lower the frequency of this beam, ten times as long as thick, by about a hundredth
(Timoshenko 1921): that much the answer is worth.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, Planar, discretise, held_up_to, steps_for
from jaxphys.problems.problem import Problem, relative_to

ROOT = 1.8751040687  # of cos(z) cosh(z) = -1


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cantilever:
    """The beam from its clamp at x = 0, y from its middle.

    Attributes:
        length: L [m]; thickness: h [m].
        youngs: Young's modulus [Pa]; poisson: Poisson's ratio [1]; density: [kg/m^3].
        amplitude: of the tip [m].
    """

    length: float = 10.0
    thickness: float = 1.0
    youngs: float = 1e6
    poisson: float = 0.3
    density: float = 1000.0
    amplitude: float = 1e-4

    @property
    def wave_speed(self) -> float:
        """sqrt((lambda + 2 mu) / rho) [m/s]."""
        nu = self.poisson
        return (self.youngs * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / self.density) ** 0.5

    @property
    def angular_frequency(self) -> float:
        """w1 [rad/s]."""
        stiffness = self.youngs / (1 - self.poisson**2) / (12 * self.density)
        return (ROOT / self.length) ** 2 * self.thickness * stiffness**0.5

    def shape(self, x: Array) -> Array:
        """f(x), 1 at the tip."""
        z = ROOT * x / self.length
        ratio = (jnp.cosh(ROOT) + jnp.cos(ROOT)) / (jnp.sinh(ROOT) + jnp.sin(ROOT))
        return 0.5 * (jnp.cosh(z) - jnp.cos(z) - ratio * (jnp.sinh(z) - jnp.sin(z)))

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m]: sections stay plane and upright to the beam."""
        swing = self.amplitude * jnp.sin(self.angular_frequency * t)
        w, slope = jax.jvp(self.shape, (X[0],), (jnp.ones_like(X[0]),))
        return jnp.stack([X[0] - X[1] * swing * slope, X[1] + swing * w, X[2]])


def swinging(truth: Cantilever, cells: int, dtype=jnp.float64) -> Discretisation:
    """The beam with `cells` cells through its thickness, four particles each, in one layer, for
    three quarters of a swing.
    """
    spacing = truth.thickness / cells
    part = spacing / 2
    x = part * (np.arange(round(truth.length / part)) + 0.5)
    y = part * (np.arange(2 * cells) + 0.5) - truth.thickness / 2
    points = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    duration = 1.5 * np.pi / truth.angular_frequency
    dt, steps = steps_for(duration, 0.5, spacing, truth.wave_speed)
    return discretise(
        truth,
        points,
        spacing**3 / 4,
        law=HENCKY,
        poisson=truth.poisson,
        nodes=(round(truth.length / spacing) + 8, cells + 8, 3),
        origin=(3.0, cells / 2 + 3.5, 1.0),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.amplitude,
        boundaries=(held_up_to(3.0, dtype), Planar(2)),
        dtype=dtype,
    )


def deflection(problem: Discretisation, state: State) -> float:
    """How far the last tenth of the beam has swung, over what it should have at the far end of its
    swing.
    """
    exact = problem.spacing * (np.asarray(problem.exact)[:, : problem.count].T - problem.origin).T
    outer = exact[0] > 0.9 * problem.truth.length
    rest = exact[1] + problem.truth.amplitude * np.asarray(problem.truth.shape(exact[0]))
    swung = (problem.places(state)[1] - rest)[outer].mean()
    return float(swung / (exact[1] - rest)[outer].mean())


def _deflection_error(problem: Discretisation, state: State) -> float:
    return relative_to(1.0, deflection(problem, state), state)


CANTILEVER = Problem(
    name="cantilever",
    source="first mode of Euler and Bernoulli's beam",
    build=lambda cells, dtype: swinging(
        Cantilever(amplitude=1e-4 if jnp.dtype(dtype) == jnp.float64 else 0.05), cells, dtype=dtype
    ),
    ladder=(2, 4, 8),
    order=None,
    floor=0.02,
    norm=_deflection_error,
)
