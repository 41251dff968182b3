"""Checkpoints by orbax, each sealed with the SHA-256 of its files: damaged ones are never read.

Every long computation saves with these: a simulation, the optimisation of an object, training.
"""

import hashlib
import os
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import jax
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.interrupt import held_interrupt
from jaxphys.core.seals import is_sound, read_seal, remove, seal

Tree = TypeVar("Tree")


def fingerprint(*parts: bytes | Any) -> str:
    """SHA-256 of bytes and of pytrees of arrays, and of the versions of the program, of JAX and of
    orbax: what decides a result, and whether it can be read again.
    """
    programs = ("jaxphys-splats", "jax", "jaxlib", "orbax-checkpoint")
    digest = hashlib.sha256(" ".join(map(version, programs)).encode())
    for part in parts:
        if isinstance(part, bytes):
            digest.update(f"{len(part)} bytes".encode() + part)
            continue
        leaves, structure = jax.tree.flatten(part)
        digest.update(str(structure).encode())
        for leaf in leaves:
            array = np.ascontiguousarray(leaf)
            digest.update(f"{array.dtype}{np.shape(leaf)}".encode())
            digest.update(array.tobytes())
    return digest.hexdigest()


def by_name(tree: Any) -> dict[str, np.ndarray]:
    """The arrays of a pytree by where they are in it, such as `average/blocks.0.kernel`."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return {
        jax.tree_util.keystr(path, simple=True, separator="/"): np.asarray(leaf)
        for path, leaf in leaves
    }


def from_names(like: Tree, arrays: Mapping[str, np.ndarray]) -> Tree:
    """The pytree of the structure of `like` that `by_name` made `arrays` of."""
    leaves, structure = jax.tree_util.tree_flatten_with_path(like)
    names = [jax.tree_util.keystr(path, simple=True, separator="/") for path, _ in leaves]
    return jax.tree.unflatten(structure, [jax.numpy.asarray(arrays[name]) for name in names])


class Checkpoints:
    """The checkpoints of one request in a folder of its own.

    A folder holds one request's: those of another one are removed when the first is saved. What is
    not whole is said on standard error, and removed.

    Args:
        folder: made when it is needed.
        identity: `fingerprint` of all that decides the result.
        keep: so many of the newest stay; None keeps all.
    """

    def __init__(self, folder: str | os.PathLike, identity: str, keep: int | None = 2):
        self._folder = Path(folder).absolute()
        self._identity = identity
        self._keep = keep
        self._sound: list[int] | None = None

    def _path(self, step: int) -> Path:
        return self._folder / str(step)

    def _manager(self):
        import orbax.checkpoint as ocp

        self._folder.mkdir(parents=True, exist_ok=True)
        options = ocp.CheckpointManagerOptions(
            max_to_keep=self._keep, enable_async_checkpointing=False
        )
        return ocp.CheckpointManager(self._folder, options=options)

    def steps(self) -> list[int]:
        """The steps that are whole and of this request, the oldest first."""
        if self._sound is None:
            self._sound = []
            entries = list(self._folder.iterdir()) if self._folder.is_dir() else []
            if not entries and os.path.lexists(self._folder) and not self._folder.is_dir():
                print(f"jaxphys: {self._folder}: is not used, it is no folder", file=sys.stderr)
                remove(self._folder)
            for entry in entries:
                name = entry.name
                # Others are what orbax had not finished.
                if name.isascii() and name.isdecimal() and str(int(name[:18])) == name:
                    if is_sound(entry, self._identity):
                        self._sound.append(int(name))
                else:
                    remove(entry)
            self._sound.sort()
        return list(self._sound)

    @held_interrupt()  # orbax works in threads, which must not outlive the program
    def save(self, step: int, arrays: Mapping[str, Any]) -> None:
        """Saves arrays by name; those of the oldest step too many go once the new ones are whole.

        Raises:
            InputError: the disk is full or cannot be written.
        """
        import orbax.checkpoint as ocp

        sound = self.steps()
        named = {name: np.asarray(array) for name, array in arrays.items()}
        empty = {name: [str(a.dtype), a.shape] for name, a in named.items() if not a.size}
        filled = {name: array for name, array in named.items() if array.size}
        try:
            for entry in list(self._folder.iterdir()) if self._folder.is_dir() else []:
                if entry.name not in map(str, sound) or int(entry.name) >= step:
                    remove(entry)  # of another request, or after a step that is repeated
            with self._manager() as manager:
                manager.save(step, args=ocp.args.StandardSave(filled))
                left = sorted(manager.all_steps())
            seal(self._path(step), self._identity, empty=empty)
        except Exception as error:  # orbax's, tensorstore's and the system's
            why = getattr(error, "strerror", None) or str(error) or repr(error)
            raise InputError(
                f"{self._folder}: the checkpoint cannot be saved ({' '.join(why.split())[:200]})"
            ) from error
        self._sound = left

    @held_interrupt()
    def load(self, step: int) -> dict[str, np.ndarray]:
        """The arrays of one of the `steps`."""
        import orbax.checkpoint as ocp

        facts = read_seal(self._path(step))
        with self._manager() as manager:
            arrays = manager.restore(step, args=ocp.args.StandardRestore())
        empty = {name: np.zeros(shape, dtype) for name, (dtype, shape) in facts["empty"].items()}
        return {name: np.asarray(array) for name, array in arrays.items()} | empty

    def newest(self) -> tuple[int, dict[str, np.ndarray]] | None:
        """The newest step and its arrays, None if there is none."""
        steps = self.steps()
        return (steps[-1], self.load(steps[-1])) if steps else None

    def drop_after(self, step: int) -> None:
        """Removes the steps after `step`, which will be computed again."""
        for later in [later for later in self.steps() if later > step]:
            remove(self._path(later))
            if self._sound is not None:
                self._sound.remove(later)
