"""A fit in a folder of its own: results, curves, and the fit beside what was observed."""

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jaxphys.core.checkpoints import Checkpoints, fingerprint
from jaxphys.core.files import aside_path, atomic_path
from jaxphys.core.interrupt import deferred_interrupt
from jaxphys.core.reading import reading
from jaxphys.core.run_folder import run_folder
from jaxphys.fitting.config import read_config
from jaxphys.fitting.evaluation import Memory
from jaxphys.fitting.fit import fit
from jaxphys.fitting.layout import layout
from jaxphys.fitting.observed import Images, Masks, Observed, Points, Tracks
from jaxphys.fitting.result import ARRAYS, HISTORY, RESULT, Fit
from jaxphys.gaussians.gaussians import from_points, to_splats
from jaxphys.page.curves import curves
from jaxphys.page.html import bundled, document
from jaxphys.pipeline.animate import source_files
from jaxphys.pipeline.draw import draw
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.pipeline.video import VideoWriter
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import render
from jaxphys.scene.build import build, validate
from jaxphys.scene.model_folder import splats_in
from jaxphys.scene.obstacles import located, mesh_file, mesh_obstacles
from jaxphys.scene.read import read_scene
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import load_object
from jaxphys.scene.view import View

EVALUATIONS, CURVES, VIDEO = "evaluations/", "curves.html", "comparison.mp4"
PRODUCTS = (RESULT, ARRAYS, HISTORY, CURVES, VIDEO, EVALUATIONS)
SIDE = 360  # of a picture of dots [pixels]
SEEN, FITTED = (0.85, 0.3, 0.1), (0.1, 0.35, 0.8)
FPS = 8


def fit_file(
    path: str | os.PathLike,
    out: str | os.PathLike,
    *,
    overwrite: bool = False,
    progress: bool = False,
    watch: Callable[[int], None] | None = None,
) -> Fit:
    """Fits what a config asks for; `out` gets `result.json`, `values.npz`, `history.jsonl`,
    `curves.html` and `comparison.mp4`. An interrupted fit keeps its evaluations there, and the same
    call goes on, to the same bytes.

    Args:
        path: of the config.
        out: the folder: new, empty, or of an earlier run of the same request.
        overwrite: whether another request's files in `out` may be replaced.
        progress: whether to count evaluations on standard error.
        watch: called with the number of evaluations after each; may raise KeyboardInterrupt.

    Raises:
        InputError: something cannot be used, named by file and field.
        SimulationError: the simulation fails where the fit starts.
        KeyboardInterrupt: what was evaluated is saved.
    """
    path = Path(path)
    config = read_config(path)
    scene, of_scene = scene_named(path.parent / config.scene)
    beside = of_scene.parent
    scene = located(scene, beside)
    objects = [
        load_object(thing, beside, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    ]
    simulation, look = build(scene, *objects)
    observed = [one.read(path.parent) for one in config.observed]
    layout(config.free, simulation, look)  # a wrong name is told before anything is made
    inputs = [path, of_scene, *source_files(scene.objects, beside)]
    inputs += [mesh_file(scene, i) for i in mesh_obstacles(scene)]
    inputs += [one.path(path.parent) for one in config.observed]
    files = tuple(source.read_bytes() for source in inputs)
    identity = fingerprint(b"fit", *files)
    end = (scene.frames - 1) * scene.seconds_per_frame
    with run_folder(out, identity, PRODUCTS, inputs=inputs, overwrite=overwrite) as folder:
        memory = Memory(Checkpoints(folder.file(EVALUATIONS), identity))
        with (
            deferred_interrupt() as interrupted,
            tqdm(desc="fit", unit="evaluation", disable=not progress) as bar,
        ):
            made = count(1)

            def after():
                bar.update()
                if watch is not None:
                    watch(next(made))
                if interrupted():
                    raise KeyboardInterrupt

            try:
                found = fit(
                    simulation,
                    config.free,
                    observed,
                    look=look,
                    end=end,
                    search=config.search,
                    stages=config.stages,
                    starts=config.starts,
                    seed=config.seed,
                    level=config.level,
                    memory=memory,
                    watch=after,
                )
            except KeyboardInterrupt:
                memory.save()
                raise
        found.write(folder)
        with atomic_path(folder.file(CURVES)) as beside:
            beside.write_text(curves_of(found), encoding="utf-8")
        video = folder.file(VIDEO)
        aside = aside_path(video)
        try:
            film_comparison(aside, found, observed[0])
            os.replace(aside, video)
        finally:
            aside.unlink(missing_ok=True)
        folder.remove(EVALUATIONS)
    return found


def scene_named(path: Path) -> tuple[Scene, Path]:
    """The scene of a file, or of the folder of a run, whose own splats its first object is made of
    where it names nothing; and the file that was read.

    Raises:
        InputError: there is none, or it cannot be used.
    """
    file = path / "config.json" if path.is_dir() else path
    scene = read_scene(file).scene
    with reading(file):
        validate(scene)
    first = scene.objects[0]
    if path.is_dir() and first.source is None:
        first = replace(first, source=str(splats_in(path).absolute()))
        scene = replace(scene, objects=(first, *scene.objects[1:]))
    return scene, file


def curves_of(found: Fit) -> str:
    """A document of the loss, and of each number where there are few, over the steps of the search,
    those that failed left out.
    """
    rows = [row for row in found.history if row["loss"] is not None]
    steps = [float(step) for step in range(len(rows))]
    loss = [math.log10(max(row["loss"], 1e-300)) for row in rows]
    charts = [curves(steps, {"loss": loss}, "logarithm to base 10", "Loss", along="step")]
    for name in rows[0].get("values", {}) if rows else ():
        parts = np.array([np.ravel(row["values"][name]) for row in rows], float).T
        values = {f"{i}" if len(parts) > 1 else name: part.tolist() for i, part in enumerate(parts)}
        charts.append(curves(steps, values, "SI units", name, along="step"))
    body = "".join(f"<div>{chart}</div>\n" for chart in charts)
    return document("fit", f"<main>\n{body}</main>", style=bundled("page.css"))


def film_comparison(path: Path, found: Fit, observed: Observed) -> None:
    """What was observed, left, and the fit, right; dots over each other where no camera looked."""
    pictures = list(_pictures(found, observed))
    height, width = pictures[0].shape[:2]
    with VideoWriter(path, width, height, FPS) as video:
        for picture in pictures:
            video.add(picture)


def _pictures(found: Fit, observed: Observed) -> Iterator[np.ndarray]:
    apart = np.abs(np.asarray(found.motion.time)[:, None] - np.asarray(observed.times))
    frames = np.argmin(apart, axis=0)
    if isinstance(observed, Images | Masks):
        return _beside(found, observed, frames)
    assert isinstance(observed, Tracks | Points)
    clouds = observed.positions if isinstance(observed, Tracks) else observed.clouds
    return _over(list(clouds), np.asarray(found.motion.position)[frames])


def _beside(found: Fit, observed: Images | Masks, frames) -> Iterator[np.ndarray]:
    """Pictures of the first camera, and the fit's."""
    assert found.look is not None
    camera, background = observed.views[0], observed.background
    for seen, frame in zip(observed.pictures[0], frames, strict=True):
        image = draw(found.look, found.motion[int(frame)], camera, background=background)
        made = np.asarray(image.colour if isinstance(observed, Images) else image.alpha)
        both = np.concatenate([np.asarray(seen), made], axis=1)
        yield _bytes(both if both.ndim == 3 else np.repeat(both[..., None], 3, axis=-1))


def _over(clouds: list, made: np.ndarray) -> Iterator[np.ndarray]:
    """Dots: what was seen, the fit, and both."""
    every = np.concatenate([made.reshape(-1, 3), *map(np.asarray, clouds)])
    camera = frame_cameras(View(), [every], FPS, SIDE, SIDE)[0]
    size = 0.004 * float(np.max(np.ptp(every, axis=0)))
    for cloud, places in zip(clouds, made, strict=True):
        seen, fitted = _dots(cloud, SEEN, size, camera), _dots(places, FITTED, size, camera)
        yield _bytes(np.concatenate([seen, fitted, (seen + fitted) / 2], axis=1))


def _dots(points, colour, size: float, camera: Camera) -> np.ndarray:
    points = np.asarray(points, np.float32)
    dots = from_points(points, np.broadcast_to(np.float32(colour), points.shape), size)
    splats = to_splats(dots, position(camera))
    return np.asarray(render(splats, camera, background=1.0).colour)


def _bytes(picture: np.ndarray) -> np.ndarray:
    return np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)
