"""A simulation frame by frame on the host: progress, checkpoints, and what a failure leaves
behind.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from jaxphys.mpm.fracture import number_of_pieces
from jaxphys.mpm.rollout import SimulationError, check, frame_step, public_arrays
from jaxphys.mpm.state import State
from jaxphys.pipeline.interrupt import deferred_interrupt
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.resume import Checkpoint
from jaxphys.scene.build import Simulation

SAVE_EVERY = 20.0  # seconds of work that an interruption without warning may cost


@dataclass
class Record:
    """What frames look like so far, on the host.

    Attributes:
        positions: of the particles that carry Gaussians, by frame, each (K, 3) float [m].
        deformations: their total deformation gradients, by frame, each (K, 3, 3).
        metrics: numbers of each frame, ready for JSON.
    """

    positions: list[np.ndarray]
    deformations: list[np.ndarray]
    metrics: list[dict]


@jax.jit
def _look(simulation: Simulation, state: State):
    """What is drawn, and sums over all particles, of one state."""
    position, gradient = public_arrays(state)
    mass, velocity = simulation.model.mass, state.velocity
    total = jnp.sum(mass)
    sums = {
        "mass": total,
        "centre_of_mass": jnp.sum(mass * state.position, axis=1) / total,
        "momentum": jnp.sum(mass * velocity, axis=1),
        "kinetic_energy": 0.5 * jnp.sum(mass * jnp.sum(velocity**2, axis=0)),
        "lowest": jnp.min(state.position, axis=1),
        "highest": jnp.max(state.position, axis=1),
        "fastest": jnp.sqrt(jnp.max(jnp.sum(velocity**2, axis=0))),
    }
    return position[simulation.particles], gradient[simulation.particles], sums


def _rounded(value: np.ndarray):
    """A float32 as the shortest decimal that reads back to it."""
    if value.ndim:
        return [_rounded(part) for part in value]
    return float(str(np.float32(value)))


def _add(record: Record, simulation: Simulation, state: State, frame: int) -> None:
    position, gradient, sums = jax.device_get(_look(simulation, state))
    row = {"frame": frame, "time": _rounded(np.asarray(state.time))}
    row |= {"steps": int(state.status.taken)}
    row |= {name: _rounded(np.asarray(value)) for name, value in sums.items()}
    if simulation.breaks:
        row["pieces"] = number_of_pieces(
            np.asarray(state.position).T, 1.1 * simulation.config.grid.spacing, minimum_size=20
        )
    record.positions.append(position)
    record.deformations.append(gradient)
    record.metrics.append(row)


def _save(checkpoint: Checkpoint, state: State, record: Record) -> None:
    arrays = {f"state_{i:02d}": leaf for i, leaf in enumerate(jax.tree.leaves(state))}
    arrays["positions"] = np.stack(record.positions)
    arrays["deformations"] = np.stack(record.deformations)
    arrays["metrics"] = np.frombuffer(json.dumps(record.metrics).encode(), np.uint8)
    checkpoint.save(len(record.metrics) - 1, arrays)


def save_record(checkpoint: Checkpoint, simulation: Simulation, record: Record) -> None:
    """Saves a finished simulation, so that a second run need only draw it."""
    _save(checkpoint, simulation.state, record)


def _restore(checkpoint: Checkpoint, frame: int, like: State) -> tuple[State, Record]:
    arrays = checkpoint.load(frame)
    leaves = [jnp.asarray(arrays[name]) for name in sorted(arrays) if name.startswith("state_")]
    state = jax.tree.unflatten(jax.tree.structure(like), leaves)
    metrics = json.loads(arrays["metrics"].tobytes())
    return state, Record(list(arrays["positions"]), list(arrays["deformations"]), metrics)


def simulate(
    simulation: Simulation,
    frames: int,
    *,
    checkpoint: Checkpoint | None = None,
    timing: Timing | None = None,
    progress: bool = False,
    watch: Callable[[int], None] | None = None,
) -> Record:
    """Runs a simulation; frame 0 is its initial state.

    Args:
        simulation: from `scene.build`.
        frames: number of frames, the initial one included.
        checkpoint: where to go on from and to save to now and then, and when interrupted.
        timing: gets the compilation's seconds.
        progress: whether to show a bar with the time left.
        watch: called with the number of each frame done; may raise KeyboardInterrupt.

    Raises:
        SimulationError: names frame, particle and remedy; its `record` holds the good frames.
        KeyboardInterrupt: after the checkpoint is saved.
    """
    timing = timing or Timing()
    state, record = simulation.state, Record([], [], [])
    done = checkpoint.frame() if checkpoint else None
    if done is not None:
        state, record = _restore(checkpoint, done, state)
    else:
        _add(record, simulation, state, 0)
    dt = jnp.asarray(simulation.dt, state.position.dtype)
    # The initial state belongs to the caller, but a compiled frame consumes what it is given.
    state = jax.tree.map(jnp.array, state)
    with timing.compiling("simulate"):
        advance = (
            frame_step(simulation.config, simulation.steps)
            .lower(simulation.model, state, dt)
            .compile()
        )
    bar = tqdm(
        total=frames,
        initial=len(record.metrics),
        desc="simulate",
        unit="frame",
        disable=not progress,
    )
    saved = time.monotonic()
    with bar, deferred_interrupt() as interrupted:
        while len(record.metrics) < frames:
            frame = len(record.metrics)
            state = advance(simulation.model, state, dt)
            try:
                check(state.status, frame)
            except SimulationError as error:
                error.record = record
                raise
            _add(record, simulation, state, frame)
            bar.update()
            stop = interrupted()
            try:
                if watch:
                    watch(frame)
            except KeyboardInterrupt:
                stop = True
            if checkpoint and (stop or time.monotonic() - saved > SAVE_EVERY):
                _save(checkpoint, state, record)
                saved = time.monotonic()
            if stop:
                raise KeyboardInterrupt
    return record
