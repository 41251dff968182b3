"""What a problem with a known answer is: where the answer comes from, and how it is measured."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jaxphys.mpm.state import State
from jaxphys.problems.discrete import Discretisation, displacement_errors, solve


def displacement_error(problem: Discretisation, state: State) -> float:
    """L2 error of the displacement over the motion's own; infinite if the run failed."""
    return displacement_errors(problem, state)[0]


def relative_to(answer: float, measured: float, state: State) -> float:
    """|measured - answer| / |answer|; infinite if the run failed."""
    if int(state.status.code) or not math.isfinite(measured):
        return math.inf
    return abs(measured - answer) / abs(answer)


@dataclass(frozen=True)
class Problem:
    """A problem of the solver whose answer is known.

    Attributes:
        name: as tables and the command line call it.
        source: the paper or the derivation of the answer.
        build: the problem at a resolution, `build(resolution, dtype)`; where the norm is one of
            displacements, its `exact` and its `truth.motion` are the reference.
        ladder: resolutions on which its order is observed, coarsest first.
        order: the order of convergence that theory gives; None where there is none to expect, for
            the reference is itself an approximation or an experiment.
        floor: how far from the truth the reference itself may be, relative.
        resolution: what a resolution counts: "cells" along the body, or "steps" in time.
        norm: the error of the state after the last step, relative and without a unit.
    """

    name: str
    source: str
    build: Callable[[int, Any], Discretisation]
    ladder: tuple[int, ...]
    order: int | None
    resolution: str = "cells"
    floor: float = 0.0
    norm: Callable[[Discretisation, State], float] = displacement_error

    def error(self, resolution: int, dtype) -> float:
        """`norm` of what the solver makes of the problem at this resolution."""
        problem = self.build(resolution, dtype)
        return self.norm(problem, solve(problem))
