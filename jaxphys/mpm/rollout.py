"""Many steps in one compiled program, and what becomes of a simulation that fails."""

import jax
import jax.numpy as jnp

from jaxphys.core.errors import InputError

from .adjoint import Adjoint, Plain, lean, repeat
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
    config: Config, model: Model, state: State, *, dt, steps, adjoint: Adjoint = PLAIN
) -> State:
    """The state after `steps` steps of `dt` [s], or `state` with the failure's status if one fails.

    Pure and free of host traffic: jit it, differentiate it. The status tells the first failing
    step and particle; `check` turns it into an exception. `steps` may be traced, so that one
    program serves any number of them; then there is no reverse mode.
    """
    end = repeat(adjoint, lean(lambda s: step(config, model, s, dt)), state, steps)
    return _keep_good(state, end)


def _keep_good(before: State, after: State) -> State:
    """`after`, or where it failed `before` with the status and step count of the failure."""
    good = after.status.code == OK
    kept = jax.tree.map(lambda new, old: jnp.where(good, new, old), after, before)
    return kept._replace(status=after.status)
