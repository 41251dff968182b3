"""The frames of a run as they are made, kept so that an interrupted run goes on where it was."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from tqdm import tqdm

from jaxphys.mpm.motion import Frame
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import State
from jaxphys.pipeline.frames import Moment, frames
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.resume import MotionCheckpoint
from jaxphys.pipeline.saving import SAVE_EVERY


@dataclass
class Record:
    """What a run has so far, on the host.

    Attributes:
        frames: of the particles that carry Gaussians.
        metrics: numbers of each frame, ready for JSON.
        reached: number of a frame and all that is needed to go on after it; set last, so that an
            interrupt between two of these leaves a frame too many at most.
    """

    frames: list[Frame] = field(default_factory=list)
    metrics: list[dict] = field(default_factory=list)
    reached: tuple[int, State] | None = None

    def add(self, moment: Moment) -> None:
        """The next frame."""
        self.frames.append(moment.frame)
        self.metrics.append(moment.metrics)
        self.reached = moment.number, moment.state

    def save(self, checkpoint: MotionCheckpoint) -> None:
        """To a checkpoint: what it does not hold yet."""
        if self.reached is not None:
            number, state = self.reached
            checkpoint.save(state, self.frames[: number + 1], self.metrics[: number + 1])

    def restore(self, checkpoint: MotionCheckpoint, like: State) -> None:
        """From a checkpoint, if there is one."""
        if found := checkpoint.restore(like):
            number, state, self.frames, self.metrics = found
            self.reached = number, state


def recorded(
    simulation: Simulation,
    count: int,
    record: Record,
    checkpoint: MotionCheckpoint,
    *,
    interrupted: Callable[[], bool],
    timing: Timing,
    progress: bool = False,
    watch: Callable[[int], None] | None = None,
) -> Iterator[Frame]:
    """The frames of a run, those from a checkpoint first, each one recorded before it is given.

    Args:
        simulation: from `scene.build`.
        count: number of frames.
        record: empty; gets every frame.
        checkpoint: where to go on from, and to save to now and then and when interrupted.
        interrupted: whether to stop after the present frame.
        timing: gets the seconds.
        progress: whether to show a bar with the time left.
        watch: called with the number of each new frame; may raise KeyboardInterrupt.

    Raises:
        SimulationError: names frame, particle and remedy; `record` holds the good frames.
        KeyboardInterrupt: after the checkpoint is saved.
    """
    record.restore(checkpoint, simulation.state)
    yield from record.frames
    if len(record.frames) >= count:
        return
    moments = frames(simulation, start=record.reached, particles=simulation.carriers, timing=timing)
    saved = time.monotonic()
    with tqdm(
        total=count,
        initial=len(record.frames),
        desc="simulate",
        unit="frame",
        disable=not progress,
    ) as bar:
        for moment in moments:
            record.add(moment)
            bar.update()
            stop = interrupted()
            try:
                if watch and moment.number:
                    watch(moment.number)
            except KeyboardInterrupt:
                stop = True
            if stop or time.monotonic() - saved > SAVE_EVERY:
                record.save(checkpoint)
                saved = time.monotonic()
            if stop:
                raise KeyboardInterrupt
            yield moment.frame
            if len(record.frames) == count:
                return
