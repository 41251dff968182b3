"""From a simulation to its motion: as one differentiable program, or frame by frame."""

from functools import partial

import jax
import jax.numpy as jnp

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adaptive import rollout_adaptively
from jaxphys.mpm.loop.adjoint import Adjoint, Checkpointed, Plain, for_frames, frame_groups
from jaxphys.mpm.loop.budget import cost_of
from jaxphys.mpm.loop.rollout import keep_good, rollout
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import OK, Config, Model, State
from jaxphys.mpm.stepping import Adaptive

PLAIN = Plain()
ROOM = 2  # times as many steps a frame as fixed ones, where nobody says how many may adapt


def rollout_frames(simulation: Simulation, frames: int, *, adjoint: Adjoint = PLAIN) -> Motion:
    """The motion of a simulation, `frames` frames long, the first one its initial state.

    Pure and free of host traffic: jit it, differentiate it. It steps as the simulation's `stepping`
    says. Fixed steps that the numbers break show in the status, and as NaN from there on.

    Adaptive steps are taken twice: once without a gradient, to find them, and once more, as they
    were. The gradient is that of the realised steps; how their lengths depend on the numbers is no
    part of it.

    Args:
        simulation: from `build`, perhaps changed by `Simulation.with_`.
        frames: T, at least 1.
        adjoint: how a gradient goes back through the steps: `Plain()`, `Checkpointed()`, or
            `Truncated(window)`, which is biased.

    Raises:
        InputError: less than one frame, or a budget of `Checkpointed` that is too small.
    """
    if frames < 1:
        raise InputError(f"rollout_frames: {frames} frames; give at least 1")
    stepping, places = simulation.stepping, simulation.steps
    if isinstance(stepping, Adaptive):
        places = stepping.most_steps or ROOM * simulation.steps

    def advance(state: State, within: Adjoint = PLAIN) -> State:
        config, model = simulation.config, simulation.model
        if isinstance(stepping, Adaptive):
            return _twice(config, model, state, stepping, simulation.frame_time, places, within)
        steps = simulation.steps
        return rollout(config, model, state, dt=simulation.dt, steps=steps, adjoint=within)

    budgeted = isinstance(adjoint, Checkpointed) and adjoint.bytes is not None
    cost = cost_of(advance, simulation.state) if budgeted else None
    inner, again = for_frames(adjoint, max(frames - 1, 1), places, cost)
    advance = partial(advance, within=inner)
    if again:
        advance = jax.checkpoint(advance, prevent_cse=False)

    def look(state: State):
        frame = simulation.frame(state)
        return frame.position, frame.deformation, frame.time, frame.status, frame.body

    def step(state, _):
        state = advance(state)
        return state, look(state)

    def several(state: State, count: int):
        return jax.lax.scan(step, state, length=count)

    if again > 1:
        rest = _in_groups(several, simulation.state, frames - 1)
    else:
        _, rest = several(simulation.state, frames - 1)
    position, deformation, time, status, body = jax.tree.map(
        lambda first, after: jnp.concatenate([first[None], after]), look(simulation.state), rest
    )
    return Motion(position, deformation, time, status, simulation.carriers, body)


def _in_groups(several, state: State, frames: int):
    """Frames of which on the way back only the starts of groups are there. `several(state, count)`
    gives the state after some frames, and their looks.
    """
    groups, size = frame_groups(frames)
    full = frames // size
    group = jax.checkpoint(partial(several, count=size), prevent_cse=False)
    state, looks = jax.lax.scan(lambda s, _: group(s), state, length=full)
    looks = jax.tree.map(lambda x: x.reshape(full * size, *x.shape[2:]), looks)
    if groups == full:
        return looks
    _, rest = jax.checkpoint(partial(several, count=frames - full * size))(state)
    return jax.tree.map(lambda a, b: jnp.concatenate([a, b]), looks, rest)


def _twice(
    config: Config,
    model: Model,
    state: State,
    stepping: Adaptive,
    duration: float,
    places: int,
    adjoint: Adjoint,
) -> State:
    """A frame in the steps that adapt to it, with a gradient."""
    first, steps = rollout_adaptively(
        config,
        *jax.lax.stop_gradient((model, state)),
        stepping,
        duration=duration,
        record=places,
    )
    # Where these failed the gradient must be none, whatever the replay says of them: it goes back
    # through it, as not a number.
    count = jnp.maximum(steps.count, 1)
    end = rollout(config, model, state, dt=steps.dt, steps=count, adjoint=adjoint)
    good = first.status.code == OK
    status = jax.tree.map(partial(jnp.where, good), end.status, first.status)
    return keep_good(state, end._replace(status=status), count)


@partial(jax.jit, static_argnames="config")
def advance_frame(config: Config, model: Model, state: State, dt, steps) -> State:
    """The state a frame later, for callers who look at every frame; compiled once a program.

    `steps` is a number, not a part of the program. After a failure the state of the last good frame
    comes back with the failure's status.
    """
    return rollout(config, model, state, dt=dt, steps=steps)


@partial(jax.jit, static_argnames=("config", "stepping"))
def advance_adaptively(
    config: Config, model: Model, state: State, stepping: Adaptive, duration, share
) -> State:
    """As `advance_frame`, in steps that adapt; share: of the step that `stepping` takes."""
    return rollout_adaptively(config, model, state, stepping, duration=duration, share=share)[0]


def next_frame(
    simulation: Simulation, config: Config, model: Model, state: State, refinement: int | None = 0
) -> State:
    """The state a frame later, as the simulation's `stepping` says, in one compiled program.

    Args:
        config, model: of the simulation, perhaps with a window, and where the devices want it.
        refinement: how often the step is halved; None takes none, and only makes the program.
    """
    dtype = state.position.dtype
    if isinstance(simulation.stepping, Adaptive):
        duration = 0.0 if refinement is None else simulation.frame_time
        share = jnp.asarray(0.5 ** (refinement or 0), dtype)
        return advance_adaptively(
            config, model, state, simulation.stepping, jnp.asarray(duration, dtype), share
        )
    steps = simulation.steps * 2 ** (refinement or 0)
    dt = jnp.asarray(simulation.frame_time / steps, dtype)
    taken = 0 if refinement is None else steps
    return advance_frame(config, model, state, dt, jnp.asarray(taken, jnp.int32))
