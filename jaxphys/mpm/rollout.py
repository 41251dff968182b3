"""Many steps in one compiled program, and what becomes of a simulation that fails."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.adjoint import Adjoint, Plain, lean, repeat
from jaxphys.mpm.state import (
    COLLAPSED,
    INVERTED,
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_FINITE,
    OK,
    STEP_TOO_LARGE,
    UNSTABLE_STEP,
    Config,
    Model,
    State,
    Status,
)
from jaxphys.mpm.step import step
from jaxphys.mpm.time_step import hard_limits

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
        "moved more than one cell, or was deformed by more than its own size, in one step",
        "take a smaller dt, or lower the speed",
    ),
    LEFT_WINDOW: (
        "outgrew the window of the grid",
        "enlarge Config.window, or set it to None",
    ),
    INVERTED: (
        "is turned inside out (det F <= 0)",
        "start from deformation gradients with det F > 0",
    ),
    COLLAPSED: (
        "was pressed to less than a thousandth of its volume",
        "take a stiffer material, less force, or a smaller dt",
    ),
    UNSTABLE_STEP: (
        "is stiffer than the step allows",
        "take a smaller dt (mpm.largest_stable_dt gives one), or a softer or denser material",
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
    step and particle; `check` turns it into an exception. Derivatives of a rollout that failed are
    not numbers. `steps` may be traced, so that one program serves any number of them; then there is
    no reverse mode.

    Unless `Config.check_step` is off, a `dt` beyond `hard_limits` of `state` fails at once.
    """
    start = check_step(config, model, state, dt) if config.check_step else state
    end = repeat(adjoint, lean(lambda s: step(config, model, s, dt)), start, steps)
    return _keep_good(state, end)


def check_step(config: Config, model: Model, state: State, dt) -> State:
    """`state`, whose status becomes UNSTABLE_STEP if it is sound but too stiff for `dt` [s]."""
    limits = hard_limits(config, *jax.lax.stop_gradient((model, state)))
    # A step at the limit passes, whichever way its digits were rounded; not a number does not.
    allowed = jax.lax.stop_gradient(dt) <= (1 + 1e-4) * jnp.min(limits)
    status = state.status
    fails = (status.code == OK) & ~allowed
    return state._replace(
        status=status._replace(
            code=jnp.where(fails, UNSTABLE_STEP, status.code),
            step=jnp.where(fails, status.taken, status.step),
            particle=jnp.where(fails, jnp.argmin(limits).astype(jnp.int32), status.particle),
        )
    )


def _keep_good(before: State, after: State) -> State:
    """`after`, or where it failed `before` with the status and step count of the failure."""
    good = after.status.code == OK
    residual = jax.tree.map(partial(jnp.where, good), after.residual, before.residual)
    without: dict[str, Any] = {"status": None, "residual": None}
    rest = (state._replace(**without) for state in (after, before))
    kept = jax.tree.map(partial(_choose, good), *rest)
    return kept._replace(status=after.status, residual=jax.lax.stop_gradient(residual))


@jax.custom_jvp
def _choose(good: Array, new: Array, old: Array) -> Array:
    """`new` if good, else `old`, whose derivative by anything is then not a number.

    The old value is there to go on from. Its derivative would be a finite answer, zero for all
    that acts in the steps that failed.
    """
    return jnp.where(good, new, old)


@_choose.defjvp
def _choose_jvp(primals, tangents):
    good, new, old = primals
    _, dnew, dold = tangents
    nan = jnp.asarray(jnp.nan, new.dtype)
    # Factors, so that they act on cotangents as they do on tangents.
    return _choose(good, new, old), dnew * jnp.where(good, 1, nan) + dold * jnp.where(good, 0, nan)
