"""The time step of a scene: as large as the bounds allow, a whole number of them to a frame."""

import math

from jaxphys.core.errors import InputError
from jaxphys.mpm.state import Config, Model, State
from jaxphys.mpm.time_step import StepBounds, largest_stable_dt, validate_dt
from jaxphys.scene.scene import Scene

# The bounds hold for the initial state; an object that is pressed together gets stiffer.
SAFETY = 0.75
MOST_STEPS = 1_000_000


def choose_substep(
    scene: Scene, config: Config, model: Model, state: State
) -> tuple[float, int, StepBounds]:
    """The time step [s], steps a frame, and the bounds.

    Raises:
        InputError: a substep that is asked for breaks the bounds and is not declared unsafe; the
            message gives the largest safe one.
    """
    bounds = largest_stable_dt(config, model, state)
    frame = scene.seconds_per_frame
    wanted = SAFETY * bounds.dt
    if scene.substep is not None:
        wanted = scene.substep
        try:
            validate_dt(wanted, bounds, unsafe=scene.unsafe_substep)
        except InputError as error:
            raise InputError(f"substep: {error}, or set unsafe_substep") from None
    steps = max(1, math.ceil(frame / wanted - 1e-9))
    if steps > MOST_STEPS:
        raise InputError(
            f"substep: {wanted:.3g} s makes {steps} steps a frame; use a coarser grid or a softer "
            "or denser material"
        )
    return frame / steps, steps, bounds
