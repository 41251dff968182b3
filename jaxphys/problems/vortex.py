"""Generalised vortex: an annulus whose rings turn against each other, and a plate that turns.

Kamojjala, Brannon, Sadeghirad and Guilkey (2015), "Verification tests in solid mechanics",
Engineering with Computers 31. A ring of radius R turns by alpha(R, t) = A sin(c pi t) h(R), with h
chosen so that both edges are free of traction and at rest. The motion keeps every volume (J = 1).
Here a rigid rotation w t may be added to alpha; with A = 0 it is all there is, and the body may
have any outline: then b = -w^2 x, for a rotation makes no stress.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.problems.discrete import (
    DEFAULT,
    BodyForce,
    Discretisation,
    Planar,
    Room,
    discretise,
    steps_for,
)
from jaxphys.problems.problem import Problem

INNER, OUTER = 0.75, 1.25


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Vortex:
    """Parameters of the vortex; the defaults have wave speed sqrt(E / rho0) = 1 m/s.

    Attributes:
        amplitude: largest angle of a ring, A [rad]. The largest shear is 6 A: at the 1 of the paper
            particles of neighbouring rings lie cells apart.
        rate: c [1/s]; the period of the motion is 2 / c.
        spin: w, of the rotation that is added [rad/s].
        youngs: Young's modulus [Pa].
        poisson: Poisson's ratio [1].
        density: reference density [kg/m^3].
    """

    amplitude: float = 0.3
    rate: float = 1.0
    spin: float = 0.0
    youngs: float = 1000.0
    poisson: float = 0.3
    density: float = 1000.0

    @property
    def shear(self) -> float:
        """mu [Pa]."""
        return self.youngs / (2 * (1 + self.poisson))

    @property
    def lame(self) -> float:
        """lambda [Pa]."""
        return self.youngs * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    @property
    def wave_speed(self) -> float:
        """sqrt((lambda + 2 mu) / rho0) [m/s]."""
        return ((self.lame + 2 * self.shear) / self.density) ** 0.5

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3,) [m] of the material point X (3,), measured from the axis."""
        wave = self.amplitude * jnp.sin(jnp.pi * self.rate * t)
        alpha = self.spin * t + wave * profile(radius(X))[0]
        cos, sin = jnp.cos(alpha), jnp.sin(alpha)
        return jnp.stack([cos * X[0] - sin * X[1], sin * X[0] + cos * X[1], X[2]])

    def body_acceleration(self, x: Array, t: Array) -> Array:
        """Body force per mass (3, ...) [m/s^2] at the current place x (3, ...), from the axis.

        b_r = -R alpha_t^2 + mu/rho R alpha_R^2,
        b_theta = R alpha_tt - mu/rho (3 alpha_R + R alpha_RR), for any law with Kirchhoff stress
        mu (b - I) + f(J) I: the exact stress has no other part since J = 1. R is |x| as well as
        |X|.
        """
        R = radius(x)
        rate = jnp.pi * self.rate
        h, slope, curvature = profile(R)
        wave = self.amplitude * jnp.sin(rate * t)
        turning = self.spin + self.amplitude * rate * jnp.cos(rate * t) * h
        stiffness = self.shear / self.density
        radial = -(turning**2) + stiffness * (wave * slope) ** 2
        shearing = 3 * slope / jnp.where(R > 0, R, 1.0) + curvature
        angular = -(rate**2) * wave * h - stiffness * wave * shearing
        # Both are per unit of radius, so that x is all that gives the direction.
        return jnp.stack(
            [radial * x[0] - angular * x[1], radial * x[1] + angular * x[0], jnp.zeros_like(R)]
        )


def radius(X: Array) -> Array:
    """Distance from the axis [m], with a gradient on it; X (3, ...)."""
    square = X[0] ** 2 + X[1] ** 2
    return jnp.sqrt(jnp.where(square > 0, square, 1e-300))


def profile(R: Array) -> tuple[Array, Array, Array]:
    """h(R), dh/dR and d2h/dR2: h is 1 in the middle of the annulus, 0 and level at its edges.

    Zero where R < 0.5 m, where there is no annulus and the polynomial has grown large.
    """
    d = R - 1
    near = R > 0.5
    return (
        jnp.where(near, 1 - 32 * d**2 + 256 * d**4, 0.0),
        jnp.where(near, -64 * d + 1024 * d**3, 0.0),
        jnp.where(near, -64 + 3072 * d**2, 0.0),
    )


def rings(inner: float, outer: float, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) [m] on rings half a cell apart, as far from each other, and their areas (N,).

    The rings fill what lies between both radii exactly; a square lattice would leave ragged edges.
    """
    number = round(2 * (outer - inner) / spacing)
    width = (outer - inner) / number
    points, areas = [], []
    for ring in range(number):
        R = inner + width * (ring + 0.5)
        count = round(2 * np.pi * R / width)
        angle = 2 * np.pi * (np.arange(count) + 0.5 * (ring % 2)) / count
        points.append(np.stack([R * np.cos(angle), R * np.sin(angle), 0 * angle], axis=1))
        areas.append(np.full(count, 2 * np.pi * R * width / count))
    return np.concatenate(points), np.concatenate(areas)


def annulus_points(spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """`rings` that fill the annulus."""
    return rings(INNER, OUTER, spacing)


def plate_points(side: float, cells: int) -> np.ndarray:
    """Points (N, 3) [m], two to a cell and axis, of a square plate about the axis."""
    x = side / (2 * cells) * (np.arange(-cells, cells) + 0.5)
    return np.stack(np.meshgrid(x, x, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)


def vortex_room(spacing: float) -> Room:
    """Room for the annulus on this spacing [m], and so for all coarser levels."""
    nodes = 2 * half_width(spacing) + 2
    return Room(len(annulus_points(spacing)[0]), (nodes, nodes, 3))


def half_width(spacing: float) -> int:
    """Nodes from the axis to the edge of the grid."""
    return int(np.ceil(OUTER / spacing)) + 3


def vortex(
    truth: Vortex,
    spacing: float,
    duration: float = 1.0,
    courant: float = 0.4,
    share: float = 1.0,
    room: Room | None = None,
    dtype=jnp.float64,
    **more,
) -> Discretisation:
    """One layer of particles in plane strain; `share` of the body force is applied.

    more: as for `discretise`: transfer, staggered.
    """
    points, areas = annulus_points(spacing)
    return _planar(truth, points, areas, spacing, duration, courant, share, room, dtype, **more)


def plate(
    truth: Vortex,
    cells: int,
    duration: float,
    side: float = 1.0,
    courant: float = 0.4,
    share: float = 1.0,
    room: Room | None = None,
    dtype=jnp.float64,
) -> Discretisation:
    """A square plate of `side` [m] in plane strain about the axis; `truth.amplitude` is 0.

    With share=1 the centripetal force is given, and the rotation is exact for any stiffness; with
    share=0 the plate is free, and holds together by its stress.
    """
    spacing = side / cells
    points = plate_points(side, cells)
    area = np.full(len(points), spacing**2 / 4)
    return _planar(truth, points, area, spacing, duration, courant, share, room, dtype)


def _planar(
    truth, points, areas, spacing, duration, courant, share, room, dtype, **more
) -> Discretisation:
    fastest = abs(truth.amplitude) * np.pi * truth.rate + abs(truth.spin) * OUTER
    dt, steps = steps_for(duration, courant, spacing, truth.wave_speed + fastest)
    middle = half_width(spacing) if room is None else room.nodes[0] // 2
    across = more.get("transfer", DEFAULT).spline.width
    # Off the nodes, so that no symmetry of the grid helps.
    origin = jnp.array([middle + 0.1, middle - 0.3, (across - 1) / 2])
    force = BodyForce(truth, origin, jnp.asarray(spacing), jnp.asarray(share))
    return discretise(
        truth,
        points,
        areas * spacing,
        law=NEO_HOOKEAN,
        poisson=truth.poisson,
        nodes=(2 * middle + 2, 2 * middle + 2, across),
        origin=origin,
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=truth.amplitude or 1.0,
        boundaries=(force, Planar(2)),
        room=room,
        dtype=dtype,
        **more,
    )


def angular_momentum(problem: Discretisation, state) -> np.ndarray:
    """Total angular momentum (3,) about the grid's corner, in units of kg dx^2/s.

    The sum of x_p x m v_p and of the moment m D C of the affine part, D = dx^2 / 4 for quadratic
    B-splines: what APIC conserves (Jiang, Schroeder and Teran 2017).
    """
    x, v, C = (np.asarray(a) for a in (state.position, state.velocity, state.affine))
    spin = 0.25 * np.stack([C[2, 1] - C[1, 2], C[0, 2] - C[2, 0], C[1, 0] - C[0, 1]])
    return np.sum(np.asarray(problem.model.mass) * (np.cross(x, v, axis=0) + spin), axis=1)


RIGID_ROTATION = Problem(
    name="rotation",
    source="a plate that turns rigidly by a quarter under the centripetal force",
    build=lambda cells, dtype: plate(
        Vortex(amplitude=0.0, spin=1.0), cells, np.pi / 2, dtype=dtype
    ),
    ladder=(4, 8, 16, 32),
    order=2,
)
VORTEX = Problem(
    name="vortex",
    source="Kamojjala, Brannon, Sadeghirad and Guilkey (2015), Engineering with Computers 31",
    build=lambda cells, dtype: vortex(Vortex(), 1 / cells, 0.5, dtype=dtype),
    ladder=(8, 16, 32),
    order=2,
)
