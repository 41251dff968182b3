"""A frame of a simulation as an image: particles move Gaussians, Gaussians become splats,
splats pixels.
"""

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.core.splats import Splats
from jaxphys.gaussians.colour import regularise
from jaxphys.gaussians.gaussians import Gaussians, concatenate, to_splats
from jaxphys.pipeline.deform import bake, deform
from jaxphys.render.camera import Camera, position
from jaxphys.render.renderer import Image, render
from jaxphys.render.settings import Settings
from jaxphys.scene.build import Simulation

SETTINGS = Settings()


def frame_splats(
    simulation: Simulation, positions: Array, deformations: Array, eye: Array
) -> Splats:
    """What is drawn of one frame.

    Args:
        simulation: whose Gaussians move.
        positions, deformations: of the particles that carry them, (K, 3) [m] and (K, 3, 3).
        eye: where the camera stands (3,) [m].
    """
    splats = deform(simulation.gaussians, positions, deformations, eye)
    if simulation.colours is not None:
        parts = [
            regularise(splats.colours[start:stop], limits)
            for (start, stop), limits in zip(
                simulation.scene_objects, simulation.colours, strict=True
            )
        ]
        splats = splats._replace(colours=jnp.concatenate(parts))
    if simulation.still is not None:
        rest = to_splats(simulation.still, eye)
        splats = jax.tree.map(lambda *both: jnp.concatenate(both), splats, rest)
    return splats


def draw(
    simulation: Simulation,
    positions: Array,
    deformations: Array,
    camera: Camera,
    *,
    background=1.0,
    settings: Settings = SETTINGS,
    capacity: int | None = None,
) -> Image:
    """One frame as an image; differentiable.

    Args:
        simulation: whose Gaussians move.
        positions, deformations: either of the particles that carry Gaussians, (K, 3) [m] and
            (K, 3, 3), or of all particles, (N, 3) and (N, 3, 3), as `rollout_frames` gives them.
        camera, background, settings, capacity: as in `jaxphys.render.render`.
    """
    if positions.shape[0] != simulation.gaussians.count:
        positions = positions[simulation.particles]
        deformations = deformations[simulation.particles]
    splats = frame_splats(simulation, positions, deformations, position(camera))
    return render(splats, camera, background=background, settings=settings, capacity=capacity)


def deformed_gaussians(simulation: Simulation, positions: Array, deformations: Array) -> Gaussians:
    """One frame as Gaussians that can be written to a file."""
    moved = bake(simulation.gaussians, positions, deformations)
    return moved if simulation.still is None else concatenate([moved, simulation.still])
