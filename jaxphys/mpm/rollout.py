"""Many steps in one compiled program, and what becomes of a simulation that fails."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError

from .adjoint import Adjoint, Plain, for_frames, lean, repeat
from .state import (
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_FINITE,
    OK,
    STEP_TOO_LARGE,
    Config,
    Model,
    State,
    Status,
)
from .step import step

PLAIN = Plain()


class Frames(NamedTuple):
    """A rollout's frames in public order. The frame after the first `steps_per_frame` is frame 0.

    position: (T, N, 3) [m]; deformation: (T, N, 3, 3), the total gradient where it is kept.
    After a failure the last good frame is repeated.
    """

    position: Array
    deformation: Array


class SimulationError(InputError):
    """A simulation failed. `frame`, `step`, `particle` and `code` say where and how."""

    def __init__(self, message: str, frame: int | None, step: int, particle: int, code: int):
        super().__init__(message)
        self.frame, self.step, self.particle, self.code = frame, step, particle, code


_CAUSES = {
    NOT_FINITE: (
        "became infinite or not a number",
        "take a smaller dt, a softer material, or less force",
    ),
    LEFT_GRID: (
        "left the grid",
        "enlarge the domain, or add a boundary that holds particles inside",
    ),
    STEP_TOO_LARGE: (
        "moved more than one cell in one step",
        "take a smaller dt, or lower the speed",
    ),
    LEFT_WINDOW: (
        "outgrew the window of the grid",
        "enlarge Config.window, or set it to None",
    ),
}


def check(status: Status, frame: int | None = None) -> None:
    """Raise `SimulationError` with the frame, step, particle and remedy unless all is well.

    Waits for the computation that `status` comes from. Not for use inside jit.
    """
    code = int(status.code)
    if code == OK:
        return
    what, remedy = _CAUSES[code]
    where = "" if frame is None else f"frame {frame}, "
    number, particle = int(status.step), int(status.particle)
    raise SimulationError(
        f"Simulation failed at {where}step {number}: particle {particle} {what}; {remedy}.",
        frame,
        number,
        particle,
        code,
    )


def rollout(
    config: Config, model: Model, state: State, *, dt, steps: int, adjoint: Adjoint = PLAIN
) -> State:
    """The state after `steps` steps of `dt` [s], or `state` with the failure's status if one fails.

    Pure and free of host traffic: jit it, differentiate it. The status tells the first failing
    step and particle; `check` turns it into an exception.
    """
    end = repeat(adjoint, lean(lambda s: step(config, model, s, dt)), state, steps)
    return _keep_good(state, end)


def rollout_frames(
    config: Config,
    model: Model,
    state: State,
    *,
    dt,
    steps_per_frame: int,
    frames: int,
    adjoint: Adjoint = PLAIN,
) -> tuple[State, Frames]:
    """The last good state and the frames of `frames` times `steps_per_frame` steps of `dt` [s]."""
    inner, again = for_frames(adjoint, frames, steps_per_frame)

    def advance(state):
        return rollout(config, model, state, dt=dt, steps=steps_per_frame, adjoint=inner)

    if again:
        advance = jax.checkpoint(advance, prevent_cse=False)

    def body(state, _):
        state = advance(state)
        return state, Frames(*public_arrays(state))

    return jax.lax.scan(body, state, length=frames)


def public_arrays(state: State) -> tuple[Array, Array]:
    """Positions (N, 3) [m] and total deformation gradients (N, 3, 3)."""
    gradient = state.deformation if state.total is None else state.total
    return jnp.moveaxis(state.position, -1, 0), jnp.moveaxis(gradient, -1, 0)


def frame_step(config: Config, steps: int, adjoint: Adjoint = PLAIN):
    """A compiled `(model, state, dt) -> state` of `steps` steps, for callers who report progress.

    The state given is consumed (its memory is reused). After a failure the state of the last good
    frame comes back with the failure's status.
    """

    @partial(jax.jit, donate_argnums=(1,))
    def advance(model: Model, state: State, dt) -> State:
        return rollout(config, model, state, dt=dt, steps=steps, adjoint=adjoint)

    return advance


def _keep_good(before: State, after: State) -> State:
    """`after`, or where it failed `before` with the status and step count of the failure."""
    good = after.status.code == OK
    kept = jax.tree.map(lambda new, old: jnp.where(good, new, old), after, before)
    return kept._replace(status=after.status)
