"""Transfers as functions of places, by central differences; node blocks against dense sums."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core import packed
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.transfer import Window, stencil
from jaxphys.mpm.transfer.blocks import scatter_blocks
from jaxphys.mpm.transfer.rules import to_nodes, to_particles
from tests.mpm import reference

GRID = Grid((6, 5, 7), 0.1)
WINDOW = Window(GRID.shape, 0.1, GRID.shape)
ORIGIN = jnp.zeros(3, jnp.int32)
random = np.random.default_rng(0)
X = jnp.asarray(0.12 + 0.2 * random.random((3, 11)))


def test_slopes_are_those_of_central_differences():
    rows, weights = (jnp.asarray(random.normal(size=(WINDOW.nodes, 4))) for _ in range(2))
    mass, momentum, affine, way = (
        jnp.asarray(random.normal(size=(*shape, 11))) for shape in ((), (3,), (3, 3), (3,))
    )

    def of(x, rows, mass, momentum, affine):
        given = to_nodes(WINDOW, ORIGIN, x, rows, mass, momentum, affine)
        sums, moment = to_particles(WINDOW, ORIGIN, x, given)
        return jnp.sum(weights * given) + jnp.sum(jnp.sin(3 * sums)) + jnp.sum(moment**2)

    ways = (0.1 * way, weights, mass**2, momentum**2, affine**2)
    start = (X, rows, mass, momentum, affine)
    value = jax.jit(of)
    slopes = jax.jit(jax.grad(of, argnums=tuple(range(5))))(*start)
    h = 1e-5
    for k, (slope, d) in enumerate(zip(slopes, ways, strict=True)):
        ends = [
            value(*(x + side * h * d if i == k else x for i, x in enumerate(start)))
            for side in (1, -1)
        ]
        expected = float(ends[0] - ends[1]) / (2 * h)
        np.testing.assert_allclose(float(jnp.vdot(slope, d)), expected, rtol=1e-6)


def test_blocks_are_the_nodes_own_part_of_a_second_derivative():
    stiffness, spring = (jnp.asarray(random.normal(size=(n, 11))) for n in (45, 6))
    at = stencil(WINDOW, ORIGIN, X)
    empty = jnp.zeros((WINDOW.nodes, 6))
    found = scatter_blocks(WINDOW, at, empty, stiffness, spring)
    w = np.asarray(reference.all_weights(GRID, X.T)).reshape(11, -1)
    d = np.asarray(reference.nodes(GRID)).reshape(1, -1, 3) - np.asarray(X.T)[:, None]
    S = np.asarray(stiffness)[packed.places(9)].reshape(3, 3, 3, 3, 11)
    K = np.asarray(spring)[packed.places(3)]
    expected = np.einsum("pm,abp->mab", w**2, K)
    expected += np.einsum("pm,pmj,ajbkp,pmk->mab", w**2, d, S, d)
    full = np.asarray(found).T[packed.places(3)]
    np.testing.assert_allclose(np.moveaxis(full, -1, 0), expected, atol=1e-13)
