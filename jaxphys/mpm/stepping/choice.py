"""Whether a scene should take explicit or implicit steps, and why: an estimate of the work of both.

An explicit step is one pass. An implicit one is Newton's method, each iteration of which solves a
linear system in as many passes as a wave needs steps to go where it must: the cells of the longest
path through the body, or fewer where the step is shorter than that takes. So implicit steps pay
where what one sees moves slowly beside sound: at rest, under slow loads, in metal.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.state import Config, Model, State
from jaxphys.mpm.stepping.bounds import fastest, largest_stable_dt
from jaxphys.mpm.stepping.fixed import SAFETY
from jaxphys.mpm.stepping.implicit import ADVECTION

ITERATIONS = 3  # of Newton's method in a step
OTHERS = 5  # passes of a Newton iteration and of a step, besides the linear system
PRODUCTS = 2.0  # of a linear system for each cell of the longest path
MARGIN = 2.0  # by which implicit steps must be cheaper to be advised: they are less accurate


class Choice(NamedTuple):
    """What is advised, and from what.

    Attributes:
        stepping: "explicit" or "implicit".
        explicit: steps in the time asked for, of one pass each.
        implicit: passes in that time.
        length: of an implicit step [s]; ratio: to that of an explicit one.
        cells: along the longest path.
        reason: one line for a user.
    """

    stepping: str
    explicit: float
    implicit: float
    length: float
    ratio: float
    cells: float
    reason: str


def advised(explicit_dt: float, implicit_dt: float, cells: float, time: float) -> Choice:
    """The choice from numbers alone.

    Args:
        explicit_dt, implicit_dt: longest steps [s] that stability, and that speeds allow.
        cells: along the longest path through the matter.
        time: that is simulated at a stretch, a frame [s].
    """
    length = min(implicit_dt, time)
    ratio = length / explicit_dt
    explicit = time / explicit_dt
    products = PRODUCTS * min(cells, ratio)
    implicit = time / length * ITERATIONS * (products + OTHERS)
    pays = MARGIN * implicit < explicit
    about = f"an implicit step is {ratio:.3g} explicit ones long and costs about " + (
        f"{implicit * length / time:.3g} of them ({cells:.3g} cells along the longest path)"
    )
    reason = f"implicit pays: {about}" if pays else f"explicit is cheaper: {about}"
    stepping = "implicit" if pays else "explicit"
    return Choice(stepping, explicit, implicit, length, ratio, cells, reason)


@jax.jit(static_argnums=0)
def _speed_and_span(config: Config, model: Model, state: State) -> tuple[Array, Array]:
    span = jnp.max(state.position, axis=1) - jnp.min(state.position, axis=1)
    return fastest(config, model, state), jnp.max(span)


def which_stepping(config: Config, model: Model, state: State, time: float) -> Choice:
    """What to take for a scene as it is now. Runs on the host.

    time: between frames [s].

    Raises:
        InputError: the state is not finite.
    """
    bounds = largest_stable_dt(config, model, state)
    speed, span = (float(x) for x in _speed_and_span(config, model, state))
    dx = config.grid.spacing
    longest = ADVECTION * dx / speed if speed > 0 else float("inf")
    return advised(SAFETY * float(bounds.dt), longest, max(span / dx, 1.0), time)
