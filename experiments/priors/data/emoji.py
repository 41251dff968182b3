"""3D emoji as front views of named objects.

    python -m experiments.priors.data.emoji EMOJI_FOLDER EMOJIBASE_FOLDER OBJECTS_FOLDER

The folders are unpacked packages: pictures named by lower-case code points, and `en/data.json` with
labels, tags and groups.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from PIL import Image

from experiments.priors.data.colour_names import colour_captions
from experiments.priors.data.pictures import straight
from experiments.priors.data.prepare import Prepared, save
from jaxphys.guidance.views import RESOLUTION
from jaxphys.library.palette import article

GROUPS = {3: "animals", 4: "food", 5: "travel", 6: "activities", 7: "objects"}
NOT_OBJECTS = {"place-geographic", "sky-weather", "time", "arrow", "place-map"}
SHARE = 0.68  # of the frame that the longest side takes, as objects of length 1 do


def frame(image: Image.Image) -> np.ndarray:
    """(64, 64, 4) uint8: cropped to what is opaque, centred, the longest side `SHARE` of the
    frame.
    """
    box = image.getchannel("A").point(lambda value: 255 * (value > 8)).getbbox()
    image = image.crop(box)
    rgba = np.asarray(image, np.float32) / 255
    premultiplied = np.concatenate([rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]], -1)
    scale = SHARE * RESOLUTION / max(image.size)
    size = [max(1, round(side * scale)) for side in image.size]
    channels = [
        np.asarray(Image.fromarray(premultiplied[..., c]).resize(size, Image.Resampling.BOX))
        for c in range(4)
    ]
    small = np.stack(channels, -1)
    out = np.zeros((RESOLUTION, RESOLUTION, 4), np.float32)
    top, left = (RESOLUTION - small.shape[0]) // 2, (RESOLUTION - small.shape[1]) // 2
    out[top : top + small.shape[0], left : left + small.shape[1]] = small
    return straight(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("emoji", type=Path)
    parser.add_argument("emojibase", type=Path)
    parser.add_argument("objects", type=Path)
    options = parser.parse_args()
    pictures = {}
    for path in options.emoji.rglob("*.webp"):
        pictures["-".join(part for part in path.stem.split("-") if part != "fe0f")] = path
    entries = json.loads(next(options.emojibase.rglob("en/data.json")).read_text())
    messages = json.loads(next(options.emojibase.rglob("en/messages.json")).read_text())
    subgroups = {entry["order"]: entry["key"] for entry in messages["subgroups"]}
    count = 0
    for entry in entries:
        code = "-".join(p for p in entry["hexcode"].lower().split("-") if p != "fe0f")
        if entry.get("group") not in GROUPS or code not in pictures:
            continue
        if subgroups.get(entry.get("subgroup")) in NOT_OBJECTS:
            continue
        label = entry["label"].lower()
        captions = [article(label), label]
        tags = [tag for tag in entry.get("tags", []) if tag.lower() not in label]
        captions += [f"{article(label)}, {', '.join(tags[:3])}"] if tags else []
        image = frame(Image.open(pictures[code]).convert("RGBA"))[None]
        opaque = image[image[..., 3] > 200][:, :3] / 255
        captions += colour_captions(label, False, opaque)
        view = np.zeros(1, np.float32)
        none = [np.zeros((0, 3), dtype) for dtype in (np.float16, np.int8, np.uint8)]
        record = Prepared(*none, image, view, view)
        save(options.objects / f"emoji-{code}.npz", record, captions)
        count += 1
    print(f"{count} emoji")


if __name__ == "__main__":
    main()
