"""Gaussians and a scene in, a directory with their motion out."""

import dataclasses
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import jax

from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.ply import write_ply
from jaxphys.mpm.rollout import SimulationError
from jaxphys.mpm.simulation import Simulation
from jaxphys.pipeline.draw import deformed_gaussians
from jaxphys.pipeline.film import Artist, film
from jaxphys.pipeline.interrupt import deferred_interrupt
from jaxphys.pipeline.output import Timing, run_directory, write_lines
from jaxphys.pipeline.record import Record, recorded
from jaxphys.pipeline.resume import Checkpoint, fingerprint
from jaxphys.pipeline.video import write_picture
from jaxphys.scene.build import build, validate
from jaxphys.scene.json import to_json, write_scene
from jaxphys.scene.look import Look
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
        simulation, look = build(scene, *objects)
    out = run_directory(out)
    scene = _write_inputs(out, scene, objects)
    checkpoint = Checkpoint(out, _identity(scene, simulation))
    record = Record()
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
        aside = out / f".motion.{os.getpid()}.mp4"
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
            os.replace(aside, out / "motion.mp4")
        except SimulationError:
            _save_last_good(out, scene, look, record, timing)
            raise
        except KeyboardInterrupt:
            record.save(checkpoint)
            if aside.exists():
                os.replace(aside, out / "motion.partial.mp4")
            raise
        finally:
            aside.unlink(missing_ok=True)
    sheet.write(out / "contact_sheet.png")
    write_lines(out / "metrics.jsonl", record.metrics)
    if save_splats:
        with timing.stage("splats"):
            for index, frame in enumerate(record.frames):
                write_ply(out / "splats" / f"{index:04d}.ply", deformed_gaussians(look, frame))
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


def _named(watch: Watch | None, stage: str) -> Callable[[int], None] | None:
    return None if watch is None else lambda frame: watch(stage, frame)


def _save_last_good(out: Path, scene: Scene, look: Look, record: Record, timing: Timing) -> None:
    """The frame before a failure, as Gaussians and as a picture."""
    write_lines(out / "metrics.jsonl", record.metrics)
    last = len(record.frames) - 1
    if last < 0:
        return
    write_ply(out / "last_good.ply", deformed_gaussians(look, record.frames[last]))
    artist = Artist(scene, look, record.frames, timing)
    write_picture(out / "last_good.png", artist.paint(last, record.frames[last]))
