"""The small pictures that the pixel prior is trained on and judges: one way to draw both."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial import cKDTree

from jaxphys.gaussians.gaussians import Gaussians, to_splats
from jaxphys.guidance import views
from jaxphys.render import (
    Camera,
    Image,
    Settings,
    look_at,
    next_capacity,
    render,
    required_pairs,
)

Array = jax.Array
SETTINGS = Settings(tile_size=8)


def neighbour_sizes(points: np.ndarray, scale: float, largest: float) -> np.ndarray:
    """(N,) standard deviations that close a surface sampled at `points` (N, 3): `scale` times the
    mean distance to the three nearest neighbours, at most `largest`."""
    near = min(4, len(points))
    distance = cKDTree(points).query(points, k=near)[0].reshape(len(points), near)
    mean = distance[:, 1:].mean(1) if near > 1 else np.full(len(points), largest)
    return np.clip(scale * mean, 1e-3, largest).astype(np.float32)


def view_camera(azimuth: Array | float, elevation: Array | float, dtype=jnp.float32) -> Camera:
    """The camera of a view [rad], see `views`."""
    eye = views.camera_position(jnp.asarray(azimuth, dtype), jnp.asarray(elevation, dtype), xp=jnp)
    return look_at(
        eye,
        jnp.zeros_like(eye),
        field_of_view=views.FIELD_OF_VIEW,
        width=views.RESOLUTION,
        height=views.RESOLUTION,
    )


def draw(
    gaussians: Gaussians,
    azimuth: Array | float,
    elevation: Array | float,
    background: Array | float,
    capacity: int | None = None,
) -> Image:
    """The picture (64, 64) of a view; `background` and `capacity` as for `render`."""
    camera = view_camera(azimuth, elevation, gaussians.means.dtype)
    eye = views.camera_position(azimuth, elevation, xp=jnp).astype(gaussians.means.dtype)
    splats = to_splats(gaussians, eye)
    return render(splats, camera, background=background, settings=SETTINGS, capacity=capacity)


def room_for_pairs(gaussians: Gaussians) -> int:
    """Capacity for `draw`: twice what the neediest of a few views asks for."""
    needs = []
    for azimuth, elevation in ((0.0, 0.0), (1.6, 0.3), (0.8, 0.9)):
        eye = jnp.asarray(views.camera_position(azimuth, elevation), gaussians.means.dtype)
        camera = view_camera(azimuth, elevation, gaussians.means.dtype)
        needs.append(int(required_pairs(to_splats(gaussians, eye), camera, SETTINGS)))
    return next_capacity(2 * max(needs))
