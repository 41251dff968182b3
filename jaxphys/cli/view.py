"""`jaxphys view`."""

import webbrowser
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from jaxphys.cli.commands import Settings


def view(
    source: Annotated[Positional[Path], tyro.conf.arg(metavar="FILE|DIR|SCENE.json")],
    /,
    *,
    material: str | None = None,
    settings: Settings = (),
    nodes: int = 50_000,
    splats: int = 8_000,
    port: int = 0,
    open: bool = True,
) -> int:
    """Look at an object that moves, poke and pull it, change what it is made of; in the browser.

    For example: jaxphys view ball.ply --material jelly

    Serves this machine alone, until Ctrl-C. Needs the extra `viewer`.

    Args:
        source: Splats or a mesh, in the scene of its material; a scene file; or a finished run,
            which is played again.
        material: What it is made of. Default: jelly, or what the scene says.
        settings: As for animate.
        nodes: Of the grid, at most; a scene with more runs here on a coarser one.
        splats: Of each object, at most.
        port: Of the server; 0: a free one.
        open: Open the browser.
    """
    from jaxphys.cli.scenes import is_object, scene_file, scene_for, with_source
    from jaxphys.cli.settings import with_settings
    from jaxphys.core.errors import InputError
    from jaxphys.viewer.serve import view_run, view_scene

    if not source.exists():
        raise InputError(f"{source}: no such file or folder")
    if not 0 <= port < 65536:
        raise InputError(f"--port: {port} must be between 0 and 65535")
    if nodes < 4096:
        raise InputError(f"--nodes: {nodes} must be at least 4096")
    if splats < 1:
        raise InputError(f"--splats: {splats} must be at least 1")

    def tell(address: str) -> None:
        print(f"{address}  (Ctrl-C ends it)", flush=True)
        if open:
            webbrowser.open(address)

    try:
        if (source / "motion.mp4").is_file():
            if material is not None or settings:
                raise InputError(
                    f"{source}: is a finished run; name its config.json to change what it is"
                )
            view_run(source, port=port, tell=tell)
        else:
            config, thing = (None, source) if is_object(source) else (source, None)
            config = scene_file(config, material, thing)
            scene = with_settings(scene_for(config, material, {}, thing), settings)
            scene, beside = with_source(scene, thing, config, None)
            view_scene(scene, beside, port=port, nodes=nodes, gaussians=splats, tell=tell)
    except KeyboardInterrupt:
        return 0
    return 0
