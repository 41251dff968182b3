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
from jax.ad_checkpoint import checkpoint_name

from jaxphys.mpm.kernel import base_node, weights

Shape = tuple[int, int, int]
TRANSFERS = "transfers"  # what `adjoint.lean` keeps


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
    """Where the 27 nodes of each particle are. Arrays (axis, node 0 to 2, N)."""

    row: Array  # (N,) int32, row number of the first node
    weight: Array  # w_k(x)
    moment: Array  # w_k(x) (x_k - x_p) [m]
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
    weight, slope, distance = weights(offset)
    distance = distance * spacing
    return _Stencil(row, weight, weight * distance, slope / spacing, distance)


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
    (wx, wy, wz), (mx, my, mz) = stencil.weight[..., None], stencil.moment[..., None]
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


def _over_planes(static, stencil, rows, terms, nothing):
    """Sum over the three planes a of the stencil of `terms(a, nodes)`, where nodes[b][c] are the
    rows (N, 4) at node (a, b, c) of each particle; `nothing` is the zero to start from.
    """
    shape = static[0]
    plane, line = shape[1] * shape[2], shape[2]

    def add_plane(a, totals):
        first = stencil.row + a * plane
        nodes = [[_read(rows, first + (b * line + c)) for c in range(3)] for b in range(3)]
        return jax.tree.map(jnp.add, totals, terms(a, nodes))

    return jax.lax.fori_loop(0, 3, add_plane, nothing)


def _sum_terms(stencil):
    """Terms of the sums of w g and of w g d along x, y and z, each (N, 4)."""
    (wx, wy, wz), (mx, my, mz) = stencil.weight[..., None], stencil.moment[..., None]

    def terms(a, nodes):
        w = m = z = 0.0
        for b in range(3):
            along = sum(wz[c] * nodes[b][c] for c in range(3))
            w, m = w + wy[b] * along, m + my[b] * along
            z = z + wy[b] * sum(mz[c] * nodes[b][c] for c in range(3))
        return wx[a] * w, mx[a] * w, wx[a] * m, wx[a] * z

    return terms, (jnp.zeros((len(stencil.row), 4), wx.dtype),) * 4


def _slope_terms(stencil, mass, momentum, affine):
    """Terms of the sums of grad w (g . (a + A d, m)) along x, y and z, each (N,).

    Nothing is written to the grid here, and a node counts by one number per particle: the particle
    axis comes last, and the columns of a node's row are read one by one.
    """
    (wx, wy, wz), (sx, sy, sz) = stencil.weight, stencil.slope
    dx, dy, dz = stencil.distance

    def terms(a, nodes):
        w = s = z = 0.0
        for b in range(3):
            constant = momentum + dx[a] * affine[:, 0] + dy[b] * affine[:, 1]
            pairs = []
            for c in range(3):
                node, value = nodes[b][c], constant + dz[c] * affine[:, 2]
                pair = sum(node[:, i] * value[i] for i in range(3))
                pairs.append(pair if mass is None else pair + node[:, 3] * mass)
            weighted = sum(wz[c] * pairs[c] for c in range(3))
            w, s = w + wy[b] * weighted, s + sy[b] * weighted
            z = z + wy[b] * sum(sz[c] * pairs[c] for c in range(3))
        return sx[a] * w, wx[a] * s, wx[a] * z

    return terms, (jnp.zeros_like(wx[0]),) * 3


def _particle_last(sums, moments):
    """(4, N), and (3, 3, N) of the first three columns, from rows."""
    return sums.T, jnp.stack([moment.T[:3] for moment in moments], axis=1)


def _through_position(slopes, affine, sums):
    """Derivative (3, N) by x_p: through the weights, and through d = x_i - x_p."""
    return jnp.stack(slopes) - sum(affine[i] * sums[i] for i in range(3))


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _to_grid(static, origin, position, mass, momentum, affine):
    return _scatter(static, origin, position, mass, momentum, affine)


def _to_grid_forward(static, origin, position, mass, momentum, affine):
    rows = checkpoint_name(_scatter(static, origin, position, mass, momentum, affine), TRANSFERS)
    return rows, (origin, position, mass, momentum, affine)


def _to_grid_backward(static, kept, cotangent):
    origin, position, mass, momentum, affine = kept
    stencil = _stencil(static, origin, position)
    sum_terms, no_sums = _sum_terms(stencil)
    slope_terms, no_slopes = _slope_terms(stencil, mass, momentum, affine)
    # In one loop, for the sake of the rows read.
    (sums, *moments), slopes = _over_planes(
        static,
        stencil,
        cotangent,
        lambda a, nodes: (sum_terms(a, nodes), slope_terms(a, nodes)),
        (no_sums, no_slopes),
    )
    sums, moments = _particle_last(sums, moments)
    return None, _through_position(slopes, affine, sums), sums[3], sums[:3], moments


_to_grid.defvjp(_to_grid_forward, _to_grid_backward)


def _gather(static, origin, position, rows):
    """Sums of w g (4, N), and of w g d^T for the first three columns (3, 3, N)."""
    stencil = _stencil(static, origin, position)
    sums, *moments = _over_planes(static, stencil, rows, *_sum_terms(stencil))
    return _particle_last(sums, moments)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _to_particle(static, origin, position, rows):
    sums, moments = _gather(static, origin, position, rows)
    return sums[:3], moments


def _to_particle_forward(static, origin, position, rows):
    sums, moments = checkpoint_name(_gather(static, origin, position, rows), TRANSFERS)
    return (sums[:3], moments), (origin, position, rows, sums)


def _to_particle_backward(static, kept, cotangents):
    origin, position, rows, sums = kept
    velocity, moment = cotangents
    stencil = _stencil(static, origin, position)
    slopes = _over_planes(static, stencil, rows, *_slope_terms(stencil, None, velocity, moment))
    slope = _through_position(slopes, moment, sums)
    return None, slope, _scatter(static, origin, position, None, velocity, moment)


_to_particle.defvjp(_to_particle_forward, _to_particle_backward)
