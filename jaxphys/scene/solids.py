"""Obstacles as they are drawn: Gaussians on their surface, which move as they do."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.rotations import matrix_to_quaternion
from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.mpm.boundaries import Boundary, Obstacle

SPLATS = 6000
TRIED = 400_000
SHELL = 0.04  # of the reach: how near to the surface a point must lie to be moved onto it
LIGHT = np.array([0.35, -0.5, 0.8])  # in the axes of the solid, as if painted on


def solids_of(
    boundaries: tuple[Boundary, ...], colour: tuple[float, float, float], seed: int
) -> tuple[tuple[Gaussians, Obstacle], ...]:
    """What is drawn of prepared boundaries: of each obstacle that holds matter out its surface, in
    axes of its own, and the obstacle, which says where these are.
    """
    return tuple((surface(one, np.asarray(colour), seed), one) for one in drawn_of(boundaries))


def drawn_of(boundaries: tuple[Boundary, ...]) -> tuple[Obstacle, ...]:
    """The obstacles among prepared boundaries that are drawn, without what is of particles."""
    return tuple(one.shared() for one in boundaries if isinstance(one, Obstacle) and not one.inside)


def surface(obstacle: Obstacle, colour: np.ndarray, seed: int) -> Gaussians:
    """Flat Gaussians spread over the surface of an obstacle, in its own axes."""
    reach = float(obstacle.reach)
    points = np.random.default_rng(seed).uniform(-reach, reach, (3, TRIED)).astype(np.float32)
    distance, normal = (np.asarray(x) for x in _nearest(obstacle, jnp.asarray(points)))
    near = np.flatnonzero(np.abs(distance) < SHELL * reach)
    density = len(near) / (2 * SHELL * reach) * (2 * reach) ** 3 / TRIED  # that is, area
    near = near[:SPLATS]
    points = points[:, near] - distance[near] * normal[:, near]
    normal = normal[:, near].T
    size = 0.6 * np.sqrt(density / len(near))
    light = LIGHT / np.linalg.norm(LIGHT)
    shade = 0.75 + 0.25 * (normal @ light)
    axes = np.stack([*_across(normal), normal], axis=2)
    return from_points(
        points.T.astype(np.float32),
        np.clip(colour * shade[:, None], 0, 1),
        np.broadcast_to([size, size, 0.1 * size], (len(near), 3)),
        quaternions=matrix_to_quaternion(jnp.asarray(axes, jnp.float32)),
    )


@jax.jit
def _nearest(obstacle: Obstacle, points):
    (distance, normal), *_ = obstacle.sides(list(points))
    return distance, jnp.stack(normal)


def _across(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (N, 3) at right angles to normals (N, 3) and to each other."""
    other = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(normal, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normal, first)
