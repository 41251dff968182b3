"""The materials that users know by name, with defaults for an object about one metre wide: the same
with which `default_scene` shows them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError, nearest
from jaxphys.mpm.materials.cohesion import WET_SAND
from jaxphys.mpm.materials.contraction import CONTRACTING_FIBRES
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN
from jaxphys.mpm.materials.fibres import FIBRES
from jaxphys.mpm.materials.fluid import FLUID
from jaxphys.mpm.materials.fracture import FRACTURE
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.mpm.materials.parameters import DENSITY, Alternative, Parameter, check_parameter
from jaxphys.mpm.materials.plasticity import DRUCKER_PRAGER, UNCORRECTED_DRUCKER_PRAGER, VON_MISES
from jaxphys.mpm.materials.snow import SNOW
from jaxphys.mpm.materials.viscoelasticity import STANDARD_SOLID
from jaxphys.mpm.materials.viscoplasticity import HERSCHEL_BULKLEY, PLASTICINE


@dataclass(frozen=True)
class Material:
    """A law with a name a user knows.

    Attributes:
        name: what users call it.
        law: what it does.
        others: laws that it may have instead; they read the same parameters or fewer.
        description: one line.
        defaults: of every parameter of its law (SI), and `density`.
    """

    name: str
    law: Law
    others: tuple[Law, ...]
    description: str
    defaults: Mapping[str, float]

    @property
    def alternatives(self) -> dict[str, Alternative]:
        """What may be given in place of a parameter that its law reads, by name."""
        return {other.parameter.name: other for other in self.law.alternatives}

    @property
    def declared(self) -> dict[str, Parameter]:
        """Every parameter that its law reads and that may be given, by name: those with defaults
        first.
        """
        own = {parameter.name: parameter for parameter in (*self.law.declared, DENSITY)}
        others = {name: other.parameter for name, other in self.alternatives.items()}
        return {name: own[name] for name in self.defaults if name in own} | others


def _material(
    name: str, law: Law, description: str, others: tuple[Law, ...] = (), **defaults: float
) -> Material:
    return Material(name, law, others, description, MappingProxyType(defaults))


_materials: dict[str, Material] = {
    material.name: material
    for material in (
        _material(
            "elastic",
            FIXED_COROTATED,
            "rubber: springs back, hardly sags (fixed corotated)",
            others=(NEO_HOOKEAN, HENCKY),
            youngs_modulus=2e5,
            poisson_ratio=0.3,
            density=400.0,
        ),
        _material(
            "jelly",
            FIXED_COROTATED,
            "soft and hardly compressible: squashes and wobbles (fixed corotated)",
            others=(NEO_HOOKEAN, HENCKY),
            youngs_modulus=1.5e4,
            poisson_ratio=0.4,
            density=300.0,
        ),
        _material(
            "metal",
            VON_MISES,
            "springs back up to its yield stress, keeps the dent beyond it (Hencky, von Mises)",
            youngs_modulus=1e6,
            poisson_ratio=0.3,
            density=1000.0,
            yield_stress=4.3e4,
            hardening=0.0,
        ),
        _material(
            "sand",
            DRUCKER_PRAGER,
            "dry grains: resist only while pressed together (Hencky, Drucker-Prager)",
            others=(UNCORRECTED_DRUCKER_PRAGER,),
            youngs_modulus=5e5,
            poisson_ratio=0.3,
            density=1600.0,
            friction_angle=35.0,
        ),
        _material(
            "fracture",
            FRACTURE,
            "elastic until stretched too far, then breaks into pieces (Hencky, damage)",
            youngs_modulus=8e5,
            poisson_ratio=0.2,
            density=500.0,
            fracture_strain=0.08,
            softening_strain=0.1,
            friction_angle=30.0,
        ),
        _material(
            "water",
            FLUID,
            "splashes, and lies flat and still in the end (Tait's pressure, Newton's viscosity)",
            bulk_modulus=5e5,
            viscosity=1e-3,
            density=1000.0,
        ),
        _material(
            "cream",
            HERSCHEL_BULKLEY,
            "flows when pushed, holds a heap when left alone (Herschel-Bulkley)",
            bulk_modulus=2e5,
            shear_modulus=1e4,
            shear_yield_stress=500.0,
            consistency=50.0,
            flow_index=0.5,
            density=500.0,
        ),
        _material(
            "toothpaste",
            HERSCHEL_BULKLEY,
            "a thick paste: sinks down slowly, and stays as it lies (Herschel-Bulkley)",
            bulk_modulus=2e5,
            shear_modulus=3e4,
            shear_yield_stress=1e3,
            consistency=1.5e3,
            flow_index=0.5,
            density=1300.0,
        ),
        _material(
            "plasticine",
            PLASTICINE,
            "kneads: stays as it was pressed, slowly (Hencky, viscous von Mises)",
            youngs_modulus=5e5,
            poisson_ratio=0.4,
            yield_stress=1.5e4,
            plastic_viscosity=500.0,
            density=1500.0,
        ),
        _material(
            "snow",
            SNOW,
            "packs where it is pressed, crumbles where it is pulled (fixed corotated, hardening)",
            youngs_modulus=1.4e5,
            poisson_ratio=0.2,
            critical_compression=0.025,
            critical_stretch=0.0075,
            packing_hardening=10.0,
            density=400.0,
        ),
        _material(
            "wet-sand",
            WET_SAND,
            "grains that hold together: stands steep, slumps in lumps (Drucker-Prager, cohesion)",
            youngs_modulus=5e5,
            poisson_ratio=0.3,
            friction_angle=35.0,
            cohesion=2.5e3,
            density=1800.0,
        ),
        _material(
            "memory-foam",
            STANDARD_SOLID,
            "gives way slowly and comes back slowly (neo-Hookean beside a Maxwell element)",
            youngs_modulus=5e3,
            poisson_ratio=0.05,
            relaxing_modulus=2.5e4,
            relaxation_time=0.15,
            density=200.0,
        ),
        _material(
            "muscle",
            CONTRACTING_FIBRES,
            "shortens and thickens, again and again (neo-Hookean, Holzapfel's fibres, which pull)",
            others=(FIBRES,),
            youngs_modulus=6e3,
            poisson_ratio=0.4,
            fibre_stiffness=5e4,
            fibre_stiffening=1.0,
            fibre_azimuth=0.0,
            fibre_elevation=90.0,
            fibre_tension=5e3,
            contraction_period=0.8,
            density=300.0,
        ),
    )
}
MATERIALS: Mapping[str, Material] = MappingProxyType(_materials)


def add(material: Material) -> None:
    """Puts a material into the catalogue, beside those of the package."""
    _materials[material.name] = material


def declared_parameters() -> dict[str, Parameter]:
    """Every parameter of every material, by name, in the order in which they are listed."""
    found: dict[str, Parameter] = {}
    for material in MATERIALS.values():
        found |= {name: one for name, one in material.declared.items() if name not in found}
    return found


def get_material(name: str, law: str | None = None, *, mean_volume: bool = False) -> Material:
    """The material called `name`, with the law called `law` in place of its own if there is one;
    mean_volume: with the stress at the volume that neighbours share (`materials.mean_volume`).

    Raises:
        InputError: there is no such material, or it cannot have this law; the message gives the
            nearest name. Or the law is not elastic, and there is no stress at a mean volume.
    """
    if name not in MATERIALS:
        raise InputError(f"unknown material {name!r}; {nearest(name, MATERIALS)}")
    material = MATERIALS[name]
    if law is not None:
        laws = {one.name: one for one in (material.law, *material.others)}
        if law not in laws:
            raise InputError(f"{name} cannot have the law {law!r}; {nearest(law, laws)}")
        material = replace(material, law=laws[law])
    return replace(material, law=at_mean_volume(material.law)) if mean_volume else material


def overridden(material: Material, overrides: Mapping | None) -> dict:
    """What differs from the material's defaults, under the names that its law reads, checked:
    numbers or (N,) arrays.

    Raises:
        InputError: a parameter that this material does not have (with the nearest that it has), one
            that is given twice under two names, or a value out of range.
    """
    found, names, alternatives = {}, material.declared, material.alternatives
    for given, value in (overrides or {}).items():
        if given not in names:
            raise InputError(
                f"{material.name}: unknown parameter {given!r}; {nearest(given, names)}"
            )
        check_parameter(names[given], value, material.name)
        name = given
        if given in alternatives:
            name = alternatives[given].instead_of
            value = np.asarray(alternatives[given].convert(np.asarray(value, np.float64)))
            if name in (overrides or {}):
                raise InputError(f"{material.name}: give {name} or {given}, not both")
        found[name] = value
    return found


def material_values(material: Material, overrides: Mapping | None = None) -> dict:
    """The material's defaults with `overrides` laid over them (`overridden`): numbers or (N,)
    arrays by the names that its law reads.
    """
    return {**material.defaults, **overridden(material, overrides)}


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
            segment. A parameter that is zero everywhere in a part may have turned its law into a
            simpler one (`Law.reduced`), which does not read it.

    Raises:
        InputError: an array of values whose length is not its part's number of particles.
    """
    total = sum(count for _, _, count in parts)
    laws = [material.law.reduced(values) for material, values, _ in parts]
    names = sorted({name for law in laws for name in law.parameters})
    columns = {name: np.zeros(total) for name in (*names, "density")}
    segments: list[tuple[Law, int, int]] = []
    start = 0
    for law, (material, values, count) in zip(laws, parts, strict=True):
        for name in (*law.parameters, "density"):
            value = np.asarray(values[name], dtype=np.float64)
            if value.shape not in ((), (count,)):
                raise InputError(
                    f"{material.name}: {name} has shape {value.shape}, "
                    f"need one number or ({count},)"
                )
            columns[name][start : start + count] = value
        if segments and segments[-1][0] is law:
            segments[-1] = (law, segments[-1][1], start + count)
        else:
            segments.append((law, start, start + count))
        start += count
    arrays = {name: jnp.asarray(column, dtype) for name, column in columns.items()}
    density = arrays.pop("density")
    return arrays, density, tuple(segments)
