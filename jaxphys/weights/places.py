"""Where the files of a published network may be on this computer. Looks only; fetches nothing."""

from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.weights.catalogue import Entry, File
from jaxphys.weights.safetensors_files import choices

VARIABLE = "JAXPHYS_WEIGHTS"
SHARED = "~/.cache/jaxphys/weights"
# Files which, in the same folder, say what others say.
STANDS_FOR = {
    "vocab.json": "tokenizer.json",
    "merges.txt": "tokenizer.json",
    "special_tokens_map.json": "tokenizer_config.json",
}


def expanded(path: str) -> Path | None:
    """`path` with ~ replaced; None where there is no home directory that it could stand for."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return None


def own_folder(entry: Entry, environment: Mapping[str, str]) -> Path:
    """Where this package keeps the files of `entry`, and where a user is to put them.

    Raises:
        InputError: that is in a home directory, and there is none.
    """
    folder = expanded(environment.get(VARIABLE) or SHARED)
    if folder is None:
        raise InputError(f"there is no home directory; set ${VARIABLE} to a folder for weights")
    return folder / entry.name


def hub_cache(environment: Mapping[str, str]) -> Path | None:
    """Where the Hugging Face hub's library keeps what it fetched, by its own rules; None where that
    is in a home directory, and there is none."""
    for variable in ("HF_HUB_CACHE", "HUGGINGFACE_HUB_CACHE"):
        if environment.get(variable):
            return expanded(environment[variable])
    caches = environment.get("XDG_CACHE_HOME") or "~/.cache"
    home = environment.get("HF_HOME") or f"{caches}/huggingface"
    return expanded(f"{home}/hub")


def places(entry: Entry, environment: Mapping[str, str]) -> Iterator[Path]:
    """The folders that may hold the files of `entry`, the first to be taken first."""
    yield own_folder(entry, environment)
    cache = hub_cache(environment)
    if cache is not None:
        for repository in entry.repositories:
            yield from _snapshots(cache, repository)
    if entry.package:
        yield from _package_folders(entry.package)


def _snapshots(cache: Path, repository: str) -> Iterator[Path]:
    """The revisions of a repository in the hub's cache, the one that was last fetched first."""
    folder = cache / f"models--{repository.replace('/', '--')}"
    main = folder / "refs" / "main"
    latest = main.read_text().strip() if main.is_file() else ""
    snapshots = sorted((folder / "snapshots").glob("*/"))
    yield from sorted(snapshots, key=lambda snapshot: snapshot.name != latest)


def _package_folders(requirement: str) -> Iterator[Path]:
    """The folder of an installed package. It is found without running any of it."""
    spec = find_spec(requirement.partition("==")[0].replace("-", "_"))
    if spec is not None and spec.submodule_search_locations:
        yield from map(Path, spec.submodule_search_locations)


def stand_in(folder: Path, file: File) -> Path | None:
    """The file in `folder` that holds what `file` does: itself, or arrays in another form (half
    precision, shards, safetensors for .pt), or a tokenizer in one piece. None if there is none."""
    path = folder / file.path
    if path.suffix == ".safetensors":
        return next(iter(choices(path.parent, path.stem)), None)
    if path.is_file():
        return path
    other = path.with_name(STANDS_FOR.get(path.name, path.name))
    if path.suffix == ".pt":
        other = path.with_suffix(".safetensors")
    return other if other.is_file() else None


def file_sets(entry: Entry, parts: Sequence[str] | None = None) -> list[tuple[File, ...]]:
    """The sets of files of which one is enough, each reduced to paths that start with `parts`."""

    def wanted(file: File) -> bool:
        return parts is None or file.path.startswith(tuple(parts))

    sets = [tuple(filter(wanted, files)) for files in (entry.files, entry.instead)]
    return [files for files in sets if files]


def missing(folder: Path, entry: Entry, parts: Sequence[str] | None = None) -> tuple[File, ...]:
    """What `folder` lacks of the set of files that it lacks least of."""
    lacking = [
        tuple(file for file in files if stand_in(folder, file) is None)
        for files in file_sets(entry, parts)
    ]
    return min(lacking, key=len)


def best_place(
    entry: Entry, environment: Mapping[str, str], parts: Sequence[str] | None = None
) -> tuple[Path, tuple[File, ...]]:
    """The first of the `places` that lacks least, and what it lacks."""
    found = [(folder, missing(folder, entry, parts)) for folder in places(entry, environment)]
    return min(found, key=lambda place: len(place[1]))
