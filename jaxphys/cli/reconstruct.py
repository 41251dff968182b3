"""`jaxphys reconstruct`."""

import json as formats
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional


def reconstruct(
    capture: Annotated[Positional[Path], tyro.conf.arg(metavar="CAPTURE_DIR")],
    /,
    *,
    out: Path,
    steps: int = 3000,
    splats: int = 20_000,
    longest: int = 400,
    degree: int = 1,
    seed: int = 0,
    overwrite: bool = False,
    quiet: bool = False,
    json: bool = False,
) -> int:
    """Make Gaussians of photographs whose cameras are known.

    For example: jaxphys reconstruct captures/lego --out outputs/lego

    Args:
        capture: Folder with transforms.json (or transforms_train.json and transforms_test.json) and
            pictures, or with a model of COLMAP (sparse/0) and images.
        out: Directory for the results, which `jaxphys animate` takes: new, empty, or of an earlier
            run. An interrupted run goes on by the same command.
        steps: Of the optimisation, a picture each.
        splats: Number of Gaussians at most.
        longest: Longer side that pictures are brought to, if they are larger [pixels].
        degree: Of the harmonics of the colours, 0 to 3.
        seed: Of every random choice.
        overwrite: Replace the files of an earlier run of another request, and only these.
        quiet: Show no progress.
        json: Print result.json.
    """
    from jaxphys.pipeline.reconstruct import reconstruct as run

    found = run(
        capture,
        out,
        steps=steps,
        splats=splats,
        longest=longest,
        degree=degree,
        seed=seed,
        overwrite=overwrite,
        progress=not quiet,
    )
    if json:
        print(formats.dumps(found))
    else:
        judged = f"{found['psnr']:.1f} dB and SSIM {found['ssim']:.3f} on {found['judged_on']}"
        print(f"{found['gaussians']} Gaussians, {judged}: {out}")
    return 0
