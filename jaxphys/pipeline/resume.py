"""Frame-level checkpoints (orbax): an interrupted run goes on where it was, to the same bytes."""

import hashlib
import shutil
from pathlib import Path
from typing import Any

import jax
import numpy as np

FOLDER = "checkpoint"


def fingerprint(*parts: bytes | Any) -> str:
    """A hash of bytes and of pytrees of arrays: what decides a run and the program that runs
    it.
    """
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, bytes):
            digest.update(part)
            continue
        leaves, structure = jax.tree.flatten(part)
        digest.update(str(structure).encode())
        for leaf in leaves:
            array = np.ascontiguousarray(leaf)
            digest.update(f"{array.dtype}{array.shape}".encode())
            digest.update(array.tobytes())
    return digest.hexdigest()


class Checkpoint:
    """One checkpoint in a directory, replaced by each new one.

    Args:
        directory: of the run; the checkpoint lives in `checkpoint/` under it.
        identity: fingerprint of the run; a checkpoint of another run is never used.
    """

    def __init__(self, directory: Path, identity: str):
        self._root = Path(directory).absolute() / FOLDER
        self._identity = identity

    def _path(self, frame: int) -> Path:
        return self._root / f"{self._identity[:16]}-{frame:06d}"

    def frame(self) -> int | None:
        """The frame of the newest whole checkpoint of this run, None if there is none."""
        found = sorted(self._root.glob(f"{self._identity[:16]}-" + "[0-9]" * 6))
        return int(found[-1].name.rsplit("-", 1)[1]) if found else None

    def save(self, frame: int, arrays: dict[str, Any]) -> None:
        """Saves arrays by name; the checkpoint before it goes once the new one is whole."""
        import orbax.checkpoint as ocp

        before = list(self._root.glob("*-" + "[0-9]" * 6))
        target = self._path(frame)
        with ocp.StandardCheckpointer() as writer:
            writer.save(target, {k: np.asarray(v) for k, v in arrays.items()}, force=True)
        for old in before:
            if old != target:
                shutil.rmtree(old)

    def load(self, frame: int) -> dict[str, np.ndarray]:
        """The arrays saved at `frame`."""
        import orbax.checkpoint as ocp

        with ocp.StandardCheckpointer() as reader:
            return reader.restore(self._path(frame))

    def remove(self) -> None:
        """Removes every checkpoint of the directory."""
        if self._root.is_dir():
            shutil.rmtree(self._root)
