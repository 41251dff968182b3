"""A folder of photographs with known cameras in, Gaussians out."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from jaxphys.core.checkpoints import Checkpoints, by_name, fingerprint, from_names
from jaxphys.core.fields import SEED, between, check_number
from jaxphys.core.files import write_json
from jaxphys.core.run_folder import run_folder
from jaxphys.gaussians.ply import write_ply
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.saving import saving
from jaxphys.pipeline.video import write_picture
from jaxphys.reconstruction import optimise as optimising
from jaxphys.reconstruction.capture import read_capture, read_picture, turned, upright
from jaxphys.reconstruction.optimise import ReconstructConfig, ReconstructState
from jaxphys.reconstruction.start import initial_gaussians, room
from jaxphys.scene.model_folder import GENERATED
from jaxphys.scene.scene import MOST_SPLATS

RESULT, SHEET, TIMING, STATE = "result.json", "held_out.png", "timing.json", "steps/"
SHOWN = 4  # held-out pictures on the sheet


def reconstruct(
    capture: str | os.PathLike,
    out: str | os.PathLike,
    *,
    steps: int = 3000,
    splats: int = 20_000,
    longest: int = 400,
    degree: int = 1,
    seed: int = 0,
    overwrite: bool = False,
    progress: bool = False,
    watch: Callable[[int], None] | None = None,
) -> dict[str, Any]:
    """Makes Gaussians of a capture; returns what `result.json` holds.

    `out` gets `gaussians.ply`, which `animate` takes with the folder's name, `result.json` (peak
    signal-to-noise ratio and structural similarity of the pictures that were held out, and the turn
    from the capture's world into the file's, in which z is up), and `held_out.png`, those pictures
    above what is drawn. An interrupted run goes on by the same call, to the same bytes.

    Args:
        capture: the folder, see `jaxphys.reconstruction.capture`.
        out: new, empty, or of an earlier run of the same request.
        steps: of the optimisation, a picture each.
        splats: Gaussians at most.
        longest: longer side that pictures are brought to [pixels], if they are larger.
        degree: of the harmonics, 0 to 3.
        seed: of every random choice.
        overwrite: whether another request's files in `out` may be replaced.
        progress: whether to show a bar.
        watch: called with the number of steps after each; may raise KeyboardInterrupt.

    Raises:
        InputError: something cannot be read or used, named by file and field.
        KeyboardInterrupt: what was done is saved.
    """
    check_number("--steps", steps, between(1, 10_000_000))
    check_number("--splats", splats, between(1, MOST_SPLATS))
    check_number("--longest", longest, between(16, 8192))
    check_number("--degree", degree, between(0, 3))
    check_number("--seed", seed, SEED)
    timing = Timing()
    with timing.stage("read"):
        found = read_capture(Path(capture))
        turn = upright(found)
        found = turned(found, turn)
        pictures = [read_picture(shot, longest) for shot in found.shots]
    config = ReconstructConfig(steps=steps, capacity=splats)
    places = [(shot.rotation, shot.translation, shot.focal, shot.centre) for shot in found.shots]
    identity = fingerprint(
        b"reconstruct", repr((config, degree, seed)).encode(), pictures, places, found.points
    )
    training = [i for i, shot in enumerate(found.shots) if not shot.held_out]
    held = [i for i, shot in enumerate(found.shots) if shot.held_out]
    shots = tuple(found.shots[i] for i in training)
    _, size = room(found.shots)
    with run_folder(
        out,
        identity,
        (GENERATED, RESULT, SHEET, TIMING, STATE),
        inputs=[shot.path for shot in found.shots],
        overwrite=overwrite,
    ) as folder:
        with timing.stage("start"):
            begun, source = initial_gaussians(
                shots,
                [pictures[i] for i in training],
                found.points,
                found.colours,
                count=min(splats, max(1, splats // 2)),
                degree=degree,
                seed=seed,
            )
        among = optimising.photographs(list(shots), [pictures[i] for i in training])
        with timing.stage("optimise"):
            checkpoints = Checkpoints(folder.file(STATE), identity)
            state = optimising.start(begun, config, size)
            newest = checkpoints.newest()
            if newest is not None:
                state = from_names(state, newest[1])
            state = _steps(state, among, config, size, seed, checkpoints, progress, watch)
        made = optimising.result(state)
        judged_on = held or training
        chosen = [found.shots[i] for i in judged_on]
        judged = optimising.judge(
            made, optimising.photographs(chosen, [pictures[i] for i in judged_on])
        )
        result = {
            "gaussians": made.count,
            "steps": steps,
            "started_from": source,
            "judged_on": "held-out pictures" if held else "the pictures it was made of",
            "pictures": len(judged_on),
            "psnr": round(float(np.mean(judged.psnr)), 3),
            "ssim": round(float(np.mean(judged.ssim)), 4),
            "turn": np.round(turn, 9).tolist(),
        }
        write_ply(folder.file(GENERATED), made)
        write_picture(folder.file(SHEET), _sheet(judged))
        write_json(folder.file(RESULT), result)
        timing.write(folder.file(TIMING))
        folder.remove(STATE)
    return result


def _steps(
    state: ReconstructState, among, config, size, seed, checkpoints, progress, watch
) -> ReconstructState:
    bar = tqdm(
        total=config.steps,
        initial=int(state.step),
        desc="reconstruct",
        disable=not progress,
        leave=False,
    )
    with saving() as after, bar:

        def on_step(state: ReconstructState) -> None:
            step = int(state.step)
            after(
                lambda: checkpoints.save(step, by_name(state)),
                None if watch is None else lambda: watch(step),
            )
            bar.update()

        return optimising.optimise(state, among, config, size=size, seed=seed, on_step=on_step)


def _sheet(judged: optimising.Judged) -> np.ndarray:
    """Some of the pictures above what was drawn, uint8 (2 H, W each, 3)."""
    size = judged.seen[0].shape
    alike = [i for i, picture in enumerate(judged.seen) if picture.shape == size]
    chosen = [alike[i] for i in np.unique(np.linspace(0, len(alike) - 1, SHOWN).astype(int))]
    rows = [np.concatenate([rows[i] for i in chosen], 1) for rows in (judged.seen, judged.drawn)]
    return (255 * np.concatenate(rows, 0) + 0.5).astype(np.uint8)
