"""The one loop over frames on the host: whoever looks at a motion as it goes takes it from here.

    for moment in islice(frames(simulation), 48): ...

Film, checkpoint, metrics and whoever comes after consume the same iterator.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.frames import next_frame, slabs_for
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.materials.fracture import number_of_pieces
from jaxphys.mpm.motion import Frame, Motion, join
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import LEFT_WINDOW, OK, Config, Model, State
from jaxphys.pipeline.output import Timing

# How often a frame that fails is tried again with half the time step.
REFINEMENTS = 5


@dataclass(frozen=True)
class Moment:
    """A frame as it is reached.

    Attributes:
        number: of the frame, 0 for the initial state.
        state: all that the solver needs to go on, on the device.
        frame: what is seen of it, on the host.
        metrics: sums over all particles, ready for JSON.
    """

    number: int
    state: State
    frame: Frame
    metrics: dict


@jax.jit
def _look(simulation: Simulation, state: State, particles: Array | None):
    """What is seen of one state, and sums over all particles."""
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
    return simulation.frame(state, particles), sums


def _rounded(value: np.ndarray):
    """A float32 as the shortest decimal that reads back to it."""
    if value.ndim:
        return [_rounded(part) for part in value]
    return float(str(np.float32(value)))


def moment_of(simulation: Simulation, state: State, number: int, particles: Array | None) -> Moment:
    """A state of a simulation as frame `number`; particles: as `frames` takes them."""
    frame, sums = jax.device_get(_look(simulation, state, particles))
    row = {"frame": number, "time": _rounded(frame.time), "steps": int(frame.status.taken)}
    row |= {name: _rounded(np.asarray(value)) for name, value in sums.items()}
    if any(law.breaks for law, _, _ in simulation.config.segments):
        row["pieces"] = number_of_pieces(
            np.asarray(state.position).T, 1.1 * simulation.config.grid.spacing, minimum_size=20
        )
    return Moment(number, state, frame, row)


def wider(config: Config) -> list[Config]:
    """Programs for a frame that outgrows what `config` computes of the grid, the next one first:
    the window on every device instead of slabs, and then the whole grid.
    """
    found = []
    if config.slabs is not None:
        found.append(replace(config, slabs=None))
    if config.window is not None:
        found.append(replace(config, slabs=None, window=None))
    return found


def retried(simulation: Simulation, config: Config, model: Model, before: State) -> State:
    """The state a frame later, tried again as `frames` says; where all fails, `before` with the
    status of the last failure.

    Args:
        config, model: of the simulation, see `mpm.loop.frames.next_frame`.
    """
    program, refinements = config, 0 if simulation.given_substep is not None else REFINEMENTS
    for refinement in range(refinements + 1):
        state = next_frame(simulation, program, model, before, refinement)
        for more in wider(program):
            if int(state.status.code) != LEFT_WINDOW:
                break
            program = more
            state = next_frame(simulation, program, model, before, refinement)
        if int(state.status.code) == OK:
            break
    return state


def frames(
    simulation: Simulation,
    *,
    start: tuple[int, State] | None = None,
    particles: Array | None = None,
    timing: Timing | None = None,
    whole: bool = False,
) -> Iterator[Moment]:
    """Frame after frame without end; take as many as are wanted.

    A frame that fails is tried again from its start with half the time step, or half of what an
    adaptive step takes of its bounds, five times at most, unless the time step was asked for. The
    frames before it stay as they are, and the next one begins with the simulation's own step again:
    what a frame is depends on its start alone.

    Args:
        simulation: from `scene.build`.
        start: number and state of a frame to go on after; None: the first moment is frame 0.
        particles: those that frames hold, see `Simulation.frame`; None: all.
        timing: gets the seconds, those of compiling apart.
        whole: compute all of the grid, in one program: for motions that take less time than it
            takes to compile a window.

    Raises:
        SimulationError: names frame, particle and remedy; every moment before it was good.
    """
    timing = timing or Timing()
    number, state = (0, simulation.state) if start is None else start
    config, model = simulation.config, simulation.model
    slabs = slabs_for(simulation.stepping)

    def cut(config: Config, state: State) -> Config:
        return config if whole else windowed(config, state, slabs=slabs)

    if config.placement.devices > 1:
        # Where the frames leave it, so that the first one is no program of its own, nor its look.
        model, state = jax.device_put((model, state), config.placement.everywhere())
    if start is None:
        check(state.status, 0)
        yield moment_of(simulation, state, 0, particles)

    with timing.stage("simulate"), timing.compiling("simulate"):
        jax.block_until_ready(next_frame(simulation, cut(config, state), model, state, None))
    while True:
        number += 1
        with timing.stage("simulate"):
            state = retried(simulation, cut(config, state), model, state)
            check(state.status, number)
            moment = moment_of(simulation, state, number, particles)
        yield moment


def simulate(simulation: Simulation, count: int, *, particles: Array | None = None) -> Motion:
    """The motion of a simulation on the host, `count` frames long, the first one its initial state.

    As `rollout_frames`, without gradients: frames come one by one, and one that fails is tried
    again with smaller steps.

    Args:
        simulation: from `scene.build`.
        count: number of frames.
        particles: those that frames hold, see `Simulation.frame`; None: all.

    Raises:
        InputError: less than one frame.
        SimulationError: names frame, particle and remedy.
    """
    if count < 1:
        raise InputError(f"simulate: {count} frames; give at least 1")
    return join([moment.frame for moment in islice(frames(simulation, particles=particles), count)])
