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
    vectors_of,
)
from jaxphys.mpm.transfer.kernels import CUBIC, KERNELS, QUADRATIC

from . import reference

GRID = Grid((8, 7, 9), 0.2)
ZERO = jnp.zeros(3, jnp.int32)
BOTH = pytest.mark.parametrize("kernel", ["quadratic", "cubic"])


def particles(count=40, seed=1, fields=1):
    """Places that both kernels allow; momenta and what they change by, of one field or two."""
    random = np.random.default_rng(seed)
    low, high = GRID.lower(CUBIC), np.array(GRID.upper(CUBIC))
    position = low + (high - low) * random.random((count, 3))
    return (
        jnp.asarray(position),
        jnp.asarray(random.random(count)),
        jnp.asarray(random.normal(size=(count, 3 * fields))),
        jnp.asarray(random.normal(size=(count, 3 * fields, 3))),
    )


def window_of(kernel, shape=GRID.shape):
    return Window(shape, GRID.spacing, GRID.shape, KERNELS[kernel])


@partial(jax.jit, static_argnames=("shape", "kernel"))
def to_grid(position, mass, momentum, affine, shape=GRID.shape, origin=ZERO, kernel="quadratic"):
    last = [jnp.moveaxis(a, 0, -1) for a in (position, mass, momentum, affine)]
    window = window_of(kernel, shape)
    columns = 4 * momentum.shape[1] // 3
    rows = jnp.zeros((window.nodes, columns), position.dtype)
    rows = scatter(window, stencil(window, origin, last[0]), rows, *last[1:])
    return rows.reshape(*shape, columns)


@partial(jax.jit, static_argnames=("shape", "kernel"))
def to_particle(position, velocity, shape=GRID.shape, origin=ZERO, kernel="quadratic"):
    rows = jnp.concatenate([velocity, jnp.zeros_like(velocity[..., :1])], -1).reshape(-1, 4)
    window = window_of(kernel, shape)
    sums, B = gather(window, stencil(window, origin, position.T), rows)
    return jnp.moveaxis(sums[:3], -1, 0), jnp.moveaxis(B, -1, 0)


@BOTH
def test_weights_are_a_partition_of_unity_and_reproduce_position(kernel):
    kernel = KERNELS[kernel]
    offset = kernel.reach + jnp.linspace(0, 1, 101)
    w, s, d = kernel.weights(offset)
    assert len(w) == len(s) == len(d) == kernel.width
    np.testing.assert_allclose(sum(w), 1.0, atol=1e-15)
    np.testing.assert_allclose(jnp.arange(kernel.width) @ w, offset, atol=1e-15)
    np.testing.assert_allclose(d, np.arange(kernel.width)[:, None] - offset, atol=1e-15)
    # Hence C = 4 / dx^2 B, or 3 / dx^2 B.
    np.testing.assert_allclose(sum(w * d**2), 1 / kernel.inverse_inertia, atol=1e-15)
    slope = jax.jvp(lambda x: kernel.weights(x)[0], (offset,), (jnp.ones_like(offset),))[1]
    np.testing.assert_allclose(s, slope, atol=1e-15)


@BOTH
def test_weights_are_those_of_the_definition(kernel):
    offset = KERNELS[kernel].reach + jnp.linspace(0, 1, 101)
    w, _, d = KERNELS[kernel].weights(offset)
    np.testing.assert_allclose(w, reference.spline(d, kernel), atol=1e-15)


@BOTH
def test_weights_are_continuous_across_cells(kernel):
    kernel = KERNELS[kernel]
    (left, left_slope, _), (right, right_slope, _) = (
        kernel.weights(jnp.array([[kernel.reach + end]])) for end in (1.0, 0.0)
    )
    assert left.shape == (1, kernel.width, 1)
    left, right, left_slope, right_slope = (
        a[0, :, 0] for a in (left, right, left_slope, right_slope)
    )
    np.testing.assert_allclose(left[1:], right[:-1], atol=1e-15)
    np.testing.assert_allclose(left_slope[1:], right_slope[:-1], atol=1e-15)
    assert left[0] == left_slope[0] == 0 and right[-1] == right_slope[-1] == 0


def fields_of(momentum, affine):
    """The one or two fields in vectors of three or six numbers, as the reference takes them."""
    return [(momentum[:, i : i + 3], affine[:, i : i + 3]) for i in range(0, momentum.shape[1], 3)]


@pytest.mark.parametrize("fields", [1, 2])
@BOTH
def test_to_grid_is_the_dense_sum(kernel, fields):
    position, mass, *vectors = particles(fields=fields)
    rows = to_grid(position, mass, *vectors, kernel=kernel)
    for k, field in enumerate(fields_of(*vectors)):
        momentum, whole = reference.to_grid(GRID, position, mass, *field, kernel)
        np.testing.assert_allclose(rows[..., 4 * k : 4 * k + 3], momentum, atol=1e-13)
        np.testing.assert_allclose(rows[..., 4 * k + 3], 0 if k else whole, atol=1e-14)


@BOTH
def test_to_particle_is_the_dense_sum(kernel):
    position = particles()[0]
    velocity = jnp.asarray(np.random.default_rng(2).normal(size=(*GRID.shape, 3)))
    for ours, dense in zip(
        to_particle(position, velocity, kernel=kernel),
        reference.to_particle(GRID, position, velocity, kernel),
        strict=True,
    ):
        np.testing.assert_allclose(ours, dense, atol=1e-13)


@BOTH
def test_to_particle_returns_an_affine_field_exactly(kernel):
    random = np.random.default_rng(3)
    v0, L = random.normal(size=3), random.normal(size=(3, 3))
    position = particles()[0]
    v, B = to_particle(position, v0 + reference.nodes(GRID) @ L.T, kernel=kernel)
    np.testing.assert_allclose(v, v0 + position @ L.T, atol=1e-13)
    C = {"quadratic": 4, "cubic": 3}[kernel] / GRID.spacing**2 * B
    np.testing.assert_allclose(C, jnp.broadcast_to(L, B.shape), atol=1e-12)


# Widths and numbers of fields are independent of each other in the code: two pairs show both.
PAIRS = pytest.mark.parametrize(("kernel", "fields"), [("quadratic", 1), ("cubic", 2)])


@PAIRS
def test_cotangents_of_to_grid_are_those_of_the_dense_sum(kernel, fields):
    p = particles(fields=fields)
    probe = jnp.asarray(np.random.default_rng(4).normal(size=(*GRID.shape, 4 * fields)))

    def dense(position, mass, momentum, affine):
        parts = []
        for field in fields_of(momentum, affine):
            part, whole = reference.to_grid(GRID, position, mass, *field, kernel)
            parts += [part, jnp.zeros_like(whole)[..., None] if parts else whole[..., None]]
        return jnp.sum(probe * jnp.concatenate(parts, -1))

    position, *rest = (jnp.moveaxis(a, 0, -1) for a in p)
    window = window_of(kernel)
    at = stencil(window, ZERO, position)
    ours = jax.jit(partial(scatter_transpose, window))(at, probe.reshape(-1, 4 * fields), *rest)
    for a, b in zip(ours, jax.jit(jax.grad(dense, range(4)))(*p), strict=True):
        a = jnp.moveaxis(a, -1, 0)
        np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.abs(b).max()))


@PAIRS
def test_cotangents_of_to_particle_are_those_of_the_dense_sum(kernel, fields):
    random = np.random.default_rng(5)
    position = particles()[0]
    velocity = jnp.asarray(random.normal(size=(*GRID.shape, 3 * fields)))
    probe_v = jnp.asarray(random.normal(size=(len(position), 3 * fields)))
    probe_B = jnp.asarray(random.normal(size=(*probe_v.shape, 3)))

    def dense(position, velocity):
        total = 0.0
        for i in range(0, 3 * fields, 3):
            own = slice(i, i + 3)
            v, B = reference.to_particle(GRID, position, velocity[..., own], kernel)
            total += jnp.sum(probe_v[:, own] * v) + jnp.sum(probe_B[:, own] * B)
        return total

    by_position, by_velocity = jax.jit(jax.grad(dense, (0, 1)))(position, velocity)
    parts = velocity.reshape(-1, fields, 3)
    rows = jnp.pad(parts, ((0, 0), (0, 0), (0, 1))).reshape(-1, 4 * fields)
    window = window_of(kernel)

    @jax.jit
    def ours(position, rows, *to_flow):
        at = stencil(window, ZERO, position)
        sums, _ = gather(window, at, rows)
        slopes = gather_slopes(window, at, rows, vectors_of(sums), *to_flow)
        return slopes, scatter(window, at, jnp.zeros_like(rows), None, *to_flow)

    slopes, to_rows = ours(position.T, rows, probe_v.T, jnp.moveaxis(probe_B, 0, -1))
    scale = float(jnp.abs(by_position).max())
    np.testing.assert_allclose(slopes.T, by_position, atol=1e-12 * scale)
    to_velocity = to_rows.reshape(-1, fields, 4)[..., :3].reshape(velocity.shape)
    np.testing.assert_allclose(to_velocity, by_velocity, atol=1e-12)


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
    origin = jnp.min(QUADRATIC.base_node(position.T, GRID.spacing, GRID.shape), axis=1)
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


@BOTH
@pytest.mark.parametrize("bad", [-1e9, -0.1, 1e9, np.nan, np.inf, -np.inf])
def test_particles_outside_are_flagged_and_address_the_grid(bad, kernel):
    kernel = KERNELS[kernel]
    position = jnp.array([[0.5, bad], [0.5, 0.5], [0.5, 0.5]])
    base = np.asarray(kernel.base_node(position, GRID.spacing, GRID.shape))
    last = np.array(GRID.shape)[:, None] - kernel.width
    assert (base >= 0).all() and (base <= last).all()
    np.testing.assert_array_equal(kernel.inside(position, GRID.spacing, GRID.shape), [True, False])


@BOTH
def test_inside_is_exactly_where_the_weights_are_whole(kernel):
    """On faces and corners of the domain and on nodes, and a hair to either side of them."""
    grid = Grid((6, 6, 6), 1.0)
    places = [0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5]
    x = np.array([place + hair for place in places for hair in (-1e-4, 0, 1e-4)])
    alone = np.stack([x, np.full_like(x, 2.5), np.full_like(x, 2.5)])
    diagonal = np.stack([x, x, x])
    position = jnp.asarray(np.concatenate([alone, np.roll(alone, 1, axis=0), diagonal], axis=1))
    found = np.asarray(KERNELS[kernel].inside(position, 1.0, grid.shape))
    lower, upper = grid.lower(KERNELS[kernel]), np.array(grid.upper(KERNELS[kernel]))
    expected = np.all((position >= lower) & (position < upper[:, None]), axis=0)
    np.testing.assert_array_equal(found, expected)
    # Where a weight is missing they are short of 1, but where the missing one is 0: on the end.
    total = np.asarray(jnp.sum(reference.all_weights(grid, position.T, kernel), axis=(1, 2, 3)))
    assert np.all(total[found] > 1 - 1e-14)
    ends = np.any(np.asarray(position) == upper[:, None], axis=0)
    assert np.all(total[~found & ~ends] < 1 - 1e-14)
    assert 0 < found.sum() < len(found)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_types_are_kept(dtype):
    p = [a.astype(dtype) for a in particles()]
    rows = to_grid(*p)
    assert rows.dtype == dtype
    assert all(a.dtype == dtype for a in to_particle(p[0], rows[..., :3]))
