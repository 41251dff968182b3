"""COLMAP's sparse models, binary and text (COLMAP 3.x, scripts/python/read_write_model.py).

Cameras as ours: x right, y down, the centre of the first pixel at (0.5, 0.5).
"""

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from jaxphys.core.errors import InputError
from jaxphys.core.reading import reading
from jaxphys.reconstruction.capture import Capture, Shot

# Name and number of parameters by number of the model.
MODELS = (
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
)
PINHOLES = {"SIMPLE_PINHOLE": 1, "SIMPLE_RADIAL": 1, "RADIAL": 1, "PINHOLE": 2, "OPENCV": 2}
LARGEST = 4 * 2**30  # bytes
STRAIGHT = 1e-6  # distortion that is none
FILES = ("cameras", "images", "points3D")
PICTURES = ("images", "input", ".")
HOLD_OUT = 8  # every so many is for judging (Mip-NeRF 360, Kerbl et al. 2023)


def model_in(folder: Path) -> Path | None:
    """The folder of the model of a capture: itself, `sparse/0` or `sparse`."""
    for path in (folder, folder / "sparse" / "0", folder / "sparse"):
        if any((path / f"cameras{suffix}").exists() for suffix in (".bin", ".txt")):
            return path
    return None


def read_colmap(folder: Path) -> Capture:
    """The capture in a folder with a model and its pictures. Every eighth shot by name is held out.

    Raises:
        InputError: a file is missing or broken, or a lens is not a pinhole.
    """
    model = model_in(folder)
    assert model is not None
    suffix = ".bin" if (model / "cameras.bin").exists() else ".txt"
    readers = _binary if suffix == ".bin" else _text
    tables: dict[str, list[Any]] = {}
    for name, reader in zip(FILES, readers, strict=True):
        path = model / f"{name}{suffix}"
        if name == "points3D" and not path.exists():
            tables[name] = []
            continue
        with reading(path, LARGEST):
            try:
                tables[name] = list(reader(path))
            except (struct.error, ValueError, IndexError, UnicodeDecodeError) as error:
                raise InputError(f"is no file of COLMAP's, or is cut off ({error})") from None
    cameras = {number: (model, size, values) for number, model, size, values in tables["cameras"]}
    pictures = next((p for p in PICTURES if (folder / p).is_dir() and p != "."), ".")
    shots = [
        _shot(model / f"images{suffix}", cameras, folder / pictures, row)
        for row in sorted(tables["images"], key=lambda row: row[-1])
    ]
    shots = [replace(shot, held_out=i % HOLD_OUT == 0) for i, shot in enumerate(shots)]
    points = np.array([row[0] for row in tables["points3D"]], np.float32).reshape(-1, 3)
    colours = np.array([row[1] for row in tables["points3D"]], np.float32).reshape(-1, 3) / 255
    return Capture(tuple(shots), points, colours, z_up=False)


def _shot(path: Path, cameras: dict, pictures: Path, row: Any) -> Shot:
    quaternion, translation, number, name = row
    if number not in cameras:
        raise InputError(f"{path}: {name!r} is of camera {number}, which is not among the cameras")
    model, size, values = cameras[number]
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise InputError(f"{path}: the picture {name!r} lies outside of {pictures}")
    count = PINHOLES.get(model, 0)
    bent = values[count + 2 :]
    if not count or np.any(np.abs(bent) > STRAIGHT):
        raise InputError(
            f"{path}: the lens of {name!r} is {model} with distortion; run `colmap"
            " image_undistorter` and give the folder that it makes"
        )
    focal = (values[0], values[count - 1])
    centre = (values[count], values[count + 1])
    rotation = _turn(np.array(quaternion))
    return Shot(pictures / name, rotation, np.array(translation), focal, centre, size)


def _turn(quaternion: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(quaternion)
    if not 0.5 < length < 2:
        raise InputError("a quaternion is not of unit length")
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def _camera(number: int, model: str, width: int, height: int, values: list[float]):
    if not (0 < width < 10**6 and 0 < height < 10**6 and np.all(np.isfinite(values))):
        raise ValueError(f"camera {number} has a size or parameters out of range")
    return number, model, (width, height), values


def _binary_cameras(path: Path) -> Iterator[Any]:
    with path.open("rb") as file:
        for _ in range(_one(file, "<Q")):
            number, model, width, height = _take(file, "<iiQQ")
            name, count = MODELS[model]
            yield _camera(number, name, width, height, list(_take(file, f"<{count}d")))


def _binary_images(path: Path) -> Iterator[Any]:
    with path.open("rb") as file:
        for _ in range(_one(file, "<Q")):
            _, qw, qx, qy, qz, tx, ty, tz, camera = _take(file, "<i7di")
            letters = bytearray()
            while (letter := file.read(1)) not in (b"\0", b""):
                letters += letter
            file.seek(24 * _one(file, "<Q"), 1)  # where points were seen
            yield (qw, qx, qy, qz), (tx, ty, tz), camera, letters.decode()


def _binary_points(path: Path) -> Iterator[Any]:
    with path.open("rb") as file:
        for _ in range(_one(file, "<Q")):
            _, x, y, z, r, g, b, _ = _take(file, "<Q3d3Bd")
            file.seek(8 * _one(file, "<Q"), 1)  # by whom it was seen
            yield (x, y, z), (r, g, b)


def _take(file, form: str) -> tuple:
    return struct.unpack(form, file.read(struct.calcsize(form)))


def _one(file, form: str) -> int:
    return _take(file, form)[0]


def _lines(path: Path) -> Iterator[list[str]]:
    for line in path.read_text().splitlines():
        if not line.startswith("#"):
            yield line.split()


def _text_cameras(path: Path) -> Iterator[Any]:
    for words in _lines(path):
        if words:
            number, model, width, height, *values = words
            yield _camera(int(number), model, int(width), int(height), [float(v) for v in values])


def _text_images(path: Path) -> Iterator[Any]:
    lines = list(_lines(path))
    for words in lines[::2]:  # every other line says where points were seen, and may be empty
        if words:
            _, qw, qx, qy, qz, tx, ty, tz, camera, *name = words
            numbers = [float(v) for v in (qw, qx, qy, qz, tx, ty, tz)]
            yield tuple(numbers[:4]), tuple(numbers[4:]), int(camera), " ".join(name)


def _text_points(path: Path) -> Iterator[Any]:
    for words in _lines(path):
        if words:
            yield tuple(map(float, words[1:4])), tuple(map(int, words[4:7]))


_binary = (_binary_cameras, _binary_images, _binary_points)
_text = (_text_cameras, _text_images, _text_points)
