"""Bundled weights: safetensors files beside this one, each listed with its hash in `manifest.json`.

A file is only read whole and only if its SHA-256 is the manifest's. An entry of the manifest holds
`file`, `sha256`, `bytes`, `licence`, `data`, `command` and, for what was trained here, `steps`,
`seed` and `held_out` (loss by noise level).
"""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np

from jaxphys.core.errors import InputError, nearest
from jaxphys.core.files import atomic_path, write_json

FOLDER = Path(__file__).parent
REMEDY = "reinstall the package"
REQUIRED = ("licence", "data", "command")


def manifest(folder: Path = FOLDER) -> dict[str, dict]:
    """The entries of the manifest by name. Raises InputError where it is missing or not JSON."""
    path = folder / "manifest.json"
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise InputError(f"weights: {path} cannot be read ({error}); {REMEDY}") from error


def weights_path(name: str, folder: Path = FOLDER) -> Path:
    """The file of the weights `name`. Raises InputError for an unknown name or a missing file."""
    entries = manifest(folder)
    if name not in entries:
        raise InputError(f"weights: unknown name {name!r}; {nearest(name, entries)}")
    path = folder / entries[name]["file"]
    if not path.is_file():
        raise InputError(f"weights {name!r}: {path} is missing; {REMEDY}")
    return path


def load(name: str, folder: Path = FOLDER) -> tuple[dict[str, np.ndarray], dict]:
    """The arrays of the weights `name` by key, and their manifest entry.

    Raises InputError if the file is not the one that the manifest lists.
    """
    path = weights_path(name, folder)
    entry = manifest(folder)[name]
    content = path.read_bytes()
    if len(content) != entry["bytes"]:
        raise InputError(
            f"weights {name!r}: {path} has {len(content)} bytes"
            f" instead of {entry['bytes']}; {REMEDY}"
        )
    if hashlib.sha256(content).hexdigest() != entry["sha256"]:
        raise InputError(f"weights {name!r}: {path} does not match its SHA-256; {REMEDY}")
    from safetensors.numpy import load as parse

    return parse(content), entry


def register(name: str, source: str | Path, folder: Path = FOLDER, **facts) -> dict:
    """Copies the safetensors file `source` into the package and lists it in the manifest.

    `facts` must hold `licence`, `data` and `command`; a trained prior adds `steps`, `seed`,
    `held_out` and whatever its loader needs. Everything must be JSON. Returns the entry.
    """
    absent = [key for key in REQUIRED if key not in facts]
    if absent:
        raise InputError(f"weights {name!r}: the entry lacks {', '.join(absent)}")
    content = Path(source).read_bytes()
    target = folder / f"{name}.safetensors"
    if Path(source).resolve() != target.resolve():
        with atomic_path(target) as aside:
            shutil.copyfile(source, aside)
    entry = {
        "file": target.name,
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        **facts,
    }
    entries = manifest(folder) if (folder / "manifest.json").exists() else {}
    write_json(folder / "manifest.json", entries | {name: entry})
    return entry
