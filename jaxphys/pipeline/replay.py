"""The motion of a finished run once more: out of its splats, or computed again as its film was.

A run keeps its scene and its Gaussians, which decide every frame to the byte, but no frames unless
`--save-splats` asked for them.
"""

import json
import math
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from jaxphys.core.errors import InputError
from jaxphys.core.reading import reading
from jaxphys.gaussians import harmonics as sh
from jaxphys.gaussians.colour import colour_range, regularise, to_unit_interval
from jaxphys.gaussians.gaussians import Gaussians, concatenate, opacities, select, with_degree
from jaxphys.gaussians.ply import read_ply
from jaxphys.page.motion_data import Moving, enlarged_by, some_of, thinning_note
from jaxphys.pipeline.deform import bake
from jaxphys.pipeline.draw import placed_solids
from jaxphys.pipeline.frames import frames
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.render.camera import Camera, position
from jaxphys.scene.build import build
from jaxphys.scene.look import Look
from jaxphys.scene.obstacles import located
from jaxphys.scene.placement import AS_IT_IS, Placement
from jaxphys.scene.read import read_scene
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import load_object

MOST_GAUSSIANS = 60_000
NEEDED = ("config.json", "metrics.jsonl", "motion.mp4")
LARGEST_METRICS = 256 * 1024 * 1024
# Of the motion's extent: farther from what the run wrote down, the page says so.
SAME = 1e-3


@dataclass(frozen=True)
class Replay:
    """A run's motion and where it is looked at from.

    Attributes:
        scene: of the run.
        moving: its Gaussians, at most 60,000 that move and as many that do not.
        view, surroundings: see `page.videos.Entry`.
    """

    scene: Scene
    moving: Moving
    view: dict[str, Any]
    surroundings: dict[str, Any]


def require_finished(directory: Path) -> None:
    """Raises InputError unless `directory` is a run that came to its end."""
    if not directory.is_dir():
        raise InputError(f"{directory}: is no directory; name one that generate or animate made")
    for name in NEEDED:
        if not (directory / name).is_file():
            raise InputError(
                f"{directory / name}: is missing; generate or animate writes it at the end of a"
                " run, which the same command goes on to"
            )


def read_metrics(path: Path) -> list[dict[str, Any]]:
    """The rows of a metrics.jsonl.

    Raises:
        InputError: a line is no row of a run.
    """
    with reading(path, LARGEST_METRICS):
        try:
            rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
            for row in rows:
                np.asarray([*row["centre_of_mass"], row["time"]], np.float64)
        except (ValueError, TypeError, KeyError, RecursionError):
            raise InputError("holds no rows of a run; make the run again") from None
    return rows


def replay(directory: Path, *, progress: bool = False) -> Replay:
    """The motion of a run.

    Args:
        directory: of a finished run.
        progress: whether to show a bar while it is computed.

    Raises:
        InputError: no finished run, or a file of it cannot be read.
        SimulationError: the motion failed this time.
    """
    require_finished(directory)
    with reading(directory / "config.json"):
        scene = located(read_scene(directory / "config.json").scene.filmed(), directory)
    rows = read_metrics(directory / "metrics.jsonl")
    splats = [directory / "splats" / f"{number:04d}.ply" for number in range(scene.frames)]
    # Only a build knows where the contents of the object's file went.
    by_itself = scene.camera.photograph is None and scene.camera.units == "metres"
    if by_itself and len(rows) == scene.frames and all(path.is_file() for path in splats):
        return _from_splats(scene, splats, rows)
    return _computed(scene, directory, rows, progress)


def _from_splats(scene: Scene, paths: list[Path], rows: list[dict[str, Any]]) -> Replay:
    first = read_ply(paths[0])
    chosen = _chosen(first)
    kept = []
    for path in paths:
        gaussians = read_ply(path)
        if gaussians.count != first.count:
            raise InputError(f"{path}: holds {gaussians.count} Gaussians, {paths[0]} {first.count}")
        kept.append(_enlarged(select(gaussians, chosen), first.count))
    colours = _colours(first, scene.regularise_colours)[chosen]
    seconds = np.asarray([row["time"] for row in rows], np.float64)
    moving = _moving(kept, colours, seconds, first.count)
    shown = [np.asarray(one.means) for one in kept]
    return Replay(scene, moving, *_seen(scene, shown, shown[0], AS_IT_IS))


def _computed(scene: Scene, directory: Path, rows: list[dict[str, Any]], progress: bool) -> Replay:
    """By the very loop that the film took its frames from."""
    things = tuple(
        load_object(thing, directory, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    )
    simulation, look = build(scene, *things)
    chosen = _chosen(look.gaussians)
    moved = _enlarged(select(with_degree(look.gaussians, 0), chosen), look.gaussians.count)
    rest = []
    if look.still is not None:
        rest = [_enlarged(select(look.still, _chosen(look.still)), look.still.count)]
    kept, points, seconds = [], [], []
    found = islice(frames(simulation, particles=simulation.carriers), scene.frames)
    bar = tqdm(found, desc=directory.name, total=scene.frames, unit="frame", disable=not progress)
    for moment in bar:
        places, gradients = moment.frame.carried()
        points.append(np.asarray(places))
        baked = bake(moved, places[chosen], gradients[chosen])
        kept.append(concatenate([baked, *rest, *placed_solids(look, moment.frame)]))
        seconds.append(float(moment.frame.time))
    notes = _difference(moment.metrics, rows, points)
    shades = [_shades(look)[chosen], *(_colours(one, False) for one in rest)]
    solids = placed_solids(look, moment.frame)
    shades += [_colours(one, False) for one in solids]
    total = look.gaussians.count + sum(one.count for one in solids)
    total += 0 if look.still is None else look.still.count
    moving = _moving(kept, np.concatenate(shades), np.asarray(seconds), total, notes)
    ground = points[0]
    if look.still is not None:
        points[0] = np.concatenate([points[0], np.asarray(look.still.means)])
    return Replay(scene, moving, *_seen(scene, points, ground, look.placements[0]))


def _chosen(gaussians: Gaussians) -> np.ndarray:
    """Which of the Gaussians are kept."""
    if gaussians.count <= MOST_GAUSSIANS:
        return np.arange(gaussians.count)
    return some_of(gaussians.count, MOST_GAUSSIANS)


def _enlarged(some: Gaussians, total: int) -> Gaussians:
    """Gaussians that stand for `total`."""
    return replace(some, log_scales=some.log_scales + math.log(enlarged_by(total, some.count)))


def _colours(gaussians: Gaussians, regular: bool) -> np.ndarray:
    """What is the same from all sides of the colours, (N, 3) in [0, 1]."""
    rgb = sh.dc_to_rgb(gaussians.harmonics[:, 0])
    if regular:
        rgb = regularise(rgb, to_unit_interval(colour_range(gaussians)))
    return np.clip(np.asarray(rgb, np.float64), 0, 1)


def _shades(look: Look) -> np.ndarray:
    """The colours of what moves, regularised object by object as the film does."""
    rgb = sh.dc_to_rgb(look.gaussians.harmonics[:, 0])
    if look.colours is not None:
        parts = zip(look.objects, look.colours, strict=True)
        rgb = jnp.concatenate([regularise(rgb[a:b], limits) for (a, b), limits in parts])
    return np.clip(np.asarray(rgb, np.float64), 0, 1)


def _moving(
    kept: list[Gaussians],
    colours: np.ndarray,
    seconds: np.ndarray,
    total: int,
    notes: tuple[str, ...] = (),
) -> Moving:
    count = kept[0].count
    if count < total:
        notes = (*notes, thinning_note(total, count))
    return Moving(
        means=np.stack([np.asarray(one.means) for one in kept]),
        quaternions=np.stack([np.asarray(one.quaternions) for one in kept]),
        log_scales=np.stack([np.asarray(one.log_scales) for one in kept]),
        colours=colours,
        opacities=np.asarray(opacities(kept[0]), np.float64),
        seconds=seconds,
        notes=notes,
    )


def _difference(
    last: dict[str, Any], rows: list[dict[str, Any]], points: list[np.ndarray]
) -> tuple[str, ...]:
    """What is to be said where the motion is another one than the run wrote down."""
    if len(rows) != len(points):
        return (f"The run wrote {len(rows)} rows of metrics for {len(points)} frames.",)
    away = np.subtract(last["centre_of_mass"], rows[-1]["centre_of_mass"])
    size = float(np.max(np.ptp(points[0], axis=0)))
    if np.linalg.norm(away) <= SAME * size:
        return ()
    off = f"{np.linalg.norm(away):.2g} m"
    return (f"Computed again on another machine or version: at the end {off} from the film.",)


def _seen(
    scene: Scene, shown: list[np.ndarray], ground: np.ndarray, placement: Placement
) -> tuple[dict[str, Any], dict[str, Any]]:
    """View and surroundings as the film's first picture has them."""
    low, high = ground.min(axis=0), ground.max(axis=0)
    points = shown[:1] * scene.frames if scene.camera.stands_by_itself else shown
    size = (scene.width, scene.height)
    camera = frame_cameras(scene.camera, points, scene.fps, *size, placement)[0]
    view = view_of(camera, scene.camera.frame, (low + high) / 2)
    extent = max(1.2 * float(np.max(high - low)), 1e-3)
    middle = ((low + high)[:2] / 2).tolist()
    floor = scene.ground
    surroundings = {
        "background": list(scene.background),
        "colour": list(scene.background if floor is None else floor.colour),
        "place": [*middle, *((0.0, 0.0) if floor is None else (floor.height, extent))],
    }
    return view, surroundings


def view_of(camera: Camera, axes: np.ndarray, middle: np.ndarray) -> dict[str, Any]:
    """A camera as an orbit about the point of its optical axis that is as far as `middle` is.

    Args:
        camera: any; a roll about its axis is left out.
        axes: directions of azimuth 0, of azimuth 90, and upwards (3, 3), as rows.
        middle: (3,) [m].
    """
    eye = np.asarray(position(camera), np.float64)
    forward = np.asarray(camera.rotation, np.float64)[2]
    distance = max(float((middle - eye) @ forward), 1e-3)
    outwards = axes @ -forward
    return {
        "target": (eye + distance * forward).tolist(),
        "distance": distance,
        "azimuth": math.atan2(outwards[1], outwards[0]),
        "elevation": math.asin(max(-1.0, min(1.0, outwards[2]))),
        "axes": axes.tolist(),
        "field": 2 * math.atan(0.5 * camera.width / float(camera.focal[0])),
        "aspect": camera.width / camera.height,
    }
