"""What each parameter of a material means, in which unit and range: declared once, for checks,
listings and messages.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.plasticity import triaxial_friction_angle


@dataclass(frozen=True)
class Range:
    """What a parameter means and where it may lie.

    Attributes:
        meaning: in words; of which test, where that matters.
        text: the range as a user reads it.
        unit: of SI, or degrees.
        low, high: its ends.
        low_included: whether `low` itself is allowed.
    """

    meaning: str
    text: str
    unit: str
    low: float
    high: float
    low_included: bool = False

    def contains(self, values: np.ndarray) -> np.ndarray:
        """Elementwise; what is not a number lies outside."""
        above = values >= self.low if self.low_included else values > self.low
        return above & (values < self.high)


@dataclass(frozen=True)
class Alternative:
    """Another way to give a parameter: `convert` turns it into the one called `name`."""

    name: str
    convert: Callable[[np.ndarray], Array]


INFINITY = float("inf")
RANGES: Mapping[str, Range] = MappingProxyType(
    {
        "youngs_modulus": Range(
            "stiffness: stress over strain of a bar that is pulled", "> 0", "Pa", 0, INFINITY
        ),
        "poisson_ratio": Range(
            "how much a bar that is pulled gets thinner, over how much it gets longer; "
            "0.5 would keep its volume",
            "between -1 and 0.5, both excluded",
            "",
            -1,
            0.5,
        ),
        "density": Range("mass over volume at rest", "> 0", "kg/m^3", 0, INFINITY),
        "yield_stress": Range(
            "stress at which a bar that is pulled starts to stay longer (uniaxial, as handbooks "
            "list it); in shear 0.58 of it",
            "> 0",
            "Pa",
            0,
            INFINITY,
        ),
        "hardening": Range(
            "by how much that stress grows for each unit of plastic strain of the bar "
            "(isotropic, linear)",
            ">= 0",
            "Pa",
            0,
            INFINITY,
            low_included=True,
        ),
        "friction_angle": Range(
            "angle of internal friction in triaxial compression, as laboratories measure it; in "
            "plane strain the same grains slide later, at 43.9 for 30",
            "in [0, 90)",
            "degrees",
            0,
            90,
            low_included=True,
        ),
        "plane_strain_friction_angle": Range(
            "angle of internal friction in plane strain: of long slopes and of two-dimensional "
            "theory",
            "in [0, 90)",
            "degrees",
            0,
            90,
            low_included=True,
        ),
        "fracture_strain": Range(
            "largest principal strain at which tension starts to fall",
            "> 0",
            "log strain",
            0,
            INFINITY,
        ),
        "softening_strain": Range(
            "further strain at which all tension is gone", "> 0", "log strain", 0, INFINITY
        ),
    }
)
ALTERNATIVES: Mapping[str, Alternative] = MappingProxyType(
    {"plane_strain_friction_angle": Alternative("friction_angle", triaxial_friction_angle)}
)


def check_parameter(name: str, value, where: str) -> None:
    """Refuses a value, a number or an array, any entry of which lies outside the range of the
    parameter `name`.

    Raises:
        InputError: with `where`, the worst entry, and the range.
    """
    values = np.asarray(value, dtype=np.float64).reshape(-1)
    allowed = RANGES[name]
    wrong = np.flatnonzero(~allowed.contains(values))
    if wrong.size:
        entry = f"[{wrong[0]}]" if values.size > 1 else ""
        unit = f" {allowed.unit}" if allowed.unit else ""
        raise InputError(
            f"{where}: {name}{entry} is {values[wrong[0]]:g}{unit}, must be {allowed.text}"
        )
