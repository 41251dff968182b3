"""Gaussians and a scene in, a directory with their motion out."""

import dataclasses
import json
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import jax
import numpy as np

from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.ply import write_ply
from jaxphys.mpm.rollout import SimulationError
from jaxphys.pipeline.draw import deformed_gaussians
from jaxphys.pipeline.film import Artist, film
from jaxphys.pipeline.output import Timing, run_directory, write_lines
from jaxphys.pipeline.resume import Checkpoint, fingerprint
from jaxphys.pipeline.simulate import Record, save_record, simulate
from jaxphys.pipeline.video import ContactSheet, write_picture
from jaxphys.scene.build import Simulation, build, validate
from jaxphys.scene.json import to_json, write_scene
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import load_object

Watch = Callable[[str, int], None]
# What a run makes besides the object and its config; an older run's must not outlive a new one.
MADE = ("motion.mp4", "motion.partial.mp4", "contact_sheet.png", "metrics.jsonl", "timing.json",
        "last_good.ply", "last_good.png")  # fmt: skip


def animate(
    scene: Scene,
    out: str | os.PathLike,
    *,
    objects: tuple[Gaussians, ...] | None = None,
    beside: Path | None = None,
    save_splats: bool = False,
    progress: bool = False,
    timing: Timing | None = None,
    watch: Watch | None = None,
) -> Path:
    """Simulates, draws and encodes a scene; returns the directory.

    The directory gets `config.json` (running it again gives the same bytes), `gaussians.ply`,
    `motion.mp4`, `contact_sheet.png`, `metrics.jsonl`, `timing.json`, and with `save_splats` one
    `splats/NNNN.ply` a frame. An interrupted run leaves a checkpoint there, and the same call
    goes on.

    Args:
        scene: what is asked for.
        out: the directory, made if missing.
        objects: the Gaussians of each object; read from the scene's sources if not given.
        beside: where relative sources are looked up first.
        save_splats: whether to write every frame's Gaussians.
        progress: whether to show bars with the time left on standard error.
        timing: to add to; a new one if not given.
        watch: called as watch(stage, frame) after each frame; may raise KeyboardInterrupt.

    Raises:
        InputError: the scene or an object cannot be used.
        SimulationError: the motion failed; `last_good.ply` and `last_good.png` show the frame
        before.
        KeyboardInterrupt: what is done is saved.
    """
    timing = timing or Timing()
    validate(scene)
    with timing.stage("load"):
        if objects is None:
            objects = tuple(
                load_object(thing, beside, scene.seed + i, f"objects[{i}]")
                for i, thing in enumerate(scene.objects)
            )
    with timing.stage("build"):
        simulation = build(scene, *objects)
    out = run_directory(out)
    scene = _write_inputs(out, scene, objects)
    checkpoint = Checkpoint(out, _identity(scene, simulation))
    watch_simulation = None if watch is None else lambda frame: watch("simulate", frame)
    try:
        with timing.stage("simulate"):
            record = simulate(
                simulation,
                scene.frames,
                checkpoint=checkpoint,
                timing=timing,
                progress=progress,
                watch=watch_simulation,
            )
    except SimulationError as error:
        _save_last_good(out, scene, simulation, error.record, timing)
        raise
    write_lines(out / "metrics.jsonl", record.metrics)
    with timing.stage("render"):
        finished = _film(out, scene, simulation, record, timing, progress, watch)
    if not finished:
        save_record(checkpoint, simulation, record)
        raise KeyboardInterrupt
    if save_splats:
        with timing.stage("splats"):
            _save_splats(out / "splats", simulation, record)
    checkpoint.remove()
    timing.write(out / "timing.json")
    return out


def _identity(scene: Scene, simulation: Simulation) -> str:
    described = json.dumps(to_json(scene), sort_keys=True) + jax.__version__
    return fingerprint(described.encode(), (simulation.model, simulation.state))


def _write_inputs(out: Path, scene: Scene, objects: tuple[Gaussians, ...]) -> Scene:
    """Writes the Gaussians and the config that names them; clears what an older run made."""
    for name in MADE:
        (out / name).unlink(missing_ok=True)
    shutil.rmtree(out / "splats", ignore_errors=True)
    names = ["gaussians.ply", *(f"gaussians_{i}.ply" for i in range(1, len(objects)))]
    for name, gaussians in zip(names, objects, strict=True):
        write_ply(out / name, gaussians)
    things = tuple(
        dataclasses.replace(thing, source=name)
        for thing, name in zip(scene.objects, names, strict=True)
    )
    scene = dataclasses.replace(scene, objects=things)
    write_scene(out / "config.json", scene)
    return scene


def _pictures(artist: Artist, record: Record) -> Iterator[np.ndarray]:
    for index, (position, gradient) in enumerate(
        zip(record.positions, record.deformations, strict=True)
    ):
        yield artist.draw(index, position, gradient)


def _film(
    out: Path,
    scene: Scene,
    simulation: Simulation,
    record: Record,
    timing: Timing,
    progress: bool,
    watch: Watch | None,
) -> bool:
    artist = Artist(scene, simulation, record.positions, timing)
    artist.prepare(record.positions, record.deformations)
    sheet = ContactSheet(scene.frames)
    watch_pictures = None if watch is None else lambda frame: watch("render", frame)
    aside = out / f".motion.{os.getpid()}.mp4"
    try:
        pictures = _pictures(artist, record)
        finished = film(aside, scene, pictures, sheet, progress=progress, watch=watch_pictures)
        os.replace(aside, out / ("motion.mp4" if finished else "motion.partial.mp4"))
    finally:
        aside.unlink(missing_ok=True)
    if not finished:
        return False
    sheet.write(out / "contact_sheet.png")
    return True


def _save_last_good(
    out: Path, scene: Scene, simulation: Simulation, record: Record, timing: Timing
) -> None:
    write_lines(out / "metrics.jsonl", record.metrics)
    position, gradient = record.positions[-1], record.deformations[-1]
    write_ply(out / "last_good.ply", deformed_gaussians(simulation, position, gradient))
    artist = Artist(scene, simulation, record.positions, timing)
    artist.prepare(record.positions[-1:], record.deformations[-1:])
    last = len(record.positions) - 1
    write_picture(out / "last_good.png", artist.draw(last, position, gradient))


def _save_splats(directory: Path, simulation: Simulation, record: Record) -> None:
    for index, (position, gradient) in enumerate(
        zip(record.positions, record.deformations, strict=True)
    ):
        moved = deformed_gaussians(simulation, position, gradient)
        write_ply(directory / f"{index:04d}.ply", moved)
