"""What follows from a motion alone: velocity, gradient, and the momentum it does not balance.

A motion is a function `motion(X (3,), t) -> x (3,)` [m] of one material point. Everything else here
comes from it by differentiation, so that a closed-form body force is checked rather than trusted.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array

Motion = Callable[[Array, Array], Array]
"""x = motion(X (3,), t): current position of the material point X [m] at time t [s]."""

Stress = Callable[[Array], Array]
"""P = stress(F (3, 3)): first Piola-Kirchhoff stress [Pa]."""


def velocity(motion: Motion, X: Array, t: Array) -> Array:
    """Material velocity dx/dt [m/s], shape (3,)."""
    return jax.jvp(lambda time: motion(X, time), (t,), (jnp.ones_like(t),))[1]


def acceleration(motion: Motion, X: Array, t: Array) -> Array:
    """Material acceleration d2x/dt2 [m/s^2], shape (3,)."""
    rate = lambda time: velocity(motion, X, time)  # noqa: E731
    return jax.jvp(rate, (t,), (jnp.ones_like(t),))[1]


def deformation_gradient(motion: Motion, X: Array, t: Array) -> Array:
    """F = dx/dX, shape (3, 3)."""
    return jax.jacfwd(motion)(X, t)


def divergence(motion: Motion, stress: Stress, X: Array, t: Array) -> Array:
    """Div P = dP_iJ/dX_J of the motion's stress [N/m^3], shape (3,)."""
    gradient = jax.jacfwd(lambda point: stress(deformation_gradient(motion, point, t)))(X)
    return jnp.einsum("ijj->i", gradient)


def body_acceleration(motion: Motion, stress: Stress, density: float, X: Array, t: Array) -> Array:
    """The body force per mass [m/s^2], shape (3,), that makes `motion` a solution.

    b = d2x/dt2 - Div P / rho0: momentum balance in the reference configuration, the method of
    manufactured solutions (for the MPM: Wallstedt and Guilkey 2008). `density` is that of
    the reference configuration [kg/m^3].
    """
    return acceleration(motion, X, t) - divergence(motion, stress, X, t) / density


def neo_hookean_stress(lame: float, shear: float) -> Stress:
    """P = lambda ln J F^-T + mu (F - F^-T) for Lame parameters in [Pa]."""

    def stress(F: Array) -> Array:
        inverse_transpose = jnp.linalg.inv(F).T
        log_volume = jnp.log(jnp.linalg.det(F))
        return lame * log_volume * inverse_transpose + shear * (F - inverse_transpose)

    return stress
