"""A motion at given times, as one differentiable program."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adjoint import Adjoint, Checkpointed, Plain, for_frames
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.motion import Motion
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import State
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.stepping.fixed import SAFETY

CHECKPOINTED = Checkpointed()
MOST_STEPS = 100_000  # between two of the times
RUNGS_PER_DOUBLING = (
    2  # of the numbers of steps, for each of which a reverse derivative is compiled
)


class TooManySteps(InputError):
    """Numbers that no simulation would come to the end of."""


def steps_for(simulation: Simulation, longest: float) -> int:
    """How many steps an interval of `longest` [s] takes at the simulation's present numbers, the
    next of a ladder of numbers: a reverse derivative is compiled for each. On the host.

    Raises:
        TooManySteps: more than `MOST_STEPS`.
    """
    bounds = largest_stable_dt(simulation.config, simulation.model, simulation.state)
    needed = max(1.0, longest / (SAFETY * bounds.dt))
    if needed > MOST_STEPS:
        raise TooManySteps(
            f"free: these numbers allow steps of {SAFETY * bounds.dt:.3g} s ({bounds.reason}), "
            f"{needed:.3g} of them between two times; start from softer or less viscous matter, or "
            "on a coarser grid"
        )
    return int(np.ceil(2 ** (np.ceil(RUNGS_PER_DOUBLING * np.log2(needed)) / RUNGS_PER_DOUBLING)))


def motion_at(
    simulation: Simulation,
    times: tuple[float, ...],
    steps: Array | int,
    adjoint: Adjoint = CHECKPOINTED,
    horizon: Array | int | None = None,
) -> Motion:
    """The motion of a simulation at `times`. Pure; differentiable by all of its numbers.

    Args:
        simulation: whose time step is not asked.
        times: T of them [s], from 0 on, increasing. Static.
        steps: between two of them. May be traced, so that one program serves any number of them;
            then there is no reverse mode, and `adjoint` is not asked.
        adjoint: how a gradient goes back.
        horizon: so many of the times are computed, which may be traced; the others repeat the last.
    """
    intervals = np.diff([0.0, *times])
    state = simulation.state

    def look(state: State):
        frame = simulation.frame(state)
        return frame.position, frame.deformation, frame.time, frame.status, frame.body

    first = 1 if times[0] == 0 else 0
    inner: Adjoint = Plain()
    again = 0
    if isinstance(steps, int):
        inner, again = for_frames(adjoint, max(len(times) - first, 1), steps)

    def advance(state, dt):
        return rollout(
            simulation.config, simulation.model, state, dt=dt, steps=steps, adjoint=inner
        )

    if again:
        advance = jax.checkpoint(advance, prevent_cse=False)

    def body(state, interval):
        dt, index = interval
        if horizon is None:
            state = advance(state, dt)
        else:
            state = jax.lax.cond(index < horizon, advance, lambda state, _: state, state, dt)
        return state, look(state)

    moments = [jax.tree.map(lambda x: x[None], look(state))] if first else []
    if len(times) > first:
        dt = jnp.asarray(intervals[first:] / steps, state.position.dtype)
        moments.append(jax.lax.scan(body, state, (dt, jnp.arange(first, len(times))))[1])
    position, deformation, time, status, rigid = jax.tree.map(
        lambda *parts: jnp.concatenate(parts), *moments
    )
    return Motion(position, deformation, time, status, simulation.carriers, rigid)


def still(simulation: Simulation, times: tuple[float, ...]) -> Motion:
    """A motion in which nothing moves, at `times` [s]: what a fit must beat."""
    frame = simulation.frame(simulation.state)
    position, deformation, status, body = jax.tree.map(
        lambda x: jnp.repeat(x[None], len(times), axis=0),
        (frame.position, frame.deformation, frame.status, frame.body),
    )
    time = jnp.asarray(times, position.dtype)
    return Motion(position, deformation, time, status, simulation.carriers, body)


def some(motion: Motion, which: np.ndarray) -> Motion:
    """Some frames of a motion, (T,) of them."""
    position, deformation, time, status, body = jax.tree.map(
        lambda x: x[which],
        (motion.position, motion.deformation, motion.time, motion.status, motion.body),
    )
    return Motion(position, deformation, time, status, motion.carriers, body)
