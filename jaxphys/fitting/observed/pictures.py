"""Pictures and silhouettes, of one camera or several."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.fitting.observed.base import Observed, refuse_not_finite
from jaxphys.mpm.motion import Frame, Motion
from jaxphys.pipeline.draw import draw, frame_splats
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import next_capacity, required_pairs
from jaxphys.scene.look import Look


@dataclass(frozen=True, eq=False)
class Seen(Observed):
    """Base of what cameras saw."""

    expected: ClassVar[float]  # noise where none is given
    channels: ClassVar[tuple[int, ...]]

    frames: np.ndarray = field(repr=False)
    cameras: Camera | Sequence[Camera] = field(repr=False)
    times: np.ndarray
    background: float | tuple[float, float, float] = 1.0

    @property
    def views(self) -> tuple[Camera, ...]:
        """The cameras."""
        return (self.cameras,) if isinstance(self.cameras, Camera) else tuple(self.cameras)

    @property
    def pictures(self) -> np.ndarray:
        """What was seen, (C, T, H, W, ...)."""
        frames = np.asarray(self.frames)
        return frames[None] if isinstance(self.cameras, Camera) else frames

    def check_own(self, simulation, look):
        if look is None:
            raise self.fail("frames", "needs look=, what is drawn; `build` gives it")
        for number, camera in enumerate(self.views):
            numbers = (camera.rotation, camera.translation, camera.focal, camera.centre)
            if not all(np.all(np.isfinite(part)) for part in numbers):
                raise self.fail("cameras", f"number {number} has entries that are not finite")
        sizes = {(camera.height, camera.width) for camera in self.views}
        if len(sizes) != 1:
            raise self.fail("cameras", f"have several sizes, {sorted(sizes)}; give one observation "
                            "for each")  # fmt: skip
        wanted = (len(self.views), len(self.times), *sizes.pop(), *self.channels)
        pictures = self.pictures
        if pictures.shape != wanted:
            raise self.fail("frames", f"has shape {pictures.shape}, expected {wanted} (cameras, "
                            "times, height, width)")  # fmt: skip
        for number, frames in enumerate(pictures):
            refuse_not_finite(self, f"frames[{number}]", frames)
            if frames.min() < 0 or frames.max() > 1:
                wrong = np.argmax((frames.min(axis=(1, 2)) < 0) | (frames.max(axis=(1, 2)) > 1))
                raise self.fail(f"frames[{number}]", f"frame {wrong} has values outside of [0, 1]")

    def noise_of(self, simulation):
        return self.noise or self.expected

    def arranged(self, residuals, simulation):
        return residuals, (0, 2, 3)

    def data(self, simulation, look):
        dtype = simulation.model.mass.dtype
        certainty = self.weight**0.5 / self.noise_of(simulation)
        stacked = jax.tree.map(lambda *parts: jnp.stack(parts), *self.views)
        return jnp.asarray(self.pictures, dtype), jnp.asarray(certainty, dtype), stacked

    def capacity(self, motion: Motion, look: Look) -> int:
        """Pairs of tile and splat that drawing a motion needs, the next power of two with room."""
        pairs = [
            int(required_pairs(frame_splats(look, motion[t], position(camera)), camera))
            for camera in self.views
            for t in range(0, len(motion), max(1, len(motion) // 4))
        ]
        return next_capacity(int(1.5 * max(pairs)))

    def drawn(self, motion: Motion, look: Look, cameras: Camera, capacity: int):
        """Pictures (T, C, H, W, 3) and silhouettes (T, C, H, W) of a motion; NaN where the room
        was too small for them.
        """

        def of_frame(parts):
            position, deformation, time, status, body = parts
            frame = Frame(position, deformation, time, status, motion.carriers, body)

            def of_camera(camera):
                image = draw(look, frame, camera, background=self.background, capacity=capacity)
                sound = jnp.where(image.overflow, jnp.nan, 1).astype(image.colour.dtype)
                failed = image.colour[0, 0, 0] * 0 + 1  # NaN where the simulation failed
                return image.colour * sound, image.alpha * sound * failed

            return jax.lax.map(of_camera, cameras)

        parts = (motion.position, motion.deformation, motion.time, motion.status, motion.body)
        return jax.lax.map(of_frame, parts)

    def residuals(self, motion, look, data, capacity: int = 0) -> Array:
        pictures, certainty, cameras = data
        drawn = self.drawn(motion, look, cameras, capacity)[self.part]
        return (drawn - jnp.moveaxis(pictures, 0, 1)) * certainty

    part: ClassVar[int]


@dataclass(frozen=True, eq=False)
class Images(Seen):
    """What cameras saw, in colour.

    Attributes:
        frames: (T, H, W, 3) of one camera, or (C, T, H, W, 3), in [0, 1].
        cameras: one, or C of one size.
        times: (T,) [s].
        background: behind everything.
        noise: of a colour; None: 0.02.
    """

    name: ClassVar[str] = "images"
    expected: ClassVar[float] = 0.02
    channels: ClassVar[tuple[int, ...]] = (3,)
    part: ClassVar[int] = 0


@dataclass(frozen=True, eq=False)
class Masks(Seen):
    """What cameras saw of the silhouette.

    Attributes:
        frames: (T, H, W) of one camera, or (C, T, H, W), in [0, 1]: how much of the background is
            hidden.
        cameras, times: as of `Images`.
        noise: None: 0.05.
    """

    name: ClassVar[str] = "masks"
    expected: ClassVar[float] = 0.05
    channels: ClassVar[tuple[int, ...]] = ()
    part: ClassVar[int] = 1
