"""Pictures of the parametric kinds to look at, two views of two variants each.

    python -m experiments.priors.data.contact_sheet OUT.png [KIND or FAMILY ...]

The upper variant of a kind has its usual colours, the lower one is random.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from jaxphys.library import KINDS, build, usual
from jaxphys.library.model import Surface

SIDE, ACROSS, POINTS = 128, 6, 14_000
VIEWS = ((0.55, 0.3), (2.5, 0.45))  # azimuth, elevation [rad]
LIGHT = np.array([0.5, -0.3, 0.81])
GROUND = 0.95


def picture(surface: Surface, azimuth: float, elevation: float, side: int = SIDE) -> np.ndarray:
    """(side, side, 3) in [0, 1]: parallel projection, nearest points last, lit from above."""
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    right, up = np.array([-sa, ca, 0]), np.array([-se * ca, -se * sa, ce])
    toward = np.array([ce * ca, ce * sa, se])
    seen = surface.normals @ toward > 0
    points, normals = surface.points[seen], surface.normals[seen]
    lit = surface.colours[seen] * (0.6 + 0.4 * np.clip(normals @ LIGHT, 0, 1))[:, None]
    order = np.argsort(points @ toward)
    scale = 0.78 * side
    column = np.rint(0.5 * side + scale * (points @ right)[order]).astype(int)
    row = np.rint(0.5 * side - scale * (points @ up)[order]).astype(int)
    image = np.full((side, side, 3), GROUND)
    nearest = np.full((side, side), -1)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            at = np.clip(row + i, 0, side - 1), np.clip(column + j, 0, side - 1)
            # The order of assignment makes the nearest point win within each shift.
            layer = np.full((side, side), -1)
            layer[at] = np.arange(len(order))
            nearest = np.maximum(nearest, layer)
    covered = nearest >= 0
    image[covered] = lit[order][nearest[covered]]
    return image


def cell(name: str) -> Image.Image:
    rows = []
    for built in (usual(name, 1), build(name, 2)):
        surface = built.model.sample(POINTS, np.random.default_rng(0))
        rows.append(np.concatenate([picture(surface, *view) for view in VIEWS], 1))
    image = Image.fromarray((255 * np.concatenate(rows)).astype(np.uint8))
    ImageDraw.Draw(image).text((3, 2), name, fill=(0, 0, 0))
    return image


def sheet(names: list[str]) -> Image.Image:
    cells = [cell(name) for name in names]
    width, height = cells[0].size
    rows = -(-len(cells) // ACROSS)
    whole = Image.new("RGB", (ACROSS * width, rows * height), (242, 242, 242))
    for index, image in enumerate(cells):
        whole.paste(image, (index % ACROSS * width, index // ACROSS * height))
    return whole


def main(path: str, *wanted: str) -> None:
    chosen = [n for n, kind in KINDS.items() if not wanted or n in wanted or kind.family in wanted]
    each = 4 * ACROSS
    for start in range(0, len(chosen), each):
        target = Path(path)
        if len(chosen) > each:
            target = target.with_stem(f"{target.stem}-{start // each:02d}")
        sheet(chosen[start : start + each]).save(target)
        print(target, ", ".join(chosen[start : start + each]))


if __name__ == "__main__":
    main(*sys.argv[1:])
