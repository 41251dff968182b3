"""A sentence in, a directory with a moving object out."""

import dataclasses
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.files import read_json, write_json
from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.gaussians.ply import read_ply, write_ply
from jaxphys.guidance.prompts.refine import Refinement, check_prompt, refine
from jaxphys.pipeline.animate import Watch, animate
from jaxphys.pipeline.interrupt import deferred_interrupt
from jaxphys.pipeline.output import Timing, run_directory
from jaxphys.pipeline.record import SAVE_EVERY
from jaxphys.pipeline.resume import FOLDER, Checkpoint, fingerprint
from jaxphys.scene.build import validate
from jaxphys.scene.scene import Generation, Scene

FIELDS = {entry.name for entry in dataclasses.fields(Refinement)}


def _asked(
    prompt: str | None, scene: Scene, changes: Mapping[str, Any]
) -> tuple[Scene, Generation]:
    """The scene with what is asked for written into it, and that part of it."""
    known = scene.generation
    if prompt is None and known is None:
        raise InputError("prompt: is missing; say what the object is, for example 'a strawberry'")
    given = {"prompt": prompt, **changes}
    given = {name: value for name, value in given.items() if value is not None}
    try:
        generation = dataclasses.replace(known or Generation(prompt or ""), **given)
    except InputError as error:
        raise InputError(f"--{error}") from None
    check_prompt(generation.prompt)
    return dataclasses.replace(scene, generation=generation), generation


def generate(
    prompt: str | None,
    scene: Scene,
    out: str | os.PathLike,
    *,
    save_splats: bool = False,
    progress: bool = False,
    watch: Watch | None = None,
    **changes: Any,
) -> Path:
    """Makes an object from a sentence and moves it; returns the directory.

    Besides what `animate` writes, the directory gets `prompt.json` (see `Refinement`).

    Args:
        prompt: the sentence; None takes the one in the scene.
        scene: whose first object the sentence describes.
        out: the directory, made if missing.
        save_splats, progress, watch: as for `animate`.
        changes: fields of `Generation` that differ from those in the scene, such as `steps`,
            `splats`, `prior`, `shape_prior`; None changes nothing.

    Raises:
        InputError, SimulationError, KeyboardInterrupt: as `animate`; or an unusable prompt.
    """
    from jaxphys.guidance import choice

    timing = Timing()
    scene, generation = _asked(prompt, scene, changes)
    validate(scene)
    choice.require(generation.prior, generation.shape_prior, dtype=generation.precision)
    refinement = _refined(generation, Path(out))
    out = run_directory(out)
    write_json(out / "prompt.json", dataclasses.asdict(refinement))
    with timing.stage("generate"):
        gaussians = _gaussians(refinement, scene, generation, out, progress)
    return animate(
        scene,
        out,
        objects=(gaussians,),
        save_splats=save_splats,
        progress=progress,
        timing=timing,
        watch=watch,
    )


def _refined(generation: Generation, out: Path) -> Refinement:
    """The prompt refined, or as an unfinished run in `out` has it: a language model may answer
    differently the second time, and the run could not go on."""
    if (out / FOLDER).is_dir() and (out / "prompt.json").is_file():
        known = read_json(out / "prompt.json")
        if known.get("original") == generation.prompt and set(known) == FIELDS:
            return Refinement(**known)
    return refine(generation.prompt, how=generation.refiner)


def _gaussians(
    refinement: Refinement, scene: Scene, generation: Generation, out: Path, progress: bool
) -> Gaussians:
    """The object: kept from an interrupted run of the same request, or made."""
    how = dataclasses.replace(generation, prompt=refinement.refined, refiner="auto")
    asked = (how, scene.seed)
    kept = out / FOLDER / f"object-{fingerprint(repr(asked).encode())[:16]}.ply"
    if not kept.exists():
        checkpoint = Checkpoint(out, fingerprint(repr(asked).encode(), ()))
        write_ply(kept, _optimise(refinement.refined, scene.seed, generation, checkpoint, progress))
    return read_ply(kept)


def _optimise(
    prompt: str, seed: int, generation: Generation, checkpoint: Checkpoint, progress: bool
) -> Gaussians:
    """Runs `text_to_gaussians`, going on from a checkpoint and saving one when interrupted."""
    from jaxphys.guidance import choice, optimise

    given = {"steps": generation.steps, "count": generation.splats}
    changes = {name: value for name, value in given.items() if value is not None}
    usual = choice.settings(generation.prior, generation.shape_prior)
    config = dataclasses.replace(usual, **changes)
    guides = choice.guides(
        prompt,
        prior=generation.prior,
        shape_prior=generation.shape_prior,
        negative=generation.negative,
        dtype=generation.precision,
        attention_slice=generation.attention_slice,
    )
    resume, done = None, checkpoint.frame()
    if done is not None:
        arrays = checkpoint.load(done)
        cloud = from_points(np.zeros((config.count, 3), np.float32), np.zeros(3), 1.0)
        structure = jax.tree.structure(optimise.start(cloud, config))
        resume = structure.unflatten([jnp.asarray(arrays[name]) for name in sorted(arrays)])
    saved = time.monotonic()
    with deferred_interrupt() as interrupted:

        def on_step(state) -> None:
            nonlocal saved
            stop = interrupted()
            if stop or time.monotonic() - saved > SAVE_EVERY:
                leaves = jax.tree.leaves(state)
                checkpoint.save(
                    int(state.step), {f"leaf_{i:03d}": leaf for i, leaf in enumerate(leaves)}
                )
                saved = time.monotonic()
            if stop:
                raise KeyboardInterrupt

        return optimise.text_to_gaussians(
            prompt,
            seed=seed,
            config=config,
            guides=guides,
            progress=progress,
            resume=resume,
            on_step=on_step,
        )
