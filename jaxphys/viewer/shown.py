"""What a window draws and tells of one frame."""

from dataclasses import dataclass, field

import numpy as np

from jaxphys.core.splats import Splats
from jaxphys.mpm.boundaries import Vector
from jaxphys.mpm.motion import Frame
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.render.camera import Camera
from jaxphys.scene.look import Look
from jaxphys.scene.scene import Scene


@dataclass(frozen=True)
class Shown:
    """One frame, finite.

    Attributes:
        number: of the frame; time: [s].
        splats: as a renderer takes them.
        energies: [J], by name; empty where nobody knows.
        momentum: [kg m/s], or None.
        held: where the hand holds matter [m], or None; grabs: how often it has taken hold.
    """

    number: int
    time: float
    splats: Splats
    energies: dict[str, float] = field(default_factory=dict)
    momentum: tuple[float, ...] | None = None
    held: Vector | None = None
    grabs: int = 0


def camera_of(scene: Scene, look: Look, frame: Frame) -> Camera:
    """The camera that the first picture of a film of this scene would have."""
    points = [np.asarray(frame.carried()[0])]
    size = scene.width, scene.height
    return frame_cameras(scene.camera, points, scene.fps, *size, look.placements[0])[0]
