"""Frames of a motion as pictures, and as a video."""

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from tqdm import tqdm

from jaxphys.core.ensemble import over_devices
from jaxphys.core.program import COMPILED_FAST, part
from jaxphys.mpm.motion import Frame
from jaxphys.pipeline.backdrop import backdrop
from jaxphys.pipeline.draw import SETTINGS, draw, frame_splats
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.video import ContactSheet, VideoWriter
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import next_capacity, required_pairs
from jaxphys.render.settings import Settings
from jaxphys.scene.look import Look
from jaxphys.scene.scene import Scene

ROOM = 1.15  # capacity over what the frames looked at need
# From so many pixels on tiles of 16 pixels are faster than tiles of 8: a splat lies in a third as
# many, and there are still enough of them to keep the loops over tiles busy.
LARGE = 200_000
# Pictures drawn at once, at most: each needs lists and pixels of its own, some 150 MB where it is
# of two megapixels, and the first one waits for the last frame.
MOST_AT_ONCE = 8


def drawn_at_once(frames: int) -> int:
    """How many of so many frames are drawn at once, each on a device of its own.

    A picture by itself keeps several cores busy in parts only, in loops of small steps; pictures
    side by side have nothing to wait for, whatever their size.
    """
    return max(1, min(frames, jax.device_count(), MOST_AT_ONCE))


def settings_for(camera: Camera) -> Settings:
    """How pictures of this size are drawn fastest; the picture is the same."""
    large = camera.width * camera.height >= LARGE
    return replace(SETTINGS, tile_size=16) if large else SETTINGS


def _room(needed: int) -> int:
    """Slots for a film's pictures that need so many at most, as far as was looked: sorting takes
    time for each slot, needed or not, so it is the next eighth of a power of two.
    """
    wanted = int(ROOM * needed)
    step = next_capacity(wanted) // 16
    return -(-wanted // step) * step if wanted else step * 16


@dataclass(frozen=True)
class Surroundings:
    """What surrounds the object in pictures; static."""

    background: tuple[float, float, float]
    floor: float | None = None
    floor_colour: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shadow: float = 0.0


def surroundings_of(scene: Scene) -> Surroundings:
    """The surroundings that a scene asks for."""
    ground = scene.ground
    if ground is None:
        return Surroundings(scene.background)
    return Surroundings(scene.background, ground.height, ground.colour, ground.shadow)


@partial(jax.jit, static_argnames=("surroundings", "capacity"))
def picture(
    look: Look,
    frame: Frame,
    camera: Camera,
    middle: Array,
    extent: Array,
    *,
    surroundings: Surroundings,
    capacity: int,
) -> tuple[Array, Array]:
    """A frame as bytes (H, W, 3) uint8, and how many pairs of tile and splat it needs.

    Args:
        look: whose Gaussians are drawn.
        frame: where they are.
        camera: where from.
        middle, extent: where the floor fades, see `backdrop`.
        surroundings: of the object.
        capacity: pairs to make room for.
    """
    behind = jnp.array(surroundings.background, frame.position.dtype)
    if surroundings.floor is not None:
        with part("drawn floor"):
            behind = backdrop(
                camera,
                frame.carried()[0],
                middle,
                extent,
                height=surroundings.floor,
                colour=surroundings.floor_colour,
                shadow=surroundings.shadow,
                background=surroundings.background,
            )
    settings = settings_for(camera)
    image = draw(look, frame, camera, background=behind, settings=settings, capacity=capacity)
    return jnp.round(255 * jnp.clip(image.colour, 0, 1)).astype(jnp.uint8), image.required


@partial(jax.jit, static_argnames=("surroundings", "capacity", "devices"))
def pictures(
    look: Look,
    frames: Frame,
    cameras: Camera,
    middle: Array,
    extent: Array,
    *,
    surroundings: Surroundings,
    capacity: int,
    devices: int,
) -> tuple[Array, Array]:
    """As `picture` of each of some frames, stacked as their cameras are, over so many devices:
    bytes (T, H, W, 3) uint8 and numbers of pairs (T,).
    """

    def one(frame: Frame, camera: Camera) -> tuple[Array, Array]:
        return picture(
            look, frame, camera, middle, extent, surroundings=surroundings, capacity=capacity
        )

    return over_devices(one, devices, in_turn=True)(frames, cameras)


@partial(jax.jit, compiler_options=dict(COMPILED_FAST))
def _needed(look: Look, frame: Frame, camera: Camera) -> Array:
    """Pairs of tile and splat of one frame."""
    splats = frame_splats(look, frame, position(camera))
    return required_pairs(splats, camera, settings_for(camera))


class Artist:
    """Draws frames of one scene, several at once where there are several devices; compiles once,
    and again only where a frame needs more room.

    Args:
        scene: size of the pictures, camera and surroundings.
        look: what is drawn.
        frames: those that the camera must show and that room is made for: all of them, or where the
            camera stands by itself (`View.stands_by_itself`) the first one.
        timing: gets the seconds of compiling.

    Attributes:
        cameras: of all frames.
        at_once: how many frames are drawn together, see `drawn_at_once`.
    """

    def __init__(self, scene: Scene, look: Look, frames: list[Frame], timing: Timing):
        self._look, self._timing = look, timing
        self.at_once = drawn_at_once(scene.frames)
        self._surroundings = surroundings_of(scene)
        shown = [np.asarray(frame.carried()[0]) for frame in frames]
        low, high = shown[0].min(axis=0), shown[0].max(axis=0)
        if look.still is not None:
            shown[0] = np.concatenate([shown[0], np.asarray(look.still.means)])
        if scene.camera.stands_by_itself:
            shown = shown[:1] * scene.frames
        self.cameras = frame_cameras(
            scene.camera, shown, scene.fps, scene.width, scene.height, look.placements[0]
        )
        self._middle = jnp.asarray((low + high)[:2] / 2)
        self._extent = jnp.asarray(max(1.2 * float(np.max(high - low)), 1e-3), shown[0].dtype)
        self._programs: dict[int, Callable] = {}
        last = len(frames) - 1
        with timing.compiling("render"):
            needed = [int(_needed(look, frames[i], self.cameras[i])) for i in {0, last // 2, last}]
        self._capacity = _room(max(needed))

    def _run(self, frames: Frame, cameras: Camera) -> tuple[Array, Array]:
        arguments = (self._look, frames, cameras, self._middle, self._extent)
        program = self._programs.get(self._capacity)
        if program is None:
            with self._timing.compiling("render"):
                program = pictures.lower(
                    *arguments,
                    surroundings=self._surroundings,
                    capacity=self._capacity,
                    devices=self.at_once,
                ).compile()
            self._programs[self._capacity] = program
        return program(*arguments)

    def paint(self, first: int, frames: list[Frame]) -> list[np.ndarray]:
        """Frames `first` and after, at most `at_once` of them, as (H, W, 3) uint8 each.

        Raises:
            SimulationError: the simulation had failed by then.
        """
        for index, frame in enumerate(frames, first):
            frame.check(index)
        # One program for any number: where frames are missing the last one is drawn again.
        places = [min(i, len(frames) - 1) for i in range(self.at_once)]
        together = _stacked([frames[i] for i in places])
        cameras = _stacked([self.cameras[first + i] for i in places])
        while True:
            pixels, required = self._run(together, cameras)
            needed = int(np.max(required))
            if needed <= self._capacity:
                return list(np.asarray(pixels)[: len(frames)])
            self._capacity = _room(needed)


def _stacked(trees: list) -> Any:
    return jax.tree.map(lambda *leaves: np.stack(leaves), *trees)


def _groups(frames: Iterable[Frame], size: int) -> Iterator[list[Frame]]:
    """So many frames at a time, fewer at the end."""
    rest = iter(frames)
    while group := list(islice(rest, size)):
        yield group


def film(
    path: str | os.PathLike,
    scene: Scene,
    look: Look,
    frames: Iterable[Frame],
    *,
    interrupted: Callable[[], bool],
    timing: Timing,
    progress: bool = False,
    watch: Callable[[int], None] | None = None,
) -> ContactSheet:
    """Draws and encodes frames as they come; returns a contact sheet of them.

    Nothing waits for the last frame but a camera that must show the whole motion.

    Args:
        path: of the video, written in place; whole whatever happens.
        scene: what surrounds the object, and the camera.
        look: what is drawn.
        frames: of the scene, all of them, one after the other.
        interrupted: whether to stop after the present pictures.
        timing: gets the seconds.
        progress: whether to show a bar with the time left.
        watch: called with the number of each picture; may raise KeyboardInterrupt.

    Raises:
        KeyboardInterrupt: a stop was asked for, here or by what gives the frames.
    """
    if not scene.camera.stands_by_itself:
        frames = list(frames)
    sheet, artist, index = ContactSheet(scene.frames), None, 0
    bar = tqdm(total=scene.frames, desc="render", unit="frame", disable=not progress)
    with bar, VideoWriter(path, scene.width, scene.height, scene.fps) as writer:
        for group in _groups(frames, drawn_at_once(scene.frames)):
            with timing.stage("render"):
                if artist is None:
                    known = frames if isinstance(frames, list) else group
                    artist = Artist(scene, look, known, timing)
                drawn = artist.paint(index, group)
            for pixels in drawn:
                with timing.stage("render"):
                    writer.add(pixels)
                    sheet.add(index, pixels)
                bar.update()
                if watch:
                    watch(index)
                index += 1
            if interrupted():
                raise KeyboardInterrupt
    return sheet
