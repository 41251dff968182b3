"""Cameras that keep a whole motion in the picture."""

import math

import numpy as np

from jaxphys.render.camera import Camera, orbit
from jaxphys.scene.scene import View

MARGIN = 0.86  # of the half picture that the motion may fill
SHARE = 0.995  # of the points that must be in the picture; single grains may fly out
SAMPLES = 3000


def _axes(azimuth: float, elevation: float) -> np.ndarray:
    """Right, down and forward of a camera (3, 3), as rows."""
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = -np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    return np.stack([right, np.cross(forward, right), forward])


def _angles(view: View, seconds: float) -> tuple[float, float]:
    elevation = view.elevation + view.rise * seconds
    return view.azimuth + view.turn * seconds, max(-89.9, min(89.9, elevation))


def frame_cameras(
    view: View, points: list[np.ndarray], fps: float, width: int, height: int
) -> list[Camera]:
    """One camera for each frame.

    Args:
        view: where from, and what is fixed; the rest follows from the points.
        points: what each frame must show, (N, 3) [m]; one entry, or one for each frame.
        fps: frames a second of the video, which `turn`, `rise` and `approach` refer to.
        width, height: [pixels].
    """
    # A fixed stride keeps the choice the same for the same motion.
    sampled = [frame[:: max(1, len(frame) // SAMPLES)] for frame in points]
    everything = np.concatenate(sampled).astype(np.float64)
    if view.target is None:
        low, high = np.quantile(everything, [1 - SHARE, SHARE], axis=0)
        target = (low + high) / 2
        # A target below the middle of a tall motion would leave the top out; centre the picture.
        axes = _axes(*_angles(view, 0.0))
        seen = (everything - target) @ axes.T
        low, high = np.quantile(seen[:, :2], [1 - SHARE, SHARE], axis=0)
        target = target + (low + high) / 2 @ axes[:2]
    else:
        target = np.asarray(view.target)
    tangent = math.tan(math.radians(view.field_of_view) / 2)
    reach = MARGIN * tangent * np.array([1.0, height / width])
    distance = view.distance
    if distance is None:
        needed = []
        for i, frame in enumerate(sampled):
            seen = (frame - target) @ _axes(*_angles(view, i / fps)).T
            needed.append((np.abs(seen[:, :2]) / reach).max(axis=1) - seen[:, 2])
        distance = max(float(np.quantile(np.concatenate(needed), SHARE)), 1e-3)
    cameras = []
    for i in range(len(points)):
        azimuth, elevation = _angles(view, i / fps)
        cameras.append(
            orbit(
                target,
                max(distance + view.approach * i / fps, 1e-3),
                math.radians(azimuth),
                math.radians(elevation),
                field_of_view=math.radians(view.field_of_view),
                width=width,
                height=height,
            )
        )
    return cameras
