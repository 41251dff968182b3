"""From a scene and Gaussians to what the solver runs, and which particle carries which
Gaussian.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.gaussians.colour import ColourRange, colour_range, to_unit_interval
from jaxphys.gaussians.filling import particle_volumes
from jaxphys.gaussians.gaussians import Gaussians, concatenate
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.materials import assemble_parameters, get_material, material_values
from jaxphys.mpm.sorting import cell_order, inverse_order
from jaxphys.mpm.state import Config, Model, State, initial_state
from jaxphys.mpm.time_step import StepBounds
from jaxphys.scene.place import Placed, place
from jaxphys.scene.scene import Object, Scene
from jaxphys.scene.solver_boundaries import solver_boundaries
from jaxphys.scene.substep import choose_substep


@partial(
    jax.tree_util.register_dataclass,
    data_fields=("model", "state", "gaussians", "still", "particles", "colours"),
    meta_fields=("config", "scene_objects", "dt", "steps", "breaks"),
)
@dataclass(frozen=True)
class Simulation:
    """All that a motion is made of. A pytree: what a gradient may reach is data, the rest static.

    Attributes:
        model, state: what the solver runs; the state at time 0.
        gaussians: K Gaussians that move, at rest.
        still: Gaussians that are drawn but do not move, or None.
        particles: which particle carries each Gaussian, int32 (K,).
        colours: the range of colours of each object, None where they are left as they are.
        config: the solver's program.
        scene_objects: (start, stop) of each object's Gaussians.
        dt: time step [s].
        steps: time steps a frame.
        breaks: whether pieces are worth counting.
    """

    model: Model
    state: State
    gaussians: Gaussians
    still: Gaussians | None
    particles: Array
    colours: tuple[ColourRange, ...] | None
    config: Config
    scene_objects: tuple[tuple[int, int], ...]
    dt: float
    steps: int
    breaks: bool

    def with_(self, *, velocity=None, **parameters) -> "Simulation":
        """The same simulation with other numbers, which may be traced and differentiated.

        Args:
            velocity: of every particle at the start [m/s], (3,) or (N, 3).
            parameters: of the materials, such as `youngs_modulus`: a number or (N,).

        Raises:
            InputError: a parameter that no material of the simulation has.
        """
        model, state = self.model, self.state
        for name in parameters:
            if name not in model.parameters:
                names = ", ".join(sorted(model.parameters))
                raise InputError(f"with_: no material here has {name!r}; valid: {names}")
        changed = {
            name: jnp.broadcast_to(jnp.asarray(value, model.mass.dtype), model.mass.shape)
            for name, value in parameters.items()
        }
        model = replace(model, parameters=model.parameters | changed)
        if velocity is not None:
            velocity = jnp.asarray(velocity, state.velocity.dtype)
            columns = velocity[:, None] if velocity.ndim == 1 else velocity.T
            state = state._replace(velocity=jnp.broadcast_to(columns, state.velocity.shape))
        return replace(self, model=model, state=state)


class Part:
    """One object on its way to particles: positions in solver order, and what belongs to each."""

    def __init__(self, placed: Placed, thing: Object, grid: Grid, where: str):
        count = placed.moving.count
        points = np.concatenate([np.asarray(placed.moving.means), placed.filling])
        order = cell_order(points, grid)
        self.thing, self.where = thing, where
        self.positions = points[order]
        self.carriers = inverse_order(order)[:count]
        self.volumes = particle_volumes(self.positions, grid.spacing)

    def motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Initial velocity (N, 3) and its gradient (N, 3, 3) from `velocity` and `spin`."""
        x, y, z = np.asarray(self.thing.spin, np.float64)
        gradient = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        arms = self.positions - np.asarray(self.thing.centre)
        velocity = np.asarray(self.thing.velocity) + arms @ gradient.T
        return velocity, np.broadcast_to(gradient, (len(arms), 3, 3))

    def values(self) -> dict[str, Any]:
        """Material parameters, numbers or (N,), regions applied."""
        material = get_material(self.thing.material)
        try:
            values = material_values(material, self.thing.parameters)
        except InputError as error:
            raise InputError(f"{self.where}.parameters: {error}") from None
        for i, region in enumerate(self.thing.regions):
            offset = np.abs(self.positions - np.asarray(region.centre))
            inside = np.all(offset < np.asarray(region.half_size), axis=1)
            try:
                material_values(material, region.parameters)
            except InputError as error:
                raise InputError(f"{self.where}.regions[{i}].parameters: {error}") from None
            for name, value in region.parameters.items():
                values[name] = np.where(inside, value, values[name])
        return values


def validate(scene: Scene) -> None:
    """Refuses materials and parameters that do not exist or are out of range, before any work.

    Raises:
        InputError: naming the field.
    """
    for i, thing in enumerate(scene.objects):
        where = f"objects[{i}]"
        try:
            material = get_material(thing.material)
        except InputError as error:
            raise InputError(f"{where}.material: {error}") from None
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


def solver_grid(scene: Scene) -> Grid:
    """The grid of a scene's domain."""
    return Grid(scene.domain.shape, scene.domain.spacing)


def build(
    scene: Scene, *objects: Gaussians, placed: tuple[Placed, ...] | None = None
) -> Simulation:
    """The simulation of a scene with these Gaussians, one set for each object.

    Args:
        scene: what is asked for.
        objects: Gaussians as files hold them; they are placed and filled.
        placed: objects that are placed and filled already, in place of `objects`.

    Raises:
        InputError: naming the object or field that cannot be simulated.
    """
    simulation, _ = build_with_bounds(scene, *objects, placed=placed)
    return simulation


def build_with_bounds(
    scene: Scene, *objects: Gaussians, placed: tuple[Placed, ...] | None = None
) -> tuple[Simulation, StepBounds]:
    """As `build`, and the bounds from which the time step was taken."""
    validate(scene)
    grid = solver_grid(scene)
    if placed is None:
        if len(objects) != len(scene.objects):
            raise InputError(
                f"build: {len(objects)} sets of Gaussians for {len(scene.objects)} objects"
            )
        placed = tuple(
            place(gaussians, thing, grid, f"objects[{i}]", scene.seed + i)
            for i, (gaussians, thing) in enumerate(zip(objects, scene.objects, strict=True))
        )
    parts = [
        Part(one, thing, grid, f"objects[{i}]")
        for i, (one, thing) in enumerate(zip(placed, scene.objects, strict=True))
    ]
    described = [(get_material(p.thing.material), p.values(), len(p.positions)) for p in parts]
    parameters, density, segments = assemble_parameters(described)
    config = Config(grid, segments, track_total=scene.splats_follow == "total")
    positions = np.concatenate([part.positions for part in parts]).astype(np.float32)
    motions = [part.motion() for part in parts]
    state = initial_state(
        config,
        jnp.asarray(positions),
        velocity=np.concatenate([velocity for velocity, _ in motions]),
        affine=np.concatenate([gradient for _, gradient in motions]),
    )
    volume = jnp.asarray(np.concatenate([part.volumes for part in parts]), jnp.float32)
    boundaries, rest = solver_boundaries(scene, grid, positions)
    model = Model(
        mass=density * volume,
        volume=volume,
        parameters=parameters,
        gravity=jnp.asarray(scene.gravity, jnp.float32),
        boundaries=boundaries,
        rest=jnp.asarray(positions.T) if rest else None,
    )
    dt, steps, bounds = choose_substep(scene, config, model, state)
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    carriers = [part.carriers + start for part, start in zip(parts, starts[:-1], strict=True)]
    edges = np.cumsum([0, *(one.moving.count for one in placed)]).tolist()
    still = [one.still for one in placed if one.still.count]
    # The paper's range would also stretch the contrast of colours that are right already.
    ranges = tuple(to_unit_interval(colour_range(one.moving)) for one in placed)
    simulation = Simulation(
        model=model,
        state=state,
        gaussians=concatenate([one.moving for one in placed]),
        still=concatenate(still) if still else None,
        particles=jnp.asarray(np.concatenate(carriers), jnp.int32),
        colours=ranges if scene.regularise_colours else None,
        config=config,
        scene_objects=tuple(pairwise(edges)),
        dt=dt,
        steps=steps,
        breaks=any(law.name == "fracture" for law, _, _ in segments),
    )
    return simulation, bounds
