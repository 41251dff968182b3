"""From a simulation to its motion: as one differentiable program, or frame by frame."""

from functools import partial

import jax
import jax.numpy as jnp

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adjoint import Adjoint, Plain, for_frames
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import Config, Model, State

PLAIN = Plain()


def rollout_frames(simulation: Simulation, frames: int, *, adjoint: Adjoint = PLAIN) -> Motion:
    """The motion of a simulation, `frames` frames long, the first one its initial state.

    Pure and free of host traffic: jit it, differentiate it. It takes the time step that the
    simulation has; one that the numbers break shows in the status, and as NaN from there on.

    Args:
        simulation: from `build`, perhaps changed by `Simulation.with_`.
        frames: T, at least 1.
        adjoint: how a gradient goes back through the steps: `Plain()` or `Checkpointed()`.

    Raises:
        InputError: less than one frame.
    """
    if frames < 1:
        raise InputError(f"rollout_frames: {frames} frames; give at least 1")
    inner, again = for_frames(adjoint, max(frames - 1, 1), simulation.steps)

    def advance(state: State) -> State:
        return rollout(
            simulation.config,
            simulation.model,
            state,
            dt=simulation.dt,
            steps=simulation.steps,
            adjoint=inner,
        )

    if again:
        advance = jax.checkpoint(advance, prevent_cse=False)

    def look(state: State):
        frame = simulation.frame(state)
        return frame.position, frame.deformation, frame.time, frame.status

    def body(state, _):
        state = advance(state)
        return state, look(state)

    _, rest = jax.lax.scan(body, simulation.state, length=frames - 1)
    position, deformation, time, status = jax.tree.map(
        lambda first, after: jnp.concatenate([first[None], after]), look(simulation.state), rest
    )
    return Motion(position, deformation, time, status, simulation.carriers)


@partial(jax.jit, static_argnames="config")
def advance_frame(config: Config, model: Model, state: State, dt, steps) -> State:
    """The state a frame later, for callers who look at every frame; compiled once a program.

    `steps` is a number, not a part of the program. After a failure the state of the last good frame
    comes back with the failure's status.
    """
    return rollout(config, model, state, dt=dt, steps=steps)
