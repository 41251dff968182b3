"""Whether the files of a network on this computer are the published ones, and readable."""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.core.files import read_json
from jaxphys.weights.catalogue import Entry, File, find_entry
from jaxphys.weights.places import best_place, file_sets, stand_in
from jaxphys.weights.safetensors_files import open_arrays
from jaxphys.weights.torch_zip import read_torch_zip

INDEX = ".safetensors.index."


@dataclass(frozen=True)
class Verdict:
    """path: of the file, or of the one that stands for it; relative to the network's folder.
    size: bytes, None if it is missing. sha256: what is known of it: "matches" or "not known".
    problem: what is wrong with it, or None.
    """

    path: str
    size: int | None
    sha256: str
    problem: str | None


def verify(
    name: str, *, environment: Mapping[str, str] = os.environ
) -> tuple[Path, tuple[Verdict, ...]]:
    """The folder that has most of a network's files, and a verdict on each.

    A file whose SHA-256 is known is compared with it; of the others the size is compared as far as
    it is known, and the file is opened. Raises InputError for an unknown name.
    """
    entry = find_entry(name)
    folder, _ = best_place(entry, environment)
    files = min(file_sets(entry), key=lambda files: sum(stand_in(folder, f) is None for f in files))
    return folder, tuple(_verdict(folder, file, entry) for file in files)


def _verdict(folder: Path, file: File, entry: Entry) -> Verdict:
    path = stand_in(folder, file)
    if path is None:
        return Verdict(file.path, None, "not known", "missing")
    relative, size = path.relative_to(folder).as_posix(), path.stat().st_size
    known = {f.path: f for f in (*entry.files, *entry.half, *entry.instead)}.get(relative)
    if known is not None and (problem := difference(path, known)):
        hashed = not known.exact or size == known.size
        return Verdict(relative, size, "differs" if hashed else "not known", problem)
    if known is not None and known.sha256 is not None:
        return Verdict(relative, size, "matches", None)
    try:
        _open(path)
    except InputError as error:
        return Verdict(relative, size, "not known", str(error))
    return Verdict(relative, size, "not known", None)


def difference(path: Path, known: File) -> str | None:
    """How the file `path` differs from the published one, as far as that is pinned, or None."""
    size = path.stat().st_size
    if known.exact and size != known.size:
        return f"has {size} bytes instead of {known.size}"
    if known.sha256 is not None and _sha256(path) != known.sha256:
        return "is another file: its SHA-256 differs"
    return None


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _open(path: Path) -> None:
    """Reads what tells whether a file is whole. Raises InputError if it is not."""
    if path.suffix == ".safetensors" or INDEX in path.name:
        open_arrays(path)
    elif path.suffix in (".pt", ".pth"):
        read_torch_zip(path)
    elif path.suffix == ".json":
        read_json(path)
