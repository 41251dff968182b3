"""A run, or a file of splats, in the formats of other programs.

The frames of a run are those that it kept (`--save-splats`), or they are simulated again from the
folder's own config.json, which gives the same motion.
"""

import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from tqdm import tqdm

from jaxphys.core.checkpoints import fingerprint
from jaxphys.core.errors import InputError, nearest, one_line, shown
from jaxphys.core.files import output_file
from jaxphys.core.run_folder import run_folder
from jaxphys.export import (
    FORMATS,
    Frames,
    NumberedGaussians,
    continuous_axes,
    numbered_name,
    write_numbered,
    write_usda,
)
from jaxphys.gaussians.ply import read_ply
from jaxphys.pipeline.animate import source_files, splats_name
from jaxphys.pipeline.draw import deformed_gaussians
from jaxphys.pipeline.frames import frames as simulated
from jaxphys.pipeline.resume import FOLDER
from jaxphys.scene.build import build, place_objects
from jaxphys.scene.obstacles import located, mesh_file, mesh_obstacles
from jaxphys.scene.read import read_scene
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import load, load_object

CONFIG = "config.json"
FILE_RATE = 24.0  # frames a second of a file that has one frame only
# A common ending stands for a longer one: a compressed .ply is a .ply.
_ENDINGS = {".compressed.ply": ".ply"}


@dataclass(frozen=True)
class _Source:
    """What is exported.

    Attributes:
        path: as the user names it.
        numbers: of the frames.
        single: whether it is one frame only, and so one file.
        rate: frames a second.
        inputs: every file that is read.
        decides: the files that a run is known by.
        frames: gives the frames.
    """

    path: Path
    numbers: range
    single: bool
    rate: float
    inputs: tuple[Path, ...]
    decides: tuple[Path, ...]
    frames: Callable[[], Frames]


def export(
    source: str | os.PathLike,
    to: str,
    out: str | os.PathLike | None = None,
    *,
    frames: str | None = None,
    as_file: bool = False,
    overwrite: bool = False,
    progress: bool = False,
) -> Path:
    """Writes a run's frames, or a file of splats, in another format; returns where.

    What belongs together is written whole or not at all: where it fails, nothing of it stays.

    Args:
        source: the folder of a run of `animate` or `generate`, or splats (.ply, .spz, .splat).
        to: one of `jaxphys.export.FORMATS`.
        out: a file where the format or the source has one only, else a folder, which is new,
            empty or of an earlier export; None: beside the source, named after it.
        frames: of a run: "a:b" from frame a to before frame b, either left out; "a" a single one.
        as_file: of a run: in the coordinates and units of the first object's own file, in which it
            then lies where it lay in its capture; else in the domain's, metres with z up.
        overwrite: whether what is there may be replaced.
        progress: whether to show a bar with the time left on standard error.

    Raises:
        InputError: the source cannot be read, has no such frames or holds no run, or `out` cannot
            be written.
        SimulationError: the run had failed, and fails again.
    """
    if to not in FORMATS:
        raise InputError(f"--to {shown(to)}: is no format; {nearest(to, FORMATS)}")
    path = Path(source)
    found = _run(path, frames) if path.is_dir() else _file(path, frames)
    if as_file:
        found = _as_file(path, found)
    form = FORMATS[to]
    if found.single or form.begin is None:
        target = _file_target(found, to, out)
        output_file(target, overwrite=overwrite, inputs=found.inputs)
        chosen = continuous_axes(_counted(found, progress))
        if form.begin is None:
            write_usda(target, chosen, found.rate)
        else:
            write_numbered(chosen, form.begin(), lambda _: target)
        return target
    target = Path(out) if out is not None else _beside(path, f"-{to}")
    if target.suffix.lower() in (form.suffix, _ENDINGS.get(form.suffix)):
        raise InputError(
            f"--out {target}: is a file's name, but {len(found.numbers)} frames are as many files;"
            " name a folder, or one frame by --frames"
        )
    identity = fingerprint(
        b"export",
        f"{to} {found.numbers} {as_file}".encode(),
        *(one.read_bytes() for one in found.decides),
    )
    names = {number: numbered_name(number, form.suffix) for number in found.numbers}
    with run_folder(
        target, identity, names.values(), inputs=found.inputs, overwrite=overwrite
    ) as folder:
        try:
            write_numbered(
                continuous_axes(_counted(found, progress)),
                form.begin(),
                lambda number: folder.file(names[number]),
            )
        except BaseException:
            folder.remove(*names.values())
            raise
        return folder.path


def _as_file(folder: Path, found: _Source) -> _Source:
    """The same in the coordinates of the first object's file."""
    if not folder.is_dir():
        raise InputError(f"--as-file: {folder} is in its own coordinates already; leave it out")
    scene = located(read_scene(folder / CONFIG).scene.filmed(), folder)
    objects = tuple(
        load_object(thing, folder, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    )
    placement = place_objects(scene, objects)[0].placement
    return replace(
        found,
        inputs=(*found.inputs, *source_files(scene.objects, folder)),
        frames=lambda: (
            NumberedGaussians(frame.number, placement.undone(frame.gaussians))
            for frame in found.frames()
        ),
    )


def _beside(source: Path, ending: str) -> Path:
    if source.name in ("", ".."):  # as "." is called
        source = source.resolve()
    return source.with_name(source.name + ending)


def _file_target(found: _Source, to: str, out: str | os.PathLike | None) -> Path:
    """The one file that is written."""
    suffix = FORMATS[to].suffix
    if out is None:
        if not found.path.is_dir():
            return found.path.with_suffix(suffix)
        number = f"-{found.numbers[0]:04d}" if found.single else ""
        return _beside(found.path, number + suffix)
    ending = _ENDINGS.get(suffix, suffix)
    if not str(out).lower().endswith(ending):
        raise InputError(f"--out {out}: must end in {ending}")
    return Path(out)


def _counted(found: _Source, progress: bool) -> Iterator[NumberedGaussians]:
    with tqdm(total=len(found.numbers), desc="export", unit="frame", disable=not progress) as bar:
        for frame in found.frames():
            yield frame
            bar.update()


def _file(path: Path, frames: str | None) -> _Source:
    if frames is not None:
        raise InputError(f"--frames {shown(frames)}: {path} is one frame; leave it out")
    gaussians = load(path)
    return _Source(
        path,
        range(1),
        True,
        FILE_RATE,
        (path,),
        (path,),
        lambda: [NumberedGaussians(0, gaussians)],
    )


def _run(folder: Path, asked: str | None) -> _Source:
    config = folder / CONFIG
    if not config.exists():
        raise InputError(
            f"{folder}: holds no {CONFIG}, so it is no run's; let `jaxphys animate` or `jaxphys"
            " generate` finish there, or name splats (.ply)"
        )
    scene = read_scene(config).scene.filmed()
    numbers, single = chosen_frames(asked, scene.frames)
    # A run names its objects and obstacles alike whatever they are.
    decides = (config, *sorted(folder.glob("*.ply")))
    kept = [folder / splats_name(number) for number in range(scene.frames)]
    # Frames are written last, after the checkpoint, which goes once they are whole.
    if all(path.is_file() for path in kept) and not (folder / FOLDER).exists():
        files = [kept[number] for number in numbers]
        return _Source(
            folder,
            numbers,
            single,
            scene.fps,
            (*decides, *files),
            decides,
            lambda: (
                NumberedGaussians(number, read_ply(file))
                for number, file in zip(numbers, files, strict=True)
            ),
        )
    scene = located(scene, folder)
    meshes = [mesh_file(scene, i) for i in mesh_obstacles(scene)]
    return _Source(
        folder,
        numbers,
        single,
        scene.fps,
        (*decides, *source_files(scene.objects, folder), *meshes),
        decides,
        lambda: _again(folder, scene, numbers),
    )


def _again(folder: Path, scene: Scene, numbers: range) -> Iterator[NumberedGaussians]:
    """The frames of a run that kept none."""
    note = f"note: {folder} kept no frames (--save-splats does): simulating them again"
    print(one_line(note), file=sys.stderr)
    objects = [
        load_object(thing, folder, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    ]
    simulation, look = build(scene, *objects)
    moments = simulated(simulation, particles=simulation.carriers)
    for moment in islice(moments, numbers.stop):
        if moment.number in numbers:
            yield NumberedGaussians(moment.number, deformed_gaussians(look, moment.frame))


def chosen_frames(asked: str | None, count: int) -> tuple[range, bool]:
    """The numbers that a user asks for of `count` frames, and whether it is a single one.

    Raises:
        InputError: anything else than "a:b", "a:", ":b" or "a" within these frames.
    """
    if asked is None:
        return range(count), False
    match = re.fullmatch(r"([0-9]{0,9})(:?)([0-9]{0,9})", asked, re.ASCII)
    if match is None or not any(match.groups()) or (match[3] and not match[2]):
        raise InputError(f"--frames {shown(asked)}: give a:b, such as 0:{count}, or one number")
    first = int(match[1] or 0)
    last = int(match[3] or count) if match[2] else first + 1
    if not first < last <= count:
        raise InputError(
            f"--frames {shown(asked)}: there are frames 0 to {count - 1}, so 0:{count} at most"
        )
    return range(first, last), not match[2]
