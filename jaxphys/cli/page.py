"""The command that shows finished runs on one page."""

from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional


def page(
    directories: Annotated[Positional[tuple[Path, ...]], tyro.conf.arg(metavar="DIR")],
    /,
    *,
    out: Path = Path("videos.html"),
    title: str | None = None,
    megabytes: float = 8.0,
    overwrite: bool = False,
) -> int:
    """Show runs on one page that needs nothing else: films, sentences, scores, objects in 3D.

    For example: jaxphys page outputs/ball outputs/bear --out videos.html

    Args:
        directories: Made by generate or animate, in the order of the page. Frames that a run did
            not keep (--save-splats) are computed again.
        out: The .html file to write.
        title: Of the page.
        megabytes: Most that the motion of each object may take; frames are left out and Gaussians
            thinned until it fits, which the page says.
        overwrite: Replace the file if it is there.
    """
    from jaxphys.pipeline.videos import write_videos

    path = write_videos(
        directories,
        out,
        title=title,
        megabytes=megabytes,
        overwrite=overwrite,
        progress=True,
    )
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB")
    return 0
