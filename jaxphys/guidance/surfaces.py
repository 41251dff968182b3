"""From a cloud of points near a surface to as many points as one likes on it."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from jaxphys.gaussians.surface import SurfaceSamples, even_samples

NEIGHBOURS = 30  # that a piece of surface is laid through
STEPS = 3  # of the cloud towards its pieces
SPARE = 2.0  # places tried for each one kept
VOTES = 5  # nearest points that a colour is chosen from
STIFF = 1e-3  # how much the pieces are kept from bending, against noise


class Pieces(NamedTuple):
    """The surface near each of M places: the foot (M, 3) of the place on it, unit normals up to
    sign (M, 3), two axes along it (M, 3, 2), and how much of a surface there is (M,), from 0 (as
    thick as narrow) to 1.
    """

    feet: np.ndarray
    normals: np.ndarray
    axes: np.ndarray
    flat: np.ndarray


def local_pieces(cloud: np.ndarray, places: np.ndarray) -> Pieces:
    """Of a cloud (N, 3) the quadratic piece of surface near each of the places (M, 3): moving least
    squares (Alexa et al. 2003), in the frame of weighted principal components. Neighbours count
    less the farther they are. Planes alone would pull round things inward.
    """
    count = min(NEIGHBOURS, len(cloud))
    distance, near = (a.reshape(len(places), count) for a in cKDTree(cloud).query(places, k=count))
    reach = distance[:, -1:] + 1e-12
    weight = np.exp(-2 * (distance / reach) ** 2)
    weight /= weight.sum(1, keepdims=True)
    middle = np.einsum("nk,nkc->nc", weight, cloud[near])
    offset = cloud[near] - middle[:, None]
    values, vectors = np.linalg.eigh(np.einsum("nk,nkc,nkd->ncd", weight, offset, offset))
    flat = 1 - values[:, 0] / np.maximum(values[:, 1], 1e-20)
    # Height over the plane as a quadratic function of where, in units of the reach.
    frame = vectors / reach[:, None]
    local = np.einsum("nkc,ncd->nkd", offset, frame)
    basis = _quadratic(local[..., 1], local[..., 2])
    left = np.einsum("nk,nki,nkj->nij", weight, basis, basis)
    left += STIFF * np.diag([0, 0, 0, 1.0, 1, 1]) + 1e-9 * np.eye(6)
    right = np.einsum("nk,nki,nk->ni", weight, basis, local[..., 0])
    bend = np.linalg.solve(left, right[..., None])[..., 0]
    own = np.einsum("nc,ncd->nd", places - middle, frame)
    u, v = own[:, 1], own[:, 2]
    height = (bend * _quadratic(u, v)).sum(1) - own[:, 0]
    slope = np.stack(
        [
            np.ones_like(u),
            -(bend[:, 1] + 2 * bend[:, 3] * u + bend[:, 4] * v),
            -(bend[:, 2] + bend[:, 4] * u + 2 * bend[:, 5] * v),
        ],
        -1,
    )
    normals = np.einsum("ncd,nd->nc", vectors, slope)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    feet = places + (height * reach[:, 0])[:, None] * vectors[:, :, 0]
    return Pieces(feet, normals, vectors[:, :, 1:], flat)


def _quadratic(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], -1)


def towards_surface(cloud: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places (M, 3) moved onto the surface of the cloud, less where it is none."""
    pieces = local_pieces(cloud, places)
    return places + pieces.flat[:, None] * (pieces.feet - places)


def medoid_colours(colours: np.ndarray) -> np.ndarray:
    """Of each row of colours (N, K, 3) the one that is nearest to the others: (N, 3). A mean would
    blur what lies along an edge."""
    apart = np.linalg.norm(colours[:, :, None] - colours[:, None], axis=-1).sum(-1)
    return np.take_along_axis(colours, apart.argmin(1)[:, None, None], 1)[:, 0]


def surface_of_cloud(
    points: np.ndarray, colours: np.ndarray, count: int, seed: int = 0
) -> SurfaceSamples:
    """`count` evenly spread points of the surface near which points (N, 3) with colours (N, 3) in
    [0, 1] lie; normals up to sign. Scatter off the surface is taken for noise.
    """
    rng = np.random.default_rng(seed)
    cloud = np.asarray(points, float)
    for _ in range(STEPS):
        cloud = towards_surface(cloud, cloud)
    wanted = int(np.ceil(SPARE * count))
    base = cloud[rng.permutation(np.arange(wanted) % len(cloud))]
    axes = local_pieces(cloud, base).axes
    reach = cKDTree(cloud).query(base, k=min(7, len(cloud)))[0].reshape(wanted, -1)[:, -1]
    # Evenly over a disc that reaches the neighbours.
    radius, angle = reach * np.sqrt(rng.random(wanted)), 2 * np.pi * rng.random(wanted)
    step = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)
    places = towards_surface(cloud, base + np.einsum("nck,nk->nc", axes, step))
    normals = local_pieces(cloud, places).normals
    votes = min(VOTES, len(cloud))
    near = cKDTree(cloud).query(places, k=votes)[1].reshape(wanted, votes)
    chosen = medoid_colours(np.asarray(colours, float)[near])
    return even_samples(places, normals, chosen, count, oriented=False)
