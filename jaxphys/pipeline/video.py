"""Pictures to an H.264 file and to one contact sheet. The same pictures give the same bytes."""

import os
import queue
import subprocess
import threading
from pathlib import Path
from typing import Self

import numpy as np
from imageio.v3 import imwrite
from PIL import Image

from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path

WAITING = 4  # pictures that may queue up while the encoder works


class VideoWriter:
    """Encodes pictures in a process of its own, fed by a thread, so that drawing goes on
    meanwhile.

    Args:
        path: the .mp4 file; written in place, so give it a temporary name.
        width, height: of the pictures [pixels]; odd ones gain a repeated column or row.
        fps: pictures a second.
        quality: x264's constant rate factor; smaller is better.
    """

    def __init__(
        self, path: str | os.PathLike, width: int, height: int, fps: float, quality: int = 18
    ):
        import imageio_ffmpeg

        self._padding = ((0, height % 2), (0, width % 2), (0, 0))
        size = f"{width + width % 2}x{height + height % 2}"
        command = [
            imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-nostdin",
            "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{fps:g}", "-i", "pipe:0",
            "-c:v", "libx264", "-preset", "veryfast", "-crf", str(quality), "-pix_fmt", "yuv420p",
            # One thread, no dates, no version of the muxer: nothing but the pictures decides.
            "-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1",
            # A relative path may begin as an option or a protocol does.
            "-movflags", "+faststart", os.path.abspath(path),
        ]  # fmt: skip
        # A group of its own: an interrupt is for us to handle, and the file must be closed well.
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, process_group=0
        )
        assert self._process.stdin is not None and self._process.stderr is not None  # pipes
        self._pictures, self._complaints = self._process.stdin, self._process.stderr
        self._queue: queue.Queue[np.ndarray | None] = queue.Queue(WAITING)
        self._failure: OSError | None = None
        self._thread = threading.Thread(target=self._feed, name="video", daemon=True)
        self._thread.start()

    def _feed(self) -> None:
        while (picture := self._queue.get()) is not None:
            if self._failure is None:
                try:
                    self._pictures.write(np.pad(picture, self._padding, "edge").tobytes())
                except OSError as error:
                    self._failure = error

    def add(self, picture: np.ndarray) -> None:
        """Appends a picture (height, width, 3) uint8; waits only while the queue is full."""
        self._queue.put(picture)

    def close(self) -> None:
        """Finishes the file. Raises `InputError` if the encoder failed."""
        try:
            self._queue.put(None)
            self._thread.join()
            _, complaint = self._process.communicate()
        except BaseException:
            self._abandon()
            raise
        if self._process.returncode or self._failure:
            text = " ".join(complaint.decode(errors="replace").split())[-200:]
            raise InputError(f"motion.mp4: the encoder failed: {text or self._failure}")

    def _abandon(self) -> None:
        """Ends the encoder; the file is of no use."""
        self._process.kill()
        self._process.wait()
        self._queue.put(None)
        self._thread.join()
        self._pictures.close()
        self._complaints.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, *_) -> None:
        if kind is None or kind is KeyboardInterrupt:  # what is there so far is worth having
            self.close()
        else:
            self._abandon()


class ContactSheet:
    """Some pictures of a video, evenly spaced, side by side.

    Args:
        total: pictures of the video.
        count: pictures on the sheet at most.
        width: of each on the sheet [pixels].
        columns: pictures in a row.
    """

    def __init__(self, total: int, count: int = 8, width: int = 480, columns: int = 4):
        self._wanted = {round(i) for i in np.linspace(0, total - 1, min(count, total))}
        self._width, self._columns = width, columns
        self._pictures: list[Image.Image] = []

    def add(self, index: int, picture: np.ndarray) -> None:
        """Keeps a reduced copy of picture number `index` if it is one of those wanted."""
        if index in self._wanted:
            height, width, _ = picture.shape
            new = (min(self._width, width), max(1, round(height * min(self._width, width) / width)))
            self._pictures.append(Image.fromarray(picture).resize(new, Image.Resampling.BOX))

    def write(self, path: Path) -> None:
        """Writes a PNG of the pictures so far."""
        width, height = self._pictures[0].size
        columns = min(self._columns, len(self._pictures))
        rows = -(-len(self._pictures) // columns)
        sheet = Image.new("RGB", (columns * width, rows * height), "white")
        for i, picture in enumerate(self._pictures):
            sheet.paste(picture, (i % columns * width, i // columns * height))
        write_picture(path, np.asarray(sheet))


def write_picture(path: str | os.PathLike, picture: np.ndarray) -> None:
    """Writes (height, width, 3) uint8 as a PNG, aside first."""
    # In memory first: on a full disk the library would leave a traceback beside our line.
    encoded = imwrite("<bytes>", picture, extension=".png", plugin="pillow")
    assert encoded is not None  # of "<bytes>"
    with atomic_path(path) as aside:
        aside.write_bytes(encoded)
