"""The pictures that image priors judge, and that the bundled one is trained on: one way to draw."""

import jax.numpy as jnp
import numpy as np
from jax import Array
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


def neighbour_sizes(points: np.ndarray, scale: float, largest: float) -> np.ndarray:
    """(N,) standard deviations that close a surface sampled at `points` (N, 3): `scale` times the
    mean distance to the three nearest neighbours, at most `largest`."""
    near = min(4, len(points))
    distance = cKDTree(points).query(points, k=near)[0].reshape(len(points), near)
    mean = distance[:, 1:].mean(1) if near > 1 else np.full(len(points), largest)
    return np.clip(scale * mean, 1e-3, largest).astype(np.float32)


def picture_settings(resolution: int) -> Settings:
    """Small tiles for small pictures."""
    return Settings(tile_size=8 if resolution <= 128 else 16, depth=False)


def view_camera(
    azimuth: Array | float, elevation: Array | float, resolution: int, dtype=jnp.float32
) -> Camera:
    """The camera of a view [rad], see `views`; `resolution` pixels a side."""
    eye = views.camera_position(jnp.asarray(azimuth, dtype), jnp.asarray(elevation, dtype), xp=jnp)
    return look_at(
        eye,
        jnp.zeros_like(eye),
        field_of_view=views.FIELD_OF_VIEW,
        width=resolution,
        height=resolution,
    )


def view_picture(
    gaussians: Gaussians,
    azimuth: Array | float,
    elevation: Array | float,
    background: Array | float,
    capacity: int | None = None,
    resolution: int = views.RESOLUTION,
) -> Image:
    """The square picture of a view; `background` and `capacity` as for `render`."""
    camera = view_camera(azimuth, elevation, resolution, gaussians.means.dtype)
    eye = views.camera_position(azimuth, elevation, xp=jnp).astype(gaussians.means.dtype)
    splats = to_splats(gaussians, eye)
    return render(
        splats,
        camera,
        background=background,
        settings=picture_settings(resolution),
        capacity=capacity,
    )


def room_for_pairs(gaussians: Gaussians, resolution: int) -> int:
    """Capacity for `view_picture`: twice what the neediest of a few views asks for."""
    needs = []
    for azimuth, elevation in ((0.0, 0.0), (1.6, 0.3), (0.8, 0.9)):
        eye = jnp.asarray(views.camera_position(azimuth, elevation), gaussians.means.dtype)
        camera = view_camera(azimuth, elevation, resolution, gaussians.means.dtype)
        splats = to_splats(gaussians, eye)
        needs.append(int(required_pairs(splats, camera, picture_settings(resolution))))
    return next_capacity(2 * max(needs))
