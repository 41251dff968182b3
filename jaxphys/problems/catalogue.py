"""All problems by name."""

from jaxphys.problems.bar import FREE_BAR, HELD_BAR
from jaxphys.problems.cantilever import CANTILEVER
from jaxphys.problems.channel import BINGHAM, POISEUILLE
from jaxphys.problems.colliding import COLLIDING_BARS, PARTING_BARS
from jaxphys.problems.column import SUDDEN_COLUMN
from jaxphys.problems.cube import FREE_CUBE
from jaxphys.problems.dam import DAM_BREAK
from jaxphys.problems.disc import SPINNING_DISC
from jaxphys.problems.discs import COLLIDING_DISCS
from jaxphys.problems.granular import LOW_COLUMN, TALL_COLUMN
from jaxphys.problems.hertz import HERTZ_IMPACT
from jaxphys.problems.incline import SLIDING_BLOCK, STICKING_BLOCK
from jaxphys.problems.particle import BREATHING_PARTICLE
from jaxphys.problems.ringing import RINGING_CUBE
from jaxphys.problems.stacked import SLIDING_ON_SLAB, STICKING_ON_SLAB
from jaxphys.problems.taylor_bar import TAYLOR_BAR
from jaxphys.problems.taylor_green import TAYLOR_GREEN
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
        RINGING_CUBE,
        CANTILEVER,
        COLLIDING_BARS,
        PARTING_BARS,
        COLLIDING_DISCS,
        SPINNING_DISC,
        SLIDING_BLOCK,
        STICKING_BLOCK,
        SLIDING_ON_SLAB,
        STICKING_ON_SLAB,
        HERTZ_IMPACT,
        TAYLOR_BAR,
        POISEUILLE,
        BINGHAM,
        TAYLOR_GREEN,
        DAM_BREAK,
        LOW_COLUMN,
        TALL_COLUMN,
    )
}
