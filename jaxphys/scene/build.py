"""From a scene and Gaussians to what the solver runs and what is drawn of it.

Five steps, each a function: objects are put in their places, become particles, particles become a
model and a state, these get a time step, and the Gaussians become a look.
"""

from dataclasses import dataclass, fields, is_dataclass
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import InputError, shown
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.mpm.boundaries import Damping, Setting, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.implicit.step import check_implicit
from jaxphys.mpm.loop.placement import suited
from jaxphys.mpm.loop.sorting import cell_order, inverse_order
from jaxphys.mpm.materials.catalogue import (
    Material,
    assemble_parameters,
    get_material,
    material_values,
    overridden,
)
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import Config, Model, State, initial_state
from jaxphys.mpm.stepping import Fixed, Implicit
from jaxphys.mpm.stepping.frame_steps import frame_steps
from jaxphys.mpm.transfer.kernels import Kernel
from jaxphys.scene.json import scene_from_json, to_json
from jaxphys.scene.look import Look, look_of
from jaxphys.scene.obstacles import sampled
from jaxphys.scene.place import Placed, place
from jaxphys.scene.scene import Object, Scene
from jaxphys.scene.solids import solids_of


class Built(NamedTuple):
    """A scene ready to run: `simulation, look = build(scene, gaussians)`.

    Attributes:
        simulation: the physics; knows no Gaussians.
        look: what is drawn; knows no particles.
    """

    simulation: Simulation
    look: Look


@dataclass(frozen=True)
class Particles:
    """The matter of one object, in the object's order: its Gaussians, then what fills it.

    Attributes:
        positions: (N, 3) [m]; volumes: (N,) [m^3].
        velocities: (N, 3) [m/s] and velocity_gradients: (N, 3, 3) [1/s], at the start.
        values: of the material's parameters, by name, numbers or (N,).
        carriers: how many of them, from the first on, carry a Gaussian each.
    """

    positions: np.ndarray
    volumes: np.ndarray
    velocities: np.ndarray
    velocity_gradients: np.ndarray
    values: dict[str, Any]
    carriers: int


def validate(scene: Scene) -> None:
    """Refuses what its file could not hold, and materials and parameters that do not exist or are
    out of range, before any work.

    Raises:
        InputError: naming the field.
    """
    try:
        read = scene_from_json(to_json(scene))
    except InputError as error:
        raise InputError(str(error).removeprefix("scene.")) from None
    _refuse_other_kinds(scene, read, "scene")
    scene = read
    for i, thing in enumerate(scene.objects):
        where = f"objects[{i}]"
        try:
            get_material(thing.material)
        except InputError as error:
            raise InputError(f"{where}.material: {error}") from None
        try:
            get_material(thing.material, thing.law)
        except InputError as error:
            raise InputError(f"{where}.law: {error}") from None
        try:
            material = material_of(thing)
        except InputError as error:
            raise InputError(f"{where}.{error}") from None
        for label, parameters in [
            (f"{where}.parameters", thing.parameters),
            *(
                (f"{where}.regions[{k}].parameters", r.parameters)
                for k, r in enumerate(thing.regions)
            ),
        ]:
            try:
                material_values(material, parameters)
            except InputError as error:
                raise InputError(f"{label}: {error}") from None


def _refuse_other_kinds(given: Any, read: Any, where: str) -> None:
    """A dict reads as what it describes, and has none of its functions: refuses it by its name."""
    if is_dataclass(read):
        if type(given) is not type(read):
            raise InputError(f"{where}: is {shown(given)}; give {type(read).__name__}(...)")
        for part in fields(read):
            name = part.name if where == "scene" else f"{where}.{part.name}"
            _refuse_other_kinds(getattr(given, part.name), getattr(read, part.name), name)
    elif isinstance(read, tuple):
        for i, pair in enumerate(zip(given, read, strict=True)):
            _refuse_other_kinds(*pair, f"{where}[{i}]")


def material_of(thing: Object) -> Material:
    """The material of an object, with the law that it asks for."""
    return get_material(thing.material, thing.law, mean_volume=thing.mean_volume)


def solver_grid(scene: Scene) -> Grid:
    """The grid of a scene's domain."""
    return Grid(scene.domain.shape, scene.domain.spacing)


def place_objects(
    scene: Scene, objects: tuple[Gaussians, ...], most: int | None = None
) -> tuple[Placed, ...]:
    """Every object in its place, and filled; of each at most so many Gaussians, see `place`.

    Raises:
        InputError: not one set of Gaussians for each object, or one that cannot be placed.
    """
    if len(objects) != len(scene.objects):
        raise InputError(
            f"build: {len(objects)} sets of Gaussians for {len(scene.objects)} objects"
        )
    for i, gaussians in enumerate(objects):
        if not isinstance(gaussians, Gaussians):
            raise InputError(
                f"build: objects[{i}] is {shown(gaussians)}; give Gaussians, as jaxphys.load reads"
            )
    grid = solver_grid(scene)
    return tuple(
        place(gaussians, thing, grid, scene.transfer.spline, f"objects[{i}]", scene.seed + i, most)
        for i, (gaussians, thing) in enumerate(zip(objects, scene.objects, strict=True))
    )


def particles_of(placed: Placed, thing: Object, grid: Grid) -> Particles:
    """The particles of an object that is in its place."""
    positions = np.concatenate([np.asarray(placed.moving.means), placed.filling])
    x, y, z = np.asarray(thing.spin, np.float64)
    gradient = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    arms = positions - np.asarray(thing.centre)
    material = material_of(thing)
    values = material_values(material, thing.parameters)
    setting = Setting(grid, positions, placed.volumes, positions.dtype)
    for region in thing.regions:
        inside = setting.in_box(np.asarray(region.centre), np.asarray(region.half_size))
        for name, value in overridden(material, region.parameters).items():
            values[name] = np.where(inside, value, values[name])
    return Particles(
        positions=positions,
        volumes=placed.volumes,
        velocities=np.asarray(thing.velocity) + arms @ gradient.T,
        velocity_gradients=np.broadcast_to(gradient, (len(positions), 3, 3)),
        values=values,
        carriers=placed.moving.count,
    )


def arrangement_of(parts: list[Particles], grid: Grid, kernel: Kernel) -> np.ndarray:
    """Which particle, in the objects' order, the solver keeps at each of its places (N,)."""
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    orders = [cell_order(part.positions, grid, kernel=kernel) for part in parts]
    return np.concatenate([start + order for start, order in zip(starts, orders, strict=False)])


def solver_parts(
    scene: Scene, parts: list[Particles], arrangement: np.ndarray, dtype
) -> tuple[Config, Model, State]:
    """Program, numbers and start for the solver, in the solver's order."""
    grid = solver_grid(scene)
    described = [
        (material_of(thing), part.values, len(part.positions))
        for thing, part in zip(scene.objects, parts, strict=True)
    ]
    parameters, density, segments = assemble_parameters(described, dtype)
    config = Config(
        grid,
        segments,
        track_total=scene.splats_follow == "total",
        check_step=not scene.unsafe_substep,
        placement=suited(len(arrangement)),
        transfer=scene.transfer,
        fields=1 if scene.contact is None else len(parts),
    )

    def gathered(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts])[arrangement]

    positions, volumes = gathered("positions"), gathered("volumes")
    setting = Setting(grid, positions, volumes, dtype)
    boundaries = prepare(sampled(scene), setting)
    if scene.damping > 0:
        boundaries = (*boundaries, Damping(scene.damping).prepared(setting))
    state = initial_state(
        config,
        jnp.asarray(positions, dtype),
        velocity=gathered("velocities"),
        affine=gathered("velocity_gradients"),
        boundaries=boundaries,
    )
    volume = jnp.asarray(volumes, dtype)
    object_of = np.repeat(np.arange(len(parts)), [len(part.positions) for part in parts])
    friction = 0.0 if scene.contact is None else scene.contact.friction
    model = Model(
        mass=jnp.asarray(np.asarray(density)[arrangement]) * volume,
        volume=volume,
        parameters={
            name: jnp.asarray(np.asarray(value)[arrangement]) for name, value in parameters.items()
        },
        # Gravity of zero is left out of the program.
        gravity=jnp.asarray(scene.gravity, dtype) if any(scene.gravity) else None,
        boundaries=boundaries,
        field=None if scene.contact is None else jnp.asarray(object_of[arrangement], jnp.int32),
        # Nor has friction of zero any code.
        friction=jnp.asarray(friction, dtype) if friction > 0 else None,
    )
    return config, model, state


def build(
    scene: Scene,
    *objects: Gaussians,
    placed: tuple[Placed, ...] | None = None,
    dtype: Any = None,
) -> Built:
    """The simulation and the look of a scene with these Gaussians, one set for each object.

    Args:
        scene: what is asked for.
        objects: Gaussians as files hold them; they are placed and filled.
        placed: objects that are placed and filled already, in place of `objects`.
        dtype: of the simulation, float32 or float64; None: JAX's own, float64 where
            `jax_enable_x64` is set.

    Raises:
        InputError: naming the object or field that cannot be simulated.
    """
    validate(scene)
    dtype = jnp.zeros((), float if dtype is None else dtype).dtype
    placed = place_objects(scene, objects) if placed is None else placed
    grid = solver_grid(scene)
    parts = [
        particles_of(one, thing, grid) for one, thing in zip(placed, scene.objects, strict=True)
    ]
    arrangement = arrangement_of(parts, grid, scene.transfer.spline)
    config, model, state = solver_parts(scene, parts, arrangement, dtype)
    stepping = scene.stepping or Fixed()
    if isinstance(stepping, Implicit):
        check_implicit(config, model)
    dt, steps = frame_steps(
        stepping,
        config,
        model,
        state,
        scene.seconds_per_frame,
        scene.substep,
    )
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])[:-1]
    carriers = [start + np.arange(part.carriers) for start, part in zip(starts, parts, strict=True)]
    simulation = Simulation(
        model=model,
        state=state,
        order=jnp.asarray(inverse_order(arrangement), jnp.int32),
        carriers=jnp.asarray(np.concatenate(carriers), jnp.int32),
        config=config,
        counts=tuple(len(part.positions) for part in parts),
        dt=dt,
        steps=steps,
        given_substep=scene.substep,
        stepping=stepping,
    )
    solids: tuple = ()
    if scene.obstacle_colour is not None:
        solids = solids_of(model.boundaries, scene.obstacle_colour, scene.seed)
    return Built(simulation, look_of(placed, scene.regularise_colours, solids))
