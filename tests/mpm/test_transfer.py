from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.transfer import (
    Window,
    gather,
    gather_slopes,
    scatter,
    scatter_transpose,
    stencil,
)
from jaxphys.mpm.transfer.kernel import base_node, inside, weights

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
    window = Window(shape, GRID.spacing, GRID.shape)
    rows = jnp.zeros((window.nodes, 4), position.dtype)
    rows = scatter(window, stencil(window, origin, last[0]), rows, *last[1:])
    return rows.reshape(*shape, 4)


@partial(jax.jit, static_argnames="shape")
def to_particle(position, velocity, shape=GRID.shape, origin=ZERO):
    rows = jnp.concatenate([velocity, jnp.zeros_like(velocity[..., :1])], -1).reshape(-1, 4)
    window = Window(shape, GRID.spacing, GRID.shape)
    sums, B = gather(window, stencil(window, origin, position.T), rows)
    return jnp.moveaxis(sums[:3], -1, 0), jnp.moveaxis(B, -1, 0)


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


WHOLE = Window(GRID.shape, GRID.spacing, GRID.shape)


def test_cotangents_of_to_grid_are_those_of_the_dense_sum():
    p = particles()
    probe = jnp.asarray(np.random.default_rng(4).normal(size=(*GRID.shape, 4)))

    def dense(*p):
        momentum, mass = reference.to_grid(GRID, *p)
        return jnp.sum(probe * jnp.concatenate([momentum, mass[..., None]], -1))

    position, *rest = (jnp.moveaxis(a, 0, -1) for a in p)
    at = stencil(WHOLE, ZERO, position)
    ours = scatter_transpose(WHOLE, at, probe.reshape(-1, 4), *rest)
    for a, b in zip(ours, jax.jit(jax.grad(dense, range(4)))(*p), strict=True):
        a = jnp.moveaxis(a, -1, 0)
        np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.abs(b).max()))


def test_cotangents_of_to_particle_are_those_of_the_dense_sum():
    random = np.random.default_rng(5)
    position = particles()[0]
    velocity = jnp.asarray(random.normal(size=(*GRID.shape, 3)))
    probe_v = jnp.asarray(random.normal(size=position.shape))
    probe_B = jnp.asarray(random.normal(size=(*position.shape, 3)))

    def dense(position, velocity):
        v, B = reference.to_particle(GRID, position, velocity)
        return jnp.sum(probe_v * v) + jnp.sum(probe_B * B)

    by_position, by_velocity = jax.jit(jax.grad(dense, (0, 1)))(position, velocity)
    rows = jnp.pad(velocity.reshape(-1, 3), ((0, 0), (0, 1)))
    at = stencil(WHOLE, ZERO, position.T)
    sums, _ = gather(WHOLE, at, rows)
    to_flow = probe_v.T, jnp.moveaxis(probe_B, 0, -1)
    slopes = gather_slopes(WHOLE, at, rows, sums, *to_flow)
    scale = float(jnp.abs(by_position).max())
    np.testing.assert_allclose(slopes.T, by_position, atol=1e-12 * scale)
    to_rows = scatter(WHOLE, at, jnp.zeros_like(rows), None, *to_flow)
    np.testing.assert_allclose(to_rows[:, :3].reshape(velocity.shape), by_velocity, atol=1e-12)


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
    origin = jnp.min(base_node(position.T, GRID.spacing, GRID.shape), axis=1)
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
