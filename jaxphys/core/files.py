"""Files that are either whole or absent."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jaxphys.core.errors import InputError

LARGEST_JSON = 64 * 1024 * 1024


@contextmanager
def atomic_path(path: str | os.PathLike) -> Iterator[Path]:
    """Yields a path beside `path` to write to; renames it into place on success, removes it on
    failure.

    The extension is kept, since writers of images and video choose a format by it.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")
    try:
        yield aside
        os.replace(aside, path)
    finally:
        aside.unlink(missing_ok=True)


def read_json(path: str | os.PathLike) -> dict:
    """The object in a small JSON file. Raises InputError, naming it, for anything else."""
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_JSON:
            raise InputError(f"{path}: is larger than {LARGEST_JSON} bytes; is it the right file?")
        value = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{path}: is not JSON ({error}); get the file again") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: holds {type(value).__name__}, not a JSON object")
    return value


def write_json(path: str | os.PathLike, value) -> None:
    """Writes `value` as indented JSON with sorted keys, so that equal values give equal bytes."""
    with atomic_path(path) as aside:
        aside.write_text(json.dumps(value, indent=2, sort_keys=True) + "\n")
