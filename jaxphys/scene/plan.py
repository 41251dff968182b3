"""What a scene needs and nothing else: said before it runs."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import jax
import numpy as np

from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.mpm.materials import MATERIALS
from jaxphys.scene.build import Simulation, build_with_bounds
from jaxphys.scene.scene import Scene
from jaxphys.scene.source import load_object

# Measured on two x86-64 cores with AVX-512, float32; for orientation only.
PARTICLE_STEPS_A_SECOND = 2.2e6
NODE_STEPS_A_SECOND = 2e8
PIXELS_A_SECOND = 6e6
SPLATS_A_SECOND = 4e5
COMPILE_SECONDS = 12.0


@dataclass(frozen=True)
class Plan:
    """What `jaxphys plan` prints.

    Attributes:
        included: part of the program -> why.
        left_out: part -> why.
        particles, gaussians, grid: sizes.
        substep: time step [s]; `bounds` [s] and `reason`: what limits it.
        steps_per_frame, frames, steps: counts.
        memory: bytes by what they hold.
        seconds: estimate by stage, on two CPU cores.
    """

    included: dict[str, str]
    left_out: dict[str, str]
    particles: int
    gaussians: int
    grid: tuple[int, int, int]
    substep: float
    bounds: dict[str, float]
    reason: str
    steps_per_frame: int
    frames: int
    steps: int
    memory: dict[str, int]
    seconds: dict[str, float]


def ball(count: int = 4000) -> Gaussians:
    """A grey ball of unit diameter on whose surface `count` Gaussians lie (a Fibonacci
    lattice).
    """
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    turn = np.pi * (1 + 5**0.5) * index
    ring = np.sqrt(1 - z**2)
    points = 0.5 * np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    size = 0.5 * np.sqrt(np.pi / count)
    return from_points(points.astype(np.float32), np.array([0.6, 0.6, 0.6]), size)


def _parts(scene: Scene, simulation: Simulation) -> tuple[dict[str, str], dict[str, str]]:
    laws = [law for law, _, _ in simulation.config.segments]
    names = {law.name for law in laws}
    materials = {thing.material for thing in scene.objects}
    included = {f"law {law.name}": "an object is made of it" for law in laws}
    left_out = {
        f"law {material.law.name}": "no object is made of it"
        for material in MATERIALS.values()
        if material.law.name not in names
    }

    def decide(name: str, wanted: bool, why: str, why_not: str) -> None:
        (included if wanted else left_out)[name] = why if wanted else why_not

    plastic = any(law.plastic for law in laws)
    spectral = any(law.name != "neo-Hookean" for law in laws)
    decide("return map", plastic, "a law is plastic", "no law is plastic")
    decide("eigen-decomposition", spectral, "a law works on principal strains", "no law needs one")
    decide(
        "second deformation gradient",
        simulation.config.keeps_total,
        "plastic flow must be seen in the splats",
        "elastic and total deformation are the same"
        if not plastic
        else "splats follow the elastic one",
    )
    decide("history", simulation.config.history_rows > 0, "a law remembers", "no law remembers")
    for i, boundary in enumerate(scene.boundaries):
        included[f"boundary {i} {boundary.type}"] = "the scene lists it"
    decide("boundaries", bool(scene.boundaries), "see above", "the scene lists none")
    if scene.boundaries:
        included.pop("boundaries")
    decide("damping", scene.damping > 0, f"{scene.damping:g} 1/s", "the scene asks for none")
    decide("gravity", any(scene.gravity), f"{scene.gravity} m/s^2", "is zero")
    decide(
        "filling",
        any(thing.filling is not None for thing in scene.objects),
        "hollow objects get particles inside",
        "no object asks for it",
    )
    degree = simulation.gaussians.degree
    decide(
        "turned view directions",
        degree > 0,
        f"harmonics of degree {degree} depend on them",
        "colours are the same from everywhere",
    )
    decide(
        "colour regularisation", scene.regularise_colours, "the scene asks for it", "switched off"
    )
    decide(
        "drawn floor", scene.ground is not None, "the scene asks for it", "the scene asks for none"
    )
    decide("checkpointed steps", False, "", "no gradient is taken")
    included |= {f"material {name}": MATERIALS[name].description for name in sorted(materials)}
    return included, left_out


def make_plan(scene: Scene, beside: Path | None = None) -> Plan:
    """The plan of a scene; a ball stands in for each object that has no source.

    Args:
        scene: to be planned.
        beside: where relative sources are looked up first.
    """
    objects = tuple(
        ball()
        if thing.source is None
        else load_object(thing, beside, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    )
    simulation, bounds = build_with_bounds(scene, *objects)
    return describe(scene, simulation, bounds)


def describe(scene: Scene, simulation: Simulation, bounds) -> Plan:
    """The plan of a scene that is built already, with the bounds of its time step."""
    included, left_out = _parts(scene, simulation)
    particles, drawn = simulation.config.particles, simulation.gaussians.count
    nodes = int(np.prod(simulation.config.grid.shape))
    steps = simulation.steps * (scene.frames - 1)
    limits = {name: float(getattr(bounds, name)) for name in bounds._fields if name != "reason"}
    pixels = scene.width * scene.height
    state = sum(leaf.nbytes for leaf in jax.tree.leaves(simulation.state))
    model = sum(leaf.nbytes for leaf in jax.tree.leaves(simulation.model))
    return Plan(
        included=included,
        left_out=left_out,
        particles=particles,
        gaussians=drawn,
        grid=simulation.config.grid.shape,
        substep=simulation.dt,
        bounds=limits,
        reason=str(bounds.reason),
        steps_per_frame=simulation.steps,
        frames=scene.frames,
        steps=steps,
        memory={
            "state and parameters": state + model,
            "grid": 16 * nodes,
            "transfers": 27 * 16 * particles,
            "motion": 48 * drawn * scene.frames,
            "picture": 32 * pixels,
        },
        seconds={
            "compile": COMPILE_SECONDS,
            "simulate": steps * (particles / PARTICLE_STEPS_A_SECOND + nodes / NODE_STEPS_A_SECOND),
            "render": scene.frames * (pixels / PIXELS_A_SECOND + drawn / SPLATS_A_SECOND),
        },
    )


def as_text(plan: Plan, as_json: bool = False) -> str:
    """The plan for people, or as JSON."""
    if as_json:
        return json.dumps(asdict(plan), indent=2)
    lines = ["in:"]
    lines += [f"  {name}: {why}" for name, why in plan.included.items()]
    lines += ["left out:"]
    lines += [f"  {name}: {why}" for name, why in plan.left_out.items()]
    grid = " x ".join(str(side) for side in plan.grid)
    lines += [
        f"particles: {plan.particles} ({plan.gaussians} carry Gaussians), grid {grid}",
        f"time step: {plan.substep:.3e} s, limited by {plan.reason}",
        *(f"  bound {name}: {value:.3e} s" for name, value in plan.bounds.items()),
        f"steps: {plan.steps_per_frame} a frame, {plan.frames} frames, {plan.steps} in all",
        "memory: " + ", ".join(f"{k} {v / 2**20:.1f} MiB" for k, v in plan.memory.items()),
        "time on two cores, roughly: "
        + ", ".join(f"{name} {seconds:.0f} s" for name, seconds in plan.seconds.items()),
    ]
    return "\n".join(lines)
