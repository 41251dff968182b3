"""Clips of a ball that falls, nine frames side by side in one picture, and words for its stiffness.

A network that knows pictures learns motion this way as it learns shape, from what stands where.
"""

import math
from functools import partial

import jax
import numpy as np
from jax import Array

import jaxphys
from experiments.fitting.scenes import SIDE, SIZE, asked_of, scene_of, solid
from jaxphys.fitting import Field, Free, Log, Problem
from jaxphys.gaussians import from_points
from jaxphys.mpm.motion import Frame, Motion
from jaxphys.render import Camera
from jaxphys.scene.look import Look

TIMES = np.arange(1, 10) / 24
ACROSS, PIXELS = 3, 24  # frames side by side, pixels of one
CELLS = 10  # Gaussians across the ball
CAPACITY = 1 << 13
AZIMUTH, ELEVATION = 0.4, 0.1
RED, GREY = (0.8, 0.1, 0.1), 0.5
# Young's moduli [Pa] that a sentence stands for.
SENTENCES = {
    "a ball of jelly": (4e3, 2.5e4),
    "a rubber ball": (2.5e4, 1.6e5),
    "a hard rubber ball": (1.6e5, 1e6),
}


def falling(velocity: tuple[float, ...], also_free: bool = False) -> tuple[Problem, Look]:
    """A red ball that falls, of unknown stiffness, and what is drawn of it; `also_free`: of unknown
    velocity, too.
    """
    thing = solid("ball", CELLS)
    red = np.broadcast_to(np.float32(RED), thing.means.shape)
    thing = from_points(np.asarray(thing.means), red, 1.2 * SIZE / CELLS)
    scene = scene_of("elastic", {"density": 1000.0, "poisson_ratio": 0.3}, law="neo-Hookean")
    simulation, look = jaxphys.build(scene, thing)
    free: dict[str, Free | Field] = {"youngs_modulus": Log(1e5)}
    if also_free:
        free["velocity"] = Free(velocity, size=1.0)
    return asked_of(simulation.with_(velocity=velocity), free, TIMES), look


def camera() -> Camera:
    """From the side, and still: it sees where the ball is."""
    return jaxphys.orbit(
        (SIDE / 2, SIDE / 2, 0.5), 2.2, AZIMUTH, ELEVATION,
        field_of_view=math.radians(24.0), width=PIXELS, height=PIXELS,
    )  # fmt: skip


def sheet(look: Look, motion: Motion, background: float = GREY) -> tuple[Array, Array]:
    """Colour (R, R, 3) and opacity (R, R) of a motion's nine frames, the first at the top left.
    Differentiable.
    """
    eye = camera()

    def seen(parts):
        position, deformation, time, status, body = parts
        frame = Frame(position, deformation, time, status, motion.carriers, body)
        image = jaxphys.draw(look, frame, eye, background=background, capacity=CAPACITY)
        return image.colour, image.alpha

    parts = (motion.position, motion.deformation, motion.time, motion.status, motion.body)
    colour, alpha = jax.lax.map(seen, parts)
    return arranged(colour), arranged(alpha[..., None])[..., 0]


def arranged(frames: Array) -> Array:
    """(T, P, P, C) -> (ACROSS P, ACROSS P, C)."""
    rows = frames.reshape(ACROSS, ACROSS, PIXELS, PIXELS, -1).transpose(0, 2, 1, 3, 4)
    return rows.reshape(ACROSS * PIXELS, ACROSS * PIXELS, -1)


def names(stiffness: np.ndarray) -> np.ndarray:
    """Which sentence says it, (N,) indices."""
    ends = [high for _, high in SENTENCES.values()]
    return np.searchsorted(ends[:-1], stiffness, side="right")


drawn = jax.jit(partial(sheet, background=0.0))
