"""Quaternions (w, x, y, z) and rotation matrices, batch axis first."""

import jax.numpy as jnp
from jax import Array

_SMALL = 1e-8  # squares of angles below which two terms of a series are exact


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


def quaternion_product(p: Array, q: Array) -> Array:
    """The quaternion (..., 4) that turns by q first and by p then."""
    pw, px, py, pz = jnp.moveaxis(p, -1, 0)
    qw, qx, qy, qz = jnp.moveaxis(q, -1, 0)
    return jnp.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def rotation_vector_to_quaternion(vectors: Array) -> Array:
    """Unit quaternions (..., 4) that turn about vectors (..., 3) by their length [rad]; smooth at
    zero.
    """
    squared = jnp.sum(vectors**2, axis=-1, keepdims=True)
    small = squared < _SMALL
    angle = jnp.sqrt(jnp.where(small, 1.0, squared))
    share = jnp.where(small, 0.5 - squared / 48, jnp.sin(0.5 * angle) / angle)
    real = jnp.where(small, 1 - squared / 8, jnp.cos(0.5 * angle))
    return jnp.concatenate([real, share * vectors], axis=-1)


def quaternion_to_rotation_vector(quaternions: Array) -> Array:
    """Axis times angle [rad] (..., 3) of unit quaternions (..., 4), the shorter way round; smooth
    at the identity.
    """
    quaternions = jnp.where(quaternions[..., :1] < 0, -quaternions, quaternions)
    real, vectors = quaternions[..., :1], quaternions[..., 1:]
    squared = jnp.sum(vectors**2, axis=-1, keepdims=True)
    small = squared < _SMALL
    length = jnp.sqrt(jnp.where(small, 1.0, squared))
    far = 2 * jnp.arctan2(length, jnp.where(small, 1.0, real)) / length
    one = jnp.where(small, real, 1.0)
    return jnp.where(small, 2 / one - 2 * squared / (3 * one**3), far) * vectors
