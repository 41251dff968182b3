"""The time step: as large as the bounds allow, a whole number of them to a frame."""

import math
from dataclasses import dataclass
from typing import ClassVar

from jaxphys.core.errors import InputError
from jaxphys.core.fields import Checked
from jaxphys.mpm.state import Config, Model, State
from jaxphys.mpm.stepping.bounds import StepBounds, largest_stable_dt, validate_dt

# The bounds hold for the initial state; an object that is pressed together gets stiffer, and a
# frame that starts stiffer than its step allows fails.
SAFETY = 0.75
MOST_STEPS = 1_000_000


@dataclass(frozen=True)
class Fixed(Checked):
    """Equal steps, as short as the state at the start asks for; looked at again every frame, which
    fails where they have become too long.
    """

    type: ClassVar[str] = "fixed"


def choose_substep(
    config: Config,
    model: Model,
    state: State,
    frame_time: float,
    substep: float | None = None,
) -> tuple[float, int, StepBounds]:
    """The time step [s], steps a frame, and the bounds.

    Args:
        config, model, state: what is stepped, all numbers concrete.
        frame_time: between frames [s].
        substep: at most so long [s]; None: as long as the bounds allow.

    Raises:
        InputError: `substep` breaks the bounds and `Config.check_step` is on; the message gives the
            largest safe one.
    """
    bounds = largest_stable_dt(config, model, state)
    wanted = SAFETY * bounds.dt
    if substep is not None:
        wanted = substep
        try:
            validate_dt(wanted, bounds, unsafe=not config.check_step)
        except InputError as error:
            raise InputError(f"substep: {error}, or set unsafe_substep") from None
    if not frame_time <= MOST_STEPS * wanted:  # also where the step is zero or not a number
        raise InputError(
            f"substep: {wanted:.3g} s makes more than {MOST_STEPS} steps a frame; use a coarser "
            "grid or a softer or denser material"
        )
    steps = max(1, math.ceil(frame_time / wanted - 1e-9))
    return frame_time / steps, steps, bounds
