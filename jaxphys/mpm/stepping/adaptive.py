"""Steps that adapt: what the state allows is looked at again every few steps of a frame.

The bounds are those of `bounds.py`, taken of the state as it is and of nothing that may come: no
fall through the domain, no start that stands for the whole run.

Of the sharp limit of stability a step takes `safety` where nothing is strained, and LEAST, the
share that fixed steps live with, from a strain of half a hundredth on, since a particle that swings
alone swings out further the nearer it is to the limit (`bounds.isolated_bound`). What it may come
back to at the other side of its swing is left to that share, as it is with fixed steps; and where
it is stiffer at this side than at rest, the share is of its limit at rest, as with these, as long
as that is no more than `safety` of its limit now.
"""

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.core.fields import Checked, between
from jaxphys.mpm.materials.law import Law, Parameters
from jaxphys.mpm.stepping import bounds, fixed
from jaxphys.mpm.transfer.schemes import Transfer

LEAST = fixed.SAFETY * bounds.SAFETY
# What is let go when strained by half or more gathers speed until the next look.
RELEASE = 0.8
GROWTH = 1.5  # from one look to the next; a step shrinks at once


@dataclass(frozen=True)
class Adaptive(Checked):
    """Steps as long as the state allows, which is looked at again every few of them.

    Attributes:
        every: steps between two looks.
        most_steps: that a frame may take; null: a million, and where a gradient is wanted, whose
            memory grows with it, twice as many as with fixed steps.
        safety: what share of the bounds to take.
    """

    type: ClassVar[str] = "adaptive"
    every: int = field(default=8, metadata=between(1, 1000))
    most_steps: int | None = field(default=None, metadata=between(1, fixed.MOST_STEPS))
    safety: float = field(default=bounds.SAFETY, metadata={"above": 0, "most": 1.0})


class Steps(NamedTuple):
    """A sequence of steps that was taken: dt (M,) [s], of which the first `count` () int32 count;
    the others are zero.
    """

    dt: Array
    count: Array  # type: ignore[assignment]  # a tuple has a method of that name


def matter_bounds(
    law: Law,
    parameters: Parameters,
    F: Array,
    density: Array,
    spacing: float,
    safety: float,
    swing: Array | float = 0.0,
    transfer: Transfer = bounds.DEFAULT,
) -> tuple[Array, Array]:
    """(wanted, limit) [s] of each particle, (...): the step to take, if matter alone decides, and
    the one beyond which it is unstable as it is now deformed.

    swing: [s] that matter bears which swings about its rest, () or (...), of which as of its limit
    `safety` is taken. What is strained swings back, so that its stiffness now is not that of its
    swing: within the limit a step need not be shorter than fixed ones would be.
    """
    limit = bounds.hard_limit(law, parameters, F, density, spacing, transfer)
    s = bounds.principal_stretches(F)
    strained = jnp.max((s - 1) ** 2, axis=0) / bounds.SWING**2
    share = jnp.maximum(LEAST / bounds.SAFETY, 1 / jnp.sqrt(1 + strained))
    released = bounds.release_bound(law, parameters, F, s, density, spacing, RELEASE, transfer)
    borne = jnp.maximum(share * limit, jnp.minimum(limit, swing))
    return safety * jnp.minimum(borne, released), limit


def next_steps(left: Array, bound: Array, most: int) -> tuple[Array, Array]:
    """(number () int32, dt () [s]) of equal steps of at most `bound` [s] that fill what is left of
    a frame [s], so that it is hit without a sliver of a step at its end. No more than `most`.
    """
    wanted = jnp.ceil(left / bound - 1e-3)  # digits of left and bound decide no step more
    count = jnp.clip(wanted, 1, most + 1).astype(jnp.int32)
    return count, left / count
