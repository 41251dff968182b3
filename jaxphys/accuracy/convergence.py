"""Order and error of a motion, read off three runs of it on finer and finer grids.

Richardson's extrapolation, as the grid convergence index has it (Roache 1994, "Perspective: a
method for uniform reporting of grid refinement studies", J. Fluids Eng. 116): where the error is
C h^p, the differences of three motions q3, q2, q1 on spacings r^2 h, r h, h obey

    |q3 - q2| / |q2 - q1| = r^p,        |q1 - q| = |q2 - q1| / (r^p - 1).

Motions are those of the same material points, so the norm of a difference is one of vectors: the
two differences of an error that has an order also point the same way, point by point. Where they do
not, the numbers show noise (particles that cross cells), a jump (contact, fracture) or chaos.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jaxphys.core.errors import InputError

LEAST_ORDER, MOST_ORDER = 0.5, 3.0
# Contact is first order, the bulk second: an observed order beyond these is that of grids that are
# still too coarse, and extrapolating with it would be worse.
TRUSTED = (1.0, 2.0)
# Cosine between the two differences below which they have nothing to do with each other.
LEAST_ALIGNMENT = 0.3
ROUNDING = 1e-5  # relative differences that are taken for those of float32's rounding


class NoOrder(InputError):
    """Motions on finer grids do not come closer to each other as an error with an order does."""


@dataclass(frozen=True)
class Convergence:
    """What three motions on finer and finer grids say of each other.

    Attributes:
        spacings: of the grids [m], coarsest first, each finer by one factor.
        order: p, observed.
        alignment: cosine between the two differences, from -1 to 1.
        difference: between the two finest motions, relative to the motion.
        error: of the finest motion, relative to the motion.
        scale: root mean square displacement of the points over all frames [m].
    """

    spacings: tuple[float, float, float]
    order: float
    alignment: float
    difference: float
    error: float
    scale: float

    @property
    def trusted_order(self) -> float:
        """What is extrapolated with: the observed order, kept to those of the method's parts."""
        return trusted(self.order)

    def error_at(self, spacing: float) -> float:
        """Expected relative error on a grid of `spacing` [m]."""
        return self.error * (spacing / self.spacings[-1]) ** self.trusted_order

    def spacing_for(self, error: float) -> float:
        """The spacing [m] whose expected relative error this is."""
        return self.spacings[-1] * (error / self.error) ** (1 / self.trusted_order)


def trusted(order: float) -> float:
    """An observed order, kept to those of the method's parts."""
    return min(max(order, TRUSTED[0]), TRUSTED[1])


def root_mean_square(motion: np.ndarray) -> float:
    """Root of the mean square length of vectors (..., 3)."""
    return float(np.sqrt(np.mean(np.sum(np.square(np.asarray(motion, np.float64)), axis=-1))))


def scale_of(motion: np.ndarray) -> float:
    """What errors are relative to [m]: the displacement of the points since the first frame, root
    mean square over frames and points; motion: (T, M, 3) [m].

    Raises:
        NoOrder: nothing moves.
    """
    motion = np.asarray(motion, np.float64)
    scale = root_mean_square(motion[1:] - motion[0]) if len(motion) > 1 else 0.0
    if not scale > 0:
        raise NoOrder("tolerance: nothing moves in this scene, so there is no motion to be right")
    return scale


def convergence(spacings: Sequence[float], motions: Sequence[np.ndarray]) -> Convergence:
    """Order and error of three motions of the same points.

    Args:
        spacings: of three grids [m], coarsest first, in equal ratios.
        motions: on each, (T, M, 3) [m], the same points at the same times.

    Raises:
        NoOrder: differences do not shrink, point different ways, or shrink at no order between 0.5
            and 3.
        InputError: not three grids in equal ratios.
    """
    coarse, middle, fine = (float(spacing) for spacing in spacings)
    ratio = middle / fine
    if not (ratio > 1 and math.isclose(coarse / middle, ratio, rel_tol=1e-6)):
        raise InputError(
            f"convergence: spacings {tuple(spacings)}; give three, coarsest first, in equal ratios"
        )
    first, second, third = (np.asarray(motion, np.float64) for motion in motions)
    scale = scale_of(third)
    before, after = second - first, third - second
    large, small = root_mean_square(before) / scale, root_mean_square(after) / scale
    if small < ROUNDING:
        # Equal but for rounding: whatever the order, no finer grid changes what is seen.
        return Convergence((coarse, middle, fine), TRUSTED[1], 1.0, small, ROUNDING, scale)
    alignment = float(np.mean(np.sum(before * after, axis=-1))) / (large * small * scale**2)
    order = math.log(large / small) / math.log(ratio)
    found = (
        f"from {coarse:.3g} to {middle:.3g} to {fine:.3g} m the motion changes by {large:.1%} and "
        f"{small:.1%}"
    )
    if not LEAST_ORDER <= order <= MOST_ORDER:
        raise NoOrder(
            f"tolerance: no order shows: {found}, an order of {order:.2f} outside of {LEAST_ORDER} "
            f"to {MOST_ORDER:g}; a finer spacing or a shorter film may show one"
        )
    if alignment < LEAST_ALIGNMENT:
        raise NoOrder(
            f"tolerance: no order shows: {found}, in different directions (cosine "
            f"{alignment:.2f}); a finer spacing or a shorter film may show one"
        )
    error = small / (ratio ** trusted(order) - 1)
    return Convergence((coarse, middle, fine), order, alignment, small, error, scale)
