"""videos.html of any runs: what was asked for, the film, scores, and the object in 3D."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jaxphys.core.errors import InputError
from jaxphys.core.fields import between, check_number
from jaxphys.core.files import atomic_path, output_file, read_json
from jaxphys.core.reading import reading
from jaxphys.page.motion_data import pack
from jaxphys.page.videos import TITLE, Entry, videos_page
from jaxphys.pipeline.replay import NEEDED, replay, require_finished
from jaxphys.scene.scene import Scene

MEGABYTES = 8.0
LARGEST_FILM = 256 * 1024 * 1024


def write_videos(
    directories: Sequence[str | os.PathLike],
    out: str | os.PathLike,
    *,
    title: str | None = None,
    titles: Sequence[str] | None = None,
    megabytes: float = MEGABYTES,
    overwrite: bool = False,
    progress: bool = False,
) -> Path:
    """Writes the page of some finished runs; returns its path.

    Args:
        directories: made by generate or animate, in the order of the page.
        out: the file.
        title: of the page.
        titles: of the runs, in their order; None: what each was asked for.
        megabytes: most that the motion of each run may take on the page, in base64.
        overwrite: whether `out` may be replaced.
        progress: whether to show bars where a motion is computed again.

    Raises:
        InputError: a directory is no finished run, there is not one title for each, or the file
        cannot be written.
        SimulationError: a motion failed this time.
    """
    check_number("--megabytes", megabytes, between(0.05, 400))
    paths = [Path(directory) for directory in directories]
    if not paths:
        raise InputError("DIR: name at least one directory that generate or animate made")
    if titles is not None and len(titles) != len(paths):
        raise InputError(f"titles: {len(titles)} for {len(paths)} runs; give one for each")
    read = [path / name for path in paths for name in (*NEEDED, "evaluation.json", "prompt.json")]
    target = output_file(out, overwrite=overwrite, inputs=tuple(read))
    for path in paths:
        require_finished(path)
    entries = [
        _entry(path, None if titles is None else titles[i], int(1e6 * megabytes), progress)
        for i, path in enumerate(paths)
    ]
    page = videos_page(entries, TITLE if title is None else title)
    with atomic_path(target) as aside:
        aside.write_text(page, encoding="utf-8")
    return target


def _entry(directory: Path, title: str | None, largest: int, progress: bool) -> Entry:
    again = replay(directory, progress=progress)
    with reading(directory / "motion.mp4", LARGEST_FILM) as path:
        film = path.read_bytes()
    facts = facts_of(again.scene, _object(directory / "prompt.json"))
    facts |= scores(_object(directory / "evaluation.json"))
    return Entry(
        title=title_of(again.scene, directory.resolve().name) if title is None else title,
        facts=facts,
        film=film,
        motion=pack(again.moving, largest),
        view=again.view,
        surroundings=again.surroundings,
        fps=again.scene.fps,
    )


def _object(path: Path) -> dict[str, Any]:
    return read_json(path) if path.exists() else {}


def title_of(scene: Scene, otherwise: str) -> str:
    """The sentence that a run was asked for, or another title."""
    return otherwise if scene.generation is None else scene.generation.prompt


def facts_of(scene: Scene, prompt: Mapping[str, Any]) -> dict[str, str]:
    """What a page tells of a run, by name.

    Args:
        scene: of the run.
        prompt: what its prompt.json holds, {} if it has none.
    """
    facts = {}
    if isinstance(prompt.get("refined"), str):
        facts["Refined prompt"] = prompt["refined"]
    made = prompt.get("made_by")
    if isinstance(made, dict):
        known = [f"{name} {value}" for name, value in made.items() if isinstance(value, str)]
        facts["Made by"] = ", ".join(known)
    facts["Material"] = ", ".join(dict.fromkeys(thing.material for thing in scene.objects))
    changed = {k: v for thing in scene.objects for k, v in thing.parameters.items()}
    if changed:
        facts["Parameters"] = json.dumps(changed, sort_keys=True)
    seconds = scene.seconds_per_frame * (scene.frames - 1)
    facts["Frames"] = f"{scene.frames}, {seconds:.4g} s simulated, {scene.fps:g} a second shown"
    facts["Seed"] = str(scene.seed)
    return facts


def scores(evaluation: Mapping[str, Any]) -> dict[str, str]:
    """What an evaluation.json holds of scores, by name."""
    found = {}
    clip = evaluation.get("clip")
    if isinstance(clip, dict) and isinstance(clip.get("score"), int | float):
        found["CLIP score"] = f"{clip['score']:.2f} ({clip.get('model', 'model not named')})"
    heads = evaluation.get("aesthetic")
    for version, head in heads.items() if isinstance(heads, dict) else ():
        if isinstance(head, dict) and isinstance(head.get("score"), int | float):
            found[f"LAION aesthetic {version}"] = f"{head['score']:.2f}"
    return found
