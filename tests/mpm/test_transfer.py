from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.kernel import base_node, inside, weights
from jaxphys.mpm.transfer import grid_to_particle, particle_to_grid, window_origin

from . import reference

GRID = Grid((8, 7, 9), 0.2)
ZERO = jnp.zeros(3, jnp.int32)


def particles(count=40, seed=1):
    random = np.random.default_rng(seed)
    low, high = GRID.lower, np.array(GRID.upper)
    position = low + (high - low) * random.random((count, 3))
    return (
        jnp.asarray(position),
        jnp.asarray(random.random(count)),
        jnp.asarray(random.normal(size=(count, 3))),
        jnp.asarray(random.normal(size=(count, 3, 3))),
    )


@partial(jax.jit, static_argnames="shape")
def to_grid(position, mass, momentum, affine, shape=GRID.shape, origin=ZERO):
    last = [jnp.moveaxis(a, 0, -1) for a in (position, mass, momentum, affine)]
    rows = particle_to_grid(shape, GRID.spacing, GRID.shape, origin, *last)
    return rows.reshape(*shape, 4)


@partial(jax.jit, static_argnames="shape")
def to_particle(position, velocity, shape=GRID.shape, origin=ZERO):
    rows = jnp.concatenate([velocity, jnp.zeros_like(velocity[..., :1])], -1).reshape(-1, 4)
    v, B = grid_to_particle(shape, GRID.spacing, GRID.shape, origin, position.T, rows)
    return jnp.moveaxis(v, -1, 0), jnp.moveaxis(B, -1, 0)


def test_weights_are_a_partition_of_unity_and_reproduce_position():
    offset = jnp.linspace(0.5, 1.5, 101)
    w, s, d = weights(offset)
    np.testing.assert_allclose(sum(w), 1.0, atol=1e-15)
    np.testing.assert_allclose(w[1] + 2 * w[2], offset, atol=1e-15)
    np.testing.assert_allclose(d, np.arange(3)[:, None] - offset, atol=1e-15)
    np.testing.assert_allclose(sum(w * d**2), 0.25, atol=1e-15)  # hence C = 4 / dx^2 B
    slope = jax.jvp(lambda x: weights(x)[0], (offset,), (jnp.ones_like(offset),))[1]
    np.testing.assert_allclose(s, slope, atol=1e-15)


def test_weights_are_continuous_across_cells():
    (left, left_slope, _), (right, right_slope, _) = (
        weights(jnp.array([[offset]])) for offset in (1.5, 0.5)
    )
    assert left.shape == (1, 3, 1)
    left, right, left_slope, right_slope = (
        a[0, :, 0] for a in (left, right, left_slope, right_slope)
    )
    np.testing.assert_allclose(left[1:], right[:2], atol=1e-15)
    np.testing.assert_allclose(left_slope[1:], right_slope[:2], atol=1e-15)
    assert left[0] == left_slope[0] == 0 and right[2] == right_slope[2] == 0


def test_to_grid_is_the_dense_sum():
    p = particles()
    rows = to_grid(*p)
    momentum, mass = reference.to_grid(GRID, *p)
    np.testing.assert_allclose(rows[..., :3], momentum, atol=1e-13)
    np.testing.assert_allclose(rows[..., 3], mass, atol=1e-14)


def test_to_particle_is_the_dense_sum():
    position = particles()[0]
    velocity = jnp.asarray(np.random.default_rng(2).normal(size=(*GRID.shape, 3)))
    for ours, dense in zip(
        to_particle(position, velocity),
        reference.to_particle(GRID, position, velocity),
        strict=True,
    ):
        np.testing.assert_allclose(ours, dense, atol=1e-13)


def test_to_particle_returns_an_affine_field_exactly():
    random = np.random.default_rng(3)
    v0, L = random.normal(size=3), random.normal(size=(3, 3))
    position = particles()[0]
    v, B = to_particle(position, v0 + reference.nodes(GRID) @ L.T)
    np.testing.assert_allclose(v, v0 + position @ L.T, atol=1e-13)
    np.testing.assert_allclose(4 / GRID.spacing**2 * B, jnp.broadcast_to(L, B.shape), atol=1e-12)


def test_gradients_of_to_grid_are_those_of_the_dense_sum():
    p = particles()
    probe = jnp.asarray(np.random.default_rng(4).normal(size=(*GRID.shape, 4)))

    def ours(*p):
        return jnp.sum(probe * jnp.tanh(to_grid(*p)))

    def dense(*p):
        momentum, mass = reference.to_grid(GRID, *p)
        return jnp.sum(probe * jnp.tanh(jnp.concatenate([momentum, mass[..., None]], -1)))

    for a, b in zip(
        jax.jit(jax.grad(ours, range(4)))(*p), jax.jit(jax.grad(dense, range(4)))(*p), strict=True
    ):
        np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.abs(b).max()))


def test_gradients_of_to_particle_are_those_of_the_dense_sum():
    random = np.random.default_rng(5)
    position = particles()[0]
    velocity = jnp.asarray(random.normal(size=(*GRID.shape, 3)))
    probe_v = jnp.asarray(random.normal(size=position.shape))
    probe_B = jnp.asarray(random.normal(size=(*position.shape, 3)))

    def loss(transfer):
        def value(position, velocity):
            v, B = transfer(position, velocity)
            return jnp.sum(probe_v * jnp.sin(v)) + jnp.sum(probe_B * jnp.sin(B))

        return jax.jit(jax.grad(value, (0, 1)))(position, velocity)

    dense = loss(lambda x, v: reference.to_particle(GRID, x, v))
    for a, b in zip(loss(to_particle), dense, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.abs(b).max()))


def test_transfers_are_each_others_transpose():
    position, mass, momentum, affine = particles()
    velocity = jnp.asarray(np.random.default_rng(6).normal(size=(*GRID.shape, 3)))
    v, B = to_particle(position, velocity)
    left = jnp.sum(to_grid(position, mass, momentum, affine)[..., :3] * velocity)
    right = jnp.sum(momentum * v) + jnp.sum(affine * B)
    np.testing.assert_allclose(left, right, rtol=1e-13)


def test_window_is_a_cut_of_the_whole_grid():
    position, mass, momentum, affine = particles()
    position = 0.5 + 0.25 * position
    shape = (6, 5, 6)
    origin = window_origin(shape, GRID.spacing, GRID.shape, position.T)
    cut = to_grid(position, mass, momentum, affine, shape, origin)
    whole = to_grid(position, mass, momentum, affine)
    x, y, z = (int(o) for o in origin)
    assert (x, y, z) != (0, 0, 0)
    inner = whole[x : x + 6, y : y + 5, z : z + 6]
    np.testing.assert_array_equal(cut, inner)
    np.testing.assert_allclose(jnp.sum(cut), jnp.sum(whole), rtol=1e-13)
    back = to_particle(position, cut[..., :3], shape, origin)
    for a, b in zip(back, to_particle(position, whole[..., :3]), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-15)


def test_window_stays_inside_the_grid():
    position = jnp.array(GRID.upper)[:, None] - 1e-9
    origin = window_origin((6, 6, 6), GRID.spacing, GRID.shape, position)
    np.testing.assert_array_equal(origin, np.array(GRID.shape) - 6)


@pytest.mark.parametrize("bad", [-1e9, -0.1, 1e9, np.nan, np.inf, -np.inf])
def test_particles_outside_are_flagged_and_address_the_grid(bad):
    position = jnp.array([[0.5, bad], [0.5, 0.5], [0.5, 0.5]])
    base = np.asarray(base_node(position, GRID.spacing, GRID.shape))
    assert (base >= 0).all() and (base <= np.array(GRID.shape)[:, None] - 3).all()
    np.testing.assert_array_equal(inside(position, GRID.spacing, GRID.shape), [True, False])


def test_inside_is_exactly_where_the_weights_are_whole():
    low, high = GRID.lower, GRID.upper[0]
    x = jnp.array([low - 1e-9, low, high - 1e-9, high])
    position = jnp.stack([x, jnp.full(4, 0.5), jnp.full(4, 0.5)])
    np.testing.assert_array_equal(
        inside(position, GRID.spacing, GRID.shape), [False, True, True, False]
    )


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_types_are_kept(dtype):
    p = [a.astype(dtype) for a in particles()]
    rows = to_grid(*p)
    assert rows.dtype == dtype
    assert all(a.dtype == dtype for a in to_particle(p[0], rows[..., :3]))
