"""A module's parameters by name, and modules filled from the arrays of a published checkpoint."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError

Module = TypeVar("Module", bound=nnx.Module)
Renames = Sequence[tuple[str, str]]


def _name(path: tuple) -> str:
    keys = [getattr(entry, "key", getattr(entry, "idx", None)) for entry in path]
    return "/".join(str(key) for key in keys if key is not None)


def named_parameters(module: nnx.Module) -> dict[str, Array]:
    """Every parameter under a name such as `layers/0/attention/output/kernel`."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(nnx.state(module, nnx.Param))
    return {_name(path): leaf for path, leaf in leaves}


def with_parameters(module: Module, parameters: dict[str, Array]) -> Module:
    """A module like `module` (whose own arrays are not read) that holds `parameters`.

    Cheap and free of effects: made to be called inside a jitted function.
    """
    graph, state = nnx.split(module, nnx.Param)
    leaves, structure = jax.tree_util.tree_flatten_with_path(state)
    named = [parameters[_name(path)] for path, _ in leaves]
    return nnx.merge(graph, jax.tree.unflatten(structure, named))


def published_name(name: str) -> str:
    """`a/0/kernel` as checkpoints have it, `a.0.weight`."""
    *path, last = name.split("/")
    return ".".join([*path, "weight" if last in ("kernel", "scale", "table") else last])


def published_shape(name: str, shape: tuple[int, ...]) -> tuple[int, ...]:
    """The shape that the array of a parameter has in checkpoints: outputs first."""
    if not name.endswith("/kernel"):
        return shape
    return (shape[1], shape[0]) if len(shape) == 2 else (shape[3], shape[2], shape[0], shape[1])


def _as_parameter(name: str, array: np.ndarray) -> np.ndarray:
    """Out of a checkpoint's layout: kernels have their inputs before their outputs here."""
    if not name.endswith("/kernel"):
        return array
    return array.T if array.ndim == 2 else array.transpose(2, 3, 1, 0)


def fill(
    build: Callable[[], Module],
    arrays: Mapping[str, np.ndarray],
    *,
    source: str,
    renames: Renames = (),
    ignore: Sequence[str] = (),
    dtype: jnp.dtype | str = jnp.float32,
) -> Module:
    """The module that `build` makes, with its parameters from a checkpoint. One to one: an array
    that is missing, left over or of another shape is an error.

    Args:
        build: makes the module; only its shapes are computed, nothing is allocated.
        arrays: by the checkpoint's names; read one at a time, so a lazy mapping keeps memory low.
            1 x 1 convolution kernels may stand for matrices.
        source: the file or folder, for errors.
        renames: (pattern, replacement) pairs, applied to the checkpoint's names in order (re.sub).
        ignore: patterns of names (after renaming) that hold no parameter, matched whole.
        dtype: of the parameters.

    Raises:
        InputError: the checkpoint is not one of this module.
    """
    module = nnx.eval_shape(build)
    wanted = {published_name(name): name for name in named_parameters(module)}
    shapes = {name: leaf.shape for name, leaf in named_parameters(module).items()}
    found: dict[str, str] = {}
    for key in arrays:
        name = key
        for pattern, replacement in renames:
            name = re.sub(pattern, replacement, name)
        if any(re.fullmatch(pattern, name) for pattern in ignore):
            continue
        if name not in wanted:
            raise InputError(f"{source}: array {key!r} belongs to no part of this network")
        if name in found:
            raise InputError(f"{source}: arrays {found[name]!r} and {key!r} are the same parameter")
        found[name] = key
    missing = sorted(set(wanted) - set(found))
    if missing:
        raise InputError(
            f"{source}: {len(missing)} arrays are missing, the first is {missing[0]!r}"
        )
    parameters = {}
    for published, name in wanted.items():
        key = found[published]
        array = np.asarray(arrays[key])
        expected = published_shape(name, shapes[name])
        if array.shape == (*expected, 1, 1):
            array = array.reshape(expected)
        if array.shape != expected:
            raise InputError(
                f"{source}: array {key!r} has shape {array.shape} instead of {expected}"
            )
        if not jnp.issubdtype(array.dtype, jnp.floating):
            raise InputError(f"{source}: array {key!r} holds {array.dtype}, not floating point")
        parameters[name] = jnp.asarray(_as_parameter(name, array), dtype)
    return with_parameters(module, parameters)
