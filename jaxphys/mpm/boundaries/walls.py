"""The six sides of the domain."""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.fields import NON_NEGATIVE, one_of, unit
from jaxphys.mpm.boundaries.base import (
    DERIVED,
    STATIC,
    Setting,
    array_of,
    changed_number,
    column,
)
from jaxphys.mpm.boundaries.contact import Contact, Face, Surface

Side = Literal["sticky", "slip", "separate", "open"]
Sides = tuple[Side, Side, Side, Side, Side, Side]
Frictions = tuple[float, float, float, float, float, float]
CELLS = 3  # how far inside the domain walls stand by default: as PhysGaussian's `bounding_box`


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Walls(Contact):
    """The six sides of the domain, some way inside it.

    Attributes:
        surface: `sticky` stops what touches it, `slip` lets it slide but not leave, `separate`
            also lets it leave.
        friction: Coulomb's coefficient.
        inset: how far inside the domain the walls stand [m]; null: three cells.
        surfaces: for -x, +x, -y, +y, -z, +z a surface each, or "open" for no wall; null: `surface`
            for all.
        frictions: the same for friction; null: `friction` for all.
    """

    type: ClassVar[str] = "walls"
    place: ClassVar[str] = "inset"
    surface: Surface = field(default="separate", metadata=STATIC | one_of(Surface))
    friction: float | None = field(default=0.0, metadata=NON_NEGATIVE)
    inset: float | None = field(default=None, metadata=NON_NEGATIVE | unit("m"))
    surfaces: Sides | None = field(default=None, metadata=STATIC | one_of(Side) | {"count": 6})
    frictions: Frictions | None = field(default=None, metadata=NON_NEGATIVE | {"count": 6})
    size: Array | None = field(default=None, kw_only=True, repr=False, metadata=DERIVED)

    def prepared(self, setting: Setting) -> Self:
        grid = setting.grid
        inset = CELLS * grid.spacing if self.inset is None else self.inset
        size = [(n - 1) * grid.spacing for n in grid.shape]
        frictions: Any = None  # declared as numbers, and then arrays, or None where zero
        if self.frictions is not None:
            frictions = tuple(jnp.asarray(f, setting.dtype) if f else None for f in self.frictions)
        made = replace(self, inset=inset, size=jnp.asarray(size, setting.dtype), frictions=None)
        return replace(Contact.prepared(made, setting), frictions=frictions)

    @property
    def rough(self) -> bool:
        return super().rough or any(f is not None for f in self.frictions or ())

    def changed(self, **values) -> Self:
        """As `Boundary.changed`. `friction` is that of all sides that have some; `frictions` gives
        one each, zero where a side was built without.
        """
        if self.frictions is None or not {"friction", "frictions"} & set(values):
            return super().changed(**values)
        rubbing = [index for index, f in enumerate(self.frictions) if f is not None]
        if "frictions" in values:
            given = values.pop("frictions")
            if np.shape(given) != (6,):
                raise InputError(f"frictions: has shape {np.shape(given)}; give (6,)")
            known = [i for i, f in enumerate(given) if not isinstance(f, jax.core.Tracer) and f]
            if set(known) - set(rubbing):
                raise InputError(
                    "frictions: some were built as zero, which leaves them out of the program; "
                    "build the scene with others to change them"
                )
        else:
            given = [values.pop("friction")] * 6
        sides: list[Any] = list(self.frictions)
        for index in rubbing:
            sides[index] = changed_number("friction", sides[index], given[index], NON_NEGATIVE)
        frictions: Any = tuple(sides)
        return replace(super().changed(**values), frictions=frictions)

    @property
    def _sides(self) -> tuple[tuple[int, int, Surface, float | None], ...]:
        """(axis, which, surface, friction) of each face; which: -1 lower, 1 upper, 0 both as one,
        since no particle touches both.
        """
        surfaces = self.surfaces or (self.surface,) * 6
        sides: list[tuple[int, int, Side, float | None]] = []
        for axis in range(3):
            lower, upper = surfaces[2 * axis : 2 * axis + 2]
            if lower == upper and self.frictions is None:
                sides.append((axis, 0, lower, self.friction))
                continue
            frictions = self.frictions or (self.friction,) * 6
            sides.append((axis, -1, lower, frictions[2 * axis]))
            sides.append((axis, 1, upper, frictions[2 * axis + 1]))
        return tuple(
            (axis, which, surface, friction)
            for axis, which, surface, friction in sides
            if surface != "open"
        )

    @property
    def kinds(self):
        return tuple((surface, friction is not None) for _, _, surface, friction in self._sides)

    def faces(self, x, time: Array) -> tuple[Face, ...]:
        size, inset = array_of(self.size), array_of(self.inset)
        still = column(jnp.zeros_like(size), x)
        faces = []
        for axis, which, surface, friction in self._sides:
            along = x[axis] - 0.5 * size[axis]
            reach = 0.5 * size[axis] - inset
            sign = -jnp.sign(along) if which == 0 else jnp.asarray(-which, along.dtype)
            distance = reach + sign * along if which else reach - jnp.abs(along)
            normal = jnp.stack([sign if a == axis else jnp.zeros_like(sign) for a in range(3)])
            if normal.ndim == 1:
                normal = column(normal, x)
            faces.append(Face(distance, normal, still, friction, surface))
        return tuple(faces)
