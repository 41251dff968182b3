"""`transforms.json` of NeRF's tools (Mildenhall et al. 2020; instant-ngp; nerfstudio).

Matrices go from camera to world, cameras are OpenGL's (x right, y up, looking along -z), z is up.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, one_line
from jaxphys.core.fields import between
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.gaussians.ply import read_points
from jaxphys.reconstruction.capture import Capture, Shot

ALONE, TRAIN, TEST = "transforms.json", "transforms_train.json", "transforms_test.json"
HOLD_OUT = 8
SUFFIXES = ("", ".png", ".jpg", ".jpeg")
FOCAL, SIDE, BENT = {"above": 0, "most": 1e6}, between(1, 1_000_000), between(-1e3, 1e3)
Row = tuple[float, float, float, float]
Matrix = tuple[Row, Row, Row, Row]
DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")


@dataclass(frozen=True)
class Lens:
    """What a file, or one of its frames, says of a camera. See instant-ngp's documentation."""

    camera_angle_x: float | None = field(default=None, metadata=between(1e-3, math.pi - 1e-3))
    fl_x: float | None = field(default=None, metadata=FOCAL)
    fl_y: float | None = field(default=None, metadata=FOCAL)
    cx: float | None = field(default=None, metadata=between(-1e6, 1e6))
    cy: float | None = field(default=None, metadata=between(-1e6, 1e6))
    w: float | None = field(default=None, metadata=SIDE)
    h: float | None = field(default=None, metadata=SIDE)
    k1: float = field(default=0.0, metadata=BENT)
    k2: float = field(default=0.0, metadata=BENT)
    k3: float = field(default=0.0, metadata=BENT)
    k4: float = field(default=0.0, metadata=BENT)
    p1: float = field(default=0.0, metadata=BENT)
    p2: float = field(default=0.0, metadata=BENT)


@dataclass(frozen=True)
class Pose:
    """Of a frame."""

    file_path: str
    transform_matrix: Matrix = field(metadata=between(-1e9, 1e9))


def files_in(folder: Path) -> list[Path]:
    """The files that say where shots were taken, those for judging last."""
    names = (ALONE,) if (folder / ALONE).exists() else (TRAIN, TEST)
    return [folder / name for name in names if (folder / name).exists()]


def read_transforms(folder: Path) -> Capture:
    """The capture of a folder. Held out is `transforms_test.json`, or every eighth frame.

    Raises:
        InputError: a file is missing or broken, or a lens is not a pinhole.
    """
    shots: list[Shot] = []
    points, colours = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    for path in files_in(folder):
        with reading(path):
            told = read_json(path)
            frames = told.get("frames")
            if not isinstance(frames, list):
                raise InputError("frames: is missing, or no list")
            for index, frame in enumerate(frames):
                where = f"{one_line(str(path))}: frames[{index}]"
                held = path.name == TEST if path.name != ALONE else index % HOLD_OUT == 0
                shots.append(_shot(folder, told, frame, where, held))
        if isinstance(named := told.get("ply_file_path"), str):
            points, colours = read_points(folder / named)
    return Capture(tuple(shots), points, colours, z_up=True)


def _shot(folder: Path, told: dict, frame: Any, where: str, held_out: bool) -> Shot:
    if not isinstance(frame, dict):
        raise InputError(f"{where}: is no object {{ ... }}")
    pose = from_json(Pose, {k: frame[k] for k in _names(Pose) if k in frame}, where)
    both = {**told, **frame}
    lens = from_json(Lens, {k: both[k] for k in _names(Lens) if both.get(k) is not None}, where)
    if any(abs(getattr(lens, name)) > 1e-6 for name in DISTORTION):
        raise InputError(
            f"{where}: the lens has a distortion; undistort the pictures (`colmap"
            " image_undistorter`, `ns-process-data`) and give k1, k2, p1, p2 as 0"
        )
    path = _picture(folder, pose.file_path, where)
    size = (lens.w, lens.h)
    if None in size:
        with reading(path), Image.open(path) as picture:
            size = picture.size
    width, height = (int(side) for side in size)  # type: ignore[arg-type]
    focal = lens.fl_x
    if focal is None and lens.camera_angle_x is not None:
        focal = 0.5 * width / math.tan(0.5 * lens.camera_angle_x)
    if focal is None:
        raise InputError(f"{where}: has neither fl_x nor camera_angle_x")
    pose_matrix = np.array(pose.transform_matrix)
    turn = pose_matrix[:3, :3]
    if not np.allclose(turn.T @ turn, np.eye(3), atol=1e-3) or np.linalg.det(turn) < 0:
        raise InputError(f"{where}.transform_matrix: is no rotation with a translation")
    rotation = np.diag([1.0, -1.0, -1.0]) @ turn.T
    return Shot(
        path,
        rotation,
        -rotation @ pose_matrix[:3, 3],
        (focal, lens.fl_y or focal),
        (
            0.5 * width if lens.cx is None else lens.cx,
            0.5 * height if lens.cy is None else lens.cy,
        ),
        (width, height),
        held_out,
    )


def _names(cls: Any) -> list[str]:
    return list(cls.__dataclass_fields__)


def _picture(folder: Path, named: str, where: str) -> Path:
    for suffix in SUFFIXES:
        path = folder / f"{named}{suffix}"
        if path.is_file():
            return path
    raise InputError(f"{where}.file_path: there is no picture {named!r} in {folder}")
