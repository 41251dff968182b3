"""What each command takes. Everything heavy is imported when a command runs, so that help is
quick.
"""

import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional

from jaxphys.core.errors import InputError

Settings = Annotated[
    tyro.conf.UseAppendAction[tuple[str, ...]],
    tyro.conf.arg(name="set", metavar="NAME=VALUE"),
]


def generate(
    prompt: Positional[str | None] = None,
    /,
    *,
    out: Path,
    material: str | None = None,
    config: Path | None = None,
    seed: int | None = None,
    width: int | None = None,
    height: int | None = None,
    frames: int | None = None,
    steps: int | None = None,
    splats: int | None = None,
    stepping: Literal["adaptive", "fixed", "implicit"] | None = None,
    prior: str | None = None,
    shape_prior: str | None = None,
    negative: str | None = None,
    stages: Literal["one", "two"] | None = None,
    distillation: Literal["sds", "ism"] | None = None,
    perp_neg: bool = False,
    refiner: Literal["auto", "endpoint", "local", "rules"] | None = None,
    precision: Literal["bfloat16", "float32"] | None = None,
    attention_slice: int | None = None,
    save_splats: bool = False,
    settings: Settings = (),
    quiet: bool = False,
    json: bool = False,
    overwrite: bool = False,
) -> int:
    """Make an object from a sentence and move it.

    For example: jaxphys generate "a teddy bear" --material fracture --out outputs/bear

    Args:
        prompt: What the object is, for example "a strawberry". Comes from --config if left out.
        out: Directory for everything that is made: new, empty, or of an earlier run.
        material: What it is made of; `jaxphys materials` lists them. Default: jelly.
        config: Scene file: the config.json of an earlier run, or one of your own.
        seed: Of every random choice. Default: 0.
        width: Of the video [pixels]. Default: 1958.
        height: Of the video [pixels]. Default: 1090.
        frames: Number of pictures. Default: the scene's, mostly 48.
        steps: Steps of optimisation.
        splats: Number of Gaussians at most.
        stepping: Time steps that adapt to what the motion allows, equal ones, or implicit ones for
            stiff matter in slow motion (`jaxphys plan` says what pays). Default: adaptive.
        prior: Judges pictures: bundled, stable-diffusion, stable-diffusion-2.1-base,
            stable-diffusion-2.1, or a folder in diffusers' layout. Or library: no prior, but the
            parametric model that the words mean; `jaxphys priors` lists them. Default: bundled.
        shape_prior: Judges points: bundled, point-e, or a folder with its files. Default: bundled.
        negative: What the prior that judges pictures moves away from.
        stages: Two, geometry under both priors and then appearance under the one that judges
            pictures; or one. Default: two for Stable Diffusion, one for bundled.
        distillation: Draw the noise that pictures are judged with (sds) or find it by inversion
            (ism), which costs more than three times as much. Default: sds.
        perp_neg: Move away from views that a picture must not show, at twice the cost.
        refiner: Who refines the sentence. Default: auto, an endpoint if one is set up, else a
            local language model if there is one, else fixed rules.
        precision: Of a published prior. Default: bfloat16.
        attention_slice: Queries a published prior attends from at a time; fewer take less memory.
            Default: 1024.
        save_splats: Also write one .ply for each picture.
        settings: Any field of the scene by its path in the file, or a parameter or field of the
            first object for short, once or more: youngs_modulus=2e4, boundaries.0.friction=0.2.
        quiet: Show no progress.
        json: Print what was made, as JSON.
        overwrite: Replace the files of an earlier run of another request, and only these.
    """
    from jaxphys.cli.made import tell
    from jaxphys.cli.scenes import files_read, scene_for, stepping_for
    from jaxphys.cli.settings import with_settings
    from jaxphys.pipeline.generate import generate as run

    changes = {"seed": seed, "width": width, "height": height, "frames": frames}
    changes |= stepping_for(stepping)
    scene = with_settings(scene_for(config, material, changes), settings)
    made = run(
        prompt,
        scene,
        out,
        beside=None if config is None else config.parent,
        save_splats=save_splats,
        overwrite=overwrite,
        inputs=files_read(config),
        progress=not quiet,
        steps=steps,
        splats=splats,
        prior=prior,
        shape_prior=shape_prior,
        negative=negative,
        stages=stages,
        distillation=distillation,
        perp_neg=perp_neg or None,
        refiner=refiner,
        precision=precision,
        attention_slice=attention_slice,
    )
    tell(made, json)
    return 0


def image(
    prompt: Positional[str],
    /,
    *,
    out: Path,
    prior: str = "stable-diffusion",
    negative: str = "",
    seed: int = 0,
    steps: int = 50,
    guidance: float = 7.5,
    sampler: Literal["ddim", "ddpm"] = "ddim",
    width: int | None = None,
    height: int | None = None,
    precision: Literal["bfloat16", "float32"] = "bfloat16",
    attention_slice: int = 1024,
    overwrite: bool = False,
) -> int:
    """Paint one picture with Stable Diffusion, which shows that a checkpoint is whole.

    For example: jaxphys image "a strawberry" --out strawberry.png

    Args:
        prompt: What to paint.
        out: The .png file to write.
        prior: As for generate.
        negative: What to move away from.
        seed: Of the noise.
        steps: Of the sampler.
        guidance: Towards the prompt; 1 is none.
        sampler: Deterministic (ddim) or with fresh noise at each step (ddpm).
        width: Pixels. Default: what the network was trained on.
        height: Pixels, likewise.
        precision: Of weights and computation.
        attention_slice: Queries attended from at a time; fewer take less memory.
        overwrite: Replace the file if it is there.
    """
    from jaxphys.pipeline.paint import paint_file

    paint_file(
        prompt,
        out,
        prior=prior,
        negative=negative,
        seed=seed,
        overwrite=overwrite,
        steps=steps,
        guidance=guidance,
        sampler=sampler,
        width=width,
        height=height,
        dtype=precision,
        attention_slice=attention_slice,
    )
    return 0


def animate(
    source: Annotated[Positional[Path | None], tyro.conf.arg(metavar="OBJECT")] = None,
    /,
    *,
    out: Path,
    material: str | None = None,
    config: Path | None = None,
    seed: int | None = None,
    width: int | None = None,
    height: int | None = None,
    frames: int | None = None,
    splats: int | None = None,
    stepping: Literal["adaptive", "fixed", "implicit"] | None = None,
    substep: float | None = None,
    unsafe_dt: bool = False,
    tolerance: float | None = None,
    up: Literal["auto", "x", "-x", "y", "-y", "z", "-z"] | None = None,
    crop: bool = False,
    save_splats: bool = False,
    settings: Settings = (),
    quiet: bool = False,
    json: bool = False,
    overwrite: bool = False,
) -> int:
    """Move an object as its material would.

    For example: jaxphys animate ball.ply --set youngs_modulus=2e4 --out outputs/ball

    Args:
        source: Splats (.ply), a mesh (.obj, .glb), a directory made by generate, or the folder of a
            trained model (point_cloud/iteration_N/point_cloud.ply, cameras.json).
        out: Directory for everything that is made: new, empty, or of an earlier run.
        material: What it is made of; `jaxphys materials` lists them. Default: jelly.
        config: Scene file, ours or PhysGaussian's, in place of the material's own scene.
        seed: Of every random choice. Default: 0.
        width: Of the video [pixels]. Default: 1958.
        height: Of the video [pixels]. Default: 1090.
        frames: Number of pictures. Default: the scene's, mostly 48.
        splats: Number of Gaussians that a mesh becomes. Default: 20000.
        stepping: Time steps that adapt to what the motion allows, equal ones, or implicit ones for
            stiff matter in slow motion (`jaxphys plan` says what pays). Default: adaptive.
        substep: Time step [s], which makes steps equal. Default: as large as is safe.
        unsafe_dt: Take --substep even if it is beyond what is stable.
        tolerance: Relative error of the motion that is allowed, such as 0.03: pilots on coarse
            grids say which grid that needs, or why nothing can be said.
        up: The axis of the file that points upwards, or auto: as the photographs of a trained
            model say. Default: z.
        crop: Leave out what of a capture is not its object: background and floaters.
        save_splats: Also write one .ply for each picture.
        settings: Any field of the scene by its path in the file, or a parameter or field of the
            first object for short, once or more: youngs_modulus=2e4, boundaries.0.friction=0.2.
        quiet: Show no progress.
        json: Print what was made, as JSON.
        overwrite: Replace the files of an earlier run of another request, and only these.
    """
    from jaxphys.cli.made import tell
    from jaxphys.cli.scenes import (
        as_captured,
        files_read,
        scene_file,
        scene_for,
        stepping_for,
        with_source,
    )
    from jaxphys.cli.settings import with_settings
    from jaxphys.pipeline.animate import animate as run

    config = scene_file(config, material, source)
    changes = {"seed": seed, "width": width, "height": height, "frames": frames, "substep": substep}
    changes |= stepping_for(stepping, substep)
    scene = scene_for(config, material, changes, source)
    if unsafe_dt:
        scene = scene_for(None, None, {"unsafe_substep": True}, base=scene)
    scene = with_settings(as_captured(scene, source, up, crop, config is None), settings)
    scene, beside = with_source(scene, source, config, splats)
    made = run(
        scene,
        out,
        beside=beside,
        save_splats=save_splats,
        overwrite=overwrite,
        inputs=files_read(config, source),
        progress=not quiet,
        tolerance=tolerance,
        tell=lambda line: print(line, file=sys.stderr),
    )
    tell(made, json)
    return 0


def splat(
    mesh: Annotated[Positional[Path], tyro.conf.arg(metavar="MESH")],
    /,
    *,
    out: Path,
    count: int = 20_000,
    seed: int = 0,
    overwrite: bool = False,
) -> int:
    """Turn a textured mesh into Gaussians.

    For example: jaxphys splat mesh.glb --out mesh.ply

    Args:
        mesh: A .obj or .glb file.
        out: The .ply (or .splat) file to write.
        count: Number of Gaussians.
        seed: Of the random points.
        overwrite: Replace the file if it is there.
    """
    from jaxphys.pipeline.convert import splat_mesh

    splat_mesh(mesh, out, count=count, seed=seed, overwrite=overwrite)
    return 0


def render(
    file: Annotated[Positional[Path], tyro.conf.arg(metavar="FILE.ply")],
    /,
    *,
    out: Path,
    azimuth: float = -60.0,
    elevation: float = 14.0,
    distance: float | None = None,
    field_of_view: float = 40.0,
    width: int = 960,
    height: int = 540,
    views: int = 24,
    background: tuple[float, float, float] = (1.0, 1.0, 1.0),
    overwrite: bool = False,
) -> int:
    """Draw splats: one picture, or a turn around them.

    For example: jaxphys render ball.ply --out ball.png

    Args:
        file: Splats.
        out: A .png file, or a directory for a full turn.
        azimuth: Degrees about z; 0 looks from +x.
        elevation: Degrees above the horizon.
        distance: From the middle, in the file's units. Default: all is in the picture.
        field_of_view: Horizontal, degrees.
        width: Pixels.
        height: Pixels.
        views: Number of pictures of the turn.
        background: Red, green, blue in [0, 1].
        overwrite: Replace the picture, or the pictures of an earlier turn, and only these.
    """
    from jaxphys.pipeline.convert import render_file
    from jaxphys.scene.scene import View

    try:
        view = View(azimuth, elevation, distance, field_of_view=field_of_view)
    except InputError as error:
        raise InputError(f"--{error}") from None
    render_file(
        file,
        out,
        view,
        width=width,
        height=height,
        views=views,
        background=background,
        overwrite=overwrite,
    )
    return 0


def plan(
    scene: Annotated[Positional[Path | None], tyro.conf.arg(metavar="SCENE|OBJECT")] = None,
    /,
    *,
    material: str | None = None,
    object: Path | None = None,
    settings: Settings = (),
    tolerance: float | None = None,
    measure: bool = True,
    json: bool = False,
) -> int:
    """Tell what a scene needs, what is left out of its program and why, the time step and its
    bound.

    For example: jaxphys plan --material sand --set domain.spacing=0.03

    Args:
        scene: A scene file, ours or PhysGaussian's; or an object or a directory, for the scene
            that animate moves it in.
        material: What it is made of, as for animate.
        object: The object to plan a scene file with; without it, a ball of the same size stands in.
        settings: As for animate.
        tolerance: Plan the grid that this relative error of the motion needs, found by pilots on
            coarse grids.
        measure: Compile the programs and run each for a second, to tell the time they will take.
        json: Print JSON.
    """
    from jaxphys.cli.scenes import is_object, scene_file, scene_for, with_source
    from jaxphys.cli.settings import with_settings
    from jaxphys.pipeline.plan import as_text, make_plan

    config = scene
    if scene is not None and is_object(scene):
        if object is not None:
            raise InputError(f"--object: {scene} is an object already; name one of them")
        config, object = None, scene
    config = scene_file(config, material, object)
    asked = with_settings(scene_for(config, material, {}, object), settings)
    asked, beside = with_source(asked, object, config, None, required=False)
    made = make_plan(
        asked,
        beside,
        measure=measure,
        tolerance=tolerance,
        tell=lambda line: print(line, file=sys.stderr),
    )
    print(as_text(made, as_json=json))
    return 0


def materials(*, json: bool = False, markdown: bool = False) -> int:
    """List the materials, their parameters and defaults.

    For example: jaxphys materials --json

    Args:
        json: Print JSON.
        markdown: Print tables, as docs/materials.md has them.
    """
    from jaxphys.cli.listing import materials_markdown, materials_text

    if json and markdown:
        raise InputError("--json, --markdown: ask for one of them")
    print(materials_markdown() if markdown else materials_text(as_json=json))
    return 0


def doctor() -> int:
    """Check the installed JAX against known answers; status 1 if one is wrong.

    For example: jaxphys doctor
    """
    from jaxphys.cli.doctor import report

    text, healthy = report()
    print(text)
    return 0 if healthy else 1
