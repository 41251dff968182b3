"""From a simulation to its motion: as one differentiable program, or frame by frame."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adaptive import rollout_adaptively
from jaxphys.mpm.loop.adjoint import Adjoint, Checkpointed, Plain, for_frames, frame_groups
from jaxphys.mpm.loop.budget import cost_of
from jaxphys.mpm.loop.implicit.rollout import implicit_rollout, implicit_steps
from jaxphys.mpm.loop.rollout import keep_good, rollout
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import OK, Config, Model, State
from jaxphys.mpm.stepping import Adaptive, Fixed, Implicit, Stepping

PLAIN = Plain()
ROOM = 2  # times as many steps a frame as fixed ones, where nobody says how many may adapt
IMPLICIT_ROOM = 32  # implicit steps a frame that a gradient has room for, where nobody says


def rollout_frames(simulation: Simulation, frames: int, *, adjoint: Adjoint = PLAIN) -> Motion:
    """The motion of a simulation, `frames` frames long, the first one its initial state.

    Pure and free of host traffic: jit it, differentiate it. It steps as the simulation's `stepping`
    says. Fixed steps that the numbers break show in the status, and as NaN from there on.

    Adaptive and implicit steps are taken twice: once without a gradient, to find them, and once
    more, as they were. The gradient is that of the realised steps; how their lengths depend on the
    numbers is no part of it.

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
    stepping, places = simulation.stepping, _places(simulation)

    def advance(state: State, within: Adjoint = PLAIN) -> State:
        config, model = simulation.config, simulation.model
        if not isinstance(stepping, Fixed):
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


def _places(simulation: Simulation) -> int:
    """For how many steps of a frame a gradient has room."""
    stepping = simulation.stepping
    if isinstance(stepping, Adaptive):
        return stepping.most_steps or ROOM * simulation.steps
    if isinstance(stepping, Implicit):
        return stepping.most_steps or IMPLICIT_ROOM
    return simulation.steps


def _twice(
    config: Config,
    model: Model,
    state: State,
    stepping: Adaptive | Implicit,
    duration: float,
    places: int,
    adjoint: Adjoint,
) -> State:
    """A frame in the steps that suit it, with a gradient."""
    start = jax.lax.stop_gradient((model, state))
    # Where these failed the gradient must be none, whatever the replay says of them: it goes back
    # through it, as not a number.
    if isinstance(stepping, Implicit):
        stepping = replace(stepping, most_steps=places)
        first, report = implicit_rollout(config, *start, time=duration, stepping=stepping)
        count = jnp.maximum(report.steps, 1)
        lengths = report.lengths.at[0].max(jnp.where(report.steps > 0, 0, duration))
        end = implicit_steps(config, model, state, lengths, stepping, adjoint)
    else:
        first, steps = rollout_adaptively(
            config, *start, stepping, duration=duration, record=places
        )
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


@partial(jax.jit, static_argnames=("config", "stepping"))
def advance_implicitly(
    config: Config, model: Model, state: State, stepping: Implicit, duration, share
) -> State:
    """As `advance_frame`, in implicit steps; share: of the step that `stepping` takes."""
    return implicit_rollout(config, model, state, time=duration, stepping=stepping, share=share)[0]


def slabs_for(stepping: Stepping) -> bool | None:
    """Whether several devices may each have a slab of the grid, for `windowed`: implicit solves
    need all of it.
    """
    return False if isinstance(stepping, Implicit) else None


def next_frame(
    simulation: Simulation, config: Config, model: Model, state: State, refinement: int | None = 0
) -> State:
    """The state a frame later, as the simulation's `stepping` says, in one compiled program.

    Args:
        config, model: of the simulation, perhaps with a window, and where the devices want it.
        refinement: how often the step is halved; None takes none, and only makes the program.
    """
    dtype, stepping = state.position.dtype, simulation.stepping
    if not isinstance(stepping, Fixed):
        duration = jnp.asarray(0.0 if refinement is None else simulation.frame_time, dtype)
        share = jnp.asarray(0.5 ** (refinement or 0), dtype)
        if isinstance(stepping, Implicit):
            return advance_implicitly(config, model, state, stepping, duration, share)
        return advance_adaptively(config, model, state, stepping, duration, share)
    steps = simulation.steps * 2 ** (refinement or 0)
    dt = jnp.asarray(simulation.frame_time / steps, dtype)
    taken = 0 if refinement is None else steps
    return advance_frame(config, model, state, dt, jnp.asarray(taken, jnp.int32))
