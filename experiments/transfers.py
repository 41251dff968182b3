"""One fall under every transfer, side by side.

    python -m experiments.transfers --out outputs/transfers

A row a transfer: the default scene of jelly without its damping, on a coarse grid. Some minutes on
two cores.
"""

import argparse
import dataclasses
from pathlib import Path

from PIL import Image

from experiments.showcase import model_gaussians
from jaxphys import animate, default_scene
from jaxphys.mpm.transfer import AFLIP, APIC, FLIP, PIC, Transfer

ROWS = {
    "pic": Transfer(PIC()),
    "flip": Transfer(FLIP()),
    "apic": Transfer(APIC()),
    "aflip": Transfer(AFLIP()),
    "apic-cubic": Transfer(APIC(), "cubic"),
}


def main() -> None:
    """Films each and puts their contact sheets below each other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("outputs/transfers"))
    parser.add_argument("--frames", type=int, default=33)
    options = parser.parse_args()
    scene = dataclasses.replace(
        default_scene("jelly", spacing=1 / 16),
        frames=options.frames,
        width=240,
        height=200,
        damping=0.0,
    )
    thing = model_gaussians("strawberry", 6000, 0)
    rows = []
    for name, transfer in ROWS.items():
        out = animate(
            dataclasses.replace(scene, transfer=transfer),
            options.out / name,
            objects=(thing,),
            overwrite=True,
            progress=True,
        )
        sheet = Image.open(out / "contact_sheet.png").convert("RGB")
        # The sheet has two rows of four: one line of eight.
        width, height = sheet.size[0], sheet.size[1] // 2
        line = Image.new("RGB", (2 * width, height))
        line.paste(sheet.crop((0, 0, width, height)), (0, 0))
        line.paste(sheet.crop((0, height, width, 2 * height)), (width, 0))
        rows.append(line)
    whole = Image.new("RGB", (rows[0].size[0], sum(row.size[1] for row in rows)))
    for k, row in enumerate(rows):
        whole.paste(row, (0, k * row.size[1]))
    whole.save(options.out / "transfers.png")


if __name__ == "__main__":
    main()
