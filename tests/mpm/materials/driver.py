"""One particle of a law, driven by a velocity gradient as a step drives it: F <- (I + dt C) F."""

from functools import partial

import jax
import jax.numpy as jnp

from jaxphys.core import algebra


def values_of(law, numbers, dtype=jnp.float64):
    """Parameters of one particle, (1,) each, prepared."""
    return law.prepare({name: jnp.full(1, numbers[name], dtype) for name in law.parameters})


@partial(jax.jit, static_argnums=0)
def drive(law, values, rates, dt, F=None, history=None):
    """Kirchhoff stresses (T, 3, 3) and histories (T, H) under velocity gradients `rates` (T, 3, 3),
    and the last F (3, 3).
    """
    dtype = jnp.asarray(rates).dtype
    F = jnp.eye(3, dtype=dtype) if F is None else F
    history = law.at_start(jnp.zeros(1, dtype)) if history is None else history

    def body(carry, C):
        F, history = carry
        trial = F + dt * algebra.matmul(C[..., None], F)
        F, tau, history = law.update(values, trial, history, dt)
        return (F, history), (tau[..., 0], history[:, 0])

    (F, _), (stresses, histories) = jax.lax.scan(body, (F[..., None], history), jnp.asarray(rates))
    return stresses, histories, F[..., 0]
