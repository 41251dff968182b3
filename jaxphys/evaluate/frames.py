"""The pictures of a video as CLIP reads them, evenly spaced."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.networks.clip_pictures import middle_square


def read_frames(path: Path, size: int) -> np.ndarray:
    """(N, size, size, 3) uint8: the middle of every picture of a video.

    Raises:
        InputError: the file is no video or is damaged.
    """
    pictures = [middle_square(picture, size) for picture in _decoded(path)]
    if not pictures:
        raise InputError(f"{path}: holds no pictures; make it again")
    return np.stack(pictures)


def evenly_spaced(total: int, count: int | None) -> list[int]:
    """`count` >= 1 of the numbers below `total`, the first and then evenly to the last; all if it
    is None or more.
    """
    if count is None or count >= total:
        return list(range(total))
    return [round(index) for index in np.linspace(0, total - 1, count)]


def _decoded(path: Path) -> Iterator[np.ndarray]:
    """Every picture (H, W, 3) uint8, one at a time, from a decoder in a process of its own."""
    import imageio_ffmpeg

    command = [
        imageio_ffmpeg.get_ffmpeg_exe(), "-nostdin", "-loglevel", "error", "-xerror",
        "-i", os.path.abspath(path), "-map", "0:v:0", "-f", "image2pipe", "-c:v", "ppm", "pipe:1",
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        stream, complaints = process.stdout, process.stderr
        assert stream is not None and complaints is not None  # both are pipes
        while stream.readline() == b"P6\n":  # each picture: that, "width height", "255", pixels
            width, height = map(int, stream.readline().split())
            stream.readline()
            content = stream.read(3 * width * height)
            if len(content) < 3 * width * height:
                break
            yield np.frombuffer(content, np.uint8).reshape(height, width, 3)
        complaint = complaints.read().decode(errors="replace").strip().splitlines()
    if process.returncode:
        why = complaint[-1] if complaint else f"status {process.returncode}"
        raise InputError(f"{path}: cannot be read as a video ({why}); make it again")
