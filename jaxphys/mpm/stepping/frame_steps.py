"""What a simulation is told of its steps before it runs."""

from jaxphys.mpm.state import Config, Model, State
from jaxphys.mpm.stepping import Implicit, Stepping
from jaxphys.mpm.stepping.fixed import choose_substep


def frame_steps(
    stepping: Stepping,
    config: Config,
    model: Model,
    state: State,
    frame_time: float,
    substep: float | None = None,
) -> tuple[float, int]:
    """The time step [s] and how many make a frame, were they equal; of implicit ones the frame, for
    nothing bounds them from the start.

    Raises:
        InputError: as `choose_substep`.
    """
    if isinstance(stepping, Implicit):
        return frame_time, 1
    dt, steps, _ = choose_substep(config, model, state, frame_time, substep)
    return dt, steps
