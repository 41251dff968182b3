"""Points on the surface that a decoded field has: as many as one likes, without scatter."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array, lax

from jaxphys.core.errors import InputError
from jaxphys.gaussians.thinning import thin
from jaxphys.guidance.bundled.shape_autoencoder import ShapeAutoencoder

CHUNK = 8192  # places asked at a time
SPARE = 2.0  # points projected for each one kept
STEPS = 4  # towards the surface, Newton's
CLOSE = 2e-3  # points that end farther from the surface are dropped


class SurfacePoints(NamedTuple):
    """Points (N, 3) in the object frame, outward unit normals (N, 3), colours (N, 3) in [0, 1]."""

    points: np.ndarray
    normals: np.ndarray
    colours: np.ndarray


def _slopes(
    network: ShapeAutoencoder, features: Array, places: Array
) -> tuple[Array, Array, Array]:
    """Distance (Q,), its gradient (Q, 3) and the colour (Q, 3) at places (Q, 3)."""

    def total(places: Array) -> tuple[Array, tuple[Array, Array]]:
        distance, colour = network.field(features[None], places[None])
        return distance.sum(), (distance[0], colour[0])

    (_, (distance, colour)), gradient = jax.value_and_grad(total, has_aux=True)(places)
    return distance, gradient, colour


@nnx.jit
def _grid_distances(network: ShapeAutoencoder, features: Array, places: Array) -> Array:
    ask = lambda chunk: network.field(features[None], chunk[None]).distance[0]  # noqa: E731
    return lax.map(ask, places)


@nnx.jit
def _project(network: ShapeAutoencoder, features: Array, places: Array):
    """Places (K, chunk, 3) moved onto the surface, with what is left, normals and colours there."""

    def onto(chunk: Array):
        def step(chunk: Array, _: None) -> tuple[Array, None]:
            distance, gradient, _colour = _slopes(network, features, chunk)
            square = jnp.sum(gradient**2, -1, keepdims=True)
            return chunk - distance[:, None] * gradient / jnp.maximum(square, 0.25), None

        chunk, _ = lax.scan(step, chunk, length=STEPS)
        distance, gradient, _ = _slopes(network, features, chunk)
        normal = gradient / (jnp.linalg.norm(gradient, axis=-1, keepdims=True) + 1e-9)
        # The field's zero lies outside of the surface by the thickness, where sheets have two.
        chunk = chunk - network.config.thickness * normal
        colour = network.field(features[None], chunk[None]).colour[0]
        return chunk, distance, normal, colour

    return lax.map(onto, places)


def _chunks(places: np.ndarray) -> np.ndarray:
    """(N, 3) as (K, CHUNK, 3), the last rows repeated."""
    rows = np.arange(-(-len(places) // CHUNK) * CHUNK)
    return places[np.minimum(rows, len(places) - 1)].reshape(-1, CHUNK, 3)


def surface_points(
    network: ShapeAutoencoder, latents: Array, count: int, seed: int = 0
) -> SurfacePoints:
    """`count` evenly spread points of the surface that `latents` (latents, channels) stand for.

    Raises InputError where the field has no surface.
    """
    rng = np.random.default_rng(seed)
    features = network.unfold(latents[None])[0]
    half, grid = network.config.half, network.config.grid
    size = 2 * half / grid
    axis = (np.arange(grid) + 0.5) * size - half
    centres = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    centres = centres.astype(np.float32)
    found = np.asarray(_grid_distances(network, features, jnp.asarray(_chunks(centres)))).reshape(
        -1
    )
    near = np.flatnonzero(np.abs(found[: len(centres)]) < 0.9 * size)
    if len(near) == 0:
        raise InputError("the shape that was drawn has no surface; try another seed")
    # At least a whole chunk; a power of two of them, so that few programs are compiled.
    wanted = CHUNK << max(0, int(np.ceil(np.log2(SPARE * count / CHUNK))))
    cells = near[rng.permutation(np.arange(wanted) % len(near))]
    places = centres[cells] + size * rng.uniform(-0.5, 0.5, (wanted, 3)).astype(np.float32)
    points, left, normals, colours = (
        np.asarray(a).reshape(wanted, -1)
        for a in _project(network, features, jnp.asarray(places.reshape(-1, CHUNK, 3)))
    )
    kept = np.flatnonzero((np.abs(left[:, 0]) < CLOSE) & (np.abs(points).max(1) < half))
    if len(kept) == 0:
        raise InputError("the shape that was drawn has no surface; try another seed")
    kept = kept[thin(points[kept], count)]
    return SurfacePoints(points[kept], normals[kept], colours[kept])
