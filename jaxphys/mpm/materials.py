"""The five materials of the paper, with defaults for an object about one metre wide, and what their
parameters may be.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError, nearest
from jaxphys.mpm.elasticity import FIXED_COROTATED
from jaxphys.mpm.fracture import FRACTURE
from jaxphys.mpm.law import Law
from jaxphys.mpm.plasticity import DRUCKER_PRAGER, VON_MISES


@dataclass(frozen=True)
class Range:
    """Where a parameter may lie. `text` is the range as a user reads it, `unit` its SI unit."""

    text: str
    unit: str
    low: float
    high: float
    low_included: bool = False

    def contains(self, values: np.ndarray) -> np.ndarray:
        """Elementwise; what is not a number lies outside."""
        above = values >= self.low if self.low_included else values > self.low
        return above & (values < self.high)


INFINITY = float("inf")
RANGES: Mapping[str, Range] = MappingProxyType(
    {
        "youngs_modulus": Range("> 0", "Pa", 0, INFINITY),
        "poisson_ratio": Range("between -1 and 0.5, both excluded", "", -1, 0.5),
        "density": Range("> 0", "kg/m^3", 0, INFINITY),
        "yield_stress": Range("> 0", "Pa", 0, INFINITY),
        "hardening": Range(">= 0", "Pa", 0, INFINITY, low_included=True),
        "friction_angle": Range("in [0, 90)", "degrees", 0, 90, low_included=True),
        "fracture_strain": Range("> 0", "log strain", 0, INFINITY),
        "softening_strain": Range("> 0", "log strain", 0, INFINITY),
    }
)


@dataclass(frozen=True)
class Material:
    """A law with a name a user knows, default parameters (SI, and `density`), and one line of
    description.
    """

    name: str
    law: Law
    defaults: Mapping[str, float]
    description: str


def _material(name: str, law: Law, description: str, **defaults: float) -> Material:
    return Material(name, law, MappingProxyType(defaults), description)


MATERIALS: Mapping[str, Material] = MappingProxyType(
    {
        material.name: material
        for material in (
            _material(
                "elastic",
                FIXED_COROTATED,
                "stiff rubber: springs back, hardly sags (fixed corotated)",
                youngs_modulus=1e6,
                poisson_ratio=0.3,
                density=1000.0,
            ),
            _material(
                "jelly",
                FIXED_COROTATED,
                "soft and nearly incompressible: wobbles under its own weight (fixed corotated)",
                youngs_modulus=5e4,
                poisson_ratio=0.4,
                density=1000.0,
            ),
            _material(
                "metal",
                VON_MISES,
                "springs back up to its yield stress, keeps the dent beyond it (Hencky, von Mises)",
                youngs_modulus=5e6,
                poisson_ratio=0.3,
                density=2000.0,
                yield_stress=5e4,
                hardening=0.0,
            ),
            _material(
                "sand",
                DRUCKER_PRAGER,
                "dry grains: resist only while pressed together (Hencky, Drucker-Prager)",
                youngs_modulus=1e6,
                poisson_ratio=0.3,
                density=1600.0,
                friction_angle=35.0,
            ),
            _material(
                "fracture",
                FRACTURE,
                "elastic until stretched too far, then breaks into pieces (Hencky, damage)",
                youngs_modulus=1e6,
                poisson_ratio=0.2,
                density=1000.0,
                fracture_strain=0.05,
                softening_strain=0.1,
                friction_angle=30.0,
            ),
        )
    }
)


def get_material(name: str) -> Material:
    """The material called `name`.

    Raises:
        InputError: there is none; the message gives the nearest name.
    """
    if name not in MATERIALS:
        raise InputError(f"unknown material {name!r}; {nearest(name, MATERIALS)}")
    return MATERIALS[name]


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


def material_values(material: Material, overrides: Mapping | None = None) -> dict:
    """The material's defaults with `overrides` laid over them: numbers or (N,) arrays by parameter
    name, checked.

    Raises:
        InputError: a parameter that this material does not have (with the nearest that it has), or
        a value out of range.
    """
    overrides = dict(overrides or {})
    for name, value in overrides.items():
        if name not in material.defaults:
            raise InputError(
                f"{material.name}: unknown parameter {name!r}; {nearest(name, material.defaults)}"
            )
        check_parameter(name, value, material.name)
    return {**material.defaults, **overrides}


def assemble_parameters(
    parts: Sequence[tuple[Material, Mapping, int]], dtype=jnp.float32
) -> tuple[dict[str, Array], Array, tuple[tuple[Law, int, int], ...]]:
    """Per-particle parameters of several parts laid one after the other.

    Args:
        parts: (material, values as `material_values` gives them, number of particles N_k) of each
            part.
        dtype: of the arrays.

    Returns:
        parameters: {name: (N,)}, every name that some law reads; zero on particles whose law does
            not read it.
        density: (N,) [kg/m^3].
        segments: (law, start, stop) of contiguous particles; neighbours that share a law are one
            segment.

    Raises:
        InputError: an array of values whose length is not its part's number of particles.
    """
    total = sum(count for _, _, count in parts)
    names = sorted({name for material, _, _ in parts for name in material.law.parameters})
    columns = {name: np.zeros(total) for name in (*names, "density")}
    segments: list[tuple[Law, int, int]] = []
    start = 0
    for material, values, count in parts:
        for name in (*material.law.parameters, "density"):
            value = np.asarray(values[name], dtype=np.float64)
            if value.shape not in ((), (count,)):
                raise InputError(
                    f"{material.name}: {name} has shape {value.shape}, "
                    f"need one number or ({count},)"
                )
            columns[name][start : start + count] = value
        if segments and segments[-1][0] is material.law:
            segments[-1] = (material.law, segments[-1][1], start + count)
        else:
            segments.append((material.law, start, start + count))
        start += count
    arrays = {name: jnp.asarray(column, dtype) for name, column in columns.items()}
    density = arrays.pop("density")
    return arrays, density, tuple(segments)
