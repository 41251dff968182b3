"""A finished run scored as its paper scores it: prompt against video, and the video by itself."""

from pathlib import Path
from typing import Any

import numpy as np

from jaxphys.core.errors import InputError, one_line
from jaxphys.core.fields import between, check_number
from jaxphys.core.files import read_json, write_json
from jaxphys.core.run_folder import added_file
from jaxphys.evaluate.aesthetic import HEADS, load_head
from jaxphys.evaluate.clip_score import clip_score, load_clip
from jaxphys.evaluate.frames import evenly_spaced, read_frames
from jaxphys.weights.resolve import locate

VIDEO, RESULT = "motion.mp4", "evaluation.json"
CLIP = "clip-vit-large-patch14"


def find_prompt(directory: Path) -> str:
    """The sentence that a run was asked for, as the user wrote it.

    Raises:
        InputError: the directory does not say.
    """
    refined, scene = directory / "prompt.json", directory / "config.json"
    prompt = read_json(refined).get("original") if refined.exists() else None
    if prompt is None and scene.exists():
        generation = read_json(scene).get("generation")
        prompt = generation.get("prompt") if isinstance(generation, dict) else None
    if not isinstance(prompt, str) or not prompt.strip():
        raise InputError(
            f"{directory}: holds no prompt (prompt.json, or generation.prompt in config.json);"
            " give --prompt"
        )
    return prompt


def evaluate(
    directory: str | Path,
    *,
    clip: str | Path | None = None,
    aesthetic: str | Path | None = None,
    prompt: str | None = None,
    frames: int | None = None,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Scores the video of a run, writes evaluation.json beside it and returns what that holds.

    Args:
        directory: made by generate or animate.
        clip: folder with the files of CLIP ViT-L/14; None looks where weights are kept.
        aesthetic: folder with the files of the aesthetic heads; None likewise.
        prompt: None takes the run's own.
        frames: so many evenly spaced pictures; None takes all.
        overwrite: whether an evaluation.json may be replaced that no run made.

    Returns:
        `prompt`; `frames`, counts `total` and `scored`; `clip` with `model`, `score` (100 max(cos,
        0)) and `cosine`; `aesthetic`, by version; each with its values `by_frame`; `unavailable`,
        by version, why a head gave no score.

    Raises:
        InputError: there is no video, no prompt or no CLIP, or the file cannot be written.
    """
    directory = Path(directory)
    if frames is not None:
        check_number("--frames", frames, between(1, 100_000))
    if not directory.is_dir():
        raise InputError(f"{directory}: is no directory; name one that generate or animate made")
    prompt = find_prompt(directory) if prompt is None else prompt
    if not (directory / VIDEO).is_file():
        raise InputError(f"{directory / VIDEO}: is missing; run generate or animate first")
    with added_file(directory, RESULT, overwrite=overwrite) as path:
        result = _scored(directory, prompt, clip, aesthetic, frames)
        write_json(path, result)
    return result


def _scored(
    directory: Path,
    prompt: str,
    clip: str | Path | None,
    aesthetic: str | Path | None,
    frames: int | None,
) -> dict[str, Any]:
    """What `evaluate` returns."""
    model = load_clip(locate(CLIP, clip))
    pictures = read_frames(directory / VIDEO, model.size)
    chosen = evenly_spaced(len(pictures), frames)
    embeddings = model.pictures(pictures[chosen])
    cosines = embeddings @ model.texts([prompt])[0]
    scores, unavailable = {}, {}
    for version, (entry, _, _) in HEADS.items():
        try:
            values = load_head(version, locate(entry, aesthetic))(embeddings)
            scores[version] = {"score": float(values.mean()), "by_frame": _listed(values)}
        except InputError as error:
            unavailable[version] = " ".join(str(error).split())
    result = {
        "prompt": prompt,
        "frames": {"total": len(pictures), "scored": len(chosen)},
        "clip": {
            "model": model.variant,
            "score": clip_score(cosines),
            "cosine": float(cosines.mean()),
            "by_frame": _listed(cosines),
        },
        "aesthetic": scores,
        "unavailable": unavailable,
    }
    return result


def _listed(values: np.ndarray) -> list[float]:
    return [round(float(value), 6) for value in values]


def as_text(result: dict[str, Any]) -> str:
    """What `evaluate` found, for people; what is unavailable is left out."""
    frames, clip = result["frames"], result["clip"]
    lines = [
        f'"{one_line(result["prompt"], 1000)}": {frames["scored"]} of {frames["total"]} pictures',
        f"  CLIP score           {clip['score']:7.3f}   100 max(cos, 0), mean over pictures",
        f"  cosine               {clip['cosine']:7.4f}   the same without cutting and scaling",
    ]
    for version, found in result["aesthetic"].items():
        lines.append(f"  LAION aesthetic {version}   {found['score']:7.3f}   about 1 to 10")
    return "\n".join([*lines, f"  CLIP: {clip['model']}"])
