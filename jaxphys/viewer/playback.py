"""A finished run that is played again: the commands that need no simulation."""

import math

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.core.splats import Splats
from jaxphys.page.motion_data import Moving
from jaxphys.pipeline.replay import Replay
from jaxphys.render.camera import Camera, look_at
from jaxphys.viewer.events import Event, Pause, Play, Reset, Seek, Step
from jaxphys.viewer.shown import Shown


class Playback:
    """The frames of a run, one after the other, from the first again after the last.

    Attributes:
        playing, message: as those of a `Session`.
        camera: that of the film's first picture.
        count: of frames.
    """

    def __init__(self, replay: Replay):
        self._moving = replay.moving
        self.scene = replay.scene
        self.playing, self.message = False, " ".join(replay.moving.notes)
        self.count = len(self._moving.seconds)
        self.camera = _camera(replay)
        self._number = 0

    def do(self, event: Event) -> None:
        """Carries out a command; what a film cannot do is told in `message`."""
        match event:
            case Play():
                self.playing = True
            case Pause():
                self.playing = False
            case Step():
                self.playing = False
                self.advance()
            case Reset():
                self._number = 0
            case Seek():
                self._number = min(max(int(event.number), 0), self.count - 1)
            case _:
                self.message = (
                    "this is a finished run; open its config.json to poke, pull and change it"
                )

    def advance(self) -> None:
        """The next frame."""
        self._number = (self._number + 1) % self.count

    def shown(self) -> Shown:
        """What is to be drawn of the present frame."""
        splats = splats_of(self._moving, self._number)
        return Shown(self._number, float(self._moving.seconds[self._number]), splats)


def splats_of(moving: Moving, number: int) -> Splats:
    """A frame as a renderer takes it.

    Raises:
        InputError: it is not finite.
    """
    quaternions = np.asarray(moving.quaternions[number], np.float64)
    unit = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    axes = (
        np.asarray(quaternion_to_matrix(jnp.asarray(unit)))
        * np.exp(moving.log_scales[number])[:, None, :]
    )
    splats = Splats(
        jnp.asarray(moving.means[number], jnp.float32),
        jnp.asarray(axes @ np.swapaxes(axes, 1, 2), jnp.float32),
        jnp.asarray(moving.opacities, jnp.float32),
        jnp.asarray(moving.colours, jnp.float32),
    )
    if not all(np.isfinite(part).all() for part in splats):
        raise InputError(f"frame {number}: is not finite; make the run again")
    return splats


def _camera(replay: Replay) -> Camera:
    view = replay.view
    start, side, up = np.asarray(view["axes"], np.float64)
    azimuth, elevation = view["azimuth"], view["elevation"]
    around = math.cos(azimuth) * start + math.sin(azimuth) * side
    outwards = math.cos(elevation) * around + math.sin(elevation) * up
    target = np.asarray(view["target"], np.float64)
    scene = replay.scene
    return look_at(
        target + view["distance"] * outwards,
        target,
        up,
        field_of_view=view["field"],
        width=scene.width,
        height=scene.height,
    )
