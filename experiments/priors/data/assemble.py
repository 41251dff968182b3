"""Gathers prepared objects and emoji into the arrays that training reads.

    python -m experiments.priors.data.assemble OBJECTS_FOLDER PREPARED_FOLDER

PREPARED_FOLDER is replaced as a whole. README.md says what its files hold.
"""

import argparse
import shutil
from pathlib import Path

import numpy as np
from tqdm import tqdm

from experiments.priors.data.prepare import POINTS, held_out
from experiments.priors.phrases import PHRASES
from jaxphys.core.files import write_json
from jaxphys.guidance.guides import phrases_of


def assemble(objects: Path, prepared: Path, encode) -> dict:
    """Writes the data set; `encode(list of phrases) -> (E, D)`. Returns its summary."""
    files = sorted(objects.glob("*.npz"))
    # Items with points come first, so that the index of a point cloud is the index of its item.
    files.sort(key=lambda file: file.name.startswith("emoji-"))
    names = [file.stem for file in files]
    clouds = sum(not name.startswith("emoji-") for name in names)
    aside = prepared.with_name(f"{prepared.name}.new")
    shutil.rmtree(aside, ignore_errors=True)
    aside.mkdir(parents=True)
    counts = [len(np.load(file)["azimuth"]) for file in files]
    images = np.lib.format.open_memmap(
        aside / "images.npy", "w+", np.uint8, (sum(counts), 64, 64, 4)
    )
    points = np.empty((clouds, POINTS, 3), np.float16)
    colours = np.empty((clouds, POINTS, 3), np.uint8)
    normals = np.empty((clouds, POINTS, 3), np.int8)
    captions, of_item, azimuth, elevation, known = {}, [], [], [], []
    start = 0
    for index, file in enumerate(tqdm(files, desc="gather")):
        with np.load(file) as data:
            images[start : start + counts[index]] = data["images"]
            start += counts[index]
            if index < clouds:
                points[index], colours[index] = data["points"], data["colours"]
                normals[index] = data["normals"]
            of_item.append([captions.setdefault(str(c), len(captions)) for c in data["captions"]])
            azimuth.append(data["azimuth"])
            elevation.append(data["elevation"])
            known.append(np.full(counts[index], index < clouds))
    images.flush()
    np.savez(aside / "points.npz", points=points, colours=colours, normals=normals)
    np.savez(
        aside / "views.npz",
        item=np.repeat(np.arange(len(files), dtype=np.int32), counts),
        azimuth=np.concatenate(azimuth),
        elevation=np.concatenate(elevation),
        known=np.concatenate(known),
    )
    np.savez(
        aside / "items.npz",
        name=np.array(names),
        held_out=np.array([held_out(name) for name in names]),
        caption_start=np.cumsum([0] + [len(ids) for ids in of_item]).astype(np.int32),
        caption=np.concatenate(of_item).astype(np.int32),
    )
    write_json(aside / "captions.json", list(captions))
    phrases: dict[str, int] = {}
    spoken = np.full((len(captions), 1 + PHRASES), -1, np.int32)
    for row, caption in zip(spoken, captions, strict=True):
        said = phrases_of(caption, PHRASES)
        row[: len(said)] = [phrases.setdefault(phrase, len(phrases)) for phrase in said]
    np.save(aside / "caption_phrases.npy", spoken)
    write_json(aside / "phrases.json", list(phrases))
    np.save(aside / "text_embeddings.npy", encode(list(phrases)).astype(np.float32))
    summary = {
        "items": len(files),
        "clouds": clouds,
        "images": sum(counts),
        "captions": len(captions),
        "phrases": len(phrases),
    }
    write_json(aside / "summary.json", summary)
    old = prepared.with_name(f"{prepared.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if prepared.exists():
        prepared.rename(old)
    aside.rename(prepared)
    shutil.rmtree(old, ignore_errors=True)
    return summary


def main() -> None:
    from jaxphys.guidance.bundled.text_encoder import load_text_encoder

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("objects", type=Path)
    parser.add_argument("prepared", type=Path)
    options = parser.parse_args()
    print(assemble(options.objects, options.prepared, load_text_encoder()))


if __name__ == "__main__":
    main()
