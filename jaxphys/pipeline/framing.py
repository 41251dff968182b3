"""Cameras that keep a whole motion in the picture, or stand where a view says."""

import math

import jax.numpy as jnp
import numpy as np

from jaxphys.render.camera import Camera, look_at
from jaxphys.scene.placement import AS_IT_IS, Placement
from jaxphys.scene.view import Photograph, View

MARGIN = 0.86  # of the half picture that the motion may fill
SHARE = 0.995  # of the points of each frame that must be in the picture; single grains may fly out
SAMPLES = 3000


def _axes(view: View, seconds: float) -> np.ndarray:
    """Right, down and forward of a camera (3, 3), as rows."""
    azimuth, elevation = _angles(view, seconds)
    start, side, up = view.frame
    outwards = math.cos(azimuth) * start + math.sin(azimuth) * side
    forward = -(math.cos(elevation) * outwards + math.sin(elevation) * up)
    right = math.cos(azimuth) * side - math.sin(azimuth) * start
    return np.stack([right, np.cross(forward, right), forward])


def _angles(view: View, seconds: float) -> tuple[float, float]:
    """Azimuth and elevation [rad]."""
    elevation = view.elevation + view.rise * seconds
    return (
        math.radians(view.azimuth + view.turn * seconds),
        math.radians(max(-89.9, min(89.9, elevation))),
    )


def _middle(frames: list[np.ndarray]) -> np.ndarray:
    """Middle of the box that holds nearly all points of every frame."""
    ends = [np.quantile(frame, [1 - SHARE, SHARE], axis=0) for frame in frames]
    return (np.min([low for low, _ in ends], 0) + np.max([high for _, high in ends], 0)) / 2


def frame_cameras(
    view: View,
    points: list[np.ndarray],
    fps: float,
    width: int,
    height: int,
    placement: Placement = AS_IT_IS,
) -> list[Camera]:
    """One camera for each frame.

    Args:
        view: where from, and what is fixed; the rest follows from the points.
        points: what each frame must show, (N, 3) [m]; one entry, or one for each frame.
        fps: frames a second of the video, which `turn`, `rise` and `approach` refer to.
        width, height: [pixels].
        placement: of the first object, for views that are in the coordinates or units of its file.
    """
    if view.photograph is not None:
        return [photograph_camera(view.photograph, placement, width, height)] * len(points)
    unit = placement.scale if view.units == "source" else 1.0
    # A fixed stride keeps the choice the same for the same motion.
    sampled = [frame[:: max(1, len(frame) // SAMPLES)].astype(np.float64) for frame in points]
    if view.target is None:
        target = _middle(sampled)
        # The middle of the box need not be the middle of what is seen of it.
        axes = _axes(view, 0.0)
        seen = [(frame - target) @ axes[:2].T for frame in sampled]
        target = target + _middle(seen) @ axes[:2]
    else:
        target = np.asarray(view.target)
    tangent = math.tan(math.radians(view.field_of_view) / 2)
    reach = MARGIN * tangent * np.array([1.0, height / width])
    if view.distance is None:
        needed = []
        for i, frame in enumerate(sampled):
            seen = (frame - target) @ _axes(view, i / fps).T
            distances = (np.abs(seen[:, :2]) / reach).max(axis=1) - seen[:, 2]
            needed.append(np.quantile(distances, SHARE))
        distance = max(float(max(needed)), 1e-3)
    else:
        distance = unit * view.distance
    cameras = []
    for i in range(len(points)):
        away = max(distance + unit * view.approach * i / fps, 1e-3)
        cameras.append(
            look_at(
                target - away * _axes(view, i / fps)[2],
                target,
                view.up,
                field_of_view=math.radians(view.field_of_view),
                width=width,
                height=height,
                dtype=jnp.float32,
            )
        )
    return cameras


def photograph_camera(
    photograph: Photograph, placement: Placement, width: int, height: int
) -> Camera:
    """The camera of a photograph among the objects of a scene.

    The picture is as wide as the photograph was; another ratio of its sides shows more or less
    above and below.
    """
    # To the camera from the file, and from the domain: the scale of all three axes cancels.
    rotation = np.asarray(photograph.rotation).T @ np.asarray(placement.rotation).T
    eye = placement.point(photograph.position)
    return Camera(
        rotation=jnp.asarray(rotation, jnp.float32),
        translation=jnp.asarray(-rotation @ eye, jnp.float32),
        focal=jnp.asarray(photograph.focal, jnp.float32) * width,
        centre=jnp.asarray([width / 2, height / 2], jnp.float32),
        width=width,
        height=height,
    )
