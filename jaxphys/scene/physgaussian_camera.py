"""The camera of PhysGaussian's configuration format as one of ours."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.scene.model_folder import FiledCamera
from jaxphys.scene.physgaussian_config import Config
from jaxphys.scene.scene import Scene
from jaxphys.scene.view import View

LARGEST = 8192  # side of a picture [pixels]


def seen_from(
    config: Config, fps: float, cameras: Sequence[FiledCamera] | None, notes: list[str]
) -> tuple[View, int, int]:
    """View, width and height of the pictures; adds to `notes` what differs.

    `default_camera_index` names one of the photographs' cameras, which stands still; -1 is an orbit
    with the lens and the picture of the first of them. `fps`: pictures a second.

    Raises:
        InputError: naming the key that cannot be used.
    """
    if config.show_hint:
        notes.append("show_hint: left out")
    index = config.default_camera_index
    if cameras is None:
        notes.append(
            "cameras.json: not found beside the model, which has lens and size of the pictures "
            "there; here the lens sees 35 degrees"
        )
        if index >= 0:
            notes.append("default_camera_index: without cameras.json the camera frames the motion")
        return _orbit(config, fps, None), Scene.width, Scene.height
    if index >= len(cameras):
        raise InputError(
            f"default_camera_index: {index}, but cameras.json holds {len(cameras)} cameras, "
            f"0 to {len(cameras) - 1}; -1 is an orbit"
        )
    camera = cameras[max(index, 0)]
    shrunk = min(1.0, LARGEST / max(camera.width, camera.height))
    width, height = (max(8, round(shrunk * side)) for side in (camera.width, camera.height))
    if index >= 0:
        return View(photograph=camera.photograph), width, height
    return _orbit(config, fps, camera), width, height


def _orbit(config: Config, fps: float, lens: FiledCamera | None) -> View:
    """About the viewpoint; as far away as the motion needs where the file names a photograph."""
    framed = config.default_camera_index >= 0
    moves = fps if config.move_camera and not framed else 0.0
    view = View(
        elevation=config.init_elevation,
        target=config.mpm_space_viewpoint_center,
        distance=None if framed else config.init_radius,
        # Their horizontal axes make a left-handed frame with the upward one.
        turn=-moves * config.delta_a,
        rise=moves * config.delta_e,
        approach=moves * (config.delta_r or 0.0),
        up=config.mpm_space_vertical_upward_axis,
        units="source",
    )
    view = dataclasses.replace(view, azimuth=_first_axis(view) - config.init_azimuthm)
    if lens is None:
        return view
    angle = math.degrees(2 * math.atan(lens.width / (2 * lens.fx)))
    return dataclasses.replace(view, field_of_view=min(max(angle, 1.0), 150.0))


def _first_axis(view: View) -> float:
    """Our azimuth of their first horizontal axis, (1, 1, 1) made perpendicular to `up`."""
    start, side, up = view.frame
    axis = np.ones(3) - up.sum() * up
    if np.linalg.norm(axis) < 1e-6:
        raise InputError(
            "mpm_space_vertical_upward_axis: along (1, 1, 1), which their horizontal axes are made "
            "from; turn it a little"
        )
    return math.degrees(math.atan2(axis @ side, axis @ start))
