"""Adaptive density control with a fixed capacity: clone, split and prune inside jit.

Kerbl et al. (2023, section 5.2) grow and shrink arrays as they optimise. Here the arrays have room
for `capacity` Gaussians and a mask says which are alive, so that shapes never change. Those with
the largest gradients are served first while there is room; how many were not is reported.
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import (
    LOGIT_LIMIT,
    Gaussians,
    axes,
    opacities,
    opacity_to_logit,
    scales,
    select,
)


@dataclass(frozen=True)
class DensityConfig:
    """When to act; the unit of gradients is the caller's.

    Attributes:
        gradient_threshold: Gaussians with a larger gradient are cloned or split.
        split_size: standard deviation [m] above which they are split rather than cloned.
        split_shrink: by which the halves of a split are smaller.
        least_opacity: Gaussians below are removed.
        largest_size: those with a standard deviation [m] above are removed.
    """

    gradient_threshold: float
    split_size: float
    split_shrink: float = 1.6
    least_opacity: float = 0.005
    largest_size: float = float("inf")


class DensityUpdate(NamedTuple):
    """What came of it.

    Attributes:
        gaussians: as many as before, those not alive invisible.
        alive: mask (N,).
        source: slot that each slot's contents come from, (N,) int32.
        fresh: slots whose optimiser state must start anew, mask (N,).
        unserved: how many clones and splits found no room, a scalar.
    """

    gaussians: Gaussians
    alive: Array
    source: Array
    fresh: Array
    unserved: Array


def with_capacity(gaussians: Gaussians, capacity: int) -> tuple[Gaussians, Array]:
    """The Gaussians with room for `capacity`, and the mask (capacity,) of those alive.

    Raises:
        InputError: there are more Gaussians than that, or none.
    """
    count = gaussians.count
    if not 0 < count <= capacity:
        raise InputError(f"{count} Gaussians with a capacity of {capacity}: give 1 to {capacity}")
    alive = jnp.arange(capacity) < count
    padded = select(gaussians, jnp.where(alive, jnp.arange(capacity), 0))
    return _hide(padded, alive), alive


def _replace(gaussians: Gaussians, means, log_scales, opacity_logits) -> Gaussians:
    return Gaussians(means, log_scales, gaussians.quaternions, opacity_logits, gaussians.harmonics)


def _hide(gaussians: Gaussians, alive: Array) -> Gaussians:
    logits = jnp.where(alive, gaussians.opacity_logits, -LOGIT_LIMIT)
    return _replace(gaussians, gaussians.means, gaussians.log_scales, logits)


def control_density(
    gaussians: Gaussians, alive: Array, gradients: Array, key: Array, config: DensityConfig
) -> DensityUpdate:
    """Removes faint and oversized Gaussians, then clones small and splits large ones.

    A clone and its original share the opacity so that the two together cover as one did, 1 -
    sqrt(1 - a) each (Rota Bulo et al. 2024). The halves of a split are drawn from the original's
    own density. It may be called inside jit, with `config` static.

    Args:
        gaussians: N slots.
        alive: mask (N,) of those in use.
        gradients: how much each wants to move, at least 0, (N,).
        key: of the random positions of halves.
        config: thresholds.
    """
    count = gaussians.count
    largest = jnp.max(scales(gaussians), axis=1)
    visible = opacities(gaussians) >= config.least_opacity
    alive = alive & visible & (largest <= config.largest_size)

    wants = alive & (gradients > config.gradient_threshold)
    # The k-th neediest Gaussian takes the k-th free slot.
    neediest = jnp.argsort(jnp.where(wants, -gradients, jnp.inf), stable=True)
    free = jnp.argsort(alive, stable=True)
    wanted = jnp.sum(wants)
    served = jnp.minimum(wanted, count - jnp.sum(alive))
    rank = jnp.arange(count)
    slots = jnp.where(rank < served, free, count)
    source = rank.at[slots].set(neediest, mode="drop").astype(jnp.int32)
    child = jnp.zeros(count, bool).at[slots].set(True, mode="drop")
    parents = jnp.where(rank < served, neediest, count)
    parent = jnp.zeros(count, bool).at[parents].set(True, mode="drop")

    now = select(gaussians, source)
    involved = child | parent
    split = involved & (largest[source] > config.split_size)
    clone = involved & ~split
    noise = jax.random.normal(key, (3, count), now.means.dtype)
    moved = now.means + algebra.matvec(axes(now), noise).T
    means = jnp.where(split[:, None], moved, now.means)
    shrunk = now.log_scales - jnp.log(jnp.asarray(config.split_shrink, now.log_scales.dtype))
    log_scales = jnp.where(split[:, None], shrunk, now.log_scales)
    shared = opacity_to_logit(1 - jnp.sqrt(1 - opacities(now)))
    logits = jnp.where(clone, shared, now.opacity_logits)
    alive = alive | child
    return DensityUpdate(
        _hide(_replace(now, means, log_scales, logits), alive),
        alive,
        source,
        child | split | ~alive,
        wanted - served,
    )


def carry_moments(update: DensityUpdate, state):
    """An optimiser's state (any pytree) after `update`: moments move along, or start at zero.

    Leaves whose first axis has one entry for each slot are moments; others, such as the step count,
    stay as they are.
    """
    count = update.source.shape[0]

    def carry(leaf):
        if jnp.ndim(leaf) == 0 or leaf.shape[0] != count:
            return leaf
        fresh = update.fresh.reshape((count,) + (1,) * (leaf.ndim - 1))
        return jnp.where(fresh, jnp.zeros((), leaf.dtype), leaf[update.source])

    return jax.tree.map(carry, state)


def lower_opacity(gaussians: Gaussians, maximum: float = 0.01) -> Gaussians:
    """Opacities cut to `maximum`: those that matter grow back, and the others can be pruned."""
    logit = opacity_to_logit(jnp.asarray(maximum, gaussians.means.dtype))
    logits = jnp.minimum(gaussians.opacity_logits, logit)
    return _replace(gaussians, gaussians.means, gaussians.log_scales, logits)
