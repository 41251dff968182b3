"""The spacing that a tolerance asks for, and what it will cost."""

import math
from dataclasses import dataclass

from jaxphys.accuracy.convergence import Convergence
from jaxphys.core.errors import InputError

# Of an error read off three grids (Roache 1994): what is aimed at is the tolerance over it.
SAFETY = 1.25
# Steps follow cells: that much finer in space, that many more of them.
DIMENSIONS = 3
FINEST = 4.0  # times finer than the finest pilot: beyond it an extrapolation means little
# Spacings come in steps of this factor, so that much the same tolerance is the same program.
STEP = 2.0**0.25


@dataclass(frozen=True)
class Choice:
    """What a tolerance comes to.

    Attributes:
        spacing: of the grid [m].
        error: expected, relative to the motion; at most the tolerance over SAFETY, unless the
            finest pilot is better than that already.
        cost: of a run at this spacing over one at the finest pilot's, by count of particles and
            steps.
    """

    spacing: float
    error: float
    cost: float


def choose(found: Convergence, tolerance: float) -> Choice:
    """The coarsest grid whose expected error, with a margin, is within the tolerance.

    No grid is coarser than the second pilot, where what is expected was seen on both sides.

    Args:
        found: of the pilots.
        tolerance: relative error of the motion that is allowed.

    Raises:
        InputError: so fine a grid is needed that pilots on these say nothing of it.
    """
    _, coarsest, finest = found.spacings
    wanted = found.spacing_for(tolerance / SAFETY)
    steps = math.ceil(math.log(coarsest / wanted) / math.log(STEP) - 1e-9)
    spacing = coarsest / STEP ** max(0, steps)
    if spacing < finest / FINEST:
        raise InputError(
            f"tolerance: {tolerance:g} needs a spacing of some {spacing:.2g} m, too far from the "
            f"{finest:.3g} m that pilots ran on; make the scene's spacing finer, or allow more: "
            f"{SAFETY * found.error_at(finest / FINEST):.1g} is in reach"
        )
    return Choice(spacing, found.error_at(spacing), (finest / spacing) ** (DIMENSIONS + 1))
