"""Pinhole cameras: x right, y down, looking along +z; the world is right-handed with z up."""

import math
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError


@partial(
    jax.tree_util.register_dataclass,
    data_fields=("rotation", "translation", "focal", "centre"),
    meta_fields=("width", "height"),
)
@dataclass(frozen=True)
class Camera:
    """A pinhole camera. A world point x is at R x + t in the camera, in metres.

    It is drawn at pixel coordinates focal * (x, y) / z + centre; the centre of the pixel in column
    i and row j is (i + 0.5, j + 0.5). All arrays may carry a gradient.

    Attributes:
        rotation: world to camera, shape (3, 3); orthonormal, which is not checked.
        translation: [m], shape (3,).
        focal: focal lengths in x and y [pixels], shape (2,).
        centre: principal point in x and y [pixels], shape (2,).
        width, height: size of the picture [pixels]; static.
    """

    rotation: Array
    translation: Array
    focal: Array
    centre: Array
    width: int
    height: int


def position(camera: Camera) -> Array:
    """Where the camera stands in the world [m], shape (3,)."""
    return -camera.rotation.T @ camera.translation


def to_camera(camera: Camera, points: Array) -> Array:
    """World points (N, 3) [m] in camera coordinates (N, 3) [m]."""
    R, t = camera.rotation, camera.translation
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    return jnp.stack([R[i, 0] * x + R[i, 1] * y + R[i, 2] * z + t[i] for i in range(3)], axis=-1)


def to_pixels(camera: Camera, points: Array) -> Array:
    """Pixel coordinates (N, 2) of world points (N, 3) [m] that lie in front of the camera."""
    local = to_camera(camera, points)
    return camera.focal * local[:, :2] / local[:, 2:] + camera.centre


def look_at(
    eye,
    target,
    up=(0.0, 0.0, 1.0),
    *,
    field_of_view: float = math.radians(40.0),
    width: int,
    height: int,
    dtype=None,
) -> Camera:
    """A camera at `eye` that sees `target` in the middle of the picture, `up` pointing upwards.

    Args:
        eye, target: [m], shape (3,); must differ.
        up: shape (3,), any length. Where it is parallel to the view, another axis takes its place.
        field_of_view: horizontal, between the left and the right border [rad], in (0, pi).
        width, height: [pixels].
        dtype: of the arrays; by default that of `eye`, float32 for Python numbers.

    Raises:
        InputError: a size below one pixel or a field of view outside (0, pi).
    """
    if width < 1 or height < 1:
        raise InputError(f"camera size {width} x {height}: needs at least one pixel each way")
    if not 0.0 < field_of_view < math.pi:
        raise InputError(f"field_of_view = {field_of_view} rad: must lie between 0 and pi")
    dtype = dtype or (eye.dtype if hasattr(eye, "dtype") else jnp.float32)
    dtype = jax.dtypes.canonicalize_dtype(dtype)  # float64 of numpy where JAX has float32 alone
    eye, target, up = (jnp.asarray(v, dtype) for v in (eye, target, up))

    rotation, translation = _facing(eye, target, up)
    focal = 0.5 * width / math.tan(0.5 * field_of_view)
    return Camera(
        rotation=rotation,
        translation=translation,
        focal=jnp.asarray(np.full(2, focal), dtype),
        centre=jnp.array([0.5 * width, 0.5 * height], dtype),
        width=width,
        height=height,
    )


@jax.jit
def _facing(eye: Array, target: Array, up: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) of a camera at `eye` that looks at `target`."""
    forward = _unit(target - eye, jnp.array([0.0, 1.0, 0.0], eye.dtype))
    # The world axis least aligned with the view stands in for an `up` that is parallel to it.
    spare = jnp.eye(3, dtype=eye.dtype)[jnp.argmin(jnp.abs(forward))]
    right = _unit(jnp.cross(forward, up), _unit(jnp.cross(forward, spare), spare))
    rotation = jnp.stack([right, jnp.cross(forward, right), forward])
    return rotation, -rotation @ eye


def _unit(vector: Array, otherwise: Array) -> Array:
    squared = jnp.sum(vector**2)
    usable = squared > 1e-12
    return jnp.where(usable, vector / jnp.sqrt(jnp.where(usable, squared, 1.0)), otherwise)


def orbit(
    target,
    distance: float,
    azimuth: float,
    elevation: float,
    *,
    field_of_view: float = math.radians(40.0),
    width: int,
    height: int,
    dtype=jnp.float32,
) -> Camera:
    """A camera on a sphere about `target` that looks at it.

    Args:
        target: [m], shape (3,).
        distance: from the target [m].
        azimuth: about z, from +x towards +y [rad].
        elevation: above the horizon [rad], in [-pi/2, pi/2].
        field_of_view, width, height, dtype: as in `look_at`.
    """
    turn, rise = jnp.asarray(azimuth, dtype), jnp.asarray(elevation, dtype)
    offset = distance * jnp.stack(
        [
            jnp.cos(rise) * jnp.cos(turn),
            jnp.cos(rise) * jnp.sin(turn),
            jnp.sin(rise),
        ]
    )
    target = jnp.asarray(target, dtype)
    return look_at(
        target + offset.astype(dtype),
        target,
        field_of_view=field_of_view,
        width=width,
        height=height,
    )
