"""Steps of given lengths, one after another: the sequence that a controller took, done again."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop.adjoint import Adjoint, repeat


def check_sequence(dt: Array, steps: int | Array) -> None:
    """Raises `InputError` where `dt` is neither a number nor holds one for each step."""
    if dt.ndim > 1:
        raise InputError(
            f"rollout: dt has shape {dt.shape}; give a number or one of each step (M,)"
        )
    if dt.ndim and (not dt.size or (isinstance(steps, int) and steps > dt.size)):
        raise InputError(f"rollout: {steps} steps, but dt holds {dt.size}")


def replayed(
    adjoint: Adjoint, run: Callable, chunks: Any, dt: Array, steps: int | Array
) -> tuple[Any, Array]:
    """(chunks before the last pass, the step [s] that it ends) after `run(chunks, dt, ahead)` of
    each of the first `steps` entries of `dt` (M,) [s].

    Traced `steps` have M places in the program. Those beyond are skipped, not taken with a step of
    zero: that would still pass velocities through the grid, which smooths them. Reverse mode works
    either way.
    """
    places, known = dt.shape[0], isinstance(steps, int)

    def taken(carry):
        chunks, k = carry
        return run(chunks, dt[jnp.maximum(k - 1, 0)], dt[k]), k + 1

    def each(carry):
        # The first one in any case: what was never begun would have a gradient of zero, not none.
        return jax.lax.cond(carry[1] < jnp.maximum(steps, 1), taken, lambda carry: carry, carry)

    start = chunks, jnp.zeros((), jnp.int32)
    chunks, _ = repeat(adjoint, taken if known else each, start, steps if known else places)
    return chunks, dt[jnp.clip(steps - 1, 0, places - 1)]
