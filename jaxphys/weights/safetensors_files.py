"""The arrays of published networks: one .safetensors file, or a folder that holds them.

Folders come in four forms: one whole file or shards with an index, each at full or half precision.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

import ml_dtypes  # noqa: F401  (gives numpy its bfloat16)
import numpy as np
from safetensors import SafetensorError, safe_open

from jaxphys.core.errors import InputError, shown
from jaxphys.core.files import read_json
from jaxphys.core.finite import all_finite
from jaxphys.core.reading import reading

TYPES = ("F32", "F16", "BF16", "F64", "I64", "I32", "I16", "I8", "U8", "BOOL")
ENDINGS = (
    "safetensors",
    "safetensors.index.json",
    "fp16.safetensors",
    "safetensors.index.fp16.json",
)
REMEDY = "put the original file there (`jaxphys weights list` names where it is published)"


class Arrays(Mapping[str, np.ndarray]):
    """Arrays by name, each read from its file when it is asked for and not kept.

    The files stay open as long as this object lives.
    """

    def __init__(self, files: list[Path]):
        """Raises InputError if a file is no safetensors file, or two hold the same name."""
        self._sources: dict[str, tuple[Path, safe_open]] = {}
        for path in files:
            opened = _open(path)
            for name in opened.keys():  # noqa: SIM118 (no mapping)
                if name in self._sources:
                    other = self._sources[name][0].name
                    raise InputError(f"{path}: array {shown(name)} is also in {other}; {REMEDY}")
                self._sources[name] = (path, opened)

    def __getitem__(self, name: str) -> np.ndarray:
        path, opened = self._sources[name]
        kind = opened.get_slice(name).get_dtype()
        if kind not in TYPES:
            raise InputError(
                f"{path}: array {shown(name)} holds {kind}; readable: {', '.join(TYPES)}"
            )
        with reading(path):
            array = opened.get_tensor(name)
        if not all_finite(array):
            raise InputError(
                f"{path}: array {shown(name)} holds numbers that are not finite; {REMEDY}"
            )
        return array

    def __iter__(self) -> Iterator[str]:
        return iter(self._sources)

    def __len__(self) -> int:
        return len(self._sources)

    def path(self, name: str) -> Path:
        """The file that holds the array `name`."""
        return self._sources[name][0]


def open_arrays(path: str | Path, stem: str = "model") -> Arrays:
    """The arrays of a .safetensors file, or of a folder with the files of one network.

    Args:
        path: the file, or an index of shards; or a folder with {stem}.safetensors, else
            {stem}.safetensors.index.json and the shards that it lists, else
            {stem}.fp16.safetensors, else {stem}.safetensors.index.fp16.json and its shards.
        stem: the files' name in a folder: "model", or "diffusion_pytorch_model" for parts of
            Stable Diffusion.

    Raises:
        InputError: nothing of the kind is there, or it is damaged, or shards are missing.
    """
    path = Path(path)
    if not path.is_dir():
        return _sharded(path) if path.suffix == ".json" else Arrays([path])
    found = choices(path, stem)
    if not found:
        raise InputError(
            f"{path}: the folder has no {stem}.safetensors (nor {' nor '.join(ENDINGS[1:])} of that"
            f" name); other kinds of files are not read; {REMEDY}"
        )
    return open_arrays(found[0])


def choices(folder: Path, stem: str = "model") -> list[Path]:
    """What a folder has of the four forms, the best first; of shards, their index."""
    return [file for ending in ENDINGS if (file := folder / f"{stem}.{ending}").is_file()]


def shards(index: Path) -> dict[str, str]:
    """The file name that an index gives for each array.

    Raises InputError if it is no such index, or names a file outside of its own folder.
    """
    try:
        listed = read_json(index).get("weight_map")
    except InputError as error:
        why = str(error).removeprefix(f"{index}: ")
        raise InputError(f"{index}: not an index of shards ({why}); {REMEDY}") from error
    if not isinstance(listed, dict) or not listed:
        raise InputError(f"{index}: 'weight_map' lists no arrays; {REMEDY}")
    for name, file in listed.items():
        if not isinstance(file, str) or not file.endswith(".safetensors"):
            raise InputError(f"{index}: array {shown(name)} is in no .safetensors file; {REMEDY}")
        if Path(file).name != file or "\\" in file:
            raise InputError(f"{index}: {shown(file)} is not a file of the same folder; {REMEDY}")
    return listed


def _sharded(index: Path) -> Arrays:
    """The arrays of every shard, which must be those that the index lists, where it lists them."""
    listed = shards(index)
    arrays = Arrays([index.parent / file for file in sorted(set(listed.values()))])
    for name in sorted(set(listed) | set(arrays)):
        found = arrays.path(name).name if name in arrays else "no shard"
        if listed.get(name) != found:
            raise InputError(
                f"{index}: array {shown(name)} is in {found}, but listed in"
                f" {listed.get(name, 'no shard')}; {REMEDY}"
            )
    return arrays


def _open(path: Path) -> safe_open:
    """The library reads and checks the header: sizes, offsets, overlaps, length."""
    if not path.is_file():
        what = "is not a file" if path.exists() else "is missing"
        raise InputError(f"{path}: {what}; {REMEDY}")
    with reading(path):
        try:
            return safe_open(path, framework="numpy")
        except (SafetensorError, OSError) as error:
            raise InputError(f"{path}: not a whole safetensors file ({error}); {REMEDY}") from error
