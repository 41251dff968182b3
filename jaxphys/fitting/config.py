"""A fit as a file: what moves, what is free of it, what was observed."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError
from jaxphys.core.fields import POSITIVE, SEED, between
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.fitting.files import read_images, read_masks, read_points, read_tracks
from jaxphys.fitting.fit import Stage
from jaxphys.fitting.free import Angle, Bounded, Field, Free, Log, Softplus
from jaxphys.fitting.observed import Observed
from jaxphys.fitting.search import LBFGS, Adam, GaussNewton

LARGEST_FILE = 2**24


@dataclass(frozen=True)
class _File:
    """Base of observations in files; the file's name is relative to that of the config."""

    file: str
    noise: float | None = field(default=None, metadata=POSITIVE)
    weight: float = field(default=1.0, metadata=POSITIVE)

    def path(self, beside: Path) -> Path:
        return beside / self.file

    def options(self) -> dict:
        return {"noise": self.noise, "weight": self.weight}


@dataclass(frozen=True)
class TracksFile(_File):
    """`Tracks` in a file."""

    type: ClassVar[str] = "tracks"

    def read(self, beside: Path) -> Observed:
        return read_tracks(self.path(beside), **self.options())


@dataclass(frozen=True)
class PointsFile(_File):
    """`Points` in a file.

    Attributes:
        trim: share of the worst pairs that does not count.
    """

    type: ClassVar[str] = "points"
    trim: float = field(default=0.0, metadata=between(0, 0.99))

    def read(self, beside: Path) -> Observed:
        return read_points(self.path(beside), trim=self.trim, **self.options())


@dataclass(frozen=True)
class ImagesFile(_File):
    """`Images` in a file.

    Attributes:
        background: behind everything.
    """

    type: ClassVar[str] = "images"
    background: float = field(default=1.0, metadata=between(0, 1))

    def read(self, beside: Path) -> Observed:
        return read_images(self.path(beside), background=self.background, **self.options())


@dataclass(frozen=True)
class MasksFile(_File):
    """`Masks` in a file."""

    type: ClassVar[str] = "masks"

    def read(self, beside: Path) -> Observed:
        return read_masks(self.path(beside), **self.options())


@dataclass(frozen=True)
class FitConfig:
    """What `jaxphys fit` is asked for.

    Attributes:
        scene: a scene's file, beside this one; or the folder of a run.
        free: name -> what it may be.
        observed: what was seen.
        search: None: what suits.
        stages: None: what suits.
        starts, seed, level: as in `fit`.
    """

    scene: str
    free: dict[str, Free | Log | Bounded | Softplus | Angle | Field]
    observed: tuple[TracksFile | PointsFile | ImagesFile | MasksFile, ...]
    search: GaussNewton | LBFGS | Adam | None = None
    stages: tuple[Stage, ...] | None = None
    starts: int = field(default=1, metadata=between(1, 1000))
    seed: int = field(default=0, metadata=SEED)
    level: float = field(default=0.9, metadata=between(0.01, 0.999))


def read_config(path: str | os.PathLike) -> FitConfig:
    """The config of a file.

    Raises:
        InputError: one line that names the file, the field and what is expected.
    """
    with reading(path):
        config = from_json(FitConfig, read_json(path, LARGEST_FILE), str(path))
        if not config.observed:
            raise InputError("observed: is empty; name at least one file")
        return config
