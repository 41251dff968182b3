"""Whether a scene should take explicit or implicit steps, and why: an estimate of the work of both.

An explicit step is one pass. An implicit one is Newton's method with conjugate gradients, whose
products are one pass each. How many was counted (docs/stepping.md): with the root of the step's
length in explicit ones, until it no longer grows, sooner in a small body. So implicit steps pay
where what one sees moves slowly beside sound: at rest, under slow loads, in metal.

The estimate is that of steps in which something happens. At rest the motion goes on as it was, and
a step takes less, down to a fifth. Of stiff matter that slides to a stop, or rings on a floor with
friction by the midpoint rule, a step takes more.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.state import Config, Model, State
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.stepping.fixed import SAFETY
from jaxphys.mpm.stepping.implicit import crossing_time

PRODUCTS = 5.0  # of a step, times the root of its length in explicit steps
ENOUGH = 50.0  # explicit steps, times the square of cells, from which on there are no more
OTHERS = 12  # passes of a step besides: evaluations, second derivatives, start and end
LAG = "but yield lags a step behind, so what flows, as sand does, wants explicit ones"
MARGIN = 1.5  # by which implicit steps must be cheaper to be advised: they are less accurate


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
    products = PRODUCTS * math.sqrt(min(ratio, ENOUGH * cells**2))
    implicit = time / length * (products + OTHERS)
    pays = MARGIN * implicit < explicit
    about = f"an implicit step is {ratio:.3g} explicit ones long and costs about " + (
        f"{implicit * length / time:.3g} of them ({cells:.3g} cells along the longest path)"
    )
    reason = f"implicit pays: {about}" if pays else f"explicit is cheaper: {about}"
    stepping = "implicit" if pays else "explicit"
    return Choice(stepping, explicit, implicit, length, ratio, cells, reason)


@jax.jit(static_argnums=0)
def _length_and_span(config: Config, model: Model, state: State) -> tuple[Array, Array]:
    span = jnp.max(state.position, axis=1) - jnp.min(state.position, axis=1)
    speed = jnp.sqrt(jnp.max(jnp.sum(state.velocity**2, axis=0)))
    for boundary in model.boundaries:
        speed = jnp.maximum(speed, boundary.fastest().astype(speed.dtype))
    return crossing_time(config.grid.spacing, speed, model.gravity), jnp.max(span)


def which_stepping(config: Config, model: Model, state: State, time: float) -> Choice:
    """What to take for a scene as it is now: at the speeds that it has. Runs on the host.

    time: between frames [s].

    Raises:
        InputError: the state is not finite.
    """
    bounds = largest_stable_dt(config, model, state)
    longest, span = (float(x) for x in _length_and_span(config, model, state))
    cells = max(span / config.grid.spacing, 1.0)
    choice = advised(SAFETY * float(bounds.dt), longest, cells, time)
    if choice.stepping == "implicit" and any(law.plastic for law, _, _ in config.segments):
        choice = choice._replace(reason=f"{choice.reason}; {LAG}")
    return choice
