"""Small scenes that the tests of the renderer share."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.core.splats import Splats
from jaxphys.render import look_at


def random_splats(count, seed=0, *, size=0.06, spread=0.5, channels=3, opacity=(0.1, 1.0)):
    """Anisotropic splats in a ball about the origin, float64."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    means = directions * spread * rng.random((count, 1)) ** (1 / 3)
    scales = size * np.exp(rng.normal(size=(count, 3)) * 0.6)
    R = np.asarray(quaternion_to_matrix(jnp.array(rng.normal(size=(count, 4)))))
    covariances = np.einsum("nij,nj,nkj->nik", R, scales**2, R)
    return Splats(
        jnp.array(means),
        jnp.array(covariances),
        jnp.array(rng.uniform(*opacity, size=count)),
        jnp.array(rng.random((count, channels))),
    )


def test_camera(width=45, height=37, dtype=jnp.float64, eye=(1.2, -1.5, 0.8)):
    """A camera near the ball, its principal point off the middle and its pixels not square."""
    camera = look_at(jnp.array(eye, dtype), (0.0, 0.05, 0.0), width=width, height=height)
    stretch = jnp.array([1.0, 1.1], dtype)
    shift = jnp.array([2.3, -1.7], dtype)
    return jax.tree.map(
        lambda leaf: leaf.astype(dtype),
        camera.__class__(
            camera.rotation,
            camera.translation,
            camera.focal * stretch,
            camera.centre + shift,
            width,
            height,
        ),
    )


test_camera.__test__ = False


def cast(tree, dtype):
    """Every array of a pytree in another floating type."""
    return jax.tree.map(lambda leaf: leaf.astype(dtype), tree)
