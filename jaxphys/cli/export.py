"""`jaxphys export`."""

from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional


def export(
    source: Annotated[Positional[Path], tyro.conf.arg(metavar="RUN_DIR|FILE")],
    /,
    *,
    to: Literal["ply", "compressed-ply", "gltf", "spz", "usd"],
    out: Path | None = None,
    frames: str | None = None,
    as_file: bool = False,
    overwrite: bool = False,
) -> int:
    """Write the frames of a run, or a file of splats, for other programs.

    For example: jaxphys export outputs/ball --to gltf --out outputs/ball-gltf

    Args:
        source: A directory made by animate or generate, or splats (.ply, .spz, .splat).
        to: ply and compressed-ply: files as viewers of 3D Gaussian splatting read them; gltf: .glb
            with KHR_gaussian_splatting; spz: the small format of Niantic's tools; usd: one .usda
            with time samples. A run becomes one numbered file a frame, but for usd.
        out: File, or for the frames of a run a directory: new, empty or of an earlier export.
            Default: beside the source, named after it.
        frames: Of a run, a:b from frame a to before frame b, or one number. Default: all.
        as_file: In the coordinates and units of the object's own file, as its capture has it, in
            place of metres with z up.
        overwrite: Replace what is there.
    """
    from jaxphys.pipeline.export import export as run

    print(run(source, to, out, frames=frames, as_file=as_file, overwrite=overwrite, progress=True))
    return 0
