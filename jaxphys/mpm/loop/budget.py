"""What a gradient keeps of a loop, in bytes, read off the traced program."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.extend.core import Jaxpr, Literal

# What the step at hand takes besides what is kept, in steps' worth of that: a pass's temporaries
# there and back, and the cotangents of state and matter.
WORK = 12


class Cost(NamedTuple):
    """Bytes: of the carry of a loop, and of what one step keeps for the way back."""

    state: int
    step: int

    @property
    def work(self) -> int:
        """Set aside for the step at hand."""
        return WORK * max(self.step, self.state)


def cost_of(body: Callable, carry: Any) -> Cost:
    """Of a loop of `body(carry) -> carry`. What all steps share, as numbers of the matter, is kept
    once and not counted.
    """

    def kept(carry):
        return jax.tree.leaves(jax.vjp(body, carry)[1])

    traced = jax.make_jaxpr(kept)(carry)
    return Cost(bytes_of(carry), _bytes_that_change(traced.jaxpr))


def bytes_of(tree: Any) -> int:
    """Of the arrays of a pytree."""
    return sum(_size(x) for x in jax.tree.leaves(tree))


def _size(x: Any) -> int:
    return int(np.prod(x.shape)) * x.dtype.itemsize


def _bytes_that_change(jaxpr: Jaxpr) -> int:
    """Of results that depend on the inputs, each counted once."""
    changing = set(jaxpr.invars)
    for equation in jaxpr.eqns:
        if any(not isinstance(x, Literal) and x in changing for x in equation.invars):
            changing.update(equation.outvars)
    results = {x for x in jaxpr.outvars if not isinstance(x, Literal)}
    return sum(_size(x.aval) for x in results & changing)
