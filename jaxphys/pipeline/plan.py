"""What a run's programs hold and nothing else: read off the programs themselves, before they run.

Parts are marked where they are traced (`core.program.part`); the plan traces the step and the
picture of the very simulation that would run, and finds the marks.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.core.program import parts
from jaxphys.gaussians.gaussians import Gaussians, from_points, transform
from jaxphys.mpm.loop.chunks import cuts
from jaxphys.mpm.loop.frames import slabs_for
from jaxphys.mpm.loop.halo import sent_bytes
from jaxphys.mpm.loop.implicit.step import check_implicit, implicit_step
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.stepping import Adaptive, Implicit
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.stepping.choice import which_stepping
from jaxphys.pipeline.film import drawn_at_once, picture, surroundings_of
from jaxphys.pipeline.memory import expected, room
from jaxphys.pipeline.pace import drawing_pace, pace
from jaxphys.pipeline.tolerance import before_text, plan_for
from jaxphys.render.camera import orbit
from jaxphys.scene.build import Built, build
from jaxphys.scene.obstacles import located
from jaxphys.scene.place import rotation_matrix
from jaxphys.scene.scene import Object, Scene
from jaxphys.scene.source import load_object

# Optional parts that any program may hold: why it does, and why not. Laws and boundaries, of which
# there are more, say themselves what they are.
OPTIONAL: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "gravity": ("the scene has it", "is zero"),
        "eigen-decomposition": ("a law works on principal strains", "no law needs one"),
        "polar rotation": (
            "a law or turned colours need the rotation of F",
            "neither laws nor colours need it",
        ),
        "return map": ("a law is plastic", "no law is plastic"),
        "viscosity": ("a fluid has it", "no fluid has any"),
        "history": ("a law remembers", "no law remembers"),
        "mean volume": ("an object takes its neighbours'", "no object asks for it"),
        "implicit step": ("the scene asks for it", "steps are explicit"),
        "second deformation gradient": (
            "plastic flow must be seen in the splats",
            "splats follow the gradient that the laws see",
        ),
        "compensated sums": (
            "float32 would round small steps away",
            "float64 has digits to spare",
        ),
        "velocity of its own": (
            "the transfer lets particles keep one",
            "particles move as the grid does",
        ),
        "contact": (
            "a boundary pushes particles at their distance",
            "no boundary touches particles",
        ),
        "friction": ("a boundary is rough", "no boundary is rough"),
        "contact between objects": (
            "the scene asks for it; each has a velocity field of its own",
            "objects that meet share one velocity field",
        ),
        "turned view directions": (
            "harmonics depend on them",
            "colours are the same from everywhere",
        ),
        "colour regularisation": ("the scene asks for it", "switched off"),
        "drawn floor": ("the scene asks for it", "the scene asks for none"),
        "obstacles": (
            "the scene has some that keep matter out",
            "the scene has none, or hides them",
        ),
        "rigid body": ("an obstacle is free", "no obstacle is free"),
        "still Gaussians": ("some are drawn that do not move", "all of them move"),
    }
)


@dataclass(frozen=True)
class Plan:
    """What `jaxphys plan` prints.

    Attributes:
        included: part of the program -> why.
        left_out: part -> why.
        particles, gaussians, grid: sizes; window: of the grid, the part that the first frame
            computes.
        devices: how many share the particles; chunk: particles computed together, at most; slab:
            planes of the window that each has of its own, or None where each has all; sent: bytes
            that a device sends to others in a step.
        pictures: frames drawn at once, each on a device of its own.
        stepping: how a frame is stepped through; advice: which way is cheaper, and why.
        substep: time step [s], of fixed steps; `bounds` [s] and `reason`: what limits it.
        steps_per_frame, frames, steps: counts, of fixed steps; those that adapt are not known
            before they are taken.
        memory: bytes at the peak, by what they hold; room: bytes that there are, if known.
        seconds: estimate by stage, from a second of each on this machine (`measured`); None where
            nobody measured.
    """

    included: dict[str, str]
    left_out: dict[str, str]
    particles: int
    gaussians: int
    grid: tuple[int, int, int]
    window: tuple[int, int, int]
    devices: int
    chunk: int
    slab: int | None
    sent: int
    pictures: int
    stepping: str
    advice: str
    substep: float
    bounds: dict[str, float]
    reason: str
    steps_per_frame: int
    frames: int
    steps: int
    memory: dict[str, int]
    room: int | None = None
    seconds: dict[str, float] | None = None


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


def stand_in(thing: Object, where: str) -> Gaussians:
    """A ball for an object that has no source yet, inside its `area` if it has one."""
    if thing.area is None:
        return ball()
    low, high = np.array(thing.area[0::2]), np.array(thing.area[1::2])
    # The area is that of the turned source.
    centre = rotation_matrix(thing, where).T @ ((low + high) / 2)
    diameter = 0.9 * float(np.min(high - low))
    return transform(ball(), scale=diameter, translation=centre)


def program_parts(scene: Scene, built: Built) -> dict[str, int]:
    """Marked parts of the step and of the picture, with the number of primitives of each."""
    simulation, look = built
    state = simulation.state
    advance = partial(step, simulation.config)
    if isinstance(simulation.stepping, Implicit):
        advance = partial(implicit_step, simulation.config, stepping=simulation.stepping)
    found = parts(advance, simulation.model, state, simulation.dt)
    dtype = state.position.dtype
    somewhere = partial(orbit, (0.0, 0.0, 0.0), width=scene.width, height=scene.height)
    camera = jax.eval_shape(lambda: somewhere(1.0, 0.0, 0.0))
    paint = partial(picture, surroundings=surroundings_of(scene), capacity=1024)
    frame = jax.eval_shape(lambda s: s.frame(s.state, s.carriers), simulation)
    shown = parts(paint, look, frame, camera, jnp.zeros(2, dtype), jnp.ones((), dtype))
    return {name: found.get(name, 0) + shown.get(name, 0) for name in {**found, **shown}}


def make_plan(
    scene: Scene,
    beside: Path | None = None,
    *,
    measure: bool = False,
    tolerance: float | None = None,
    tell: Callable[[str], None] | None = None,
) -> Plan:
    """The plan of a scene's film; a ball stands in for each object that has no source.

    Args:
        scene: to be planned.
        beside: where relative sources are looked up first.
        measure: compile its programs and run each for a second, for the time it will take.
        tolerance: plan the scene on the grid that this relative error of its motion asks for; takes
            pilots, see `pipeline.tolerance`.
        tell: gets what the pilots found, as a line.

    Raises:
        InputError: the scene cannot be built, or not be held to the tolerance.
    """
    scene = scene.filmed()
    objects = tuple(
        stand_in(thing, f"objects[{i}]")
        if thing.source is None
        else load_object(thing, beside, scene.seed + i, f"objects[{i}]")
        for i, thing in enumerate(scene.objects)
    )
    scene = located(scene, beside)
    if tolerance is None:
        built = build(scene, *objects)
    else:
        chosen = plan_for(scene, objects, tolerance)
        scene, built = chosen.scene, chosen.built
        if tell is not None:
            tell(before_text(chosen))
    plan = replace(describe(scene, built), room=room())
    return measured(scene, built, plan) if measure else plan


def measured(scene: Scene, built: Built, plan: Plan) -> Plan:
    """The plan with how long its run will take on this machine.

    Steps that adapt are taken to be as many as equal ones, and the motion to stay in its first
    window: pilots (`tolerance`) know better.
    """
    simulation, _ = built
    stepping = pace(simulation)
    compiled, a_picture = drawing_pace(scene, built)
    count = simulation.steps * (scene.frames - 1)
    if isinstance(simulation.stepping, Implicit):
        count = plan.steps
    seconds = {
        "compile": stepping.compile + compiled,
        "simulate": count * stepping.step,
        "render": scene.frames * a_picture,
    }
    return replace(plan, seconds=seconds)


def _facts(scene: Scene, built: Built) -> tuple[dict[str, str], dict[str, str]]:
    """Parts in and parts left out, each with the reason."""
    found = program_parts(scene, built)
    included, left_out = {}, {}
    running = {law for law, _, _ in built.simulation.config.segments}
    for name in sorted(name for name in found if name.startswith("law ")):
        included[name] = "an object is made of it"
    for law in dict.fromkeys(material.law for material in MATERIALS.values()):
        if running.isdisjoint({law, *(simpler for _, simpler in law.without)}):
            left_out[f"law {law.name}"] = "no object is made of it"
    for name in sorted({name for law in running for name in law.omits}):
        left_out[name] = "is zero"
    for name in sorted(name for name in found if name.startswith("boundary ")):
        included[name] = "the scene lists it"
    if not any(name.startswith("boundary ") for name in found):
        left_out["boundaries"] = "the scene lists none"
    for name, (why, why_not) in OPTIONAL.items():
        if name in found:
            included[name] = why
        else:
            left_out[name] = why_not
    filled = built.simulation.config.particles > len(built.simulation.carriers)
    if filled:
        included["filling"] = "hollow objects get particles inside"
    else:
        left_out["filling"] = "every particle carries a Gaussian"
    if any(built.look.lone):
        left_out["lone splats"] = f"{sum(built.look.lone)} lie apart from their object"
    for name in sorted({thing.material for thing in scene.objects}):
        included[f"material {name}"] = MATERIALS[name].description
    return included, left_out


def describe(scene: Scene, built: Built) -> Plan:
    """The plan of a scene that is built already."""
    simulation, look = built
    included, left_out = _facts(scene, built)
    bounds = largest_stable_dt(simulation.config, simulation.model, simulation.state)
    reason = bounds.reason if scene.substep is None else "the scene's own substep"
    slabs = slabs_for(simulation.stepping)
    first = windowed(simulation.config, simulation.state, slabs=slabs)
    placement = simulation.config.placement
    chunk = max(into.size for into in cuts(simulation.config.runs, placement))
    particles, drawn = simulation.config.particles, look.gaussians.count
    advice, substep, a_frame = _steps(simulation)
    steps = a_frame * (scene.frames - 1)
    # What the scene has nothing of sets no bound.
    limits = {k: float(v) for k, v in bounds._asdict().items() if np.isfinite(v)}
    return Plan(
        included=included,
        left_out=left_out,
        particles=particles,
        gaussians=drawn,
        grid=simulation.config.grid.shape,
        window=first.window or first.grid.shape,
        devices=placement.devices,
        chunk=chunk,
        slab=None if first.slabs is None else first.slabs.planes,
        sent=sent_bytes(first),
        pictures=drawn_at_once(scene.frames),
        stepping=_stepping_text(scene),
        advice=advice,
        substep=substep,
        bounds=limits,
        reason=reason,
        steps_per_frame=a_frame,
        frames=scene.frames,
        steps=steps,
        memory=expected(scene, built),
    )


def _stepping_text(scene: Scene) -> str:
    """How a film of this scene is stepped through."""
    stepping = scene.stepping
    if isinstance(stepping, Adaptive):
        return (
            f"adaptive, the bounds looked at again every {stepping.every} steps; "
            "equal ones would be"
        )
    if isinstance(stepping, Implicit):
        method = {1.0: "backward Euler", 0.5: "midpoint"}.get(
            stepping.theta, f"theta {stepping.theta}"
        )
        return f"implicit ({method}), as long as speed and deformation allow, solved for"
    return "fixed"


def _steps(simulation: Simulation) -> tuple[str, float, int]:
    """Which way is cheaper and why; the step [s], and steps a frame.

    Of implicit steps an estimate, from the speeds of the start.
    """
    config, model, state = simulation.config, simulation.model, simulation.state
    steps = simulation.steps
    try:
        check_implicit(replace(config, slabs=None), model)
    except InputError as error:
        return f"only explicit steps will do ({error})", simulation.dt, steps
    choice = which_stepping(config, model, state, simulation.frame_time)
    if not isinstance(simulation.stepping, Implicit):
        return choice.reason, simulation.dt, steps
    count = max(1, math.ceil(simulation.frame_time / choice.length - 1e-9))
    return choice.reason, simulation.frame_time / count, count


def shared(plan: Plan) -> str:
    """How devices share the window, for people."""
    if plan.devices == 1:
        return ""
    sent = f"{plan.sent / 1000:,.0f} kB a device and step"
    if plan.slab is None:
        return f"; each has the window as a whole and adds its own to the others', {sent}"
    return f"; each has {plan.slab} planes of the window and tells its neighbours, {sent}"


def memory_text(plan: Plan) -> str:
    """What the peak is made of, and whether there is that much."""
    total = sum(plan.memory.values())
    parts = ", ".join(f"{name} {size / 2**20:.1f}" for name, size in plan.memory.items())
    line = f"memory at the peak: {total / 2**20:.0f} MiB ({parts})"
    if plan.room is None:
        return line
    fits = "" if total <= plan.room else ": it does not fit"
    return f"{line}, of {plan.room / 2**20:.0f} MiB{fits}"


def as_text(plan: Plan, as_json: bool = False) -> str:
    """The plan for people, or as JSON."""
    if as_json:
        return json.dumps(asdict(plan), indent=2)
    lines = ["in:"]
    lines += [f"  {name}: {why}" for name, why in plan.included.items()]
    lines += ["left out:"]
    lines += [f"  {name}: {why}" for name, why in plan.left_out.items()]
    grid, window = (" x ".join(map(str, shape)) for shape in (plan.grid, plan.window))
    part = "" if plan.window == plan.grid else f", of which {window} at a time"
    at_once = "frames drawn one by one"
    if plan.pictures > 1:
        at_once = f"{plan.pictures} frames drawn at once, one on each"
    lines += [
        f"particles: {plan.particles} ({plan.gaussians} carry Gaussians), grid {grid}{part}",
        f"devices: {plan.devices}, particles in chunks of {plan.chunk}{shared(plan)}; {at_once}",
        f"stepping: {plan.stepping}",
        f"  {plan.advice}",
        f"time step: {plan.substep:.3e} s, limited by {plan.reason}",
        *(f"  bound {name}: {value:.3e} s" for name, value in plan.bounds.items()),
        f"steps: {plan.steps_per_frame} a frame, {plan.frames} frames, {plan.steps} in all",
        memory_text(plan),
    ]
    if plan.seconds is not None:
        lines.append(
            "time on this machine, roughly: "
            + ", ".join(f"{name} {seconds:.1f} s" for name, seconds in plan.seconds.items())
        )
    return "\n".join(lines)
