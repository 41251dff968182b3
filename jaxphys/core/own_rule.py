"""A function with its own rule of differentiation that no transformation forgets, as a primitive.

`jax.custom_jvp` is dropped where JAX splits a loop into what is known and what is linear, on the
supposition that nobody differentiates the known part again. Forward over reverse (`jax.hessian`)
does, and then meets the inside of the function. A primitive is never looked into.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Primitive, jaxpr_as_fun
from jax.interpreters import ad, batching, mlir

Leaves = list[Any]
FlatRule = Callable[[Leaves, Leaves], tuple[Leaves, Leaves]]  # tangents of floats alone

own_rule_p = Primitive("own_rule")
own_rule_p.multiple_results = True


def own_rule(
    function: Callable[..., Any], rule: Callable[[tuple, tuple], tuple[Any, Any]], *arguments: Any
) -> Any:
    """`function(*arguments)`, whose derivative is `rule(primals, tangents) -> (results, tangents)`.

    May be batched, compiled, put into loops and checkpoints, and differentiated to any order that
    the rule can be; the rule is to call `own_rule` itself for its results where a higher order
    matters.

    Args:
        function: of pytrees of arrays. Knows no traced array but its arguments.
        rule: as that of `jax.custom_jvp`: tangents are full pytrees, of dtype float0 where a number
            is no float.
        arguments: pytrees of arrays.

    Raises:
        TypeError: `function` knows traced arrays besides its arguments.
    """
    leaves, tree = jax.tree.flatten(arguments)
    call, shown = jax.make_jaxpr(
        lambda *leaves: function(*jax.tree.unflatten(tree, leaves)), return_shape=True
    )(*leaves)
    if any(isinstance(constant, jax.core.Tracer) for constant in call.consts):
        raise TypeError("a function with its own rule must be given all that is traced")
    moving = [_moves(a) for a in call.in_avals]

    def flat(primals: Leaves, tangents: Leaves) -> tuple[Leaves, Leaves]:
        found = iter(tangents)
        full = [
            next(found) if m else np.zeros(np.shape(x), jax.dtypes.float0)
            for x, m in zip(primals, moving, strict=True)
        ]
        results, rates = rule(jax.tree.unflatten(tree, primals), jax.tree.unflatten(tree, full))
        results, rates = jax.tree.leaves(results), jax.tree.leaves(rates)
        return results, [t for t, a in zip(rates, call.out_avals, strict=True) if _moves(a)]

    results = own_rule_p.bind(*leaves, call=call, rule=flat)
    return jax.tree.unflatten(jax.tree.structure(shown), results)


def _moves(aval) -> bool:
    return jnp.issubdtype(aval.dtype, jnp.inexact)


def _evaluate(*operands, call: ClosedJaxpr, rule: FlatRule):
    return jaxpr_as_fun(call)(*operands)


def _abstract(*_, call: ClosedJaxpr, rule: FlatRule):
    return call.out_avals


def _jvp(primals, tangents, *, call: ClosedJaxpr, rule: FlatRule):
    full = [
        ad.instantiate_zeros(t) for t, a in zip(tangents, call.in_avals, strict=True) if _moves(a)
    ]
    results, rates = rule(list(primals), full)
    found = iter(rates)
    return results, [
        next(found) if _moves(a) else ad.Zero(a.to_tangent_aval()) for a in call.out_avals
    ]


def _batch(operands, axes, *, call: ClosedJaxpr, rule: FlatRule):
    places = [None if a is batching.not_mapped else a for a in axes]
    sides = [p for p, a in zip(places, call.in_avals, strict=True) if _moves(a)]
    size = next(x.shape[p] for x, p in zip(operands, places, strict=True) if p is not None)
    mapped: Callable = partial(jax.vmap, out_axes=0, axis_size=size)
    batched = jax.make_jaxpr(mapped(jaxpr_as_fun(call), in_axes=places))(*operands)
    along = mapped(rule, in_axes=(places, sides))
    return own_rule_p.bind(*operands, call=batched, rule=along), [0] * len(call.out_avals)


own_rule_p.def_impl(_evaluate)
own_rule_p.def_abstract_eval(_abstract)
ad.primitive_jvps[own_rule_p] = _jvp
batching.primitive_batchers[own_rule_p] = _batch
mlir.register_lowering(own_rule_p, mlir.lower_fun(_evaluate, multiple_results=True))
