"""What a simulation is made of: `Config` the program, `Model` the numbers, `State` the motion."""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.placement import Placement, Slabs
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.transfer.kernels import Kernel
from jaxphys.mpm.transfer.schemes import Transfer
from jaxphys.mpm.transfer.stencil import Window

CODES = 10
(
    OK,
    NOT_FINITE,
    LEFT_GRID,
    STEP_TOO_LARGE,
    LEFT_WINDOW,
    INVERTED,
    COLLAPSED,
    UNSTABLE_STEP,
    TOO_MANY_STEPS,
    NOT_CONVERGED,
) = range(CODES)


@dataclass(frozen=True)
class Config:
    """What decides which program is compiled. Hashable.

    Attributes:
        grid: the background grid.
        segments: (law, start, stop) for contiguous runs of particles, from 0 to N without gaps.
        track_total: keep the total deformation gradient beside the elastic one. Has an effect only
            where a law is plastic; elsewhere the two are the same.
        window: nodes per axis of the part of the grid that is computed, or None for all of it. The
            window follows the particles; if they outgrow it, the status says so. A block of
            particles that spans c cells needs c + 3 nodes, c + 4 with cubic splines, two more if it
            moves, and room for what its motion adds.
        check_step: compare dt with what the state's stiffness allows, at the start of every
            rollout.
        tells_rates: a pass tells how fast its particles move and deform (`Seen.rates`), for steps
            that adapt.
        placement: in which chunks and on which devices particles are computed.
        transfer: how particles and grid exchange velocities, and with which kernel.
        slabs: how devices share the window, or None where each has all of it. A slab follows the
            particles of its device; if they outgrow it, the status says so.
        fields: how many velocity fields the grid has: one, or one for each object
            (`Model.field`), where objects meet by contact (`mpm.meeting`).
    """

    grid: Grid
    segments: tuple[tuple[Law, int, int], ...]
    track_total: bool = False
    window: tuple[int, int, int] | None = None
    check_step: bool = True
    tells_rates: bool = False
    placement: Placement = Placement()
    transfer: Transfer = Transfer()
    slabs: Slabs | None = None
    fields: int = 1

    def __post_init__(self):
        reached = 0
        for law, start, stop in self.segments:
            if start != reached or stop <= start:
                raise InputError(
                    f"Config.segments: '{law.name}' covers particles {start} to {stop}, but must "
                    f"start at {reached} and hold at least one; order segments without gaps."
                )
            reached = stop
        if not reached:
            raise InputError("Config.segments is empty: give at least one (law, start, stop).")
        width = self.kernel.width
        if min(self.grid.shape) < width:
            raise InputError(
                f"Config.grid has shape {self.grid.shape}: {self.transfer.kernel} splines touch "
                f"{width} nodes per axis; give at least as many."
            )
        if self.window is not None and not all(
            width <= w <= n for w, n in zip(self.window, self.grid.shape, strict=True)
        ):
            raise InputError(
                f"Config.window is {self.window}: it must lie between {width} nodes and the grid's "
                f"{self.grid.shape} on each axis."
            )
        if self.fields < 1:
            raise InputError(f"Config.fields is {self.fields}: give at least 1.")
        if self.fields > 1 and self.slabs is not None:
            raise InputError(
                f"Config.slabs: with {self.fields} velocity fields every device has the window as "
                "a whole; set it to None."
            )
        if self.slabs is not None:
            most = (self.window or self.grid.shape)[0]
            if self.placement.devices == 1:
                raise InputError("Config.slabs: one device has the whole window; set it to None.")
            if not width <= self.slabs.planes <= most:
                raise InputError(
                    f"Config.slabs.planes is {self.slabs.planes}: it must lie between {width} and "
                    f"the {most} nodes of the window along x."
                )

    @property
    def particles(self) -> int:
        """Number of particles."""
        return self.segments[-1][2]

    @property
    def kernel(self) -> Kernel:
        """That of the transfers."""
        return self.transfer.spline

    @property
    def shares_volume(self) -> bool:
        """Whether particles tell the grid their volumes, for a law that asks for their mean."""
        return any(law.shares_volume for law, _, _ in self.segments)

    @property
    def columns(self) -> int:
        """Numbers of a node: momentum and mass, and four more where momentum before forces acted or
        volumes are told, too.
        """
        return 8 if self.transfer.keeps_velocity or self.shares_volume else 4

    @property
    def nodes(self) -> tuple[int, int, int]:
        """Shape of the part of the grid that a device computes."""
        shape = self.window or self.grid.shape
        return shape if self.slabs is None else (self.slabs.planes, *shape[1:])

    @property
    def rows(self) -> int:
        """Rows of numbers that a device has: one for each node of each field."""
        return self.fields * self.computed.nodes

    @property
    def parts(self) -> int:
        """How many such parts there are: a slab for each device, or the window."""
        return 1 if self.slabs is None else self.placement.devices

    @property
    def follows(self) -> bool:
        """Whether what is computed of the grid follows the particles."""
        return self.window is not None or self.slabs is not None

    @property
    def runs(self) -> tuple[tuple[Law, int, int], ...]:
        """The segments, those of one law that follow each other as one."""
        found: list[tuple[Law, int, int]] = []
        for law, start, stop in self.segments:
            if found and found[-1][0] == law:
                start = found.pop()[1]
            found.append((law, start, stop))
        return tuple(found)

    @property
    def computed(self) -> Window:
        """The part of the grid that a device computes, for transfers."""
        return Window(self.nodes, self.grid.spacing, self.grid.shape, self.kernel)

    @property
    def history_rows(self) -> int:
        """Rows of `State.history`: the most that any law keeps."""
        return max(len(law.history) for law, _, _ in self.segments)

    @property
    def keeps_total(self) -> bool:
        """Whether `State.total` exists."""
        return self.track_total and any(law.plastic for law, _, _ in self.segments)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Model:
    """What a gradient may reach and a step does not change. A pytree.

    mass: (N,) [kg]; volume: (N,) rest volume [m^3]; parameters: name -> (N,), as the laws name
    them; gravity: (3,) [m/s^2], or None for none, which no step then adds; boundaries: as
    `boundaries.prepare` makes them; wave_modulus: (N,) of waves at rest [Pa], which a rollout works
    out for its boundaries (`stepping.bounds.with_wave_modulus`); field: (N,) int32, from 0, which
    of `Config.fields` each particle moves in, or None where there is one; friction: () Coulomb's
    coefficient between these, or None for none.
    """

    mass: Array
    volume: Array
    parameters: dict[str, Array]
    gravity: Array | None
    boundaries: tuple = ()
    wave_modulus: Array | None = None
    field: Array | None = None
    friction: Array | None = None


class Status(NamedTuple):
    """Whether a simulation is sound, and if not, what failed first. All scalars, int32.

    code: OK, or one of NOT_FINITE, LEFT_GRID, STEP_TOO_LARGE, LEFT_WINDOW, INVERTED, COLLAPSED,
    UNSTABLE_STEP, TOO_MANY_STEPS, NOT_CONVERGED, which `loop.status.check` explains; step: steps
    taken before the one that failed; particle: the lowest index that failed in it (UNSTABLE_STEP,
    TOO_MANY_STEPS: the one that allows least; NOT_CONVERGED: -1, for it is the step that failed);
    taken: steps taken in all. `step` and `particle` are -1 while code is OK.
    """

    code: Array
    step: Array
    particle: Array
    taken: Array


class Residual(NamedTuple):
    """What rounding left out of the sums that a step adds to, for `core.compensated`.

    position: (3, N) [m]; deformation, total: (3, 3, N), `total` None where the state has none;
    time: () [s]. Position plus residual is where a particle is, to about twice the digits; nothing
    but the next sum reads it, and no gradient goes through it.
    """

    position: Array | None
    deformation: Array | None
    total: Array | None
    time: Array | None


class RigidBody(NamedTuple):
    """A rigid body that particles push.

    position: of its centre of mass [m], (3,); orientation: quaternion from its own axes to the
    world's, (4,); momentum: [kg m/s], (3,); angular_momentum: about its centre of mass
    [kg m^2/s], (3,); rest: what rounding left out of position and orientation, or None in float64;
    slip: how far its points are strained along surfaces with friction [m], three rows a surface,
    (R, P), or None if there are none.
    """

    position: Array
    orientation: Array
    momentum: Array
    angular_momentum: Array
    rest: tuple[Array, Array] | None
    slip: Array | None


class State(NamedTuple):
    """What a step changes. Particle axis last.

    position: (3, N) [m]; velocity: (3, N) [m/s]; affine: (3, 3, N), C [1/s];
    deformation: (3, 3, N), the elastic trial gradient; total: (3, 3, N), the total gradient, or
    None where it is the same or not asked for; history: (H, N) or None if no law keeps any;
    time: () [s]; status: `Status`; residual: `Residual`, or None in float64, where sums have digits
    to spare; slip: (R, N) [m], how far contact is strained along surfaces with friction, three rows
    each, or None if there are none; rigid: the `RigidBody`, or None if no boundary is free.
    """

    position: Array
    velocity: Array
    affine: Array
    deformation: Array
    total: Array | None
    history: Array | None
    time: Array
    status: Status
    residual: Residual | None = None
    slip: Array | None = None
    rigid: RigidBody | None = None


@jax.jit
def _particles_last(value: Array) -> Array:
    return jnp.moveaxis(value, 0, -1)


def initial_state(
    config: Config,
    position,
    velocity=None,
    deformation=None,
    affine=None,
    dtype=None,
    boundaries: tuple = (),
) -> State:
    """The state at time 0 from arrays in public order.

    position: (N, 3) [m]; velocity: (N, 3) [m/s], default 0; deformation: (N, 3, 3), default the
    identity; affine: (N, 3, 3) [1/s], default 0; dtype: default that of `position`; boundaries:
    those of the model, some of which need room in `slip`.
    Raises `InputError` if a shape is wrong, there are not as many particles as segments cover, or
    a particle is turned inside out: det F <= 0 (of traced arrays the first step's status tells).
    """
    count = config.particles
    position = jnp.asarray(position, dtype)
    dtype = position.dtype
    if not jnp.issubdtype(dtype, jnp.floating):
        raise InputError(f"initial_state: position has dtype {dtype}; give floating-point numbers.")

    def last(name, value, shape):
        value = jnp.asarray(value, dtype)
        if value.shape != (count, *shape):
            raise InputError(
                f"initial_state: {name} has shape {value.shape}, but Config.segments cover "
                f"{count} particles; give shape {(count, *shape)}."
            )
        # A copy in any case: the caller's array must survive the state's donation.
        return _particles_last(value)

    def zeros(*shape):
        # Of numpy: nothing to compile. So are the constants below.
        return jnp.asarray(np.zeros((*shape, count)), dtype)

    if deformation is not None:
        refuse_inverted(deformation, "initial_state")
    else:
        deformation = np.broadcast_to(np.eye(3), (count, 3, 3))
    history = None
    if config.history_rows:
        columns = []
        for law, start, stop in config.segments:
            initial = np.zeros(config.history_rows)
            initial[: len(law.history)] = law.history
            columns.append(np.broadcast_to(initial[:, None], (config.history_rows, stop - start)))
        history = jnp.asarray(np.concatenate(columns, axis=1), dtype)

    total = last("deformation", deformation, (3, 3)) if config.keeps_total else None
    residual = None
    if jnp.finfo(dtype).bits < 64:
        residual = Residual(
            position=zeros(3),
            deformation=zeros(3, 3),
            total=None if total is None else zeros(3, 3),
            time=jnp.zeros((), dtype),
        )
    rows = sum(boundary.rows for boundary in boundaries)
    return State(
        position=last("position", position, (3,)),
        velocity=zeros(3) if velocity is None else last("velocity", velocity, (3,)),
        affine=zeros(3, 3) if affine is None else last("affine", affine, (3, 3)),
        deformation=last("deformation", deformation, (3, 3)),
        total=total,
        history=history,
        time=jnp.zeros((), dtype),
        status=Status(
            code=jnp.array(OK, jnp.int32),
            step=jnp.array(-1, jnp.int32),
            particle=jnp.array(-1, jnp.int32),
            taken=jnp.array(0, jnp.int32),
        ),
        residual=residual,
        slip=zeros(rows) if rows else None,
        rigid=next((b.body(boundaries) for b in boundaries if b.free), None),
    )


def refuse_inverted(deformation, where: str) -> None:
    """Raises `InputError` if some det F of concrete gradients (N, 3, 3) is not positive; where: for
    its message.
    """
    if isinstance(deformation, jax.core.Tracer) or np.shape(deformation)[1:] != (3, 3):
        return
    volume = np.linalg.det(np.asarray(deformation, np.float64))
    wrong = np.flatnonzero(volume <= 0)
    if wrong.size:
        raise InputError(
            f"{where}: deformation[{wrong[0]}] has determinant {volume[wrong[0]]:.3g}: no "
            "motion leads there; give gradients with det F > 0."
        )
