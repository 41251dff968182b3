"""The motion of a finished run once more: out of its splats, or computed again as its film was.

A run keeps its scene and its Gaussians, which decide every frame to the byte, but no frames unless
`--save-splats` asked for them.
"""

import json
import math
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from jaxphys.core.errors import InputError
from jaxphys.core.reading import reading
from jaxphys.gaussians import harmonics as sh
from jaxphys.gaussians.colour import regularise
from jaxphys.gaussians.gaussians import Gaussians, concatenate, opacities, select, with_degree
from jaxphys.gaussians.ply import read_ply
from jaxphys.gaussians.thinning import fewer, some_of
from jaxphys.mpm.simulation import Simulation
from jaxphys.page.motion_data import Moving, thinning_note
from jaxphys.pipeline.deform import bake
from jaxphys.pipeline.draw import placed_solids
from jaxphys.pipeline.frames import frames
from jaxphys.pipeline.framing import frame_cameras
from jaxphys.render.camera import Camera, position
from jaxphys.scene.build import build
from jaxphys.scene.look import Look
from jaxphys.scene.obstacles import located
from jaxphys.scene.placement import Placement
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
    things = tuple(
        load_object(thing, directory, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    )
    simulation, look = build(scene, *things)
    files = [directory / "splats" / f"{number:04d}.ply" for number in range(scene.frames)]
    if len(rows) == scene.frames and all(path.is_file() for path in files):
        kept, points, seconds, notes = _from_splats(look, files, rows)
    else:
        bar = directory.name if progress else None
        kept, points, seconds, notes = _computed(scene, simulation, look, rows, bar)
    total = sum(one.count for one in _parts(look))
    moving = _moving(kept, _colours(look), seconds, total, notes)
    ground = points[0]
    if look.still is not None:
        points[0] = np.concatenate([points[0], np.asarray(look.still.means)])
    return Replay(scene, moving, *_seen(scene, points, ground, look.placements[0]))


# Frames of what is shown, places of what moves (K, 3) at each [m], times [s], and notes.
_Frames = tuple[list[Gaussians], list[np.ndarray], np.ndarray, tuple[str, ...]]


def _from_splats(look: Look, paths: list[Path], rows: list[dict[str, Any]]) -> _Frames:
    """As the run kept them, in the order in which `deformed_gaussians` puts what is drawn."""
    counts = [one.count for one in _parts(look)]
    kept, points = [], []
    for path in paths:
        gaussians = with_degree(read_ply(path), 0)
        if gaussians.count != sum(counts):
            raise InputError(
                f"{path}: holds {gaussians.count} Gaussians, the run's scene {sum(counts)}; make "
                "the run again"
            )
        ends = np.cumsum([0, *counts]).tolist()
        parts = [select(gaussians, slice(*pair)) for pair in pairwise(ends)]
        kept.append(concatenate([fewer(part, MOST_GAUSSIANS) for part in parts]))
        points.append(np.asarray(parts[0].means))
    return kept, points, np.asarray([row["time"] for row in rows], np.float64), ()


def _computed(
    scene: Scene,
    simulation: Simulation,
    look: Look,
    rows: list[dict[str, Any]],
    bar: str | None,
) -> _Frames:
    """By the very loop that the film took its frames from; bar: what is written beside one."""
    chosen = _chosen(look.gaussians.count)
    moved = fewer(with_degree(look.gaussians, 0), MOST_GAUSSIANS)
    rest = [] if look.still is None else [fewer(look.still, MOST_GAUSSIANS)]
    kept, points, seconds = [], [], []
    found = islice(frames(simulation, particles=simulation.carriers), scene.frames)
    for moment in tqdm(found, desc=bar, total=scene.frames, unit="frame", disable=bar is None):
        places, gradients = moment.frame.carried()
        points.append(np.asarray(places))
        baked = bake(moved, places[chosen], gradients[chosen])
        solids = [fewer(one, MOST_GAUSSIANS) for one in placed_solids(look, moment.frame)]
        kept.append(concatenate([baked, *rest, *solids]))
        seconds.append(float(moment.frame.time))
    notes = _difference(moment.metrics, rows, points)
    return kept, points, np.asarray(seconds), notes


def _parts(look: Look) -> list[Gaussians]:
    """What is drawn: what moves, what does not, and each obstacle in its own axes."""
    still = [] if look.still is None else [look.still]
    return [look.gaussians, *still, *(solid for solid, _ in look.solids)]


def _chosen(count: int) -> np.ndarray:
    """Which of so many Gaussians are kept."""
    return np.arange(count) if count <= MOST_GAUSSIANS else some_of(count, MOST_GAUSSIANS)


def _colours(look: Look) -> np.ndarray:
    """What is the same from all sides of the colours of what is kept, (N, 3) in [0, 1]: of what
    moves regularised object by object, as the film has it.
    """
    shades = [sh.dc_to_rgb(one.harmonics[:, 0]) for one in _parts(look)]
    if look.colours is not None:
        pairs = zip(look.objects, look.colours, strict=True)
        shades[0] = jnp.concatenate(
            [regularise(shades[0][a:b], limits) for (a, b), limits in pairs]
        )
    kept = [rgb[_chosen(one.count)] for rgb, one in zip(shades, _parts(look), strict=True)]
    return np.clip(np.asarray(jnp.concatenate(kept), np.float64), 0, 1)


def _moving(
    kept: list[Gaussians],
    colours: np.ndarray,
    seconds: np.ndarray,
    total: int,
    notes: tuple[str, ...],
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
