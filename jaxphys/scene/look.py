"""What is drawn of a scene: Gaussians, which of them move, and the range of their colours."""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import jax
import numpy as np

from jaxphys.gaussians.colour import ColourRange, colour_range, to_unit_interval
from jaxphys.gaussians.gaussians import Gaussians, concatenate
from jaxphys.mpm.boundaries import Boundary, Obstacle
from jaxphys.scene.place import Placed
from jaxphys.scene.placement import Placement
from jaxphys.scene.solids import drawn_of


@partial(
    jax.tree_util.register_dataclass,
    data_fields=("gaussians", "still", "colours", "solids"),
    meta_fields=("counts", "lone", "placements"),
)
@dataclass(frozen=True)
class Look:
    """The Gaussians of a scene. A pytree. It knows no particles: a `Frame` of the motion says where
    each Gaussian is.

    Attributes:
        gaussians: K Gaussians that move, at rest, object after object.
        still: Gaussians that are drawn but do not move, or None.
        colours: the range of colours of each object, None where they are left as they are.
        counts: moving Gaussians of each object.
        lone: Gaussians beside each object that were left out, since nothing would hold them to it.
        placements: where the contents of each object's file are, for cameras that stood there.
        solids: of each obstacle that is drawn its Gaussians, in axes of its own, and the obstacle,
            which says where these are.
    """

    gaussians: Gaussians
    still: Gaussians | None
    colours: tuple[ColourRange, ...] | None
    counts: tuple[int, ...]
    lone: tuple[int, ...]
    placements: tuple[Placement, ...]
    solids: tuple[tuple[Gaussians, Obstacle], ...] = ()

    @property
    def objects(self) -> tuple[tuple[int, int], ...]:
        """(start, stop) of each object's moving Gaussians."""
        return tuple(pairwise(np.cumsum([0, *self.counts]).tolist()))

    def following(self, boundaries: tuple[Boundary, ...]) -> "Look":
        """The same with obstacles where other numbers put them and how these move them, in the
        shape that they were built with; boundaries: of the simulation after `Simulation.with_`,
        `simulation.model.boundaries`.
        """
        if not self.solids:
            return self
        shapes = [gaussians for gaussians, _ in self.solids]
        return replace(self, solids=tuple(zip(shapes, drawn_of(boundaries), strict=True)))


def look_of(
    placed: tuple[Placed, ...],
    regularise_colours: bool,
    solids: tuple[tuple[Gaussians, Obstacle], ...] = (),
) -> Look:
    """The look of objects that are in their places, and of obstacles among them."""
    still = [one.still for one in placed if one.still.count]
    # The paper's range would also stretch the contrast of colours that are right already.
    ranges = tuple(to_unit_interval(colour_range(one.moving)) for one in placed)
    return Look(
        gaussians=concatenate([one.moving for one in placed]),
        still=concatenate(still) if still else None,
        colours=ranges if regularise_colours else None,
        counts=tuple(one.moving.count for one in placed),
        lone=tuple(one.lone for one in placed),
        placements=tuple(one.placement for one in placed),
        solids=solids,
    )
