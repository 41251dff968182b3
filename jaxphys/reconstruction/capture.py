"""A capture: pictures, where they were taken from, and points that were seen.

`read_capture` takes a folder as COLMAP leaves it (`sparse/0`, `sparse` or the model itself, and
`images`), or as NeRF's tools do (`transforms.json`, or `transforms_train.json` with
`transforms_test.json`).
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from jaxphys.core.errors import InputError
from jaxphys.core.reading import reading

LONGEST = 16_384  # pixels a side; more is no photograph


@dataclass(frozen=True)
class Shot:
    """One picture and its camera: a world point x is at R x + t in the camera (x right, y down).

    Attributes:
        path: of the picture.
        rotation: R, (3, 3); translation: t, (3,).
        focal, centre: in x and y [pixels of the size below].
        size: width and height that focal and centre are for [pixels].
        held_out: whether it is for judging, not for training.
    """

    path: Path
    rotation: np.ndarray
    translation: np.ndarray
    focal: tuple[float, float]
    centre: tuple[float, float]
    size: tuple[int, int]
    held_out: bool = False

    @property
    def position(self) -> np.ndarray:
        """Of the camera in the world, (3,)."""
        return -self.rotation.T @ self.translation


@dataclass(frozen=True)
class Capture:
    """All shots, and what is known of the world.

    Attributes:
        shots: at least two.
        points: seen by several, (M, 3); M may be 0.
        colours: of these, RGB in [0, 1], (M, 3).
        z_up: whether the files say that z points up.
    """

    shots: tuple[Shot, ...]
    points: np.ndarray
    colours: np.ndarray
    z_up: bool


def read_capture(folder: Path) -> Capture:
    """The capture in a folder.

    Raises:
        InputError: there is none, a file is missing or broken, or a lens is not a pinhole.
    """
    from jaxphys.reconstruction.colmap import model_in, read_colmap
    from jaxphys.reconstruction.transforms import files_in, read_transforms

    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; name the one that holds the capture")
    if files_in(folder):
        capture = read_transforms(folder)
    elif model_in(folder) is not None:
        capture = read_colmap(folder)
    else:
        raise InputError(
            f"{folder}: holds neither transforms.json nor a model of COLMAP (sparse/0/cameras.bin"
            " or .txt); name the folder of a capture"
        )
    if len(capture.shots) < 2:
        raise InputError(f"{folder}: has {len(capture.shots)} pictures with a camera; give two")
    if all(shot.held_out for shot in capture.shots):
        raise InputError(f"{folder}: holds pictures for judging alone (transforms_test.json)")
    return capture


def read_picture(shot: Shot, longest: int) -> np.ndarray:
    """A shot's picture with its longer side at most `longest`, uint8 (H, W, 4); A is 255 where the
    file has no transparency.

    Raises:
        InputError: it cannot be read, or has another shape than its camera.
    """
    with reading(shot.path):
        try:
            with Image.open(shot.path) as picture:
                return _brought_to(picture, shot, longest)
        except (SyntaxError, Image.DecompressionBombError) as error:  # as Pillow calls them
            raise InputError(f"is no picture that can be read ({error})") from None


def _brought_to(picture: Image.Image, shot: Shot, longest: int) -> np.ndarray:
    width, height = picture.size
    if max(width, height) > LONGEST:
        raise InputError(f"{shot.path}: {width} x {height} pixels; give at most {LONGEST}")
    wanted = shot.size[0] / shot.size[1]
    if abs(width / height / wanted - 1) > 0.02:
        raise InputError(
            f"{shot.path}: is {width} x {height}, and its camera {shot.size[0]} x"
            f" {shot.size[1]}; give the pictures that the cameras are of"
        )
    scale = min(1.0, longest / max(width, height))
    if scale == 1:
        return np.asarray(picture.convert("RGBA"))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    # Colours of what is transparent must not run into what is not.
    whole = picture.convert("RGBA").convert("RGBa")
    return np.asarray(whole.resize(size, Image.Resampling.BOX).convert("RGBA"))


def turned(capture: Capture, turn: np.ndarray) -> Capture:
    """The capture in a world that is turned by a rotation (3, 3)."""
    shots = tuple(replace(shot, rotation=shot.rotation @ turn.T) for shot in capture.shots)
    return replace(capture, shots=shots, points=capture.points @ turn.T.astype(np.float32))


def upright(capture: Capture) -> np.ndarray:
    """The rotation (3, 3) that turns the world so that z points up.

    Where the files do not say what is up it is the mean of what is up in the pictures: who takes
    them holds the camera upright on the whole.
    """
    if capture.z_up:
        return np.eye(3)
    up = np.mean([-shot.rotation[1] for shot in capture.shots], axis=0)
    length = np.linalg.norm(up)
    if length < 0.1:  # from all sides alike
        return np.eye(3)
    up = up / length
    side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(up, side), up])
