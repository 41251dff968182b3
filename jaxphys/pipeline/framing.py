"""Cameras that keep a whole motion in the picture."""

import math

import numpy as np

from jaxphys.render.camera import Camera, orbit
from jaxphys.scene.scene import View

MARGIN = 0.86  # of the half picture that the motion may fill
SHARE = 0.995  # of the points of each frame that must be in the picture; single grains may fly out
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


def _middle(frames: list[np.ndarray]) -> np.ndarray:
    """Middle of the box that holds nearly all points of every frame."""
    ends = [np.quantile(frame, [1 - SHARE, SHARE], axis=0) for frame in frames]
    return (np.min([low for low, _ in ends], 0) + np.max([high for _, high in ends], 0)) / 2


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
    sampled = [frame[:: max(1, len(frame) // SAMPLES)].astype(np.float64) for frame in points]
    if view.target is None:
        target = _middle(sampled)
        # The middle of the box need not be the middle of what is seen of it.
        axes = _axes(*_angles(view, 0.0))
        seen = [(frame - target) @ axes[:2].T for frame in sampled]
        target = target + _middle(seen) @ axes[:2]
    else:
        target = np.asarray(view.target)
    tangent = math.tan(math.radians(view.field_of_view) / 2)
    reach = MARGIN * tangent * np.array([1.0, height / width])
    distance = view.distance
    if distance is None:
        needed = []
        for i, frame in enumerate(sampled):
            seen = (frame - target) @ _axes(*_angles(view, i / fps)).T
            distances = (np.abs(seen[:, :2]) / reach).max(axis=1) - seen[:, 2]
            needed.append(np.quantile(distances, SHARE))
        distance = max(float(max(needed)), 1e-3)
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
