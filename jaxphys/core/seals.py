"""Files and folders sealed with the SHA-256 of what they hold: what is damaged is never read."""

import hashlib
import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

from jaxphys.core.files import atomic_path

SEAL = "sha256.json"


def seal(path: Path, identity: str, **facts: Any) -> None:
    """Records the SHA-256 of the file `path`, or of every file in the folder `path`, with the
    request that it belongs to, in PATH.sha256.json or PATH/sha256.json. The last thing to do.
    """
    facts = {"identity": identity, "files": _hashes(path), **facts}
    body = json.dumps(facts, sort_keys=True).encode()
    with atomic_path(_seal_of(path)) as aside:
        aside.write_bytes(hashlib.sha256(body).hexdigest().encode() + b"\n" + body)


def read_seal(path: Path) -> dict[str, Any]:
    """What was recorded of `path`, if it still is exactly what was sealed.

    Raises:
        ValueError: it says in a few words why it is not.
    """
    try:
        if path.is_symlink():
            raise ValueError("it is a link")
        known, _, body = _seal_of(path).read_bytes().partition(b"\n")
        if hashlib.sha256(body).hexdigest().encode() != known:
            raise ValueError("its seal is damaged")
        facts = json.loads(body)
        if _hashes(path) != facts["files"]:
            raise ValueError("its SHA-256 differs")
    except FileNotFoundError:
        raise ValueError("it was not finished") from None
    except OSError as error:
        raise ValueError(f"it cannot be read ({error.strerror})") from None
    return facts


def is_sound(path: Path, identity: str) -> bool:
    """Whether `path` is what was sealed for this request; says on standard error if it is damaged,
    and removes it then.
    """
    if not os.path.lexists(path):
        return False
    try:
        return read_seal(path)["identity"] == identity
    except ValueError as error:
        print(f"jaxphys: {path}: is not used, {error}", file=sys.stderr)
        remove(path)
        return False


def _seal_of(path: Path) -> Path:
    return path / SEAL if path.is_dir() else path.with_name(f"{path.name}.{SEAL}")


def _hashes(path: Path) -> dict[str, str]:
    """SHA-256 by relative path of all that is there. Raises ValueError for links and the like."""
    if not path.is_dir():
        return {path.name: _sha256(path)}
    found = {}
    for folder, folders, files in os.walk(path):
        links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
        for entry in (Path(folder, name) for name in [*files, *links]):
            if entry != path / SEAL:
                found[entry.relative_to(path).as_posix()] = _sha256(entry)
    return found


def _sha256(path: Path) -> str:
    if path.is_symlink() or not path.is_file():
        raise ValueError(f"{path.name} is no file")
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def remove(path: Path) -> None:
    """Removes a file with its seal, or a folder; of a link, the link."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
        _seal_of(path).unlink(missing_ok=True)
