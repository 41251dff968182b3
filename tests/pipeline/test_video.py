import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from jaxphys.core.errors import InputError
from jaxphys.evaluate.frames import read_frames
from jaxphys.pipeline.video import ContactSheet, VideoWriter, write_picture


def pictures(count, width=64, height=48):
    """A bright column that moves to the right."""
    for i in range(count):
        picture = np.zeros((height, width, 3), np.uint8)
        picture[:, 8 * i : 8 * i + 8] = (250, 120, 10)
        yield picture


def encode(path, frames, width=64, height=48):
    with VideoWriter(path, width, height, 12.0) as writer:
        for picture in frames:
            writer.add(picture)


def decode(path, width, height):
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-i", str(path),
               "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"]  # fmt: skip
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3)


def test_pictures_come_back_and_bytes_repeat(tmp_path):
    encode(tmp_path / "a.mp4", pictures(5))
    encode(tmp_path / "b.mp4", pictures(5))
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    found = decode(tmp_path / "a.mp4", 64, 48)
    assert len(found) == 5
    for i, picture in enumerate(found):
        # Chroma is stored at half resolution: look at the middle of the column.
        assert np.abs(picture[24, 8 * i + 4].astype(int) - (250, 120, 10)).max() < 12
        assert picture[24, (8 * i + 36) % 64].max() < 12


@pytest.mark.parametrize("name", ["12:30", "-y", "http:"])
def test_a_folder_may_have_any_name(name, tmp_path, monkeypatch):
    """Beginnings of relative paths are options or protocols to the encoder and the decoder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).mkdir()
    encode(f"{name}/a.mp4", pictures(2))
    assert len(read_frames(Path(f"{name}/a.mp4"), 8)) == 2


def test_odd_sizes_are_padded(tmp_path):
    encode(tmp_path / "a.mp4", pictures(2, 33, 17), 33, 17)
    assert decode(tmp_path / "a.mp4", 34, 18).shape == (2, 18, 34, 3)


def test_encoder_failure_is_one_line(tmp_path):
    with pytest.raises(InputError, match=r"motion\.mp4: the encoder failed") as error:
        encode(tmp_path / "missing" / "a.mp4", pictures(40))
    assert "\n" not in str(error.value)


def test_contact_sheet_holds_evenly_spaced_pictures(tmp_path):
    sheet = ContactSheet(9, count=3, width=64, columns=2)
    for i in range(9):
        sheet.add(i, np.full((48, 64, 3), 20 * i, np.uint8))
    sheet.write(tmp_path / "sheet.png")
    found = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert found.shape == (96, 128, 3)
    assert [found[0, 0, 0], found[0, 127, 0], found[95, 0, 0], found[95, 127, 0]] == [
        0,
        80,
        160,
        255,
    ]


def test_picture_is_lossless(tmp_path):
    picture = np.random.default_rng(0).integers(0, 256, (7, 9, 3), np.uint8)
    write_picture(tmp_path / "a.png", picture)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), picture)
