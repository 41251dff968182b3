"""Samples and renders the models of Sweet Home 3D's furniture libraries.

    python -m experiments.priors.data.furniture FURNITURE_FOLDER OBJECTS_FOLDER
        [--workers 2] [--attribution FILE.md]

FURNITURE_FOLDER is the unpacked Debian package (any depth): its `.sh3f` files are zip archives with
a catalogue of names, tags, licences and creators. Only CC0 and CC-BY models are taken. With
`--attribution` the list of creators that CC-BY asks for is written instead.
"""

import argparse
import re
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple
from zipfile import ZipFile

import numpy as np
from tqdm import tqdm

from experiments.priors.data import wavefront
from experiments.priors.data.colour_names import colour_captions
from experiments.priors.data.prepare import SAMPLES, prepare, save, stable_hash
from jaxphys.library.palette import article

NOT_A_NAME = {"blend swap", "scopia", "kator legaz", "reallusion", ""}
# Words in a model's own licence note that go beyond attribution.
RESTRICTED = re.compile(r"non-?commercial|share-?alike|by-(nc|sa|nd)|no-?deriv", re.IGNORECASE)


class Entry(NamedTuple):
    """One model of a catalogue; `size` is width, height, depth [cm], in the file's x, y, z."""

    archive: Path
    model: str
    name: str
    tags: tuple[str, ...]
    category: str
    creator: str
    licence: str
    size: tuple[float, float, float]
    rotation: tuple[float, ...] | None

    @property
    def item(self) -> str:
        """A unique file-system-safe name."""
        stem = Path(self.model).stem
        return f"furniture-{self.archive.stem}-{re.sub(r'[^A-Za-z0-9]+', '_', stem)}"


def read_properties(text: str) -> dict[str, str]:
    """A Java properties file: `key=value`, `#` comments, unicode escapes."""
    found = {}
    for line in text.replace("\\\n", "").splitlines():
        if "=" in line and not line.lstrip().startswith("#"):
            key, _, value = line.partition("=")
            found[key.strip()] = re.sub(
                r"\\u([0-9a-fA-F]{4})", lambda match: chr(int(match[1], 16)), value.strip()
            )
    return found


def catalogue(path: Path) -> list[Entry]:
    """The entries of one library that are free to use with at most attribution."""
    with ZipFile(path) as archive:
        found = read_properties(archive.read("PluginFurnitureCatalog.properties").decode("latin-1"))
        notes = {}
        for member in archive.namelist():
            if member.lower().endswith((".txt", ".html")) and "/" in member:
                folder = member.rpartition("/")[0]
                notes[folder] = notes.get(folder, "") + archive.read(member).decode("latin-1")
    if "Public domain" in found["license"]:
        licence = "CC0"
    elif "Attribution 3.0" in found["license"]:
        licence = "CC-BY 3.0"
    else:
        raise ValueError(f"{path}: unknown licence {found['license']!r}")
    entries = []
    index = 1
    while f"name#{index}" in found:
        get = lambda key, index=index: found.get(f"{key}#{index}", "")  # noqa: E731
        model = get("model").lstrip("/")
        index += 1
        # The licence notes spell out what each creator granted; a stricter one is respected.
        if RESTRICTED.search(notes.get(model.rpartition("/")[0], "")):
            continue
        tags = tuple(
            tag.strip().lower()
            for tag in get("tags").split(",")
            if tag.strip().lower() not in NOT_A_NAME
        )
        rotation = tuple(float(value) for value in get("modelRotation").split()) or None
        size = tuple(float(get(key)) for key in ("width", "height", "depth"))
        entries.append(
            Entry(
                path,
                model,
                get("name"),
                tags,
                get("category"),
                get("creator"),
                licence,
                size,
                rotation,
            )
        )
    return entries


def captions(entry: Entry, colours: np.ndarray) -> list[str]:
    """The name, with its tags, and with the colours that are seen."""
    name = re.sub(r"\s*\(.*?\)", "", entry.name).strip().lower()
    plural = name.endswith("s") and not name.endswith("ss")
    found = [name if plural else article(name)]
    found += [f"{found[0]}, {tag}" for tag in entry.tags if tag not in name][:2]
    found += colour_captions(name, plural, colours[:: max(1, len(colours) // 2000)])
    return list(dict.fromkeys(found))


def to_frame(
    entry: Entry, points: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """From the file's frame (y up, front +z, its own size) to ours: z up, front +x, longest side
    1.
    """
    if entry.rotation is not None:
        turn = np.array(entry.rotation).reshape(3, 3)
        points, normals = points @ turn.T, normals @ turn.T
    low, high = points.min(0), points.max(0)
    scale = np.array(entry.size) / np.maximum(high - low, 1e-9)
    points, normals = (points - 0.5 * (low + high)) * scale, normals / scale
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    points = points / (np.ptp(points, axis=0).max() + 1e-9)
    return points[:, [2, 0, 1]], normals[:, [2, 0, 1]]


def draw(folder: Path, entry: Entry) -> str | None:
    """Samples and renders one model into `folder` unless it is there; returns why it could not."""
    path = folder / f"{entry.item}.npz"
    if path.exists():
        return None
    key = stable_hash(path.name)
    with ZipFile(entry.archive) as archive:
        try:
            triangles = wavefront.read(archive, entry.model)
        except (KeyError, ValueError, IndexError) as error:
            return f"{entry.item}: {error}"
    points, normals, colours = wavefront.sample(triangles, SAMPLES, np.random.default_rng(key))
    points, normals = to_frame(entry, points, normals)
    if not np.isfinite(points).all():
        return f"{entry.item}: points that are not finite"
    save(path, prepare(points, normals, colours, key), captions(entry, colours))
    return None


def attribution(entries: list[Entry]) -> str:
    """The CC-BY models by library and creator, as Markdown."""
    lines = [
        "# Attribution",
        "",
        "The diffusion priors were trained on renders of the 3D models below, among others. They",
        "come from the furniture libraries of Sweet Home 3D, converted to OBJ by Emmanuel Puybaret",
        "(eTeks), and are licensed under Creative Commons Attribution 3.0",
        "(https://creativecommons.org/licenses/by/3.0/). They were sampled, relit and rendered; no",
        "model is contained in this package.",
    ]
    groups: dict[tuple[str, str], list[str]] = {}
    for entry in entries:
        if entry.licence != "CC0":
            groups.setdefault((entry.archive.stem, entry.creator), []).append(entry.name)
    for (library, creator), names in sorted(groups.items()):
        counts = {name: names.count(name) for name in sorted(names)}
        listed = ", ".join(name if n == 1 else f"{name} ({n})" for name, n in counts.items())
        lines += ["", f"**{creator}** ({library}): {listed}."]
    free = sum(entry.licence == "CC0" for entry in entries)
    lines += [
        "",
        f"A further {free} models of the same collection are dedicated to the public domain (CC0).",
    ]
    lines += [
        "",
        "Pictures of the Fluent 3D emoji (Microsoft, MIT licence) were also among the training",
        "data, with names from emojibase (MIT licence). The text encoder is all-MiniLM-L6-v2 by",
        "the authors of sentence-transformers (Apache-2.0), quantised.",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("furniture", type=Path)
    parser.add_argument("objects", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--attribution", type=Path)
    options = parser.parse_args()
    entries = [e for path in sorted(options.furniture.rglob("*.sh3f")) for e in catalogue(path)]
    if options.attribution:
        options.attribution.write_text(attribution(entries))
        return
    # Spawned, not forked: each worker starts its own jax.
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        reports = list(tqdm(pool.map(partial(draw, options.objects), entries), total=len(entries)))
    print(*[report for report in reports if report], sep="\n")


if __name__ == "__main__":
    main()
