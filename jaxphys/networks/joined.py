"""Matrices of a checkpoint that act on the same rows, joined into one."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from jaxphys.core.errors import InputError


class JoinedArrays(Mapping[str, np.ndarray]):
    """A checkpoint's arrays in which some layers' matrices follow each other in one: `a.qkv.weight`
    in the place of `a.q.weight`, `a.k.weight` and `a.v.weight`.

    A product with one row takes as long as its matrix takes to be read, and memory is read faster
    in few long pieces than in many short ones.
    """

    def __init__(
        self, arrays: Mapping[str, np.ndarray], joined: Mapping[str, Sequence[str]], *, source: str
    ):
        """Reads nothing yet.

        Args:
            arrays: by the checkpoint's names; matrices have outputs first.
            joined: the layers, in order, that each new layer is made of.
            source: the file or folder, for errors.

        Raises:
            InputError: some of the layers to be joined are there, others not.
        """
        self._arrays, self._source = arrays, source
        wholes = {part: whole for whole, parts in joined.items() for part in parts}
        self._parts: dict[str, list[str]] = {}
        for key in arrays:
            path = key.split(".")
            whole = wholes.get(path[-2]) if len(path) > 1 else None
            if whole is None:
                self._parts[key] = [key]
                continue
            owner, last = path[:-2], path[-1]
            names = [".".join([*owner, part, last]) for part in joined[whole]]
            for name in names:
                if name not in arrays:
                    raise InputError(f"{source}: array {name!r} is missing")
            self._parts[".".join([*owner, whole, last])] = names

    def __getitem__(self, name: str) -> np.ndarray:
        """Raises InputError if the matrices do not fit beside each other."""
        first, *others = self._parts[name]
        arrays = [np.asarray(self._arrays[first])]
        for other in others:
            array = np.asarray(self._arrays[other])
            if not array.shape or array.shape[1:] != arrays[0].shape[1:]:
                raise InputError(
                    f"{self._source}: array {other!r} of shape {array.shape} does not fit beside"
                    f" {first!r} of {arrays[0].shape}"
                )
            arrays.append(array)
        return np.concatenate(arrays) if others else arrays[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)
