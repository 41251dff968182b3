"""The frames of a run as they are made, kept so that an interrupted run goes on where it was."""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from jaxphys.mpm.motion import Frame
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import State, Status
from jaxphys.pipeline.frames import frames
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.resume import Checkpoint

SAVE_EVERY = 20.0  # seconds of work that an interruption without warning may cost


@dataclass
class Record:
    """What a run has so far, on the host.

    Attributes:
        frames: of the particles that carry Gaussians.
        metrics: numbers of each frame, ready for JSON.
        state: all that is needed to go on after the last of them.
        saved: how many frames the checkpoint holds.
    """

    frames: list[Frame] = field(default_factory=list)
    metrics: list[dict] = field(default_factory=list)
    state: State | None = None
    saved: int = 0

    def save(self, checkpoint: Checkpoint) -> None:
        """To a checkpoint, unless all of it is there."""
        if self.saved == len(self.frames):
            return
        leaves = jax.tree.leaves(self.state)
        arrays = {f"state_{i:02d}": leaf for i, leaf in enumerate(leaves)}
        arrays["positions"] = np.stack([frame.position for frame in self.frames])
        arrays["deformations"] = np.stack([frame.deformation for frame in self.frames])
        arrays["times"] = np.stack([frame.time for frame in self.frames])
        arrays["statuses"] = np.stack([np.stack(frame.status) for frame in self.frames])
        arrays["metrics"] = np.frombuffer(json.dumps(self.metrics).encode(), np.uint8)
        checkpoint.save(len(self.frames) - 1, arrays)
        self.saved = len(self.frames)

    def restore(self, checkpoint: Checkpoint, like: State) -> None:
        """From a checkpoint, if there is one."""
        done = checkpoint.frame()
        if done is None:
            return
        arrays = checkpoint.load(done)
        leaves = [jnp.asarray(arrays[name]) for name in sorted(arrays) if name.startswith("state_")]
        self.state = jax.tree.unflatten(jax.tree.structure(like), leaves)
        self.metrics = json.loads(arrays["metrics"].tobytes())
        carriers = np.arange(arrays["positions"].shape[1], dtype=np.int32)
        self.frames = [
            Frame(position, deformation, moment, Status(*status), carriers)
            for position, deformation, moment, status in zip(
                arrays["positions"],
                arrays["deformations"],
                arrays["times"],
                arrays["statuses"],
                strict=True,
            )
        ]
        self.saved = len(self.frames)


def recorded(
    simulation: Simulation,
    count: int,
    record: Record,
    checkpoint: Checkpoint,
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
    start = (len(record.frames) - 1, record.state) if record.frames else None
    moments = frames(simulation, start=start, particles=simulation.carriers, timing=timing)
    saved = time.monotonic()
    with tqdm(
        total=count,
        initial=len(record.frames),
        desc="simulate",
        unit="frame",
        disable=not progress,
    ) as bar:
        for moment in moments:
            record.frames.append(moment.frame)
            record.metrics.append(moment.metrics)
            record.state = moment.state
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
