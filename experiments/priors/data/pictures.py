"""The pixel prior's pictures: an object's points as Gaussians, drawn as the guidance draws them."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.gaussians.gaussians import from_points
from jaxphys.guidance.pictures import neighbour_sizes, view_picture
from jaxphys.render import next_capacity

SIZE, LARGEST, OPACITY = 0.6, 0.04, 0.95  # of the Gaussians: see `neighbour_sizes`
FIRST_CAPACITY = 1 << 14


@partial(jax.jit, static_argnames="capacity")
def _draw(points, colours, sizes, azimuth, elevation, capacity):
    """Premultiplied RGBA (V, 64, 64, 4) and the pairs of splat and tile needed, (V,)."""
    gaussians = from_points(points, colours, sizes, opacity=OPACITY)

    def one(view):
        image = view_picture(gaussians, *view, 0.0, capacity)
        return jnp.concatenate([image.colour, image.alpha[..., None]], -1), image.required

    return jax.lax.map(one, (azimuth, elevation))


def pictures(points, colours, azimuth, elevation) -> np.ndarray:
    """RGBA uint8 (V, 64, 64, 4), straight alpha.

    points: (N, 3) in the object's frame; colours: (N, 3) uint8; azimuth, elevation: (V,) [rad].
    """
    points = np.asarray(points, np.float32)
    sizes = neighbour_sizes(points, SIZE, LARGEST)
    colours = np.asarray(colours, np.float32) / 255
    views = np.asarray(azimuth, np.float32), np.asarray(elevation, np.float32)
    capacity = FIRST_CAPACITY
    while True:
        images, required = _draw(points, colours, sizes, *views, capacity)
        if int(required.max()) <= capacity:
            return straight(np.asarray(images))
        capacity = next_capacity(int(required.max()))


def straight(premultiplied: np.ndarray) -> np.ndarray:
    """Premultiplied float RGBA in [0, 1] to straight uint8 RGBA; colour 0 where alpha is 0."""
    alpha = premultiplied[..., 3:]
    colour = premultiplied[..., :3] / np.maximum(alpha, 1e-6)
    image = np.concatenate([np.where(alpha > 0, colour, 0), alpha], -1)
    return np.rint(255 * np.clip(image, 0, 1)).astype(np.uint8)
