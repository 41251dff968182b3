"""How long a simulation and its pictures take on this machine: a second of the very programs that
will run, and no table of other machines' figures.
"""

import statistics
import time
from dataclasses import dataclass, replace

import jax
import numpy as np

from jaxphys.mpm.loop.frames import next_frame, slabs_for
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.simulation import Simulation
from jaxphys.pipeline.film import Artist
from jaxphys.pipeline.frames import moment_of
from jaxphys.pipeline.output import Timing
from jaxphys.scene.build import Built
from jaxphys.scene.scene import Scene

BUDGET = 1.0  # seconds of stepping, and as many of drawing
FEW = 4  # steps to begin with, when nothing is known of their length
MOST_CALLS = 5


@dataclass(frozen=True)
class Pace:
    """What was measured.

    Attributes:
        compile: seconds until the program of a frame was ready, from wherever it came.
        step: seconds a step, of the first ones.
        steps: how many were measured.
    """

    compile: float
    step: float
    steps: int


def pace(simulation: Simulation, budget: float = BUDGET) -> Pace:
    """Compiles the program of the first frame, and steps through its beginning for about `budget`
    seconds; what it computes is thrown away, and the program is there when the run begins, as is
    that which looks at a frame.

    Raises:
        SimulationError: the first steps fail.
    """
    config = windowed(simulation.config, simulation.state, slabs=slabs_for(simulation.stepping))
    model, state = simulation.model, simulation.state
    if config.placement.devices > 1:
        model, state = jax.device_put((model, state), config.placement.everywhere())
    begin = time.perf_counter()
    jax.block_until_ready(next_frame(simulation, config, model, state, None))
    compiled = time.perf_counter() - begin
    moment_of(simulation, state, 0, simulation.carriers)  # compiled once a run, for any window

    def steps_taken(steps: int) -> tuple[float, int]:
        """(seconds, steps) of about so many steps from the start."""
        short = replace(simulation, steps=min(steps, simulation.steps))
        begin = time.perf_counter()
        after = jax.block_until_ready(next_frame(short, config, model, state))
        spent = time.perf_counter() - begin
        check(after.status, 1)
        return spent, max(1, int(after.status.taken) - int(state.status.taken))

    spent, taken = steps_taken(FEW)
    wanted = max(FEW, int(budget / MOST_CALLS / (spent / taken)))
    samples: list[float] = []
    total, count = spent, taken
    while len(samples) < MOST_CALLS and (total < budget or not samples):
        spent, taken = steps_taken(wanted)
        samples.append(spent / taken)
        total, count = total + spent, count + taken
    return Pace(compiled, statistics.median(samples), count)


def programs(simulation: Simulation, boxes: np.ndarray) -> int:
    """How many programs a motion needs, for windows follow it in few sizes and each is compiled.

    Args:
        simulation: that will run.
        boxes: lowest and highest coordinates of all particles in each frame, (T, 2, 3) [m], such as
            those of a pilot.
    """
    cut = slabs_for(simulation.stepping)
    dtype = simulation.state.position.dtype
    found = {
        windowed(
            replace(simulation.config, placement=replace(simulation.config.placement, devices=1)),
            simulation.state._replace(position=jax.numpy.asarray(box.T, dtype)),
            slabs=cut,
        ).window
        for box in np.unique(boxes[:-1], axis=0)
    }
    return len(found)


def drawing_pace(scene: Scene, built: Built) -> tuple[float, float]:
    """(seconds of compiling, seconds a picture) of the first frame's picture."""
    simulation, look = built
    frame = jax.device_get(simulation.frame(simulation.state, simulation.carriers))
    timing = Timing()
    artist = Artist(scene, look, [frame] * scene.frames, timing)
    group = [frame] * artist.at_once
    artist.paint(0, group)
    samples: list[float] = []
    while len(samples) < MOST_CALLS and (sum(samples) < BUDGET or not samples):
        begin = time.perf_counter()
        artist.paint(0, group)
        samples.append(time.perf_counter() - begin)
    return sum(timing.compile.values()), statistics.median(samples) / artist.at_once
