"""Axial vibration of a bar in its first modes: period, energy loss and order.

The standing wave of the linear bar, v(x, t) = V0 cos(w t) sin(b x), with one end at rest and the
other free: b = (2 n - 1) pi / (2 L), w = b sqrt(E / rho). With Poisson's ratio 0 nothing moves
sideways. Used for the MPM by Bardenhagen (2002), "Energy conservation error in the material point
method for solid mechanics", J. Comput. Phys. 180.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.transfer import Transfer
from jaxphys.problems.discrete import (
    DEFAULT,
    Discretisation,
    Room,
    discretise,
    held_up_to,
    steps_for,
)
from jaxphys.problems.problem import Problem


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Bar:
    """The bar from its fixed end at x = 0 to its free end at x = length.

    Attributes:
        length: L [m].
        youngs: Young's modulus [Pa]; Poisson's ratio is 0.
        density: reference density [kg/m^3].
        speed: V0, largest velocity of the free end [m/s]: small, for the theory is linear.
        mode: n, from 1.
    """

    length: float = 25.0
    youngs: float = 100.0
    density: float = 1.0
    speed: float = 1e-5
    mode: int = 1

    @property
    def wave_speed(self) -> float:
        """sqrt(E / rho) [m/s]."""
        return (self.youngs / self.density) ** 0.5

    @property
    def wave_number(self) -> float:
        """b [1/m]."""
        return (2 * self.mode - 1) * np.pi / (2 * self.length)

    @property
    def angular_frequency(self) -> float:
        """w [rad/s]."""
        return self.wave_number * self.wave_speed

    @property
    def period(self) -> float:
        """2 pi / w [s]."""
        return 2 * np.pi / self.angular_frequency

    def motion(self, X: Array, t: Array) -> Array:
        """Position (3, ...) [m] at time t [s] of the points that rest at X (3, ...) [m].

        Odd in X[0]: the bar mirrored at its fixed end moves so that this end stays where it is.
        """
        b, w = self.wave_number, self.angular_frequency
        displacement = self.speed / w * jnp.sin(w * t) * jnp.sin(b * X[0])
        return jnp.stack([X[0] + displacement, X[1], X[2]])


LEVELS = (8, 16, 32)


def line_room(cells: int, per_axis: int = 2, transfer: Transfer = DEFAULT) -> Room:
    """Room for a line of `cells` cells, three of margin at both ends, and as many nodes across as
    the kernel reaches, 3 x 3 or 4 x 4.
    """
    width = transfer.spline.width
    return Room(cells * per_axis, (cells + 7, width, width))


def line_points(lower: float, cells: int, spacing: float, per_axis: int = 2) -> np.ndarray:
    """Points (N, 3) [m] along x at the middles of `per_axis` equal parts of each cell."""
    part = spacing / per_axis
    x = lower + part * (np.arange(cells * per_axis) + 0.5)
    return np.stack([x, 0 * x, 0 * x], axis=1)


def free_bar(
    bar: Bar,
    cells: int,
    courant: float = 0.5,
    periods: float = 1.0,
    staggered: bool = True,
    room: Room | None = None,
    transfer: Transfer = DEFAULT,
    dtype=jnp.float64,
    per_axis: int = 2,
) -> Discretisation:
    """The bar and its mirror image, free at both ends: no boundary condition is imposed.

    cells: cells along the bar, half of what is simulated. The bar is one line of particles on a
    line of nodes: the sums over the other two axes are exact, so that the problem is the
    one-dimensional one.
    """
    return _line(
        bar, cells, cells, courant, periods, staggered, -1e5, room, transfer, dtype, per_axis
    )


def held_bar(
    bar: Bar,
    cells: int,
    courant: float = 0.5,
    periods: float = 1.0,
    room: Room | None = None,
    dtype=jnp.float64,
) -> Discretisation:
    """The bar alone, with the nodes up to its fixed end held by a sticky half-space.

    A quadratic B-spline field with these nodes at rest does not vanish at the end itself but in the
    mean half a cell away, so that the bar is longer by O(dx): first order.
    """
    return _line(bar, cells, 0, courant, periods, True, 3.0, room, DEFAULT, dtype)


def _line(
    bar, cells, mirrored, courant, periods, staggered, held, room, transfer, dtype, per_axis=2
) -> Discretisation:
    spacing, width = bar.length / cells, transfer.spline.width
    middle = (width - 1) / 2  # of the nodes across
    dt, steps = steps_for(periods * bar.period, courant, spacing, bar.wave_speed)
    return discretise(
        bar,
        line_points(-mirrored * spacing, cells + mirrored, spacing, per_axis),
        spacing**3 / per_axis,
        law=HENCKY,
        poisson=0.0,
        nodes=(cells + mirrored + 7, width, width),
        origin=(mirrored + 3, middle, middle),
        spacing=spacing,
        dt=dt,
        steps=steps,
        scale=bar.speed / bar.angular_frequency,
        staggered=staggered,
        boundaries=(held_up_to(held, dtype),),
        room=room,
        transfer=transfer,
        dtype=dtype,
    )


def _visible(dtype) -> Bar:
    """float32 holds a displacement of 1e-5 of the body no better than to a percent."""
    return Bar(speed=1e-5 if jnp.dtype(dtype) == jnp.float64 else 1e-2)


_SOURCE = "standing wave of the linear bar (Bardenhagen 2002, J. Comput. Phys. 180)"

FREE_BAR = Problem(
    name="free-bar",
    source=_SOURCE,
    build=lambda cells, dtype: free_bar(_visible(dtype), cells, dtype=dtype),
    ladder=(8, 16, 32, 64),
    order=2,
)
HELD_BAR = Problem(
    name="held-bar",
    source=_SOURCE,
    build=lambda cells, dtype: held_bar(_visible(dtype), cells, dtype=dtype),
    ladder=(8, 16, 32, 64),
    order=1,
)
