"""Frames of a motion as pictures, and as a video."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from tqdm import tqdm

from jaxphys.pipeline.backdrop import backdrop
from jaxphys.pipeline.draw import draw, frame_splats
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.pipeline.interrupt import deferred_interrupt
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.video import ContactSheet, VideoWriter
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import next_capacity, required_pairs
from jaxphys.scene.build import Simulation
from jaxphys.scene.scene import Scene

ROOM = 1.15  # capacity over what the frames looked at need


@dataclass(frozen=True)
class Look:
    """What surrounds the object in pictures; static."""

    background: tuple[float, float, float]
    floor: float | None = None
    floor_colour: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shadow: float = 0.0


def look_of(scene: Scene) -> Look:
    """The surroundings that a scene asks for."""
    ground = scene.ground
    if ground is None:
        return Look(scene.background)
    return Look(scene.background, ground.height, ground.colour, ground.shadow)


@partial(jax.jit, static_argnames=("look", "capacity"))
def picture(
    simulation: Simulation,
    positions: Array,
    deformations: Array,
    camera: Camera,
    middle: Array,
    extent: Array,
    *,
    look: Look,
    capacity: int,
) -> tuple[Array, Array]:
    """A frame as bytes (H, W, 3) uint8, and how many pairs of tile and splat it needs.

    Args:
        simulation: whose Gaussians are drawn.
        positions, deformations: of the particles that carry them, (K, 3) [m] and (K, 3, 3).
        camera: where from.
        middle, extent: where the floor fades, see `backdrop`.
        look: surroundings.
        capacity: pairs to make room for.
    """
    behind = jnp.array(look.background, positions.dtype)
    if look.floor is not None:
        behind = backdrop(
            camera,
            positions,
            middle,
            extent,
            height=look.floor,
            colour=look.floor_colour,
            shadow=look.shadow,
            background=look.background,
        )
    image = draw(simulation, positions, deformations, camera, background=behind, capacity=capacity)
    return jnp.round(255 * jnp.clip(image.colour, 0, 1)).astype(jnp.uint8), image.required


@jax.jit
def _needed(simulation: Simulation, positions: Array, deformations: Array, camera: Camera) -> Array:
    """Pairs of tile and splat of one frame."""
    splats = frame_splats(simulation, positions, deformations, position(camera))
    return required_pairs(splats, camera)


class Artist:
    """Draws frames of one scene; compiles once, and again only where a frame needs more room."""

    def __init__(
        self, scene: Scene, simulation: Simulation, points: list[np.ndarray], timing: Timing
    ):
        self._simulation, self._timing, self._look = simulation, timing, look_of(scene)
        still = simulation.still
        shown = list(points)
        if still is not None:
            shown[0] = np.concatenate([shown[0], np.asarray(still.means)])
        self.cameras = frame_cameras(scene.camera, shown, scene.fps, scene.width, scene.height)
        first = points[0]
        low, high = first.min(axis=0), first.max(axis=0)
        self._middle = jnp.asarray((low + high)[:2] / 2)
        self._extent = jnp.asarray(max(1.2 * float(np.max(high - low)), 1e-3), jnp.float32)
        self._capacity = 0
        self._programs: dict[int, Callable] = {}

    def _run(self, place, deformation, camera):
        arguments = (self._simulation, place, deformation, camera, self._middle, self._extent)
        program = self._programs.get(self._capacity)
        if program is None:
            with self._timing.compiling("render"):
                program = picture.lower(
                    *arguments, look=self._look, capacity=self._capacity
                ).compile()
            self._programs[self._capacity] = program
        return program(*arguments)

    def prepare(self, record_positions: list, record_deformations: list) -> None:
        """Makes room for the first, the middle and the last frame, so that one program does."""
        last = len(record_positions) - 1
        with self._timing.compiling("render"):
            needed = [
                int(
                    _needed(
                        self._simulation,
                        record_positions[i],
                        record_deformations[i],
                        self.cameras[i],
                    )
                )
                for i in sorted({0, last // 2, last})
            ]
        self._capacity = next_capacity(int(ROOM * max(needed)))

    def draw(self, index: int, place: np.ndarray, deformation: np.ndarray) -> np.ndarray:
        """Frame `index` as (H, W, 3) uint8."""
        while True:
            pixels, required = self._run(place, deformation, self.cameras[index])
            if int(required) <= self._capacity:
                return np.asarray(pixels)
            self._capacity = next_capacity(int(required))


def film(
    path: str | os.PathLike,
    scene: Scene,
    pictures: Iterator[np.ndarray],
    sheet: ContactSheet,
    *,
    progress: bool,
    watch: Callable[[int], None] | None = None,
) -> bool:
    """Encodes pictures as they come; returns whether all of them were, or an interrupt came first.

    Either way the file is whole.
    """
    bar = tqdm(total=scene.frames, desc="render", unit="frame", disable=not progress)
    with (
        bar,
        deferred_interrupt() as interrupted,
        VideoWriter(path, scene.width, scene.height, scene.fps) as writer,
    ):
        for index, pixels in enumerate(pictures):
            writer.add(pixels)
            sheet.add(index, pixels)
            bar.update()
            try:
                if watch:
                    watch(index)
            except KeyboardInterrupt:
                return False
            if interrupted():
                return False
    return True
