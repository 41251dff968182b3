"""What stands behind the object: a floor that fades into the background, with a soft shadow.

The floor is a plane seen by each pixel, not made of splats: it costs the same at any distance, has
no seams, and never hides what stands on it. Its fading is so slow that steps of one level of 8 bits
show as rings; half a level of noise breaks them up.
"""

from functools import partial, reduce

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.render.camera import Camera, position

CELLS = 96  # of the shadow map, a side
CLOSING = 2  # half the width of gaps between points that are closed [cells]
BLUR = (1.5, 5.0)  # standard deviations of the contact and of the wide shadow [cells]


def _blurred(picture: Array, deviation: float) -> Array:
    """Gaussian blur of (CELLS, CELLS) as two products with a banded matrix."""
    index = jnp.arange(CELLS, dtype=picture.dtype)
    kernel = jnp.exp(-0.5 * ((index[:, None] - index) / deviation) ** 2)
    kernel = kernel / (deviation * jnp.sqrt(2 * jnp.pi).astype(picture.dtype))
    return kernel @ picture @ kernel.T


def _closed(picture: Array) -> Array:
    """Grey closing of (CELLS, CELLS) by a square: gaps narrower than it take what is around them.

    (Serra 1982): the largest value nearby, then of those the smallest.
    """
    for choose, beyond in ((jnp.maximum, 0.0), (jnp.minimum, 1.0)):
        for axis in (0, 1):
            width = [(0, 0), (0, 0)]
            width[axis] = (CLOSING, CLOSING)
            padded = jnp.pad(picture, width, constant_values=beyond)
            picture = reduce(
                choose,
                [
                    jax.lax.slice_in_dim(padded, k, k + CELLS, axis=axis)
                    for k in range(2 * CLOSING + 1)
                ],
            )
    return picture


def _noise(width: int, height: int, dtype) -> Array:
    """Noise in [-1/2, 1/2), (height, width), the same in every frame and unlike in neighbours.

    (Jimenez 2014, interleaved gradient noise.)
    """
    x, y = jnp.arange(width, dtype=dtype), jnp.arange(height, dtype=dtype)
    coarse = (0.06711056 * x[None, :] + 0.00583715 * y[:, None]) % 1
    return (52.9829189 * coarse) % 1 - 0.5


def shadow_map(points: Array, height: float, corner: Array, side: Array) -> Array:
    """How dark the floor is, (CELLS, CELLS) in [0, 1], under points (N, 3) [m].

    What touches the floor casts a narrow shadow, what hangs above a wide and faint one, as under
    an overcast sky. Cells between points are as dark as the points around them: how densely an
    object is sampled does not show.

    Args:
        points: of the object [m].
        height: of the floor [m].
        corner: least x and y of the map (2,) [m].
        side: length of its sides () [m].
    """
    cells = (points[:, :2] - corner) / side * CELLS
    index = jnp.clip(cells.astype(jnp.int32), 0, CELLS - 1)
    flat = index[:, 0] * CELLS + index[:, 1]
    above = (points[:, 2] - height) / side * CELLS  # height in cells
    darkness = jnp.zeros((CELLS, CELLS), points.dtype)
    for deviation in BLUR:
        # Each cell counts the point nearest to the floor; a count would depend on density.
        reach = jnp.exp(-jnp.clip(above, 0, None) / (2.5 * deviation))
        nearest = jnp.zeros(CELLS * CELLS, points.dtype).at[flat].max(reach)
        nearest = _closed(nearest.reshape(CELLS, CELLS))
        darkness = darkness + 0.5 * _blurred(nearest, deviation)
    return jnp.clip(darkness, 0, 1)


def _sample(picture: Array, x: Array, y: Array) -> Array:
    """Bilinear samples at cell coordinates; zero outside."""
    x, y = x - 0.5, y - 0.5
    inside = (x >= 0) & (x < CELLS - 1) & (y >= 0) & (y < CELLS - 1)
    i = jnp.clip(x.astype(jnp.int32), 0, CELLS - 2)
    j = jnp.clip(y.astype(jnp.int32), 0, CELLS - 2)
    u, v = x - i, y - j
    flat, base = picture.reshape(-1), i * CELLS + j
    low = flat[base] * (1 - v) + flat[base + 1] * v
    high = flat[base + CELLS] * (1 - v) + flat[base + CELLS + 1] * v
    return jnp.where(inside, low * (1 - u) + high * u, 0)


@partial(jax.jit, static_argnames=("height", "colour", "shadow", "background"))
def backdrop(
    camera: Camera,
    points: Array,
    middle: Array,
    extent: Array,
    *,
    height: float,
    colour: tuple[float, float, float],
    shadow: float,
    background: tuple[float, float, float],
) -> Array:
    """The picture behind the object, (H, W, 3).

    Args:
        camera: where from.
        points: what casts the shadow, (N, 3) [m].
        middle: of the floor, x and y (2,) [m]; it fades with distance from there.
        extent: how far the floor is seen and shadows are cast () [m].
        height: of the floor [m].
        colour, background: red, green, blue in [0, 1].
        shadow: darkness of the shadow in [0, 1].
    """
    dtype = points.dtype
    eye = position(camera)
    x = (jnp.arange(camera.width, dtype=dtype) + 0.5 - camera.centre[0]) / camera.focal[0]
    y = (jnp.arange(camera.height, dtype=dtype) + 0.5 - camera.centre[1]) / camera.focal[1]
    R = camera.rotation
    rays = [R[0, k] * x[None, :] + R[1, k] * y[:, None] + R[2, k] for k in range(3)]
    # Only from above, and only downwards, is there a floor to be seen.
    down = jnp.minimum(rays[2], -1e-6)
    distance = (height - eye[2]) / down
    floor_x, floor_y = eye[0] + distance * rays[0], eye[1] + distance * rays[1]
    far = ((floor_x - middle[0]) ** 2 + (floor_y - middle[1]) ** 2) / extent**2
    seen = (rays[2] < -1e-6) & (eye[2] > height)
    fade = jnp.where(seen, jnp.exp(-jnp.minimum(0.5 * far, 50)), 0)[..., None]
    corner, side = middle - 1.5 * extent, 3 * extent
    dark = _sample(
        shadow_map(points, height, corner, side),
        (floor_x - corner[0]) / side * CELLS,
        (floor_y - corner[1]) / side * CELLS,
    )
    paper, floor = jnp.array(background, dtype), jnp.array(colour, dtype)
    plain = paper + fade * (floor - paper)
    picture = plain * (1 - shadow * jnp.where(seen, dark, 0)[..., None])
    # Rounded to levels, the mean is what it should be. Bare paper stays as it is.
    level = 1 / 255
    noise = level * _noise(camera.width, camera.height, dtype)[..., None]
    differs = jnp.max(jnp.abs(picture - paper), axis=-1, keepdims=True) > 1e-3 * level
    return picture + jnp.where(differs, noise, 0)
