"""Real spherical harmonics up to degree 3, in the basis and signs of 3D Gaussian splatting files.

The order is degree by degree, `m = -l .. l` within each; the Condon-Shortley sign is kept, so that
the degree 1 functions are `-y, z, -x` times a constant (Kerbl et al. 2023, 3D Gaussian Splatting).
The functions are orthonormal on the unit sphere.
"""

import math
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra

Numbers = TypeVar("Numbers", Array, np.ndarray)
DC = 0.28209479177387814
_DEGREE_1 = 0.4886025119029199
_DEGREE_2 = (
    1.0925484305920792,
    -1.0925484305920792,
    0.31539156525252005,
    -1.0925484305920792,
    0.5462742152960396,
)
_DEGREE_3 = (
    -0.5900435899266435,
    2.890611442640554,
    -0.4570457994644658,
    0.3731763325901154,
    -0.4570457994644658,
    1.445305721320277,
    -0.5900435899266435,
)
MAX_DEGREE = 3


def degree_of(count: int) -> int:
    """The degree that has `count` coefficients; ValueError unless it is 1, 4, 9 or 16."""
    degree = math.isqrt(count) - 1
    if (degree + 1) ** 2 != count or not 0 <= degree <= MAX_DEGREE:
        raise ValueError(f"{count} harmonic coefficients: expected 1, 4, 9 or 16")
    return degree


def _basis_list(x, y, z, degree: int) -> list:
    basis = [x * 0 + DC]
    if degree >= 1:
        basis += [-_DEGREE_1 * y, _DEGREE_1 * z, -_DEGREE_1 * x]
    if degree >= 2:
        a, b, c, d, e = _DEGREE_2
        xx, yy, zz = x * x, y * y, z * z
        basis += [a * x * y, b * y * z, c * (2 * zz - xx - yy), d * x * z, e * (xx - yy)]
    if degree >= 3:
        a, b, c, d, e, f, g = _DEGREE_3
        basis += [
            a * y * (3 * xx - yy),
            b * x * y * z,
            c * y * (4 * zz - xx - yy),
            d * z * (2 * zz - 3 * xx - 3 * yy),
            e * x * (4 * zz - xx - yy),
            f * z * (xx - yy),
            g * x * (xx - 3 * yy),
        ]
    return basis


def basis(directions: Array, degree: int) -> Array:
    """Values of the (degree + 1)^2 functions at unit `directions` (..., 3), shape (..., K)."""
    x, y, z = directions[..., 0], directions[..., 1], directions[..., 2]
    return jnp.stack(_basis_list(x, y, z, degree), axis=-1)


@jax.jit
def evaluate(harmonics: Array, directions: Array) -> Array:
    """Values (N, 3) of the functions `harmonics` (N, K, 3) at unit `directions` (N, 3)."""
    degree = degree_of(harmonics.shape[-2])
    if degree == 0:
        return DC * harmonics[..., 0, :]
    x, y, z = (directions[..., axis, None] for axis in range(3))
    terms = _basis_list(x, y, z, degree)
    return algebra.total(term * harmonics[..., index, :] for index, term in enumerate(terms))


def _projections() -> list[tuple[np.ndarray, np.ndarray]]:
    """For each degree l: 2l + 1 directions, and the matrix from values there to coefficients.

    The directions are those of a spiral over the sphere, greedily picked so that the basis matrix
    (2l + 1 square) is well conditioned: each new one is farthest from the span of those before it.
    """
    index = np.arange(200) + 0.5
    z, turn = 1 - 2 * index / 200, np.pi * (1 + math.sqrt(5)) * index
    radius = np.sqrt(1 - z * z)
    spiral = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1)
    values = np.stack(_basis_list(spiral[:, 0], spiral[:, 1], spiral[:, 2], MAX_DEGREE), axis=-1)
    result = []
    for degree in range(MAX_DEGREE + 1):
        remaining = values[:, degree**2 : (degree + 1) ** 2].copy()
        chosen: list[int] = []
        for _ in range(2 * degree + 1):
            length = np.linalg.norm(remaining, axis=-1)
            length[chosen] = -1
            chosen.append(int(np.argmax(length)))
            unit = remaining[chosen[-1]] / length[chosen[-1]]
            remaining -= (remaining @ unit)[:, None] * unit
        block = values[chosen, degree**2 : (degree + 1) ** 2]
        result.append((spiral[chosen], np.linalg.inv(block)))
    return result


_PROJECTIONS = _projections()


@jax.jit
def rotate(harmonics: Array, rotations: Array) -> Array:
    """Coefficients of the turned functions: evaluate(rotated, d) = evaluate(harmonics, R^T d).

    Each degree is a space that rotations map to itself, so the turned function is known from its
    values in 2l + 1 directions: they are sampled and projected back. Exact up to round-off, and
    differentiable in both arguments.

    Args:
        harmonics: (N, K, 3), K = 1, 4, 9 or 16.
        rotations: (N, 3, 3), or (3, 3) for one rotation of all.
    """
    degree = degree_of(harmonics.shape[-2])
    if degree == 0:
        return harmonics
    rotations = jnp.broadcast_to(rotations, (*harmonics.shape[:-2], 3, 3))
    parts = [harmonics[..., :1, :]]
    for order in range(1, degree + 1):
        directions, projection = _PROJECTIONS[order]
        # (..., S, 3): rows of directions times R are R^T d.
        turned = algebra.total(
            jnp.asarray(directions[:, axis, None], harmonics.dtype) * rotations[..., axis, None, :]
            for axis in range(3)
        )
        first, last = order**2, (order + 1) ** 2
        sampled = basis(turned, order)[..., first:]
        block = harmonics[..., first:last, :]
        values = jnp.einsum(
            "...sk,...kc->...sc", sampled, block, precision=jax.lax.Precision.HIGHEST
        )
        matrix = jnp.asarray(projection, harmonics.dtype)
        parts.append(
            jnp.einsum("ks,...sc->...kc", matrix, values, precision=jax.lax.Precision.HIGHEST)
        )
    return jnp.concatenate(parts, axis=-2)


def rgb_to_dc(rgb: Array) -> Array:
    """The degree 0 coefficient of a constant colour: (rgb - 0.5) / Y0."""
    return (rgb - 0.5) / DC


def dc_to_rgb(dc: Numbers) -> Numbers:
    """The constant colour of a degree 0 coefficient; not clipped to [0, 1]."""
    return dc * DC + 0.5
