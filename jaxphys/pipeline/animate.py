"""Gaussians and a scene in, a directory with their motion out."""

import dataclasses
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from jaxphys.core.checkpoints import fingerprint
from jaxphys.core.files import aside_path, atomic_path, write_json
from jaxphys.core.interrupt import deferred_interrupt
from jaxphys.core.run_folder import RunFolder, run_folder
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.mesh import write_triangles
from jaxphys.gaussians.ply import write_ply
from jaxphys.mpm.loop.status import SimulationError
from jaxphys.pipeline.draw import deformed_gaussians
from jaxphys.pipeline.film import Artist, film
from jaxphys.pipeline.memory import at_least, expected, require_room, room
from jaxphys.pipeline.output import Timing, write_lines
from jaxphys.pipeline.record import Record, recorded
from jaxphys.pipeline.resume import FOLDER, MotionCheckpoint
from jaxphys.pipeline.tell import NAME as REPORT
from jaxphys.pipeline.tell import report_of
from jaxphys.pipeline.tolerance import TolerancePlan, after_text, as_json, before_text, plan_for
from jaxphys.pipeline.video import write_picture
from jaxphys.scene.build import build, validate
from jaxphys.scene.json import to_json, write_scene
from jaxphys.scene.look import Look
from jaxphys.scene.obstacles import (
    located,
    mesh_file,
    mesh_obstacles,
    triangles_of,
    with_sources,
)
from jaxphys.scene.scene import Object, Scene
from jaxphys.scene.source import find, load_object

Watch = Callable[[str, int], None]
# What an unfinished run leaves, and a finished one takes away.
UNFINISHED = ("motion.partial.mp4", "last_good.ply", "last_good.png", FOLDER)
ACCURACY = "accuracy.json"
MADE = (
    "config.json",
    "motion.mp4",
    "contact_sheet.png",
    "metrics.jsonl",
    "timing.json",
    ACCURACY,
    REPORT,
)


def animate(
    scene: Scene,
    out: str | os.PathLike,
    *,
    objects: tuple[Gaussians, ...] | None = None,
    beside: Path | None = None,
    save_splats: bool = False,
    overwrite: bool = False,
    inputs: tuple[Path, ...] = (),
    progress: bool = False,
    timing: Timing | None = None,
    watch: Watch | None = None,
    tolerance: float | None = None,
    tell: Callable[[str], None] | None = None,
) -> Path:
    """Simulates, draws and encodes a scene; returns the directory.

    The directory gets `config.json` (running it again gives the same bytes), `gaussians.ply`,
    `motion.mp4`, `contact_sheet.png`, `metrics.jsonl`, `timing.json`, a `report.html` that shows
    and explains them, and with `save_splats` one `splats/NNNN.ply` a frame. An interrupted run
    leaves a checkpoint there, and the same call goes on.

    With a `tolerance` pilots on coarse grids choose the grid, `config.json` has what they chose,
    and `accuracy.json` the error that was expected and the estimate after the run.

    Args:
        scene: what is asked for.
        out: the directory: new, empty, or of an earlier run of the same request.
        objects: the Gaussians of each object; read from the scene's sources if not given.
        beside: where relative sources are looked up first.
        save_splats: whether to write every frame's Gaussians.
        overwrite: whether the files of another request's run in `out` may be replaced.
        inputs: files that were read to make the scene, which the run must not replace.
        progress: whether to show bars with the time left on standard error.
        timing: to add to; a new one if not given.
        watch: called as watch(stage, frame) after each frame; may raise KeyboardInterrupt.
        tolerance: relative error of the motion that is allowed, see `pipeline.tolerance.plan_for`.
        tell: gets a line before the run and one after it, where there is a tolerance.

    Raises:
        InputError: the scene or an object cannot be used, they do not fit into memory, or `out`
        cannot be written to (see `run_folder`).
        SimulationError: the motion failed; `last_good.ply` and `last_good.png` show the frame
        before.
        KeyboardInterrupt: what is done is saved.
    """
    timing, scene = timing or Timing(), scene.filmed()
    validate(scene)
    scene = located(scene, beside)
    with timing.stage("load"):
        if objects is None:
            objects = tuple(
                load_object(thing, beside, scene.seed + i, f"objects[{i}]")
                for i, thing in enumerate(scene.objects)
            )
            inputs = (*inputs, *source_files(scene.objects, beside))
    require_room(at_least(scene, objects), room())
    held_to = None
    if tolerance is not None:
        with timing.stage("pilots"):
            held_to = plan_for(scene, objects, tolerance)
        scene = held_to.scene
        if tell is not None:
            tell(before_text(held_to))
    meshes = [mesh_file(scene, i) for i in mesh_obstacles(scene)]
    inputs = (*inputs, *meshes)
    written = with_written_sources(scene)
    shapes = [path.read_bytes() for path in meshes]
    identity = fingerprint(b"animate", _text(written), objects, *shapes)
    names = products(scene, save_splats)
    with run_folder(out, identity, names, inputs=inputs, overwrite=overwrite) as folder:
        return animate_in(
            folder,
            scene,
            objects,
            save_splats=save_splats,
            progress=progress,
            timing=timing,
            watch=watch,
            held_to=held_to,
            tell=tell,
        )


def products(scene: Scene, save_splats: bool) -> list[str]:
    """The names of all files that moving a scene may make."""
    splats = range(scene.frames if save_splats else 0)
    obstacles = _obstacle_names(scene).values()
    return [*MADE, *UNFINISHED, *_object_names(scene), *obstacles, *map(splats_name, splats)]


def source_files(objects: tuple[Object, ...], beside: Path | None) -> list[Path]:
    """The files that some objects of a scene are read from."""
    return [find(thing.source, beside) for thing in objects if thing.source is not None]


def animate_in(
    folder: RunFolder,
    scene: Scene,
    objects: tuple[Gaussians, ...],
    *,
    save_splats: bool,
    progress: bool,
    timing: Timing,
    watch: Watch | None,
    prompt: Mapping[str, Any] | None = None,
    held_to: TolerancePlan | None = None,
    tell: Callable[[str], None] | None = None,
) -> Path:
    """As `animate`, into a folder in which the `products` of the scene are declared.

    Args:
        prompt: what the folder's prompt.json holds, for the report; None: there is none.
        held_to: the plan that chose the scene's grid, None: there is no tolerance.
        tell: gets the estimate of the error.
    """
    with timing.stage("build"):
        built = build(scene, *objects) if held_to is None else held_to.built
        simulation, look = built
    require_room(expected(scene, built), room())
    scene = _write_inputs(folder, scene, objects)
    identity = fingerprint(_text(scene), (simulation.model, simulation.state))
    checkpoint = MotionCheckpoint(folder.file(FOLDER), identity)
    record = Record()
    video = folder.file("motion.mp4")
    aside = aside_path(video)
    with deferred_interrupt() as interrupted:
        frames = recorded(
            simulation,
            scene.frames,
            record,
            checkpoint,
            interrupted=interrupted,
            timing=timing,
            progress=progress,
            watch=_named(watch, "simulate"),
        )
        try:
            sheet = film(
                aside,
                scene,
                look,
                frames,
                interrupted=interrupted,
                timing=timing,
                progress=progress,
                watch=_named(watch, "render"),
            )
            os.replace(aside, video)
        except SimulationError:
            _save_last_good(folder, scene, look, record, timing)
            raise
        except KeyboardInterrupt:
            record.save(checkpoint)
            if aside.exists():
                os.replace(aside, folder.file("motion.partial.mp4"))
            raise
        finally:
            aside.unlink(missing_ok=True)
    sheet.write(folder.file("contact_sheet.png"))
    write_lines(folder.file("metrics.jsonl"), record.metrics)
    if held_to is not None:
        error = held_to.achieved(record.frames)
        write_json(folder.file(ACCURACY), as_json(held_to, error))
        if tell is not None:
            tell(after_text(held_to, error))
    if save_splats:
        with timing.stage("splats"):
            for index, frame in enumerate(record.frames):
                write_ply(folder.file(splats_name(index)), deformed_gaussians(look, frame))
    with timing.stage("report"):
        page = report_of(scene, built, record.metrics, prompt or {})
        with atomic_path(folder.file(REPORT)) as beside:
            beside.write_text(page, encoding="utf-8")
    timing.write(folder.file("timing.json"))
    folder.remove(*UNFINISHED)
    return folder.path


def _text(scene: Scene) -> bytes:
    return json.dumps(to_json(scene), sort_keys=True).encode()


def _object_names(scene: Scene) -> list[str]:
    return ["gaussians.ply", *(f"gaussians_{i}.ply" for i in range(1, len(scene.objects)))]


def _obstacle_names(scene: Scene) -> dict[int, str]:
    return {i: f"obstacle_{i}.ply" for i in mesh_obstacles(scene)}


def splats_name(frame: int) -> str:
    """The file in a run's folder that holds the Gaussians of a frame, with `save_splats`."""
    return f"splats/{frame:04d}.ply"


def with_written_sources(scene: Scene) -> Scene:
    """The scene with its objects and obstacles read from where the run writes them."""
    scene = with_sources(scene, _obstacle_names(scene))
    things = tuple(
        dataclasses.replace(thing, source=name)
        for thing, name in zip(scene.objects, _object_names(scene), strict=True)
    )
    return dataclasses.replace(scene, objects=things)


def _write_inputs(folder: RunFolder, scene: Scene, objects: tuple[Gaussians, ...]) -> Scene:
    """Writes the Gaussians, the obstacles' meshes and the config that names them."""
    for i, name in _obstacle_names(scene).items():
        write_triangles(folder.file(name), triangles_of(scene, i))
    for name, gaussians in zip(_object_names(scene), objects, strict=True):
        write_ply(folder.file(name), gaussians)
    scene = with_written_sources(scene)
    write_scene(folder.file("config.json"), scene)
    return scene


def _named(watch: Watch | None, stage: str) -> Callable[[int], None] | None:
    return None if watch is None else lambda frame: watch(stage, frame)


def _save_last_good(
    folder: RunFolder, scene: Scene, look: Look, record: Record, timing: Timing
) -> None:
    """The frame before a failure, as Gaussians and as a picture."""
    write_lines(folder.file("metrics.jsonl"), record.metrics)
    last = len(record.frames) - 1
    if last < 0:
        return
    write_ply(folder.file("last_good.ply"), deformed_gaussians(look, record.frames[last]))
    artist = Artist(scene, look, record.frames, timing)
    write_picture(folder.file("last_good.png"), artist.paint(last, record.frames[last:])[0])
