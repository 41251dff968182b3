"""The two sums over the nodes i of each particle p, their tangents and their transposes.

With weight w and distance d = x_i - x_p:

    to the grid       g_i = sum_p w (a_p + A_p d,  m_p)
    to the particles  v_p = sum_i w v_i,   B_p = sum_i w v_i d^T

The transpose of the first is the second and the other way round; derivatives by x_p go through w
and d. Automatic differentiation would store 27 of everything and turn every gather into a scatter.

Vectors have three numbers of momentum, and up to four more of what else is shared by mass: what
momentum was before forces acted (three, where a scheme needs two fields), what volume changed by
(one). Of the grid they are columns 0 to 2 and 4 to 7, as far as there are any; column 3 is mass.

Layout: rows of four or eight numbers, one per node and, inside the transfers, one per particle, so
that a node's row is read, scaled and added as one short vector. A loop over the planes of the
stencil, nine rows each of a quadratic kernel, keeps the compiled program small and makes XLA store
the weights rather than compute them for each row again (docs/performance.md).
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.transfer.stencil import Stencil, Window

COLUMN = (0, 1, 2, 4, 5, 6, 7)  # of each number of a vector


def scatter(
    window: Window, at: Stencil, rows: Array, mass: Array | None, momentum: Array, affine: Array
) -> Array:
    """`rows` and what particles give to them: momentum [kg m/s] and mass [kg] of nodes (M, 4), or
    (M, 8) where vectors have more than three numbers.

    Args:
        window: whose nodes the rows are, x slowest.
        at: the particles' stencils in it.
        rows: (M, 4) or (M, 8) to add to.
        mass: (N,) [kg], or None for zero.
        momentum: (3, N) [kg m/s], the value at the particle, or (V, N) with V up to 7.
        affine: (3, 3, N) or (V, 3, N) [kg/s], what momentum changes by per metre: with quadratic
            splines m C - dt V 4/dx^2 tau for MLS-MPM (Hu et al. 2018, eq. 29).
    """
    width = window.kernel.width
    gifts = _gifts(width, at.weight, at.moment, _rows(momentum, mass), [*_columns(affine)])
    return _add_planes(window, at, rows, gifts)


def scatter_tangent(
    window: Window, at: Stencil, rows: Array, given: tuple, moved: Array, of_given: tuple
) -> Array:
    """`rows` and the tangent (M, 4) or (M, 8) of what particles give to them in `scatter`.

    given: mass, momentum and affine; moved: tangent (3, N) of the position; of_given: of the three.
    """
    width = window.kernel.width
    inputs, tangents = (
        (weight, moment, _rows(momentum, mass), [*_columns(affine)])
        for (weight, moment), (mass, momentum, affine) in (
            ((at.weight, at.moment), given),
            (_moved(at, moved), of_given),
        )
    )

    def gifts(a):
        return jax.jvp(lambda *numbers: [*_gifts(width, *numbers)(a)], inputs, tangents)[1]

    return _add_planes(window, at, rows, gifts)


def gather(window: Window, at: Stencil, rows: Array) -> tuple[Array, Array]:
    """Sums of w g (4, N), and of w g d^T for the vector in it (3, 3, N), of rows g (M, 4); of rows
    (M, 8) they are (8, N) and (7, 3, N), whatever of them is used.

    Of velocities [m/s] these are the particle's and its first moment B [m^2/s]; C = 4 / dx^2 B with
    quadratic splines (Jiang et al. 2015).
    """
    sums, *moments = _over_planes(window, at, rows, *_sum_terms(window, at, rows.shape[1]))
    return _particle_last(sums, moments)


def gather_tangent(
    window: Window, at: Stencil, rows: Array, moved: Array, of_rows: Array
) -> tuple[Array, Array]:
    """Tangent of `gather`, from those of the position (3, N) and of the rows."""
    weights, rates = (at.weight, at.moment), _moved(at, moved)
    columns = rows.shape[1]
    halves = slice(0, columns), slice(columns, 2 * columns)

    def terms(a, nodes):
        # Both rows of a node lie side by side, so that they are read as one.
        inner, outer = ([[node[:, half] for node in line] for line in nodes] for half in halves)

        def of(weights, nodes):
            where = at._replace(weight=weights[0], moment=weights[1])
            return _sum_terms(window, where, columns)[0](a, nodes)

        return jax.jvp(of, (weights, inner), (rates, outer))[1]

    both = jnp.concatenate([rows, of_rows], axis=1)
    sums, *moments = _over_planes(window, at, both, terms, _sum_terms(window, at, columns)[1])
    return _particle_last(sums, moments)


def scatter_transpose(
    window: Window, at: Stencil, rows: Array, mass: Array, momentum: Array, affine: Array
) -> tuple[Array, Array, Array, Array]:
    """Cotangents of position, mass, momentum and affine of `scatter`, from those of the rows.

    In one loop, for the sake of the rows read.
    """
    sum_terms, no_sums = _sum_terms(window, at, rows.shape[1])
    slope_terms, no_slopes = _slope_terms(window, at, mass, momentum, affine)
    (sums, *moments), slopes = _over_planes(
        window,
        at,
        rows,
        lambda a, nodes: (sum_terms(a, nodes), slope_terms(a, nodes)),
        (no_sums, no_slopes),
    )
    sums, moments = _particle_last(sums, moments)
    count = len(momentum)
    to_position = _through_position(slopes, affine, sums, COLUMN)
    return to_position, sums[3], vectors_of(sums)[:count], moments[:count]


def gather_slopes(
    window: Window, at: Stencil, rows: Array, vectors: Array, velocity: Array, moment: Array
) -> Array:
    """Cotangent (3, N) of position of `gather`, from those of its vector, velocity first, (V, N),
    and moment (V, 3, N).

    rows: what was gathered from; vectors: those of the sums that `gather` gave, at least as many.
    The cotangent of the rows is `scatter` of the same two.
    """
    slopes = _over_planes(window, at, rows, *_slope_terms(window, at, None, velocity, moment))
    return _through_position(slopes, moment, vectors, range(len(moment)))


def vectors_of(sums: Array) -> Array:
    """The vectors (3, N) or (7, N) in sums (4, N) or (8, N)."""
    return sums[:3] if len(sums) == 4 else jnp.concatenate([sums[:3], sums[4:]])


def _moved(at, moved):
    """Tangents of a stencil's weights and moments, from that of the position (3, N)."""
    rate = at.slope * moved[:, None]
    return rate, rate * at.distance - at.weight * moved[:, None]


def _columns(affine):
    return (_rows(affine[:, axis]) for axis in range(3))


def _gifts(width, weight, moment, value, along):
    """What particles give to the nodes of a plane, (N, 4) or (N, 8) each, z fastest."""
    (wx, wy, wz), (mx, my, mz) = weight[..., None], moment[..., None]

    def gifts(a):
        for b in range(width):
            w = wx[a] * wy[b]
            constant = w * value + mx[a] * wy[b] * along[0] + wx[a] * my[b] * along[1]
            for c in range(width):
                yield wz[c] * constant + mz[c] * w * along[2]

    return gifts


def _add_planes(window, at, rows, gifts):
    """`rows` and, plane by plane of the stencil, what `gifts(a)` gives to its nodes."""
    width = window.kernel.width
    plane, line = window.shape[1] * window.shape[2], window.shape[2]

    def add_plane(a, rows):
        first = at.row + a * plane
        for i, new in enumerate(gifts(a)):
            rows = rows.at[first + (i // width * line + i % width)].add(
                new, mode="promise_in_bounds", wrap_negative_indices=False
            )
        return rows

    return jax.lax.fori_loop(0, width, add_plane, rows)


def _rows(vectors: Array, last: Array | None = None) -> Array:
    """Rows (N, 4) from (3, N) and a fourth column, 0 by default; (N, 8) from more than three."""
    last = jnp.zeros_like(vectors[0]) if last is None else last
    if len(vectors) == 3:
        return jnp.concatenate([vectors, last[None]]).T
    void = jnp.zeros((len(COLUMN) - len(vectors), *vectors.shape[1:]), vectors.dtype)
    return jnp.concatenate([vectors[:3], last[None], vectors[3:], void]).T


def _read(rows, index):
    return rows.at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)


def _over_planes(window, at, rows, terms, nothing):
    """Sum over the planes a of the stencil of `terms(a, nodes)`, where nodes[b][c] are the rows
    (N, 4) at node (a, b, c) of each particle; `nothing` is the zero to start from.
    """
    width = window.kernel.width
    plane, line = window.shape[1] * window.shape[2], window.shape[2]

    def add_plane(a, totals):
        first = at.row + a * plane
        nodes = [[_read(rows, first + (b * line + c)) for c in range(width)] for b in range(width)]
        return jax.tree.map(jnp.add, totals, terms(a, nodes))

    return jax.lax.fori_loop(0, width, add_plane, nothing)


def _sum_terms(window, at, columns):
    """Terms of the sums of w g and of w g d along x, y and z, each (N, columns)."""
    width = window.kernel.width

    def terms(a, nodes):
        (wx, wy, wz), (mx, my, mz) = at.weight[..., None], at.moment[..., None]
        w = m = z = 0.0
        for b in range(width):
            along = sum(wz[c] * nodes[b][c] for c in range(width))
            w, m = w + wy[b] * along, m + my[b] * along
            z = z + wy[b] * sum(mz[c] * nodes[b][c] for c in range(width))
        return wx[a] * w, mx[a] * w, wx[a] * m, wx[a] * z

    return terms, (jnp.zeros((len(at.row), columns), at.weight.dtype),) * 4


def _slope_terms(window, at, mass, momentum, affine):
    """Terms of the sums of grad w (g . (a + A d, m)) along x, y and z, each (N,).

    Nothing is written to the grid here, and a node counts by one number per particle: the particle
    axis comes last, and the columns of a node's row are read one by one.
    """
    width = window.kernel.width
    (wx, wy, wz), (sx, sy, sz) = at.weight, at.slope
    dx, dy, dz = at.distance

    def terms(a, nodes):
        w = s = z = 0.0
        for b in range(width):
            constant = momentum + dx[a] * affine[:, 0] + dy[b] * affine[:, 1]
            pairs = []
            for c in range(width):
                node, value = nodes[b][c], constant + dz[c] * affine[:, 2]
                pair = sum(node[:, COLUMN[i]] * value[i] for i in range(len(momentum)))
                pairs.append(pair if mass is None else pair + node[:, 3] * mass)
            weighted = sum(wz[c] * pairs[c] for c in range(width))
            w, s = w + wy[b] * weighted, s + sy[b] * weighted
            z = z + wy[b] * sum(sz[c] * pairs[c] for c in range(width))
        return sx[a] * w, wx[a] * s, wx[a] * z

    return terms, (jnp.zeros_like(wx[0]),) * 3


def _particle_last(sums, moments):
    """(4, N) or (8, N), and (3, 3, N) or (7, 3, N) of the vectors, from rows."""
    return sums.T, jnp.stack([vectors_of(moment.T) for moment in moments], axis=1)


def _through_position(slopes, affine, sums, column):
    """Derivative (3, N) by x_p: through the weights, and through d = x_i - x_p; column: where in
    the sums each number of a vector is.
    """
    return jnp.stack(slopes) - sum(affine[i] * sums[column[i]] for i in range(len(affine)))
