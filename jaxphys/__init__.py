"""Text, meshes or splats to 3D Gaussians that move as their material would, differentiable end to
end.

The names below are loaded when first used, so that `import jaxphys` is quick.
"""

import importlib
import importlib.metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .core.ensemble import over_devices as over_devices
    from .core.errors import InputError as InputError
    from .fitting.fit import fit as fit
    from .gaussians.gaussians import Gaussians as Gaussians
    from .mpm.loop.adjoint import Checkpointed as Checkpointed
    from .mpm.loop.adjoint import Plain as Plain
    from .mpm.loop.adjoint import Truncated as Truncated
    from .mpm.loop.frames import rollout_frames as rollout_frames
    from .mpm.loop.status import SimulationError as SimulationError
    from .mpm.materials.deriving import law_of_gradient as law_of_gradient
    from .mpm.materials.deriving import law_of_stretches as law_of_stretches
    from .mpm.materials.deriving import law_of_volume as law_of_volume
    from .mpm.materials.parameters import Parameter as Parameter
    from .mpm.materials.registering import register_material as register_material
    from .mpm.motion import Frame as Frame
    from .mpm.motion import Motion as Motion
    from .mpm.simulation import Simulation as Simulation
    from .mpm.stepping import Adaptive as Adaptive
    from .mpm.stepping import Fixed as Fixed
    from .mpm.stepping import Implicit as Implicit
    from .pipeline.animate import animate as animate
    from .pipeline.draw import draw as draw
    from .pipeline.frames import frames as frames
    from .pipeline.frames import simulate as simulate
    from .pipeline.generate import generate as generate
    from .pipeline.tolerance import plan_for as plan_for
    from .render.camera import look_at as look_at
    from .render.camera import orbit as orbit
    from .render.renderer import render as render
    from .scene.build import build as build
    from .scene.defaults import default_scene as default_scene
    from .scene.look import Look as Look
    from .scene.read import read_scene as read_scene
    from .scene.scene import Object as Object
    from .scene.scene import Scene as Scene
    from .scene.source import load as load

_HOMES = {
    "over_devices": "core.ensemble",
    "InputError": "core.errors",
    "fit": "fitting.fit",
    "Gaussians": "gaussians.gaussians",
    "Checkpointed": "mpm.loop.adjoint",
    "Plain": "mpm.loop.adjoint",
    "Truncated": "mpm.loop.adjoint",
    "rollout_frames": "mpm.loop.frames",
    "law_of_gradient": "mpm.materials.deriving",
    "law_of_stretches": "mpm.materials.deriving",
    "law_of_volume": "mpm.materials.deriving",
    "Parameter": "mpm.materials.parameters",
    "register_material": "mpm.materials.registering",
    "Frame": "mpm.motion",
    "Motion": "mpm.motion",
    "SimulationError": "mpm.loop.status",
    "Simulation": "mpm.simulation",
    "Adaptive": "mpm.stepping",
    "Fixed": "mpm.stepping",
    "Implicit": "mpm.stepping",
    "animate": "pipeline.animate",
    "draw": "pipeline.draw",
    "frames": "pipeline.frames",
    "simulate": "pipeline.frames",
    "generate": "pipeline.generate",
    "plan_for": "pipeline.tolerance",
    "look_at": "render.camera",
    "orbit": "render.camera",
    "render": "render.renderer",
    "build": "scene.build",
    "default_scene": "scene.defaults",
    "Look": "scene.look",
    "read_scene": "scene.read",
    "Object": "scene.scene",
    "Scene": "scene.scene",
    "load": "scene.source",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.metadata.version("jaxphys-splats")
    if name not in _HOMES:
        raise AttributeError(f"module 'jaxphys' has no attribute {name!r}")
    return getattr(importlib.import_module(f"jaxphys.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*_HOMES, "__version__"])
