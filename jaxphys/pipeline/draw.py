"""A frame of a motion as an image: particles move Gaussians, Gaussians become splats, splats
pixels.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.program import part
from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.core.splats import Splats
from jaxphys.gaussians.colour import regularise
from jaxphys.gaussians.gaussians import Gaussians, concatenate, to_splats, transform
from jaxphys.mpm.motion import Frame
from jaxphys.mpm.state import OK
from jaxphys.pipeline.deform import bake, deform
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import Image, render
from jaxphys.render.settings import Settings
from jaxphys.scene.look import Look

SETTINGS = Settings(depth=False)  # films and fits look at colours


def frame_splats(look: Look, frame: Frame, eye: Array) -> Splats:
    """What is drawn of one frame.

    Args:
        look: whose Gaussians move.
        frame: where their particles are.
        eye: where the camera stands (3,) [m].

    Raises:
        InputError: the frame carries another number of points than the look has Gaussians.
        SimulationError: the simulation had failed by then.
    """
    frame.check()
    splats = deform(look.gaussians, *frame.carried(), eye)
    if look.colours is not None:
        with part("colour regularisation"):
            regular = [
                regularise(splats.colours[start:stop], limits)
                for (start, stop), limits in zip(look.objects, look.colours, strict=True)
            ]
            splats = splats._replace(colours=jnp.concatenate(regular))
    if look.still is not None:
        with part("still Gaussians"):
            rest = to_splats(look.still, eye)
            splats = jax.tree.map(lambda *both: jnp.concatenate(both), splats, rest)
    if look.solids:
        with part("obstacles"):
            rest = [to_splats(one, eye) for one in placed_solids(look, frame)]
            splats = jax.tree.map(lambda *all: jnp.concatenate(all), splats, *rest)
    return splats


def placed_solids(look: Look, frame: Frame) -> list[Gaussians]:
    """The obstacles that are drawn, where they are at the time of a frame."""
    placed = []
    for gaussians, obstacle in look.solids:
        if obstacle.free and frame.body is not None:
            centre, orientation = frame.body
        else:
            centre, orientation, *_ = obstacle.pose(frame.time)
        turn = quaternion_to_matrix(orientation)
        placed.append(transform(gaussians, rotation=turn, translation=centre))
    return placed


def draw(
    look: Look,
    frame: Frame,
    camera: Camera,
    *,
    background=1.0,
    settings: Settings = SETTINGS,
    capacity: int | None = None,
) -> Image:
    """One frame as an image; differentiable.

    Inside jit, where a failure cannot be raised, the picture of a failed frame is NaN.

    Args:
        look: whose Gaussians move.
        frame: of a motion, such as `motion[-1]`.
        camera, background, settings, capacity: as in `jaxphys.render.render`.

    Raises:
        InputError: the frame carries another number of points than the look has Gaussians.
        SimulationError: the simulation had failed by then.
    """
    splats = frame_splats(look, frame, position(camera))
    image = render(splats, camera, background=background, settings=settings, capacity=capacity)
    # What is not a number is not drawn: without this a failure would be an empty picture.
    sound = jnp.where(frame.status.code == OK, 1, jnp.nan).astype(image.colour.dtype)
    return image._replace(colour=image.colour * sound)


def deformed_gaussians(look: Look, frame: Frame) -> Gaussians:
    """One frame as Gaussians that can be written to a file. Raises as `frame_splats` does."""
    frame.check()
    moved = bake(look.gaussians, *frame.carried())
    still = [] if look.still is None else [look.still]
    rest = [*still, *placed_solids(look, frame)]
    return concatenate([moved, *rest]) if rest else moved
