"""The folder of a run: what the run may write there, and that nobody else's files are touched.

A run owns a folder that it made, or that was empty, or that carries the mark of an earlier run.
The mark is a file with a line for the request and then a line for each file that was made, written
before the file itself; who holds its lock is the only one to write. So a killed run leaves behind
exactly what is known to be ours, and no lock.
"""

import fcntl
import json
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Self

from jaxphys.core.errors import InputError
from jaxphys.core.files import output_file, remove_asides

MARK = ".jaxphys-run"
ANOTHER = "name a new or an empty folder"


class RunFolder:
    """A folder that is locked by this process.

    Names are relative, with forward slashes; one that ends in a slash is a folder of which
    everything inside belongs to the run.

    Attributes:
        path: of the folder.
    """

    def __init__(self, path: Path):
        self.path = path
        self._made: list[Path] = []  # folders, the outermost first
        try:
            while not self._open():
                pass
        except OSError as error:
            raise InputError(f"--out {path}: cannot be written ({error.strerror})") from None
        try:
            text = self._mark.read()
            self._length = text.rfind(b"\n") + 1  # a line that was not finished counts as none
            self.identity, self._names = _parse(path / MARK, text[: self._length])
        except BaseException:
            self._mark.close()
            raise
        self._declared: frozenset[str] = frozenset()
        self._same, self._begun = True, False

    def _open(self) -> bool:
        """Opens and locks the mark; False if whoever made it took it away meanwhile."""
        path, mark = self.path, self.path / MARK
        if not os.path.lexists(path):
            self._make_folders(path)
        self._created = not os.path.lexists(mark)
        if self._created:
            if other := min((entry.name for entry in path.iterdir()), default=None):
                raise InputError(f"--out {path}: holds {other!r}, which no run made; {ANOTHER}")
        elif mark.is_symlink() or not mark.is_file():
            raise InputError(f"{mark}: is no file of a run; {ANOTHER}")
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT
        self._mark = os.fdopen(os.open(mark, flags, 0o666), "r+b", buffering=0)
        try:
            fcntl.flock(self._mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(self._mark.fileno()), os.lstat(mark)):
                return True
        except BlockingIOError:
            self._mark.close()
            raise InputError(
                f"--out {path}: another run is writing there; wait for it, or name another folder"
            ) from None
        except FileNotFoundError:
            pass
        self._mark.close()
        return False

    def _make_folders(self, path: Path) -> None:
        lacking = [path]
        while not os.path.lexists(lacking[-1].parent):
            lacking.append(lacking[-1].parent)
        for folder in reversed(lacking):
            folder.mkdir(exist_ok=True)
            self._made.append(folder)

    def declare(
        self, identity: str, names: Iterable[str], *, inputs: Iterable[Path], overwrite: bool
    ) -> None:
        """Says what request this is and which files it may make. Changes nothing.

        Raises:
            InputError: the folder holds another request and `overwrite` is not given; a file that
                is no run's, or that is an input, is in the way.
        """
        names = frozenset(names)
        self._same = identity == self.identity
        there = [name for name in self._names if os.path.lexists(self.path / name)]
        if there and not self._same and not overwrite:
            raise InputError(
                f"--out {self.path}: holds the run of another request (or version); --overwrite"
                f" replaces its files, or {ANOTHER}"
            )
        for name in sorted(names):
            self._check_free(name)
        for given in inputs:
            if self._would_write(Path(given), names | set(there)):
                raise InputError(f"{given}: is read by this run and would be replaced; {ANOTHER}")
        self.identity, self._declared = identity, names

    def _check_free(self, name: str) -> None:
        """Refuses what is in the way of `name` and is not what a run made."""
        path = self.path / name
        for part in (path, *(part for part in path.parents if self.path in part.parents)):
            if part.is_symlink() or (part != path and part.is_file()):
                raise InputError(f"{part}: is not what a run makes; move it away")
        if not os.path.lexists(path):
            return
        if name not in self._names:
            raise InputError(f"{path}: is in the way and no run made it; move it away")
        if path.is_dir() != name.endswith("/") or not (path.is_dir() or path.is_file()):
            raise InputError(f"{path}: is not what a run made; move it away")

    def _would_write(self, given: Path, names: Iterable[str]) -> bool:
        try:
            inside = given.resolve().relative_to(self.path.resolve()).as_posix()
        except (ValueError, OSError):
            return False
        return any(
            inside.startswith(name) if name.endswith("/") else inside == name for name in names
        )

    def begin(self) -> None:
        """Makes the folder this request's: the files of another one go, and what killed runs left
        aside. Called by the first `file`."""
        if self._begun:
            return
        self._begun = True
        if not self._same:
            for name in list(self._names):
                self._delete(name)
            self._names, self._length = {}, 0
        self._mark.truncate(self._length)
        if not self._length:
            self._note({"program": "jaxphys", "identity": self.identity})
        for folder in {self.path, *((self.path / name).parent for name in self._names)}:
            if folder.is_dir():
                remove_asides(folder, alone=True)

    def file(self, name: str) -> Path:
        """The path of a declared file, which counts as this run's from now on."""
        if name not in self._declared:
            raise ValueError(f"{name!r} was not declared")
        self.begin()
        if name not in self._names:
            self._note(name)
            self._names[name] = None
        return self.path / name

    def remove(self, *names: str) -> None:
        """Removes files that a run made, where they are there."""
        for name in names:
            if name in self._names:
                self._delete(name)

    def _note(self, line: str | dict) -> None:
        try:
            self._mark.write(json.dumps(line).encode() + b"\n")
        except OSError as error:
            raise InputError(f"{self.path / MARK}: cannot be written ({error.strerror})") from None

    def _delete(self, name: str) -> None:
        path = self.path / name
        between = [part for part in path.parents if self.path in part.parents]
        if any(part.is_symlink() for part in (path, *between)):
            return  # not what was made, and leads to what is not ours
        if name.endswith("/"):
            if path.is_dir():
                shutil.rmtree(path)
        elif path.is_file():
            path.unlink()
        for parent in between:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()

    def close(self) -> None:
        """Unlocks the folder. Where nothing was made there, it is left as it was found."""
        if not self._begun and self._created:
            (self.path / MARK).unlink(missing_ok=True)
            for folder in reversed(self._made):
                if not any(folder.iterdir()):
                    folder.rmdir()
        self._mark.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()


def _parse(path: Path, text: bytes) -> tuple[str | None, dict[str, None]]:
    """The request and the names of a mark."""
    lines = text.splitlines()
    if not lines:
        return None, {}
    try:
        first, *names = map(json.loads, lines)
        identity = first["identity"]
        if not isinstance(identity, str) or not all(map(_inside, names)):
            raise ValueError
    except (ValueError, TypeError, KeyError, RecursionError):
        raise InputError(f"{path}: is damaged, so that nobody knows what a run made; {ANOTHER}") \
            from None  # fmt: skip
    return identity, dict.fromkeys(names)


def _inside(name) -> bool:
    """Whether `name` can only be inside the folder."""
    if not isinstance(name, str) or not name or "\0" in name or name.startswith("/"):
        return False
    return name != MARK and ".." not in PurePosixPath(name).parts


def _checked(path: Path) -> Path:
    """`path`, or where it leads, if it is or can become a folder."""
    if path.is_symlink():
        if not path.exists():
            raise InputError(f"--out {path}: is a link that leads nowhere; name a folder")
        path = path.resolve()
    if os.path.lexists(path) and not path.is_dir():
        kind = "a file" if path.is_file() else "no folder"
        raise InputError(f"--out {path}: is {kind}; name a folder")
    if path.is_dir() and not os.access(path, os.R_OK | os.W_OK | os.X_OK):
        raise InputError(f"--out {path}: cannot be written; choose another folder")
    return path


@contextmanager
def run_folder(
    path: str | os.PathLike,
    identity: str,
    names: Iterable[str],
    *,
    inputs: Iterable[Path] = (),
    overwrite: bool = False,
) -> Iterator[RunFolder]:
    """`path` as the folder of one run, made if it is missing and locked meanwhile.

    Nothing in it changes before the first `RunFolder.file` (or `begin`); where none comes, what was
    made of it is removed again. The same request may go on in its folder or be repeated.

    Args:
        path: of the folder; "" and "." are refused.
        identity: fingerprint of the request.
        names: of all files that the run may make, relative to the folder.
        inputs: files that are read, and so never replaced.
        overwrite: whether the files of another request's run may be replaced, and only these.

    Raises:
        InputError: it is no folder, holds what no run made or another request's run, is locked by
            another run, or cannot be written.
    """
    path = Path(path)
    if path == Path():
        raise InputError('--out "": is the current folder; name one for the run')
    try:
        path = _checked(path)
    except OSError as error:
        raise InputError(f"--out {path}: cannot be used ({error.strerror})") from None
    with RunFolder(path) as folder:
        folder.declare(identity, names, inputs=inputs, overwrite=overwrite)
        yield folder


@contextmanager
def added_file(path: str | os.PathLike, name: str, *, overwrite: bool = False) -> Iterator[Path]:
    """The path of one more file in the folder of a run, which is locked meanwhile; in a folder
    without a mark, a single file.

    Raises:
        InputError: as `run_folder`, or as `output_file`.
    """
    path = Path(path)
    if not os.path.lexists(path / MARK):
        yield output_file(path / name, overwrite=overwrite)
        return
    with RunFolder(path) as folder:
        folder.declare(folder.identity or "", [name], inputs=(), overwrite=False)
        yield folder.file(name)
