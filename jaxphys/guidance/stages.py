"""Parts of an optimisation: which priors are asked, what learns how fast, whether Gaussians are
added.

The paper has two: geometry under the 3D and the 2D prior together, then appearance under the 2D
prior alone, with densification. One stage that does all of it at once is enough for small priors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import jax.numpy as jnp

from jaxphys.core.errors import InputError, nearest

Rates = tuple[tuple[str, float], ...]
Density = Literal["none", "gradients", "compact"]
DENSITIES = ("none", "gradients", "compact")
RATES: Rates = (
    ("means", 4e-4),
    ("log_scales", 6e-3),
    ("quaternions", 6e-3),
    ("opacity_logits", 2e-2),
    ("harmonics", 1.5e-2),
)


@dataclass(frozen=True)
class Stage:
    """A part of the optimisation. The 2D prior is asked in each.

    Attributes:
        share: of the steps, relative to the shares of the other stages.
        shape: whether the 3D prior is asked too.
        density: "none" keeps the Gaussians; "gradients" clones, splits and prunes them
            (`density.control_density`); "compact" also closes gaps (`compact.close_gaps`).
        rates: learning rate by field of `Gaussians`, all five, at the start of the whole
            optimisation: with the steps, whatever the stage, they fall to a tenth. 0 keeps a field.
    """

    share: float = 1.0
    shape: bool = True
    density: Density = "gradients"
    rates: Rates = RATES

    def __post_init__(self):
        if not 0.0 < self.share < float("inf"):
            raise InputError(f"share = {self.share}: a stage's share of the steps is above 0")
        if self.density not in DENSITIES:
            valid = nearest(self.density, DENSITIES)
            raise InputError(f"unknown density {self.density!r}: {valid}")
        wanted, given = [name for name, _ in RATES], [name for name, _ in self.rates]
        if sorted(given) != sorted(wanted):
            raise InputError(f"rates of {', '.join(given)}: give one each of {', '.join(wanted)}")
        if any(rate < 0 for _, rate in self.rates):
            raise InputError(f"rates {self.rates}: must be at least 0")


ONE = (Stage(),)


def two(geometry: float, rates: Rates = RATES) -> tuple[Stage, Stage]:
    """The paper's stages; `geometry` is the first one's share of the steps, between 0 and 1."""
    return (
        Stage(geometry, density="none", rates=rates),
        Stage(1.0 - geometry, shape=False, density="compact", rates=rates),
    )


def ends(stages: Sequence[Stage], steps: int) -> tuple[int, ...]:
    """The step before which each stage ends, rising to `steps`."""
    total, passed, found = sum(stage.share for stage in stages), 0.0, []
    for stage in stages:
        passed += stage.share
        found.append(round(steps * passed / total))
    return (*found[:-1], steps)


def stage_at(stages: Sequence[Stage], steps: int, step: int) -> Stage:
    """The stage that step 0, 1, ... of `steps` belongs to; from `steps` on the last."""
    for stage, end in zip(stages[:-1], ends(stages, steps)[:-1], strict=True):
        if step < end:
            return stage
    return stages[-1]


def stepwise(answers: Sequence[Callable[[Any], Any]], ends: Sequence[int]) -> Callable[[Any], Any]:
    """A function of a traced step that answers with the function of the step's stage. One stage's
    is asked as it stands."""

    def answer(step):
        value = answers[-1](step)
        for earlier, end in zip(reversed(answers[:-1]), reversed(ends[:-1]), strict=True):
            value = jnp.where(step < end, earlier(step), value)
        return value

    return answer
