"""Particle-to-grid and grid-to-particle transfers, and their transposes.

Both are sums over the 27 nodes i of each particle p with weight w and distance d = x_i - x_p:

    to the grid       g_i = sum_p w (a_p + A_p d,  m_p)
    to the particles  v_p = sum_i w v_i,   B_p = sum_i w v_i d^T

The transpose of the first is the second and the other way round, so each carries its own rule: it
keeps the particles and the grid, and recomputes the weights, where automatic differentiation would
store 27 of everything and turn every gather into a scatter. Derivatives by x_p go through w and d.

Layout: rows of four numbers, one per node and, inside the transfers, one per particle, so that a
node's row is read, scaled and added as one short vector. A loop over the three planes of the
stencil, nine rows each, keeps the compiled program small and makes XLA store the weights rather
than compute them for each row again (docs/performance.md).
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .kernel import base_node, weight_slopes, weights

Shape = tuple[int, int, int]


def particle_to_grid(
    shape: Shape,
    spacing: float,
    grid_shape: Shape,
    origin: Array,
    position: Array,
    mass: Array,
    momentum: Array,
    affine: Array,
) -> Array:
    """Grid rows (nx * ny * nz, 4): momentum [kg m/s] and mass [kg] of the nodes of a window.

    shape: nodes of the window; grid_shape: nodes of the whole grid; origin: (3,) int32, the
    window's first node. Particles outside the window are clamped to it (see `window_origin`).
    position: (3, N) [m]; mass: (N,) [kg]; momentum: (3, N) [kg m/s], the value at the particle;
    affine: (3, 3, N) [kg/s], what momentum changes by per metre: m C - dt V 4/dx^2 tau for MLS-MPM
    (Hu et al. 2018, eq. 29).
    """
    return _to_grid((shape, spacing, grid_shape), origin, position, mass, momentum, affine)


def grid_to_particle(
    shape: Shape,
    spacing: float,
    grid_shape: Shape,
    origin: Array,
    position: Array,
    rows: Array,
) -> tuple[Array, Array]:
    """Velocity (3, N) [m/s] and its first moment B (3, 3, N) [m^2/s] from node rows (M, 4).

    The fourth column of `rows` is not read. C = 4 / dx^2 B (Jiang et al. 2015).
    """
    return _to_particle((shape, spacing, grid_shape), origin, position, rows)


def window_origin(shape: Shape, spacing: float, grid_shape: Shape, position: Array) -> Array:
    """First node (3,) int32 of the window of `shape` nodes that covers the particles (3, N).

    If they do not fit, the window starts at the lowest of them: `fits_window` tells.
    """
    if shape == grid_shape:
        return jnp.zeros(3, jnp.int32)
    lowest = jnp.min(base_node(position, spacing, grid_shape), axis=1)
    room = jnp.array(grid_shape, jnp.int32) - jnp.array(shape, jnp.int32)
    return jnp.minimum(lowest, room)


class _Stencil(NamedTuple):
    """Where the 27 nodes of each particle are. Arrays (axis, node 0 to 2, N, 1)."""

    row: Array  # (N,) int32, row number of the first node
    weight: Array  # w_k(x) per axis
    moment: Array  # w_k(x) (x_k - x_p) per axis [m]
    slope: Array  # derivative of w_k by x_p [1/m]
    distance: Array  # x_k - x_p [m]


def _stencil(static, origin, position) -> _Stencil:
    shape, spacing, grid_shape = static
    base = base_node(position, spacing, grid_shape)
    # Clamped for the sake of a particle outside the grid: flagged elsewhere, it must not throw its
    # neighbours about with weights of any size.
    offset = jnp.clip(position / spacing - base.astype(position.dtype), 0.5, 1.5)
    local = base
    if shape != grid_shape:
        last = jnp.array(shape, dtype=jnp.int32)[:, None] - 3
        local = jnp.clip(base - origin[:, None], 0, last)
    row = (local[0] * shape[1] + local[1]) * shape[2] + local[2]
    weight = jnp.stack(weights(offset), axis=1)[..., None]
    slope = jnp.stack(weight_slopes(offset), axis=1)[..., None] / spacing
    distance = jnp.stack([(k - offset) * spacing for k in range(3)], axis=1)[..., None]
    return _Stencil(row, weight, weight * distance, slope, distance)


def _rows(vectors: Array, last: Array | None = None) -> Array:
    """Rows (N, 4) from (3, N) and a fourth column, 0 by default."""
    last = jnp.zeros_like(vectors[0]) if last is None else last
    return jnp.concatenate([vectors, last[None]]).T


def _read(rows, index):
    return rows.at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)


def _scatter(static, origin, position, mass, momentum, affine):
    """Rows (M, 4) of sum_p w (a + A d, m); `mass` None stands for zero."""
    shape = static[0]
    plane, line = shape[1] * shape[2], shape[2]
    stencil = _stencil(static, origin, position)
    (wx, wy, wz), (mx, my, mz) = stencil.weight, stencil.moment
    value = _rows(momentum, mass)
    along = [_rows(affine[:, axis]) for axis in range(3)]

    def add_plane(a, rows):
        first = stencil.row + a * plane
        for b in range(3):
            w = wx[a] * wy[b]
            constant = w * value + mx[a] * wy[b] * along[0] + wx[a] * my[b] * along[1]
            for c in range(3):
                new = wz[c] * constant + mz[c] * w * along[2]
                rows = rows.at[first + (b * line + c)].add(
                    new, mode="promise_in_bounds", wrap_negative_indices=False
                )
        return rows

    rows = jnp.zeros((shape[0] * plane, 4), position.dtype)
    return jax.lax.fori_loop(0, 3, add_plane, rows)


def _gather(static, origin, position, rows):
    """Sums of w g (4, N), and of w g d^T for the first three columns (3, 3, N)."""
    shape = static[0]
    plane, line = shape[1] * shape[2], shape[2]
    stencil = _stencil(static, origin, position)
    (wx, wy, wz), (mx, my, mz) = stencil.weight, stencil.moment

    def add_plane(a, sums):
        first = stencil.row + a * plane
        w = m = z = 0.0
        for b in range(3):
            nodes = [_read(rows, first + (b * line + c)) for c in range(3)]
            along = wz[0] * nodes[0] + wz[1] * nodes[1] + wz[2] * nodes[2]
            w, m = w + wy[b] * along, m + my[b] * along
            z = z + wy[b] * (mz[0] * nodes[0] + mz[1] * nodes[1] + mz[2] * nodes[2])
        terms = (wx[a] * w, mx[a] * w, wx[a] * m, wx[a] * z)
        return tuple(total + term for total, term in zip(sums, terms, strict=True))

    nothing = jnp.zeros((position.shape[1], 4), position.dtype)
    sums, *moments = jax.lax.fori_loop(0, 3, add_plane, (nothing,) * 4)
    return sums.T, jnp.stack([moment.T[:3] for moment in moments], axis=1)


def _slope(static, origin, position, rows, mass, momentum, affine, sums):
    """Derivative (3, N) by x_p of sum_i g_i . w (a + A d, m), given the sums of w g (4, N)."""
    shape = static[0]
    plane, line = shape[1] * shape[2], shape[2]
    stencil = _stencil(static, origin, position)
    (wx, wy, wz), (sx, sy, sz) = stencil.weight, stencil.slope
    dx, dy, dz = stencil.distance
    value = _rows(momentum, mass)
    along = [_rows(affine[:, axis]) for axis in range(3)]

    def add_plane(a, slopes):
        first = stencil.row + a * plane
        w = s = z = 0.0
        for b in range(3):
            constant = value + dx[a] * along[0] + dy[b] * along[1]
            pairs = [
                _read(rows, first + (b * line + c)) * (constant + dz[c] * along[2])
                for c in range(3)
            ]
            weighted = wz[0] * pairs[0] + wz[1] * pairs[1] + wz[2] * pairs[2]
            w, s = w + wy[b] * weighted, s + sy[b] * weighted
            z = z + wy[b] * (sz[0] * pairs[0] + sz[1] * pairs[1] + sz[2] * pairs[2])
        terms = (sx[a] * w, wx[a] * s, wx[a] * z)
        return tuple(total + term for total, term in zip(slopes, terms, strict=True))

    nothing = jnp.zeros((position.shape[1], 4), position.dtype)
    slopes = jax.lax.fori_loop(0, 3, add_plane, (nothing,) * 3)
    through_weights = jnp.stack([jnp.sum(slope, axis=1) for slope in slopes])
    through_distance = sum(affine[i] * sums[i] for i in range(3))
    return through_weights - through_distance


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _to_grid(static, origin, position, mass, momentum, affine):
    return _scatter(static, origin, position, mass, momentum, affine)


def _to_grid_forward(static, origin, position, mass, momentum, affine):
    rows = _scatter(static, origin, position, mass, momentum, affine)
    return rows, (origin, position, mass, momentum, affine)


def _to_grid_backward(static, kept, cotangent):
    origin, position, mass, momentum, affine = kept
    sums, moments = _gather(static, origin, position, cotangent)
    slope = _slope(static, origin, position, cotangent, mass, momentum, affine, sums)
    return None, slope, sums[3], sums[:3], moments


_to_grid.defvjp(_to_grid_forward, _to_grid_backward)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _to_particle(static, origin, position, rows):
    sums, moments = _gather(static, origin, position, rows)
    return sums[:3], moments


def _to_particle_forward(static, origin, position, rows):
    sums, moments = _gather(static, origin, position, rows)
    return (sums[:3], moments), (origin, position, rows, sums)


def _to_particle_backward(static, kept, cotangents):
    origin, position, rows, sums = kept
    velocity, moment = cotangents
    slope = _slope(static, origin, position, rows, None, velocity, moment, sums)
    return None, slope, _scatter(static, origin, position, None, velocity, moment)


_to_particle.defvjp(_to_particle_forward, _to_particle_backward)
