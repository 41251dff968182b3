"""Files that are either whole or absent."""

import errno
import json
import math
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from jaxphys.core.errors import InputError, shown
from jaxphys.core.reading import reading

LARGEST_JSON = 64 * 1024 * 1024
MOST_DIGITS = 40
ASIDE = re.compile(r"\.jaxphys-(\d+)-(.+)", re.DOTALL)
# What only a disk answers: whatever else fails while a file is written is for others to tell.
DISK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO,
        errno.ENAMETOOLONG, errno.EISDIR, errno.ENOTDIR, errno.ENOENT, errno.EEXIST, errno.ELOOP,
        errno.ENOTEMPTY}  # fmt: skip


def aside_path(path: Path) -> Path:
    """Where this process writes `path` until it is whole. The extension is kept, since writers of
    images and video choose a format by it."""
    return path.with_name(f".jaxphys-{os.getpid()}-{path.name}")


def remove_asides(folder: Path, name: str | None = None, *, alone: bool = False) -> None:
    """Removes what killed processes left aside in `folder`, of the file `name` or of any.

    Args:
        alone: nobody else may be writing there, so that a live process of that number is another.
    """
    for entry, match in [(entry, ASIDE.fullmatch(entry.name)) for entry in folder.iterdir()]:
        if match is None:
            continue
        number, of = match.groups()
        if name in (None, of) and (alone or not _runs(int(number))):
            entry.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


@contextmanager
def atomic_path(path: str | os.PathLike) -> Iterator[Path]:
    """Yields a path beside `path` to write to; renames it into place on success, removes it on
    failure.

    Raises:
        InputError: the disk refuses: it is full, read-only, or something else is in the way.
    """
    path = Path(path)
    aside = aside_path(path)
    ours = (aside, path, *path.parents)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        remove_asides(path.parent, path.name)
        yield aside
        os.replace(aside, path)
    except OSError as error:
        if error.errno not in DISK or error.filename not in (None, *map(os.fspath, ours)):
            raise
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        if os.path.lexists(aside):
            aside.unlink()


def output_file(
    path: str | os.PathLike, *, overwrite: bool, inputs: tuple[str | os.PathLike, ...] = ()
) -> Path:
    """`path` as a single file that may be written.

    Raises:
        InputError: it is there and `overwrite` is not given, it is one of the `inputs`, or no file.
    """
    path = Path(path)
    if path.is_symlink():
        raise InputError(f"{path}: is a link; name the file that it leads to")
    if not os.path.lexists(path):
        return path
    if not path.is_file():
        raise InputError(f"{path}: is no file; name another")
    if any(os.path.exists(known) and os.path.samefile(known, path) for known in inputs):
        raise InputError(f"{path}: is what is read; name another file")
    if not overwrite:
        raise InputError(f"{path}: is there already; --overwrite replaces it")
    return path


def read_json(path: str | os.PathLike, largest: int = LARGEST_JSON, kind: type = dict) -> Any:
    """The object in a JSON file, or with `kind` = list the list.

    What JSON does not know (NaN, infinities) or no number type here holds (1e999, whole numbers of
    more than `MOST_DIGITS` digits) is refused.

    Raises:
        InputError: anything else than such a file of at most `largest` bytes; names it.
    """
    with reading(path, largest):
        try:
            value = json.loads(
                Path(path).read_text(encoding="utf-8"),
                parse_constant=_refuse_number,
                parse_float=_finite,
                parse_int=_whole,
            )
        except UnicodeDecodeError:
            raise InputError("is not a text file; JSON is text in UTF-8") from None
        except json.JSONDecodeError as error:
            raise InputError(
                f"not valid JSON at line {error.lineno}, column {error.colno}: {error.msg}"
            ) from None
        except RecursionError:
            raise InputError("is nested too deeply") from None
        if not isinstance(value, kind):
            wanted = "a list [ ... ]" if kind is list else "an object { ... }"
            raise InputError(f"expected {wanted}, found {shown(value)}")
        return value


def _refuse_number(text: str) -> NoReturn:
    raise InputError(f"{shown(text)} is not a number that fits; write a smaller, finite one")


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _refuse_number(text)


def _whole(text: str) -> int:
    return int(text) if len(text) <= MOST_DIGITS else _refuse_number(text)


def write_json(path: str | os.PathLike, value) -> None:
    """Writes `value` as indented JSON with sorted keys, so that equal values give equal bytes."""
    with atomic_path(path) as aside:
        aside.write_text(json.dumps(value, indent=2, sort_keys=True) + "\n")
