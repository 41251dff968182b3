"""The command that scores a finished run."""

import sys
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional


def evaluate(
    directory: Annotated[Positional[Path], tyro.conf.arg(metavar="DIR")],
    /,
    *,
    prompt: str | None = None,
    clip: Path | None = None,
    aesthetic: Path | None = None,
    frames: int | None = None,
    overwrite: bool = False,
    json: bool = False,
) -> int:
    """Score the video of a run with CLIP and LAION's aesthetic heads; status 1 if a head is
    missing.

    For example: jaxphys evaluate outputs/ball --json

    Args:
        directory: Made by generate or animate. Gets an evaluation.json.
        prompt: The sentence to compare with. Default: the one of the run.
        clip: Folder with the files of openai/clip-vit-large-patch14. Default: where weights are
            kept.
        aesthetic: Folder with the files of the heads. Default: likewise.
        frames: Score so many evenly spaced pictures. Default: all.
        overwrite: Replace an evaluation.json that no run made.
        json: Print JSON.
    """
    from json import dumps

    from jaxphys.evaluate.report import as_text
    from jaxphys.evaluate.report import evaluate as run

    result = run(
        directory,
        clip=clip,
        aesthetic=aesthetic,
        prompt=prompt,
        frames=frames,
        overwrite=overwrite,
    )
    print(dumps(result, indent=2) if json else as_text(result))
    for version, why in result["unavailable"].items():
        print(f"jaxphys: no aesthetic score {version}: {why}", file=sys.stderr)
    return 1 if result["unavailable"] else 0
