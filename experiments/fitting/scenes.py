"""Small solids that fall on a sticky floor, and what is seen of them.

Of the size and speed of PAC-NeRF's scenes (Li et al. 2023), on shapes of our own: a lattice of
Gaussians, each of which is a particle.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import numpy as np

import jaxphys
from jaxphys.fitting import (
    Field,
    Fit,
    Free,
    Images,
    Observed,
    Problem,
    Tracks,
    layout,
    problem,
    solved,
    still,
)
from jaxphys.gaussians import Gaussians, from_points
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.render import Camera
from jaxphys.scene import Domain, Object, Plane, Scene
from jaxphys.scene.look import Look

SIZE, FLOOR, GAP = 0.5, 0.2, 0.12
SIDE, HEIGHT = 1.2, 1.0
STEPS = 48  # between two times, in what is seen and in every trial
PIXELS, CAPACITY = 32, 1 << 15
TRACK_NOISE, PIXEL_NOISE = 5e-4, 0.02  # [m], of colours in [0, 1]


def _ball(x, y, z):
    return x**2 + y**2 + z**2 < 1


def _letter(x, y, z):
    """An L."""
    return (np.abs(y) < 0.4) & ((x < -0.3) | (z < -0.4)) & (np.abs(x) < 0.8)


def _heap(x, y, z):
    return np.hypot(x, y) < 0.55 * (1 - z)


def _rod(x, y, z):
    return y**2 + z**2 < 0.36


def _torus(x, y, z):
    return (np.hypot(x, z) - 0.65) ** 2 + y**2 < 0.35**2


def _bird(x, y, z):
    """A body, a head and two wings."""
    body = (x / 0.7) ** 2 + (y / 0.4) ** 2 + ((z + 0.2) / 0.45) ** 2 < 1
    head = (x - 0.6) ** 2 + y**2 + (z - 0.3) ** 2 < 0.32**2
    wings = (np.abs(x) < 0.35) & (np.abs(z + 0.05) < 0.16)
    return body | head | wings


def _block(x, y, z):
    return (np.abs(x) < 0.8) & (np.abs(y) < 0.7)


def _cat(x, y, z):
    """A body on four legs, and a head."""
    body = (np.abs(x) < 0.9) & (np.abs(y) < 0.4) & (np.abs(z) < 0.35)
    legs = (np.abs(np.abs(x) - 0.65) < 0.26) & (np.abs(np.abs(y) - 0.25) < 0.2) & (z <= 0)
    head = (np.abs(x - 0.65) < 0.35) & (np.abs(y) < 0.35) & (z >= 0)
    return body | legs | head


def _cup(x, y, z):
    """A foot, a stem and a bowl."""
    radius = np.where(z > 0, 0.75, np.where(z > -0.6, 0.35, 0.6))
    return np.hypot(x, y) < radius


SHAPES = {
    "ball": _ball,
    "letter": _letter,
    "heap": _heap,
    "rod": _rod,
    "torus": _torus,
    "bird": _bird,
    "block": _block,
    "cat": _cat,
    "cup": _cup,
}


def solid(shape: str, cells: int) -> Gaussians:
    """A lattice of Gaussians, `cells` along the longest side of 2, coloured by place so that
    pictures show how it turns and shears.
    """
    step = 2 / cells
    line = -1 + step * (np.arange(cells) + 0.5)
    places = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    places = places[SHAPES[shape](*places.T)]
    colours = 0.5 + 0.35 * np.sin(4 * places + [0.0, 1.0, 2.0])
    return from_points(places.astype(np.float32), colours.astype(np.float32), 0.6 * step)


def scene_of(
    material: str,
    parameters: Mapping[str, float],
    *,
    law: str | None = None,
    cell: float = 0.1,
    floor: str = "sticky",
) -> Scene:
    """A scene of one thing above a floor, at rest, with gravity."""
    thing = Object(
        material=material,
        law=law,
        parameters=dict(parameters),
        size=SIZE,
        centre=(SIDE / 2, SIDE / 2, FLOOR + GAP + SIZE / 2),
        filling=None,
    )
    return Scene(
        objects=(thing,),
        boundaries=(Plane((SIDE / 2, SIDE / 2, FLOOR), (0.0, 0.0, 1.0), floor),),
        domain=Domain((SIDE, SIDE, HEIGHT), cell),
    )


def asked_of(
    simulation: Simulation,
    free: Mapping[str, Free | Field],
    times: Sequence[float],
    *,
    look: Look | None = None,
    views: int = 0,
) -> Problem:
    """What is asked of a scene, with nothing moving seen in it yet: its programs make what is seen
    (`moved`), and fit it (`Problem.observing`). Tracks, or pictures of so many views.
    """
    times = tuple(float(t) for t in times)
    blank = np.full((views, len(times), PIXELS, PIXELS, 3), 1.0)
    seen = (
        Images(blank, cameras(views), np.array(times), noise=PIXEL_NOISE)
        if views
        else tracks(still(simulation, times), times, 0)
    )
    numbers = layout(free, simulation, look)
    return problem(simulation, numbers, (seen,), look=look, steps=STEPS)


def moved(asked: Problem, true: Mapping[str, Any]) -> Motion:
    """The motion with the true numbers."""
    vector = asked.layout.vector(true)
    run = asked.call("motion", asked.program(vector))
    return jax.device_get(run(asked.cast(vector), len(asked.times))[0]).check()


def tracks(motion: Motion, times: Sequence[float], seed: int) -> Tracks:
    """Where all particles were, with noise."""
    random = np.random.default_rng(seed)
    places = np.asarray(motion.position, np.float64)
    noisy = places + TRACK_NOISE * random.normal(size=places.shape)
    return Tracks(noisy, np.asarray(times, np.float64), noise=TRACK_NOISE)


def cameras(views: int) -> list[Camera]:
    """Around it."""
    return [
        jaxphys.orbit(
            (SIDE / 2, SIDE / 2, 0.45), 2.2, 0.4 + 2 * np.pi * k / views, 0.3,
            width=PIXELS, height=PIXELS,
        )
        for k in range(views)
    ]  # fmt: skip


def images(motion: Motion, times: Sequence[float], look: Look, views: int, seed: int) -> Images:
    """What cameras around it saw, with noise."""
    random = np.random.default_rng(seed)
    draw = jax.jit(partial(jaxphys.draw, background=1.0, capacity=CAPACITY))
    seen = [
        [np.asarray(draw(look, motion[t], camera).colour) for t in range(len(motion))]
        for camera in cameras(views)
    ]
    noisy = np.asarray(seen) + PIXEL_NOISE * random.normal(size=np.shape(seen))
    times = np.asarray(times, np.float64)
    return Images(np.clip(noisy, 0, 1), cameras(views), times, noise=PIXEL_NOISE)


@dataclass
class Counter:
    """Counts the evaluations of a fit."""

    count: int = 0

    def __call__(self) -> None:
        self.count += 1


def fitted(asked: Problem, observed: Observed, **options) -> tuple[Fit, int]:
    """A fit to what was observed, and how many evaluations it took."""
    counter = Counter()
    return solved(asked.observing((observed,)), watch=counter, **options), counter.count


def told(fit: Fit) -> dict:
    """What a line keeps of a fit."""
    sure = fit.uncertainty.to_json() if fit.uncertainty else {}
    (misfit,) = fit.misfits
    return {
        "found": fit.to_json()["values"],
        "intervals": sure.get("numbers"),
        "undetermined": sure.get("undetermined"),
        "independent": sure.get("independent_residuals"),
        "misfit": misfit.fit,
        "misfit_start": misfit.start,
        "misfit_still": misfit.still,
        "noise": misfit.noise,
        "search": fit.search,
        "reason": fit.reason,
        "particles": fit.simulation.config.particles,
    }
