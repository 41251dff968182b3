"""All problems by name."""

from jaxphys.problems.bar import FREE_BAR, HELD_BAR
from jaxphys.problems.column import SUDDEN_COLUMN
from jaxphys.problems.cube import FREE_CUBE
from jaxphys.problems.particle import BREATHING_PARTICLE
from jaxphys.problems.vortex import RIGID_ROTATION, VORTEX

PROBLEMS = {
    problem.name: problem
    for problem in (
        FREE_BAR,
        HELD_BAR,
        SUDDEN_COLUMN,
        BREATHING_PARTICLE,
        RIGID_ROTATION,
        VORTEX,
        FREE_CUBE,
    )
}
