"""Gaussians to be written, and what of them a file may change, in the terms of each format."""

import jax.numpy as jnp
import numpy as np

from jaxphys.gaussians import Gaussians

UP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)  # (x, y, z) -> (x, z, -y)


def cloud(count=700, degree=3, seed=0, spread=1.0):
    """Gaussians of every kind that the formats hold without cutting anything off."""
    random = np.random.default_rng(seed)
    # A rotation may make one coefficient of all seven of degree 3, which SPZ cuts off at 1.
    harmonics = random.uniform(-0.35, 0.35, (count, (degree + 1) ** 2, 3))
    parts = (
        spread * random.normal(size=(count, 3)),
        random.uniform(-8, 0, (count, 3)),
        random.normal(size=(count, 4)) * random.uniform(0.5, 2, (count, 1)),
        random.uniform(-5, 5, count),
        harmonics,
    )
    return Gaussians(*(jnp.asarray(part, jnp.float32) for part in parts))


def unit(quaternions):
    quaternions = np.asarray(quaternions, float)
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def opacity(gaussians):
    return 1 / (1 + np.exp(-np.asarray(gaussians.opacity_logits, float)))


def angles(p, q):
    """Degrees of the turns between quaternions, whatever their signs."""
    return angles_signed(p, np.where(np.sum(unit(p) * unit(q), 1, keepdims=True) < 0, -1, 1) * q)


def angles_signed(p, q):
    """Degrees of the turns that a player takes from one quaternion to the other."""
    half = np.linalg.norm(unit(p) - unit(q), axis=1) / 2
    return np.degrees(4 * np.arcsin(np.clip(half, 0, 1)))


def rotation(quaternions):
    """Matrices, column by column as q e q*, written out here once more."""
    w, v = unit(quaternions)[:, :1], unit(quaternions)[:, 1:]
    columns = []
    for e in np.eye(3):
        t = 2 * np.cross(v, np.broadcast_to(e, v.shape))
        columns.append(e + w * t + np.cross(v, t))
    return np.stack(columns, axis=2)


def covariances(gaussians):
    scales = np.exp(np.asarray(gaussians.log_scales, float))
    axes = rotation(gaussians.quaternions) * scales[:, None]
    return axes @ np.swapaxes(axes, 1, 2)
