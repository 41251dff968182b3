"""A run as fine as a tolerance asks for: pilots, the grid that follows, what it will take, and what
came out.

    plan = plan_for(scene, objects, 1e-2)      pilots; raises where no order shows
    plan.scene                                 the scene on the grid that the tolerance needs
    plan.achieved(frames)                      the estimate after the run
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jaxphys.accuracy.choice import Choice, choose
from jaxphys.accuracy.convergence import root_mean_square
from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.mpm.motion import Frame
from jaxphys.pipeline.pace import Pace, pace, programs
from jaxphys.pipeline.pilots import Pilots, fly_all, with_spacing
from jaxphys.scene.build import Built, build
from jaxphys.scene.scene import Scene

LEAST, MOST = 1e-6, 1.0
# Below it a difference between two grids is too small to be told from that between two fillings.
DISTINCT = 1.2
SINGLE = 1e-4  # tolerances below it ask for float64, to stay well above float32's rounding


@dataclass(frozen=True)
class TolerancePlan:
    """A scene on the grid that a tolerance asks for.

    Attributes:
        scene: to be run.
        tolerance: relative error of the motion that is allowed.
        pilots: and what they found.
        choice: the grid, and the error that is expected of it.
        built: the scene, ready to run.
        pace: of its steps on this machine.
        steps: of the whole motion, expected.
        programs: to be compiled, expected.
    """

    scene: Scene
    tolerance: float
    pilots: Pilots
    choice: Choice
    built: Built
    pace: Pace
    steps: int
    programs: int

    @property
    def seconds(self) -> float:
        """Of simulating, without drawing, expected: compiling and stepping."""
        return self.programs * self.pace.compile + self.steps * self.pace.step

    def points_in(self, frame: Frame) -> np.ndarray:
        """The points that pilots followed, (M, 3) [m], in a frame of what carries Gaussians."""
        position = np.asarray(frame.carried()[0])
        starts = np.cumsum([0, *self.built.look.counts])
        chosen = [start + points for start, points in zip(starts, self.pilots.points, strict=False)]
        return position[np.concatenate(chosen)]

    def achieved(self, frames: Sequence[Frame]) -> float:
        """The estimate of the run's relative error, from its distance to the finest pilot.

        A run on a grid much like the pilot's has the error that was expected.
        """
        found, finest = self.pilots.convergence, self.pilots.runs[-1]
        ratio = finest.spacing / self.choice.spacing
        if ratio < DISTINCT:
            return self.choice.error
        motion = np.stack([self.points_in(frame) for frame in frames])
        distance = root_mean_square(motion - finest.motion[: len(motion)]) / found.scale
        return distance / (ratio**found.trusted_order - 1)


def plan_for(scene: Scene, objects: tuple[Gaussians, ...], tolerance: float) -> TolerancePlan:
    """Pilots of a scene, and the grid that its motion needs to be right to a tolerance.

    Spacing, particles and time step follow. The transfer stays the scene's, for it changes how
    motion dies away; so does the dtype, which is refused where it is too coarse.

    Args:
        scene: what is asked for; its own spacing says how coarse pilots are.
        objects: its Gaussians, one set for each object.
        tolerance: relative error of the motion, root mean square over Gaussians and frames, over
            that of their displacements.

    Raises:
        InputError: the tolerance is out of range, or out of reach, or the scene cannot be piloted.
        NoOrder: pilots show no order, and so say nothing; the message says why.
    """
    if not LEAST <= tolerance <= MOST:
        raise InputError(f"tolerance: {tolerance:g}; give a relative error, {LEAST:g} to {MOST:g}")
    if tolerance < SINGLE and jnp.result_type(float) != jnp.float64:
        raise InputError(
            f"tolerance: {tolerance:g} is less than float32 is good for; set JAX_ENABLE_X64=1"
        )
    scene = scene.filmed()
    pilots = fly_all(scene, objects)
    found = choose(pilots.convergence, tolerance)
    scene = with_spacing(scene, found.spacing)
    built = build(scene, *objects)
    return TolerancePlan(
        scene,
        tolerance,
        pilots,
        found,
        built,
        pace(built.simulation),
        expected_steps(pilots, found.spacing),
        programs(built.simulation, pilots.runs[-1].boxes),
    )


def expected_steps(pilots: Pilots, spacing: float) -> int:
    """Steps of the motion on a grid of `spacing` [m]: those of the finest pilot, more as pilots
    needed more from grid to grid.
    """
    first, last = pilots.runs[0], pilots.runs[-1]
    power = math.log(last.steps / first.steps) / math.log(first.spacing / last.spacing)
    return max(1, round(last.steps * (last.spacing / spacing) ** power))


def before_text(plan: TolerancePlan) -> str:
    """What is said before the run."""
    found, simulation = plan.pilots.convergence, plan.built.simulation
    spacings = ", ".join(f"{spacing:.3g}" for spacing in found.spacings)
    return (
        f"tolerance {plan.tolerance:g}: pilots on grids of {spacings} m took "
        f"{plan.pilots.seconds:.0f} s and show order {found.order:.2f} and an error of "
        f"{found.error:.1%}; with a spacing of {plan.choice.spacing:.4g} m "
        f"({simulation.config.particles} particles, some {plan.steps} steps) an error of "
        f"{plan.choice.error:.2%} is expected, in some {plan.seconds:.0f} s of simulating"
    )


def after_text(plan: TolerancePlan, error: float) -> str:
    """What is said after it."""
    verdict = "within" if error <= plan.tolerance else "NOT within"
    return f"tolerance {plan.tolerance:g}: the error is some {error:.2%}, {verdict} the tolerance"


def as_json(plan: TolerancePlan, error: float | None = None) -> dict:
    """The plan, and the estimate after the run, ready for JSON; no seconds, so that equal runs
    write equal files.
    """
    found = plan.pilots.convergence
    return {
        "tolerance": plan.tolerance,
        "spacings": list(found.spacings),
        "order": found.order,
        "alignment": found.alignment,
        "pilot_error": found.error,
        "spacing": plan.choice.spacing,
        "expected_error": plan.choice.error,
        "estimated_error": error,
    }
