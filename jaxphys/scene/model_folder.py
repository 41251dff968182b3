"""The folder that training of 3D Gaussian splatting leaves (Kerbl et al. 2023):
`point_cloud/iteration_N/point_cloud.ply` and the cameras of its photographs, `cameras.json`.
"""

from dataclasses import dataclass, field
from pathlib import Path

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, one_line
from jaxphys.core.fields import PLACE, between
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.scene.view import Photograph, Vector

GENERATED = "gaussians.ply"
TRAINED = "point_cloud/iteration_N/point_cloud.ply"
CAMERAS = "cameras.json"
SIDE = between(1, 1_000_000)


@dataclass(frozen=True)
class FiledCamera:
    """One entry of `cameras.json`; other keys (id, img_name) are not read."""

    width: int = field(metadata=SIDE)
    height: int = field(metadata=SIDE)
    position: Vector = field(metadata=PLACE)
    rotation: tuple[Vector, Vector, Vector] = field(metadata=between(-1.001, 1.001))
    fx: float = field(metadata={"above": 0})
    fy: float = field(metadata={"above": 0})

    @property
    def photograph(self) -> Photograph:
        """The same without the size of the picture."""
        return Photograph(
            self.position, self.rotation, (self.fx / self.width, self.fy / self.width)
        )


def is_trained(folder: Path) -> bool:
    """Whether a folder holds what training leaves."""
    return bool(_iterations(folder))


def splats_in(folder: Path) -> Path:
    """The splats of a folder of `generate`, or of the last iteration of a trained model.

    Raises:
        InputError: there are none.
    """
    if (folder / GENERATED).exists():
        return folder / GENERATED
    trained = _iterations(folder)
    if not trained:
        raise InputError(f"{folder}: holds neither {GENERATED} nor {TRAINED}; name the .ply itself")
    return trained[max(trained)]


def cameras_beside(source: Path) -> tuple[FiledCamera, ...] | None:
    """The photographs' cameras of a model: a folder, its .ply or one beside `cameras.json`.

    None where there is no such file.

    Raises:
        InputError: the file is broken; names it.
    """
    folders = [source] if source.is_dir() else [source.parent, *source.parents[2:3]]
    for folder in folders:
        if (folder / CAMERAS).exists():
            return _read(folder / CAMERAS)
    return None


def _iterations(folder: Path) -> dict[int, Path]:
    """The splats of every iteration that was saved."""
    found = {}
    for path in folder.glob("point_cloud/iteration_*/point_cloud.ply"):
        number = path.parent.name.removeprefix("iteration_")
        if number.isdecimal():
            found[int(number)] = path
    return found


def _read(path: Path) -> tuple[FiledCamera, ...]:
    with reading(path):
        entries = read_json(path, kind=list)
        if not entries:
            raise InputError("holds no cameras")
        where = one_line(str(path))
        return tuple(
            from_json(FiledCamera, entry, f"{where}[{i}]", unknown=lambda key, value: None)
            for i, entry in enumerate(entries)
        )
