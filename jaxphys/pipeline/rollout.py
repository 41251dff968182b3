"""A motion as one differentiable function, for use inside `jax.jit`."""

from jaxphys.mpm.adjoint import Adjoint, Plain
from jaxphys.mpm.rollout import Frames
from jaxphys.mpm.rollout import rollout_frames as solver_rollout_frames
from jaxphys.scene.build import Simulation

PLAIN = Plain()


def rollout_frames(simulation: Simulation, frames: int, *, adjoint: Adjoint = PLAIN) -> Frames:
    """Positions (T, N, 3) [m] and deformation gradients (T, N, 3, 3) of all particles.

    Args:
        simulation: from `build`, perhaps changed by `Simulation.with_`.
        frames: T, frames after the initial state.
        adjoint: how a gradient goes back through the steps: `Plain()` or `Checkpointed()`.
    """
    _, motion = solver_rollout_frames(
        simulation.config,
        simulation.model,
        simulation.state,
        dt=simulation.dt,
        steps_per_frame=simulation.steps,
        frames=frames,
        adjoint=adjoint,
    )
    return motion
