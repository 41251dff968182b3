"""Sums of many small terms: what rounding left out is carried along and added with the next term.

In float32 a number near 1 cannot change by less than 6e-8, so that a million terms of 3e-8 sum to
nothing, or to twice as much. With the rest carried, the error no longer grows with their number
(Neumaier 1974).
"""

from jax import Array
from jax.lax import stop_gradient

from jaxphys.core.program import part


def add(total: Array, residual: Array | None, term: Array) -> tuple[Array, Array | None]:
    """`total + term` and what rounding left out of it: total plus residual is the sum.

    The residual is exact whichever of the two is larger (Knuth 1998, section 4.2.2, theorem B).
    Nothing depends on it in a derivative: that is the one of `total + term`.

    Args:
        total: the sum so far.
        residual: what was left out so far, or None for a plain sum, in which nothing is carried.
        term: what to add, of the shape of `total`.
    """
    if residual is None:
        return total + term, None
    with part("compensated sums"):
        term = term + stop_gradient(residual)
        result = total + term
        total, term, rounded = stop_gradient((total, term, result))
        taken = rounded - total
        return result, (total - (rounded - taken)) + (term - taken)
