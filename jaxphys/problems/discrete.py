"""From a motion to particles on a grid, and from the particles back to an error.

The grid's spacing is the unit of length of what is solved, so that levels of one problem differ in
numbers only: given the same `Room`, they share one compiled program.

Velocities start at t = -dt/2: the step is v <- v + dt a(x), x <- x + dt v, which is the leapfrog
scheme, second order in dt, when v is read as the velocity half a step before x.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core import algebra
from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Boundary, Plane, Setting
from jaxphys.mpm.boundaries.contact import Surface
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.state import Config, Model, State, initial_state
from jaxphys.mpm.transfer import Transfer
from jaxphys.problems.kinematics import deformation_gradient, velocity

DEFAULT = Transfer()


class Room(NamedTuple):
    """What a compiled program has room for: particles, and nodes per axis.

    Particles that a problem does not need have no mass and no volume, and rest at its origin.
    """

    particles: int
    nodes: tuple[int, int, int]


@dataclass(frozen=True)
class Discretisation:
    """A problem with a known answer on a grid, ready to be solved. Lengths in units of `spacing`.

    Attributes:
        truth: what the answer comes from: `truth.motion(X (3, ...), t)` [m] at any time [s].
        config, model, state: what `step` takes.
        dt: [s]; steps: how many.
        exact: (3, N) positions after the last step.
        spacing: dx of the grid [m].
        scale: the displacement [m] that errors are relative to.
        count: how many particles are the problem's.
        origin: (3,) where the truth's origin sits on the grid [dx].
    """

    truth: Any
    config: Config
    model: Model
    state: State
    dt: float
    steps: int
    exact: Array
    spacing: float
    scale: float
    count: int
    origin: Array

    def places(self, state: State) -> np.ndarray:
        """Where the problem's particles are, (3, N) [m] from the truth's origin."""
        x = np.asarray(state.position, np.float64)[:, : self.count]
        return self.spacing * (x - np.asarray(self.origin)[:, None])

    @property
    def volumes(self) -> np.ndarray:
        """Rest volumes of the problem's particles, (N,) [m^3]."""
        return self.spacing**3 * np.asarray(self.model.volume, np.float64)[: self.count]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BodyForce(Boundary):
    """Adds dt b(x, t) to the velocity of every node.

    Attributes:
        truth: the problem, whose `body_acceleration(x (3, ...), t)` is b [m/s^2] at places x [m].
        origin: (3,) where the problem's origin sits on the grid [dx].
        spacing: dx [m], ().
        share: what part of b to apply, (): 1, or another number in a negative control.
    """

    type: ClassVar[str] = "body force"
    truth: Any
    origin: Array
    spacing: Array
    share: Array

    def on_grid(self, velocity, coordinates, grid, time, dt) -> Array:
        offsets = [self.spacing * (x - self.origin[axis]) for axis, x in enumerate(coordinates)]
        x = jnp.stack(jnp.broadcast_arrays(*offsets))
        b = self.truth.body_acceleration(x, time) / self.spacing
        return velocity + (dt * self.share * b).astype(velocity.dtype)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Planar(Boundary):
    """Keeps the motion in the plane normal to an axis (plane strain)."""

    type: ClassVar[str] = "plane strain"
    axis: int = field(metadata={"static": True})

    def on_grid(self, velocity, coordinates, grid, time, dt) -> Array:
        return velocity.at[self.axis].set(0.0)


def held_up_to(coordinate: float, dtype) -> Plane:
    """Holds all nodes with x up to `coordinate` [dx]; a large negative one holds none."""
    return node_wall(0, coordinate, 1, "sticky", dtype)


def node_wall(axis: int, coordinate: float, side: int, surface: Surface, dtype) -> Plane:
    """A wall of nodes: those on `axis` up to `coordinate` [dx] (side 1), or from it on (-1)."""
    point, normal = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    point[axis], normal[axis] = coordinate + 0.25 * side, float(side)
    setting = Setting(Grid((3, 3, 3), 1.0), np.zeros((0, 3)), np.zeros(0), dtype)
    plane = Plane(
        (point[0], point[1], point[2]),
        (normal[0], normal[1], normal[2]),
        surface,
        friction=None,
        acts_on="nodes",
    )
    return plane.prepared(setting)


def steps_for(duration: float, courant: float, spacing: float, speed: float) -> tuple[float, int]:
    """(dt [s], steps) that cover `duration` [s] exactly with speed * dt <= courant * spacing."""
    steps = int(np.ceil(duration * speed / (courant * spacing) - 1e-9))
    return duration / steps, steps


@jax.jit
def _sample(truth, X, early, end):
    """Positions, velocities, F and C at the start, and positions at the end, of X (3, N)."""
    start = jnp.zeros_like(end)

    def one(X):
        F = deformation_gradient(truth.motion, X, start)
        rate = jax.jacfwd(lambda point: velocity(truth.motion, point, early))(X)
        affine = algebra.matmul(rate, algebra.inverse(F))
        v = velocity(truth.motion, X, early)
        return truth.motion(X, start), v, F, affine, truth.motion(X, end)

    return jax.vmap(one)(X)


def discretise(
    truth,
    points: np.ndarray,
    volume,
    *,
    law: Law,
    poisson: float | None = None,
    nodes: tuple[int, int, int],
    origin,
    spacing: float,
    dt: float,
    steps: int,
    scale: float,
    gravity=(0.0, 0.0, 0.0),
    boundaries: tuple = (),
    contacts: tuple = (),
    parameters: Mapping[str, float] | None = None,
    objects: np.ndarray | None = None,
    friction: float = 0.0,
    staggered: bool = True,
    room: Room | None = None,
    transfer: Transfer = DEFAULT,
    dtype=jnp.float64,
) -> Discretisation:
    """Particles at `points` (N, 3) [m] with rest `volume` (N,) or () [m^3] that start on a motion.

    Args:
        truth: a pytree with `motion`, `density` [kg/m^3] and, with `poisson`, `youngs` [Pa].
        poisson: of an elastic law; parameters: of any other law, by name, in SI units.
        nodes: of the grid; `room` may give more; transfer: see `Config`.
        origin: (3,) where the motion's origin sits on the grid [dx].
        spacing: dx [m]; scale: see `Discretisation`; gravity: [m/s^2].
        boundaries: in units of dx, prepared; contacts: likewise, still to be prepared for the
            particles that they touch.
        objects: (N,) from 0, which object each point belongs to, where these meet by contact with
            `friction`; None: all share one velocity field.
        staggered: whether velocities start at -dt/2 rather than at 0.
    """
    count = len(points)
    room = room or Room(count, nodes)
    X = np.zeros((room.particles, 3))
    X[:count] = points
    real = np.arange(room.particles) < count
    rest_volume = np.zeros(room.particles)
    rest_volume[:count] = np.asarray(volume) / spacing**3
    early = -dt / 2 if staggered else 0.0
    x, v, F, affine, exact = _sample(truth, jnp.asarray(X), early, dt * steps)
    # What fills the room has no motion of its own.
    v = jnp.where(real[:, None], v, 0.0)
    F = jnp.where(real[:, None, None], F, jnp.eye(3))
    affine = jnp.where(real[:, None, None], affine, 0.0)
    full = lambda value: jnp.full((room.particles,), value, dtype)  # noqa: E731
    volume = jnp.asarray(rest_volume, dtype)
    field = None
    if objects is not None:
        field = jnp.zeros(room.particles, jnp.int32).at[:count].set(objects.astype(np.int32))
    config = Config(
        Grid(room.nodes, 1.0),
        ((law, 0, room.particles),),
        transfer=transfer,
        fields=1 if objects is None else int(np.max(objects)) + 1,
    )
    if poisson is not None:
        parameters = {"youngs_modulus": truth.youngs, "poisson_ratio": poisson}
    assert parameters is not None  # every law has some
    # Stress over density is a speed squared: lengths in dx make it smaller by dx^2.
    stresses = {one.name for one in law.declared if one.unit.startswith("Pa")}
    start = x / spacing + jnp.asarray(origin, jnp.float64)
    setting = Setting(config.grid, np.asarray(start), rest_volume, jnp.dtype(dtype))
    boundaries = (*boundaries, *(contact.prepared(setting) for contact in contacts))
    model = Model(
        mass=volume * truth.density,
        volume=volume,
        parameters={
            name: full(value / spacing**2 if name in stresses else value)
            for name, value in parameters.items()
        },
        gravity=jnp.asarray(gravity, dtype) / spacing,
        boundaries=boundaries,
        field=field,
        friction=jnp.asarray(friction, dtype) if friction > 0 else None,
    )
    origin = jnp.asarray(origin, jnp.float64)
    state = initial_state(config, start, v / spacing, F, affine, dtype=dtype, boundaries=boundaries)
    exact = (exact / spacing + origin).T
    return Discretisation(
        truth, config, model, state, dt, steps, exact, spacing, scale, count, origin
    )


@partial(jax.jit, static_argnums=0)
def _advance(config, model, state, dt, steps, keep):
    def body(_, state):
        state = step(config, model, state, dt)
        return state._replace(affine=keep * state.affine)

    return jax.lax.fori_loop(0, steps, body, state)


def solve(problem: Discretisation, keep_affine: float = 1.0, steps: int | None = None) -> State:
    """The state after all steps, or after `steps`; its status says whether they are sound.

    keep_affine: what part of C survives a step. 0 makes it a particle-in-cell method that forgets
    all but the mean velocity: a negative control.
    """
    steps = problem.steps if steps is None else steps
    dtype = problem.state.position.dtype
    keep = jnp.asarray(keep_affine, dtype)
    return _advance(problem.config, problem.model, problem.state, problem.dt, steps, keep)


def displacement_errors(problem: Discretisation, state: State) -> tuple[float, float]:
    """(L2, largest) error of the positions over `problem.scale`; infinite if the run failed.

    L2 is the root of the volume-weighted mean square over particles.
    """
    if int(state.status.code):
        return float("inf"), float("inf")
    n = problem.count
    difference = np.asarray(state.position)[:, :n] - np.asarray(problem.exact)[:, :n]
    square = np.sum(difference**2, axis=0) * (problem.spacing / problem.scale) ** 2
    mean = np.average(square, weights=np.asarray(problem.model.volume)[:n])
    return float(np.sqrt(mean)), float(np.sqrt(square.max()))


def volume_gain(problem: Discretisation, state: State) -> float:
    """Relative change of the total volume, sum V0 (J - 1) / sum V0."""
    J = np.linalg.det(np.moveaxis(np.asarray(state.deformation), -1, 0))
    return float(np.average(J - 1, weights=np.asarray(problem.model.volume)))


def energy(problem: Discretisation, state: State) -> float:
    """Kinetic energy (with that of the affine parts, m D |C|^2 / 2, where particles give them to
    the grid) and stored energy.

    In units of kg dx^2/s^2; of one law for all particles; gravity's potential is not in it.
    """
    ((law, _, _),) = problem.config.segments
    speed = jnp.sum(state.velocity**2, axis=0)
    if problem.config.transfer.scheme.affine:
        rate = jnp.sum(state.affine**2, axis=(0, 1))
        speed = speed + rate / problem.config.kernel.inverse_inertia
    history = jnp.zeros((0, state.position.shape[1])) if state.history is None else state.history
    if law.energy is None:
        raise InputError(f"energy: the law {law.name} stores none")
    stored = law.energy(problem.model.parameters, state.deformation, history)
    return float(jnp.sum(0.5 * problem.model.mass * speed + problem.model.volume * stored))


def observed_order(sizes, errors) -> float:
    """Slope of log(error) over log(size), by least squares; not a number if a run failed."""
    if not np.all(np.isfinite(errors)):
        return float("nan")
    return float(np.polyfit(np.log(np.asarray(sizes)), np.log(np.asarray(errors)), 1)[0])
