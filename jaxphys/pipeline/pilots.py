"""Pilots of a scene: the same motion on coarser grids, to learn how right a finer one will be.

A pilot is what a run on its grid would be, but for the skin of the objects, which has no more
particles than the grid needs (`accuracy.pilot_particles`). What is compared are the objects'
Gaussians, or some thousands of them.
"""

import time
from dataclasses import dataclass, replace
from itertools import islice

import jax.numpy as jnp
import numpy as np

from jaxphys.accuracy.convergence import Convergence, NoOrder, convergence
from jaxphys.accuracy.pilot_particles import carried, coarser
from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.mpm.stepping import Implicit
from jaxphys.pipeline.frames import frames
from jaxphys.pipeline.output import Timing
from jaxphys.scene.build import Built, build, place_objects
from jaxphys.scene.place import Placed
from jaxphys.scene.scene import Scene

# Cells along an object of the pilots' grids; along a cube of its volume, to be exact. Fewer show no
# order (docs/benchmarks/tolerance.md). If these show none, one grid more is tried.
CELLS = 7.0
RATIO = 2.0**0.5
PILOTS, MOST_PILOTS = 3, 4
MOST_POINTS = 4_000  # of an object that are compared


@dataclass(frozen=True)
class Pilot:
    """One run on a coarse grid.

    Attributes:
        spacing: of the grid [m].
        particles: of all objects.
        steps: that the whole motion took.
        motion: of the points that are compared, (T, M, 3) [m].
        boxes: lowest and highest coordinates of all particles in each frame, (T, 2, 3) [m].
        seconds: that it took, compilation among them; compile: of compiling.
    """

    spacing: float
    particles: int
    steps: int
    motion: np.ndarray
    boxes: np.ndarray
    seconds: float
    compile: float


@dataclass(frozen=True)
class Pilots:
    """What pilots of a scene found.

    Attributes:
        runs: coarsest first.
        points: which Gaussians of each object are compared.
        convergence: order and error.
    """

    runs: tuple[Pilot, ...]
    points: tuple[np.ndarray, ...]
    convergence: Convergence

    @property
    def seconds(self) -> float:
        """That all of them took."""
        return sum(run.seconds for run in self.runs)


def check_scene(scene: Scene) -> None:
    """Refuses what pilots on other grids say nothing of.

    Raises:
        InputError: with the reason.
    """
    if scene.substep is not None:
        raise InputError("tolerance: chooses the time step too; leave out substep")
    if isinstance(scene.stepping, Implicit):
        raise InputError(
            "tolerance: the error of implicit steps does not follow the grid; take adaptive or "
            "fixed ones"
        )
    if scene.frames < 2:
        raise InputError("tolerance: one frame holds no motion; ask for more frames")


def with_spacing(scene: Scene, spacing: float) -> Scene:
    """The scene on another grid [m]."""
    return replace(scene, domain=replace(scene.domain, spacing=spacing))


def without_shown_filling(scene: Scene) -> Scene:
    """The scene with its filling undrawn, so that Gaussians are the same ones on every grid."""
    things = tuple(
        thing
        if thing.filling is None
        else replace(thing, filling=replace(thing.filling, show=False))
        for thing in scene.objects
    )
    return replace(scene, objects=things)


def points_of(placed: tuple[Placed, ...]) -> tuple[np.ndarray, ...]:
    """Which Gaussians of each object are compared: all, or some evenly out of their order."""
    counts = [one.moving.count for one in placed]
    return tuple(
        np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).astype(np.int64))
        for count in counts
    )


def fly(
    scene: Scene, objects: tuple[Gaussians, ...], points: tuple[np.ndarray, ...], spacing: float
) -> Pilot:
    """The scene's motion on a grid of some spacing.

    Args:
        scene: as a film has it, its filling undrawn.
        objects: its Gaussians.
        points: which of each to follow.
        spacing: of the pilot's grid [m].

    Raises:
        InputError: the objects cannot be placed on this grid.
        SimulationError: as `frames`.
    """
    begin = time.perf_counter()
    # Points are carried by all of the deformation, plastic flow included.
    scene = replace(with_spacing(scene, spacing), splats_follow="total")
    coarse = [coarser(one, spacing / 2) for one in place_objects(scene, objects)]
    for i, (one, chosen) in enumerate(zip(coarse, points, strict=True)):
        if len(chosen) and chosen[-1] >= len(one.owner):
            raise InputError(
                f"objects[{i}]: which stray Gaussians are left out depends on the grid; remove them"
            )
    simulation = build(scene, placed=tuple(one.placed for one in coarse)).simulation
    starts = [start for start, _ in simulation.objects]
    owners = [
        start + one.owner[chosen] for start, one, chosen in zip(starts, coarse, points, strict=True)
    ]
    particles = jnp.asarray(np.concatenate(owners), jnp.int32)
    offset = np.concatenate(
        [one.offset[chosen] for one, chosen in zip(coarse, points, strict=True)]
    )
    timing, motion, boxes, steps = Timing(), [], [], 0
    moments = frames(simulation, particles=particles, timing=timing, whole=True)
    for moment in islice(moments, scene.frames):
        frame = moment.frame
        motion.append(carried(np.asarray(frame.position), np.asarray(frame.deformation), offset))
        boxes.append([moment.metrics["lowest"], moment.metrics["highest"]])
        steps = moment.metrics["steps"]
    return Pilot(
        spacing,
        simulation.config.particles,
        steps,
        np.stack(motion),
        np.array(boxes),
        time.perf_counter() - begin,
        sum(timing.compile.values()),
    )


def fly_all(scene: Scene, objects: tuple[Gaussians, ...]) -> Pilots:
    """Pilots of a scene on three coarser grids, and what they say of its order and error.

    Args:
        scene: as a film has it.
        objects: its Gaussians, one set for each object.

    Raises:
        InputError: the scene cannot be piloted, or a pilot failed.
        NoOrder: no order shows; the message says why.
    """
    check_scene(scene)
    scene = without_shown_filling(scene)
    placed = place_objects(scene, objects)
    _refuse_breaking(build(scene, placed=placed))
    points, runs = points_of(placed), list[Pilot]()
    spacing = coarsest(placed)
    while True:
        try:
            runs.append(fly(scene, objects, points, spacing))
        except InputError as error:
            raise InputError(
                f"tolerance: the pilot on a grid of {spacing:.3g} m failed ({error}); "
                "without pilots nothing is known of the error"
            ) from None
        spacing /= RATIO
        if len(runs) < PILOTS:
            continue
        last = runs[-PILOTS:]
        try:
            found = convergence([run.spacing for run in last], [run.motion for run in last])
        except NoOrder:
            if len(runs) == MOST_PILOTS:
                raise
            continue
        return Pilots(tuple(runs), points, found)


def coarsest(placed: tuple[Placed, ...]) -> float:
    """Spacing of the coarsest pilot [m]: so that the smallest object has enough cells."""
    volume = min(float(np.sum(one.volumes)) for one in placed)
    return volume ** (1 / 3) / CELLS


def _refuse_breaking(built: Built) -> None:
    for law, _, _ in built.simulation.config.segments:
        if law.breaks:
            raise NoOrder(
                f"tolerance: no order shows where matter breaks ({law.name}), for where it does "
                "depends on the grid: there is no motion that finer grids come closer to"
            )
