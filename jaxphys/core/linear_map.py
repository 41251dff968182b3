"""A linear map that is given together with its transpose, as one primitive of JAX.

A rule of differentiation that calls such a map in its tangents serves both directions: forward mode
runs the map, reverse mode its transpose, and neither is derived from the other by tracing. What is
kept for the way back is what the map is told to depend on (`residuals`), and nothing else.

Its own derivative, by what it depends on, is again a map with a transpose, so that this holds at
every order: no derivative of whatever order keeps the inside of a map.
"""

from collections.abc import Callable
from functools import partial
from itertools import compress
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

Leaves = list[Any]  # arrays; None where there is nothing, which counts as zeros
Flat = Callable[[Leaves, Leaves], Leaves]  # (residuals, what it is linear in) -> results


class Side(NamedTuple):
    """A map or its transpose, and what stands for it where it is differentiated by residuals."""

    run: Flat
    smooth: Flat


linear_map_p = Primitive("linear_map")
linear_map_p.multiple_results = True


def linear_map(
    forward: Callable[[Any, tuple], tuple],
    transpose: Callable[[Any, tuple], tuple],
    residuals: Any,
    tangents: tuple,
    like: tuple,
    *,
    near: Callable[[Any], Any] = lambda residuals: residuals,
) -> tuple:
    """`forward(residuals, tangents)`, whose transpose is `transpose(residuals, cotangents)`.

    Differentiable any number of times in both directions, and by `residuals` too; may be batched.

    Args:
        forward: linear in its second argument, and differentiable by the first. It is given a plain
            tuple, of which an entry without any tangent is None, and gives a tuple of pytrees.
        transpose: likewise, from cotangents of what `forward` gives to those of `tangents`. In both
            a number that is no float has tangents of dtype float0.
        residuals: any pytree of arrays. What the two depend on otherwise.
        tangents: tuple of pytrees of arrays.
        like: tuple of pytrees of arrays, of which the results are tangents.
        near: residuals close by, at which the map is differentiated by them instead, where at the
            residuals themselves it is not to be.
    """
    kept, kept_tree = jax.tree.flatten(residuals)
    given, given_tree = jax.tree.flatten(tangents)
    shown, shown_tree = jax.tree.flatten(like)
    ins = tuple(_tangent_of(x) for x in given)
    outs = tuple(_tangent_of(x) for x in shown)

    def flat(function, before, after, tree):
        def at(choice, residuals: Leaves, leaves: Leaves) -> Leaves:
            residuals = choice(jax.tree.unflatten(kept_tree, residuals))
            results = function(residuals, _entries(before, leaves, tree))
            found = jax.tree.leaves(results)
            return [
                None if a.dtype == jax.dtypes.float0 else x
                for x, a in zip(found, after, strict=True)
            ]

        return Side(partial(at, lambda residuals: residuals), partial(at, near))

    results = _call(
        flat(forward, ins, outs, given_tree),
        flat(transpose, outs, ins, shown_tree),
        kept,
        [None if a.dtype == jax.dtypes.float0 else x for x, a in zip(given, ins, strict=True)],
        ins,
        outs,
        tuple(a.dtype != jax.dtypes.float0 for a in outs),
    )
    return jax.tree.unflatten(
        shown_tree, [_zeros(a) if x is None else x for x, a in zip(results, outs, strict=True)]
    )


def zero_tangent(tree: Any) -> Any:
    """Tangents of a pytree that are zero; of dtype float0 where numbers are no floats."""
    return jax.tree.map(lambda x: _zeros(_tangent_of(x)), tree)


def _tangent_of(x: Any) -> ShapedArray:
    """Shape and type of the tangent of `x`; of `x` itself if that is one already."""
    if getattr(x, "dtype", None) == jax.dtypes.float0:
        return ShapedArray(x.shape, x.dtype)
    return jax.typeof(x).to_tangent_aval()


def _zeros(aval: ShapedArray) -> Any:
    if aval.dtype == jax.dtypes.float0:
        return np.zeros(aval.shape, aval.dtype)
    return jnp.zeros(aval.shape, aval.dtype)


def _filled(avals: tuple, leaves: Leaves) -> Leaves:
    return [_zeros(a) if x is None else x for a, x in zip(avals, leaves, strict=True)]


def _entries(avals: tuple, leaves: Leaves, tree: Any) -> tuple:
    """A tuple of pytrees from leaves, None for an entry that has some but none of them given."""
    found, first = [], 0
    for part in tree.children():
        after = first + part.num_leaves
        own = leaves[first:after]
        empty = bool(own) and all(x is None for x in own)
        full = None if empty else jax.tree.unflatten(part, _filled(avals[first:after], own))
        found.append(full)
        first = after
    return tuple(found)


def _call(
    forward: Side,
    transpose: Side,
    residuals: Leaves,
    leaves: Leaves,
    ins: tuple[ShapedArray, ...],
    outs: tuple[ShapedArray, ...],
    wanted: tuple[bool, ...],
) -> Leaves:
    """Results, None where not wanted. ins, outs: of every leaf, given and wanted or not."""
    found = iter(
        linear_map_p.bind(
            *residuals,
            *(x for x in leaves if x is not None),
            forward=forward,
            transpose=transpose,
            kept=len(residuals),
            ins=ins,
            outs=outs,
            given=tuple(x is not None for x in leaves),
            wanted=wanted,
        )
    )
    return [next(found) if w else None for w in wanted]


def _evaluate(*operands, forward, kept, given, wanted, **_):
    leaves = iter(operands[kept:])
    results = forward.run(list(operands[:kept]), [next(leaves) if g else None for g in given])
    return list(compress(results, wanted))


def _abstract(*_, outs, wanted, **__):
    return list(compress(outs, wanted))


def _transpose(cotangents, *operands, forward, transpose, kept, ins, outs, given, wanted):
    # A cotangent that is zero is not given to the transpose.
    found = iter(cotangents)
    leaves = [next(found) if w else None for w in wanted]
    leaves = [None if type(x) is ad.Zero else x for x in leaves]
    residuals = list(operands[:kept])
    undefined = iter(ad.is_undefined_primal(x) for x in operands[kept:])
    asked = tuple(next(undefined) if g else False for g in given)
    results = _call(transpose, forward, residuals, leaves, outs, ins, asked)
    return [None] * kept + [x for x, g in zip(results, given, strict=True) if g]


def _jvp(primals, tangents, *, forward, transpose, kept, ins, outs, given, wanted):
    parts: dict[str, Any] = {"ins": ins, "outs": outs, "wanted": wanted}
    entries = iter(primals[kept:])
    leaves = [next(entries) if g else None for g in given]
    residuals = list(primals[:kept])
    results = _call(forward, transpose, residuals, leaves, **parts)

    moving = iter(None if type(t) is ad.Zero else t for t in tangents[kept:])
    rates = [next(moving) if g else None for g in given]
    total: Leaves = [ad.Zero(a) for a in outs]
    if any(rate is not None for rate in rates):
        total = _call(forward, transpose, residuals, rates, **parts)
    moved = [i for i, t in enumerate(tangents[:kept]) if type(t) is not ad.Zero]
    if moved:
        along = _along_residuals(forward, moved, kept, given, outs, wanted)
        more = _call(
            *along,
            [*residuals, *primals[kept:]],
            [tangents[i] for i in moved],
            tuple(_tangent_of(residuals[i]) for i in moved),
            outs,
            wanted,
        )
        total = [
            b if type(a) is ad.Zero else a + b if w else None
            for a, b, w in zip(total, more, wanted, strict=True)
        ]
    return list(compress(results, wanted)), list(compress(total, wanted))


def _along_residuals(forward, moved, kept, given, outs, wanted) -> tuple[Side, Side]:
    """The derivative of a map's results by its residuals `moved`, linear in their change, and its
    transpose; both depend on all operands of the map.
    """
    sides = tuple(compress(outs, wanted))

    def split(operands):
        leaves = iter(operands[kept:])
        leaves = [next(leaves) if g else None for g in given]

        def results(changed):
            residuals = list(operands[:kept])
            for i, x in zip(moved, changed, strict=True):
                residuals[i] = x
            return list(compress(forward.smooth(residuals, leaves), wanted))

        return results, [operands[i] for i in moved]

    def along(operands, rates):
        results, start = split(operands)
        rates = _filled(tuple(map(_tangent_of, start)), rates)
        found = iter(jax.jvp(results, (start,), (rates,))[1])
        return [next(found) if w else None for w in wanted]

    def back(operands, cotangents):
        results, start = split(operands)
        cotangents = _filled(sides, list(compress(cotangents, wanted)))
        return jax.vjp(results, start)[1](cotangents)[0]

    return Side(along, along), Side(back, back)


def _batch(operands, axes, *, forward, transpose, kept, ins, outs, given, wanted):
    size = next(
        x.shape[axis]
        for x, axis in zip(operands, axes, strict=True)
        if axis is not batching.not_mapped
    )

    def batched(side: Side) -> Side:
        # All that is linear gets the batch, or the transpose would have to sum over it.
        places = (list(residual_axes), 0)
        return Side(
            *(jax.vmap(function, in_axes=places, out_axes=0, axis_size=size) for function in side)
        )

    def with_batch(x, axis):
        if axis is batching.not_mapped:
            return jnp.broadcast_to(x, (size, *x.shape))
        return jnp.moveaxis(x, axis, 0)

    def longer(avals):
        return tuple(ShapedArray((size, *a.shape), a.dtype) for a in avals)

    residual_axes = [None if a is batching.not_mapped else a for a in axes[:kept]]
    found = linear_map_p.bind(
        *operands[:kept],
        *map(with_batch, operands[kept:], axes[kept:]),
        forward=batched(forward),
        transpose=batched(transpose),
        kept=kept,
        ins=longer(ins),
        outs=longer(outs),
        given=given,
        wanted=wanted,
    )
    return found, [0] * len(found)


linear_map_p.def_impl(_evaluate)
linear_map_p.def_abstract_eval(_abstract)
ad.primitive_jvps[linear_map_p] = _jvp
ad.primitive_transposes[linear_map_p] = _transpose
batching.primitive_batchers[linear_map_p] = _batch
mlir.register_lowering(linear_map_p, mlir.lower_fun(_evaluate, multiple_results=True))
