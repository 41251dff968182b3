"""Obstacles that are meshes: where their files are, and their signed distances."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.gaussians.mesh import load_mesh
from jaxphys.gaussians.signed_distance import signed_distance
from jaxphys.gaussians.solid_mesh import solid_mesh
from jaxphys.mpm.boundaries import AnyBoundary, MeshObstacle, Samples, Solid
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import find

MARGIN = 2.0  # cells of the solver by which samples go beyond a solid: contact acts within one


def mesh_obstacles(scene: Scene) -> list[int]:
    """Which boundaries of a scene are read from files."""
    return [i for i, one in enumerate(scene.boundaries) if isinstance(one, MeshObstacle)]


def with_sources(scene: Scene, sources: Mapping[int, str]) -> Scene:
    """The scene with other files for the obstacles at these places in its list of boundaries."""
    changed = [
        dataclasses.replace(one, source=sources[i])
        if i in sources and isinstance(one, MeshObstacle)
        else one
        for i, one in enumerate(scene.boundaries)
    ]
    return dataclasses.replace(scene, boundaries=tuple(changed))


def mesh_file(scene: Scene, index: int) -> Path:
    """The file of the obstacle at this place in the list of boundaries.

    Raises:
        InputError: it is missing.
    """
    one = scene.boundaries[index]
    assert isinstance(one, MeshObstacle)
    path = Path(one.source)
    if not path.is_file():
        where = f"boundaries[{index}].source"
        raise InputError(f"{where}: {path}: no such file; name a mesh (.obj, .glb, .stl)")
    return path


def located(scene: Scene, beside: Path | None) -> Scene:
    """The scene with the paths of its obstacles as they are from here; relative ones are looked up
    beside its file first.
    """
    chosen = {i: scene.boundaries[i] for i in mesh_obstacles(scene)}
    found = {
        i: str(find(one.source, beside))
        for i, one in chosen.items()
        if isinstance(one, MeshObstacle)
    }
    return with_sources(scene, found)


def triangles_of(scene: Scene, index: int) -> np.ndarray:
    """The triangles (F, 3, 3) of the file of an obstacle, in its units.

    Raises:
        InputError: it is missing, or no mesh.
    """
    return load_mesh(mesh_file(scene, index)).triangles


def sampled(scene: Scene) -> tuple[AnyBoundary, ...]:
    """The boundaries of a scene, with the signed distances of those that are meshes and have none
    yet.

    Raises:
        InputError: a file is missing, no mesh, or not closed.
    """
    made: list[AnyBoundary] = []
    for i, one in enumerate(scene.boundaries):
        if isinstance(one, MeshObstacle) and one.samples is None:
            margin = MARGIN * scene.domain.spacing / one.size
            try:
                triangles = triangles_of(scene, i)
                samples = Samples(*signed_distance(triangles, one.resolution, margin))
                unit = Solid(*solid_mesh(triangles)) if one.free else None
            except InputError as error:
                where = f"boundaries[{i}].source: "
                told = str(error).removeprefix(where)
                raise InputError(f"{where}{told}") from None
            one = dataclasses.replace(one, samples=samples, unit=unit)
        made.append(one)
    return tuple(made)
