"""What is differentiated: a small block through scenes in JSON, one axis changed at a time."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.mpm.loop.adjoint import Adjoint, Checkpointed, Plain
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.mpm.simulation import Simulation
from jaxphys.scene.build import build
from jaxphys.scene.json import scene_from_json

SIDE, SPACING, FRAMES = 4, 0.1, 3
FLOOR = {"type": "plane", "point": [0.5, 0.5, 0.27], "normal": [0.05, 0.0, 1.0], "friction": 0.4}
# Each struck or rubbed by the block within the frames, or around it.
BOUNDARIES: dict[str, dict[str, Any]] = {
    "plane": FLOOR,
    "plane that moves": FLOOR | {"velocity": [0.1, 0.0, 0.2]},
    "sticky plane at nodes": FLOOR | {"surface": "sticky"},
    "ball": {"type": "ball", "centre": [0.5, 0.45, 0.12], "radius": 0.15, "friction": 0.3},
    "cuboid that turns": {
        "type": "cuboid",
        "centre": [0.5, 0.5, 0.16],
        "half_size": [0.2, 0.15, 0.1],
        "friction": 0.3,
        "motion": {"type": "steady", "velocity": [0.1, 0.0, 0.1], "spin": [0.0, 0.5, 1.0]},
    },
    "capsule": {
        "type": "capsule",
        "centre": [0.5, 0.5, 0.17],
        "radius": 0.1,
        "half_height": 0.1,
        "orientation": [0.8, 0.6, 0.0, 0.0],
    },
    "impulse": {
        "type": "impulse",
        "centre": [0.45, 0.5, 0.45],
        "half_size": [0.08, 0.1, 0.1],
        "force": [3.0, 0.0, 1.0],
        "duration": 0.01,
    },
    "damping": {"type": "damping", "rate": 20.0},
}
# By how much the start is deformed: nothing, two stretches alike, and past yield.
STARTS = {
    "at rest": np.eye(3),
    "two equal stretches": np.diag([1.01, 1.01, 0.99]),
    "strained": np.array([[1.1, 0.04, 0.0], [0.0, 0.93, 0.03], [0.02, 0.0, 0.98]]),
}
FLUIDS = ("water",)


@dataclass(frozen=True)
class Case:
    """One row: which axis it is about, the scene, the start, how a gradient goes back."""

    axis: str
    name: str
    scene: dict[str, Any] = field(hash=False)
    start: str = "strained"
    adjoint: Adjoint = field(default_factory=Plain)

    @property
    def simulation(self) -> Simulation:
        """In float64, where JAX is set to it."""
        made = build(scene_from_json(self.scene), block()).simulation
        material = self.scene["objects"][0]["material"]
        start = STARTS[self.start]
        if material in FLUIDS:  # whose start must be a multiple of the identity
            start = np.eye(3) * np.cbrt(np.linalg.det(start))
        return made.with_(deformation=start)


def block() -> Gaussians:
    """Gaussians (SIDE^3) on a lattice that is a little out of order."""
    line = np.linspace(-1, 1, SIDE)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points + 0.05 * np.random.default_rng(0).normal(size=points.shape)
    return from_points(points.astype(np.float32), np.full(points.shape, 0.5), 0.3)


def scene(material: str = "elastic", boundary: str = "plane", **changes: Any) -> dict[str, Any]:
    """A scene in JSON."""
    thing: dict[str, Any] = {
        "material": material,
        "size": 0.3,
        "centre": [0.5, 0.5, 0.46],
        "velocity": [0.5, 0.2, -1.5],
        "spin": [1.0, 2.0, -1.0],
        "filling": None,
    }
    return {
        "objects": [thing],
        "boundaries": [BOUNDARIES[boundary]],
        "domain": {"size": [1.0, 1.0, 1.0], "spacing": SPACING},
        "frame_time": 0.01,
        "frames": FRAMES,
    } | changes


def cases() -> list[Case]:
    """Each axis by itself, from an elastic block on a rough plane in equal steps; materials also
    from rest and from two equal stretches.
    """
    found = [Case("material", name, scene(name), start) for name in MATERIALS for start in STARTS]
    found += [Case("boundary", name, scene(boundary=name)) for name in BOUNDARIES]
    for scheme in ("pic", "flip", "apic", "aflip"):
        for kernel in ("quadratic", "cubic"):
            transfer = {"scheme": {"type": scheme}, "kernel": kernel}
            found.append(Case("transfer", f"{scheme}, {kernel}", scene(transfer=transfer)))
    for stepping in ("fixed", "adaptive", "implicit"):
        asked: dict[str, Any] = {"type": stepping}
        if stepping == "implicit":
            asked |= {"tolerance": 1e-12, "reduction": 1e-12}
        found.append(Case("stepping", stepping, scene(stepping=asked)))
    plain = Case("adjoint", "Plain()", scene("metal"))
    found.append(plain)
    for name, adjoint in (
        ("Checkpointed(segments=2)", Checkpointed(segments=2)),
        ("Checkpointed(bytes=...)", Checkpointed(bytes=4_000_000)),
    ):
        found.append(replace(plain, name=name, adjoint=adjoint))
    return found
