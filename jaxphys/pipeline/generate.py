"""A sentence in, a directory with a moving object out."""

import dataclasses
import json
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jaxphys.core.checkpoints import Checkpoints, by_name, fingerprint, from_names
from jaxphys.core.errors import InputError
from jaxphys.core.files import read_json, write_json
from jaxphys.core.run_folder import RunFolder, run_folder
from jaxphys.core.seals import is_sound, seal
from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.gaussians.ply import read_ply, write_ply
from jaxphys.guidance.prompts.refine import Refinement, check_prompt, refine
from jaxphys.pipeline.animate import (
    Watch,
    animate_in,
    products,
    source_files,
    with_written_sources,
)
from jaxphys.pipeline.output import Timing
from jaxphys.pipeline.resume import FOLDER
from jaxphys.pipeline.saving import saving
from jaxphys.scene.build import validate
from jaxphys.scene.json import to_json
from jaxphys.scene.obstacles import located, mesh_file, mesh_obstacles
from jaxphys.scene.scene import Generation, Scene
from jaxphys.scene.source import load_object

PROMPT = "prompt.json"


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
    beside: Path | None = None,
    save_splats: bool = False,
    overwrite: bool = False,
    inputs: tuple[Path, ...] = (),
    progress: bool = False,
    watch: Watch | None = None,
    **changes: Any,
) -> Path:
    """Makes an object from a sentence and moves it; returns the directory.

    Besides what `animate` writes, the directory gets `prompt.json`: see `Refinement`, and under
    `made_by` the priors, or the parametric model and what of it was chosen.

    Args:
        prompt: the sentence; None takes the one in the scene.
        scene: whose first object the sentence describes; others are read from their sources.
        out: the directory: new, empty, or of an earlier run of the same request.
        beside, save_splats, overwrite, inputs, progress, watch: as for `animate`.
        changes: fields of `Generation` that differ from those in the scene, such as `steps`,
            `splats`, `prior`, `shape_prior`; None changes nothing.

    Raises:
        InputError, SimulationError, KeyboardInterrupt: as `animate`; or an unusable prompt.
    """
    from jaxphys.guidance import choice, library

    timing = Timing()
    scene, generation = _asked(prompt, scene.filmed(), changes)
    validate(scene)
    choice.require(generation.prior, generation.shape_prior, dtype=generation.precision)
    if generation.prior == choice.LIBRARY:
        library.require_known(generation.prompt)
    elif generation.prior == choice.BUNDLED and not library.is_known(generation.prompt):
        print(f"jaxphys: {library.unknown(generation.prompt)}", file=sys.stderr)
    scene = located(scene, beside)
    others = tuple(
        load_object(thing, beside, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
        if i > 0
    )
    meshes = [mesh_file(scene, i) for i in mesh_obstacles(scene)]
    inputs = (*inputs, *source_files(scene.objects[1:], beside), *meshes)
    # Everything that is asked for decides the result, the refiner too.
    shapes = [path.read_bytes() for path in meshes]
    identity = fingerprint(b"generate", _text(with_written_sources(scene)), others, *shapes)
    names = [PROMPT, *products(scene, save_splats)]
    with run_folder(out, identity, names, inputs=inputs, overwrite=overwrite) as folder:
        refinement = _refined(generation, folder, identity)
        with timing.stage("generate"):
            if generation.prior == choice.LIBRARY:
                count = generation.splats or library.COUNT
                gaussians, made = library.library_object(generation.prompt, scene.seed, count)
            else:
                gaussians = _gaussians(refinement, scene, generation, folder, progress)
                made = {"shape_prior": generation.shape_prior}
        made = {"prior": generation.prior, **made}
        told = {**dataclasses.asdict(refinement), "made_by": made}
        write_json(folder.file(PROMPT), told)
        return animate_in(
            folder,
            scene,
            (gaussians, *others),
            save_splats=save_splats,
            progress=progress,
            timing=timing,
            watch=watch,
            prompt=told,
        )


def _text(value: Any) -> bytes:
    return json.dumps(to_json(value), sort_keys=True).encode()


def _refined(generation: Generation, folder: RunFolder, identity: str) -> Refinement:
    """The prompt refined, or as an unfinished run of the same request has it: a language model may
    answer differently the second time, and the run could not go on."""
    kept = folder.path / FOLDER / PROMPT
    if is_sound(kept, identity):
        return Refinement(**read_json(kept))
    refinement = refine(generation.prompt, how=generation.refiner)
    kept = folder.file(FOLDER) / PROMPT
    write_json(kept, dataclasses.asdict(refinement))
    seal(kept, identity)
    return refinement


def _gaussians(
    refinement: Refinement, scene: Scene, generation: Generation, folder: RunFolder, progress: bool
) -> Gaussians:
    """The object: kept from an interrupted run of the same request, or made."""
    how = dataclasses.replace(generation, prompt=refinement.refined)
    identity = fingerprint(b"object", _text(how), str(scene.seed).encode())
    kept = folder.file(FOLDER) / "object.ply"
    if not is_sound(kept, identity):
        checkpoints = Checkpoints(folder.file(FOLDER) / "object", identity)
        made = _optimise(refinement.refined, scene.seed, generation, checkpoints, progress)
        write_ply(kept, made)
        seal(kept, identity)
    return read_ply(kept)


def _optimise(
    prompt: str, seed: int, generation: Generation, checkpoints: Checkpoints, progress: bool
) -> Gaussians:
    """Runs `text_to_gaussians`, going on from a checkpoint and saving one when interrupted."""
    from jaxphys.guidance import choice, optimise

    splats = generation.splats
    given = {"steps": generation.steps, "count": splats, "surface": splats}
    changes: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    usual = choice.settings(
        generation.prior,
        generation.shape_prior,
        stages=generation.stages,
        distillation=generation.distillation,
        perp_neg=generation.perp_neg,
    )
    config = dataclasses.replace(usual, **changes)
    guides = choice.guides(
        prompt,
        prior=generation.prior,
        shape_prior=generation.shape_prior,
        negative=generation.negative,
        dtype=generation.precision,
        attention_slice=generation.attention_slice,
    )
    resume, newest = None, checkpoints.newest()
    if newest is not None:
        cloud = from_points(np.zeros((config.count, 3), np.float32), np.zeros(3), 1.0)
        resume = from_names(optimise.start(cloud, config), newest[1])
    with saving() as after:

        def on_step(state) -> None:
            after(lambda: checkpoints.save(int(state.step), by_name(state)), None)

        return optimise.text_to_gaussians(
            prompt,
            seed=seed,
            config=config,
            guides=guides,
            progress=progress,
            resume=resume,
            on_step=on_step,
        )
