"""Tangents of the two sums, against those of dense sums that share no code with them."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.mpm.transfer import Window, gather_tangent, scatter_tangent, stencil

from . import reference
from .test_transfer import GRID, ZERO, particles

WHOLE = Window(GRID.shape, GRID.spacing, GRID.shape)


def last(arrays):
    return tuple(jnp.moveaxis(a, 0, -1) for a in arrays)


def close(ours, theirs):
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * float(jnp.abs(theirs).max()))


def test_tangent_of_to_grid_is_that_of_the_dense_sum():
    here, there = particles(), particles(seed=2)
    momentum, mass = jax.jit(lambda p, t: jax.jvp(lambda *p: reference.to_grid(GRID, *p), p, t)[1])(
        here, there
    )
    (position, *given), (moved, *of_given) = last(here), last(there)
    rows = jnp.ones((WHOLE.nodes, 4))
    at = stencil(WHOLE, ZERO, position)
    ours = scatter_tangent(WHOLE, at, rows, tuple(given), moved, tuple(of_given)) - 1
    close(ours[:, :3].reshape(momentum.shape), momentum)
    close(ours[:, 3].reshape(mass.shape), mass)


def test_tangent_of_to_particle_is_that_of_the_dense_sum():
    random = np.random.default_rng(5)
    position, moved = particles()[0], particles(seed=2)[2]
    velocity, of_velocity = jnp.asarray(random.normal(size=(2, *GRID.shape, 3)))
    v, B = jax.jit(lambda p, t: jax.jvp(lambda *p: reference.to_particle(GRID, *p), p, t)[1])(
        (position, velocity), (moved, of_velocity)
    )
    rows, of_rows = (jnp.pad(x.reshape(-1, 3), ((0, 0), (0, 1))) for x in (velocity, of_velocity))
    at = stencil(WHOLE, ZERO, position.T)
    sums, moment = gather_tangent(WHOLE, at, rows, moved.T, of_rows)
    close(sums[:3].T, v)
    close(jnp.moveaxis(moment, -1, 0), B)
