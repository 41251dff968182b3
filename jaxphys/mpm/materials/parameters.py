"""What a parameter of a law is, and those that several laws share: a meaning is declared once, for
checks, listings and messages.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import numbers_of


@dataclass(frozen=True)
class Parameter:
    """A number that a law reads of every particle: what it means and where it may lie.

    Attributes:
        name: as scenes and `Simulation.with_` give it.
        meaning: one line, in words; of which test, where that matters.
        unit: of SI, or degrees; empty for a pure number.
        low, high: the ends of its range.
        low_included: whether `low` itself is allowed; `high` never is.
    """

    name: str
    meaning: str
    unit: str
    low: float = 0.0
    high: float = inf
    low_included: bool = False

    @property
    def text(self) -> str:
        """The range as a user reads it."""
        if self.low == -inf:
            return "any number" if self.high == inf else f"< {self.high:g}"
        if self.high == inf:
            return f"{'>=' if self.low_included else '>'} {self.low:g}"
        if self.low_included:
            return f"in [{self.low:g}, {self.high:g})"
        return f"between {self.low:g} and {self.high:g}, both excluded"

    def contains(self, values: np.ndarray) -> np.ndarray:
        """Elementwise; what is not a number lies outside."""
        above = values >= self.low if self.low_included else values > self.low
        return above & (values < self.high)


@dataclass(frozen=True)
class Alternative:
    """Another way to give the parameter called `instead_of`, which `convert` makes of it."""

    parameter: Parameter
    instead_of: str
    convert: Callable[[Any], Array]


DENSITY = Parameter("density", "mass over volume at rest", "kg/m^3")
YOUNGS_MODULUS = Parameter(
    "youngs_modulus", "stiffness: stress over strain of a bar that is pulled", "Pa"
)
POISSON_RATIO = Parameter(
    "poisson_ratio",
    "how much a bar that is pulled gets thinner, over how much it gets longer; 0.5 would keep its "
    "volume",
    "",
    low=-1,
    high=0.5,
)
BULK_MODULUS = Parameter(
    "bulk_modulus",
    "pressure over the share of volume that it takes away; a hundred times density times the "
    "square of the fastest speed is as good as water's 2.2e9 to the eye",
    "Pa",
)
SHEAR_MODULUS = Parameter(
    "shear_modulus", "stiffness against a change of shape: shear stress over shear angle", "Pa"
)
YIELD_STRESS = Parameter(
    "yield_stress",
    "stress at which a bar that is pulled starts to stay longer (uniaxial, as handbooks list it); "
    "in shear 0.58 of it",
    "Pa",
)


def check_parameter(parameter: Parameter, value, where: str) -> None:
    """Refuses a value, a number or an array, any entry of which lies outside of the range.

    Raises:
        InputError: with `where`, the first entry that does, and the range.
    """
    values = numbers_of(f"{where}: {parameter.name}", value).reshape(-1)
    wrong = np.flatnonzero(~parameter.contains(values))
    if wrong.size:
        entry = f"[{wrong[0]}]" if values.size > 1 else ""
        unit = f" {parameter.unit}" if parameter.unit else ""
        raise InputError(
            f"{where}: {parameter.name}{entry} is {values[wrong[0]]:g}{unit}, must be "
            f"{parameter.text}"
        )
