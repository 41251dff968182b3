"""A motion as one file a frame, numbered as players of sequences want them."""

from collections.abc import Callable
from pathlib import Path

from jaxphys.export.frames import Frames
from jaxphys.gaussians.gaussians import Gaussians


def numbered_name(number: int, suffix: str) -> str:
    """The name of one frame's file: a common beginning and the number."""
    return f"frame{number:04d}{suffix}"


def write_numbered(
    frames: Frames, write: Callable[[Path, Gaussians], None], file: Callable[[int], Path]
) -> None:
    """Writes each frame to the file that `file` names for its number.

    Raises:
        InputError: as `write` does, with the file's name.
    """
    for frame in frames:
        write(file(frame.number), frame.gaussians)
