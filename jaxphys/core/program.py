"""Which parts a traced program holds: code marks its optional parts, readers find the marks.

What a plan tells of a program is read off the program itself, so that the two cannot differ.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import jax

_MARK = "part: "
# Options of `jax.jit` for what runs a few times only: compiled fast, not to be fast.
COMPILED_FAST: Mapping[str, Any] = MappingProxyType(
    {"xla_backend_optimization_level": 0, "xla_llvm_disable_expensive_passes": True}
)


def part(name: str):
    """Context in which everything that is traced belongs to the part `name` of a program.

    Costs nothing where the program runs; profiles show the name too. Parts may lie within parts.
    """
    return jax.named_scope(_MARK + name)


def _equations(jaxpr: Any) -> Iterator[Any]:
    for equation in jaxpr.eqns:
        yield equation, ()
        for value in equation.params.values():
            for inner in value if isinstance(value, tuple | list) else (value,):
                inner = getattr(inner, "jaxpr", inner)
                if hasattr(inner, "eqns"):
                    for deeper, around in _equations(inner):
                        yield deeper, (str(equation.source_info.name_stack), *around)


def parts(function: Callable, *arguments: Any) -> dict[str, int]:
    """The parts of `function` and how many primitives each holds, those of parts within included.

    Args:
        function: traced, not run.
        arguments: pytrees of arrays or of `jax.ShapeDtypeStruct`.
    """
    found: Counter[str] = Counter()
    for equation, around in _equations(jax.make_jaxpr(function)(*arguments)):
        if any(hasattr(getattr(v, "jaxpr", v), "eqns") for v in equation.params.values()):
            continue
        stacks = "/".join((*around, str(equation.source_info.name_stack)))
        names = {piece[len(_MARK) :] for piece in stacks.split("/") if piece.startswith(_MARK)}
        found.update(names)
    return dict(found)
