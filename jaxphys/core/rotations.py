"""Quaternions (w, x, y, z) and rotation matrices, batch axis first."""

import jax.numpy as jnp
from jax import Array


def normalise_quaternion(quaternions: Array) -> Array:
    """Unit quaternions of shape (..., 4); a zero quaternion becomes the identity, with zero
    gradient.
    """
    squared = jnp.sum(quaternions**2, axis=-1, keepdims=True)
    usable = squared > 1e-24
    length = jnp.sqrt(jnp.where(usable, squared, 1.0))
    identity = jnp.array([1.0, 0.0, 0.0, 0.0], quaternions.dtype)
    return jnp.where(usable, quaternions / length, identity)


def quaternion_to_matrix(quaternions: Array) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), which need not have unit length."""
    w, x, y, z = jnp.moveaxis(normalise_quaternion(quaternions), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def matrix_to_quaternion(matrices: Array) -> Array:
    """Unit quaternions (..., 4) with w >= 0 of rotation matrices (..., 3, 3).

    Of the four candidate formulas (Shepperd 1978) the one with the largest divisor is taken, so
    none divides by a small number.
    """
    m = matrices
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    yz, zx, xy = (
        m[..., 2, 1] - m[..., 1, 2],
        m[..., 0, 2] - m[..., 2, 0],
        m[..., 1, 0] - m[..., 0, 1],
    )
    sxy, szx, syz = (
        m[..., 1, 0] + m[..., 0, 1],
        m[..., 0, 2] + m[..., 2, 0],
        m[..., 2, 1] + m[..., 1, 2],
    )
    candidates = jnp.stack(
        [
            jnp.stack([1 + xx + yy + zz, yz, zx, xy], -1),
            jnp.stack([yz, 1 + xx - yy - zz, sxy, szx], -1),
            jnp.stack([zx, sxy, 1 - xx + yy - zz, syz], -1),
            jnp.stack([xy, szx, syz, 1 - xx - yy + zz], -1),
        ],
        axis=-2,
    )
    largest = jnp.argmax(jnp.stack([xx + yy + zz, xx, yy, zz], -1), axis=-1)
    chosen = jnp.take_along_axis(candidates, largest[..., None, None], axis=-2)[..., 0, :]
    unit = chosen / jnp.linalg.norm(chosen, axis=-1, keepdims=True)
    return jnp.where(unit[..., :1] < 0, -unit, unit)


def axis_angle_to_matrix(axis: Array, angle: Array) -> Array:
    """Rotation by `angle` [rad] about `axis` (3,), which need not have unit length. Shape (3, 3).
    Rodrigues' formula.
    """
    x, y, z = axis / jnp.linalg.norm(axis)
    zero = jnp.zeros_like(x)
    K = jnp.stack([jnp.stack([zero, -z, y]), jnp.stack([z, zero, -x]), jnp.stack([-y, x, zero])])
    return jnp.eye(3, dtype=K.dtype) + jnp.sin(angle) * K + (1 - jnp.cos(angle)) * (K @ K)
