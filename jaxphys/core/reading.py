"""The border that every file reader stands behind: whatever goes wrong in it names the file."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jaxphys.core.errors import InputError, one_line


@contextmanager
def reading(path: str | os.PathLike, largest: int | None = None) -> Iterator[Path]:
    """Yields `path` once it is known to be a regular file; errors inside are told as this file's.

    An exception that the reader did not foresee is a fault of the reader, not of the user: it goes
    on as it is, with a note of the file's name.

    Args:
        path: the file.
        largest: most bytes that it may have; None is any number.

    Raises:
        InputError: the file is missing, is a folder, pipe or device, is too large or cannot be
            read; or as raised inside, with the file's name put before it where it is not in it.
    """
    path = Path(path)
    try:
        _require_regular(path, largest)
        yield path
    except InputError as error:
        if one_line(str(path)) in str(error):
            raise
        raise InputError(f"{path}: {error}") from error
    except OSError as error:
        why = error.strerror or error
        raise InputError(f"{path}: cannot be read ({why}); check the path") from error
    except MemoryError as error:
        raise InputError(f"{path}: does not fit into memory; give a smaller file") from error
    except Exception as error:
        note = f"while reading {path}"
        if note not in getattr(error, "__notes__", ()):
            error.add_note(note)
        raise


def _require_regular(path: Path, largest: int | None) -> None:
    try:
        found = path.stat()
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except ValueError as error:  # a NUL or half of a surrogate pair in the name
        raise InputError(f"{path}: is no name that a file can have ({error})") from None
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"{path}: is a folder; name a file")
    # A pipe would be waited for without end, and a device has no end.
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{path}: is a pipe or a device; copy it into a file first")
    if largest is not None and found.st_size > largest:
        raise InputError(
            f"{path}: has {_binary(found.st_size)}, more than the {_binary(largest)} that such a"
            " file may have; is it the right one?"
        )


def _binary(size: int) -> str:
    return f"{size / 2**30:.1f} GiB" if size >= 2**30 else f"{size / 2**20:.1f} MiB"
