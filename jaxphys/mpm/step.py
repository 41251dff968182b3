"""One explicit MLS-MPM step (Hu et al. 2018) with APIC transfers (Jiang et al. 2015)."""

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra, compensated
from jaxphys.core.program import part
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.kernel import base_node, inside
from jaxphys.mpm.state import (
    CODES,
    COLLAPSED,
    INVERTED,
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_FINITE,
    OK,
    STEP_TOO_LARGE,
    Config,
    Model,
    Residual,
    State,
    Status,
)
from jaxphys.mpm.transfer import grid_to_particle, particle_to_grid, window_origin

COLLAPSE = 1e-3  # share of its volume below which a particle counts as collapsed


def step(config: Config, model: Model, state: State, dt) -> State:
    """The state one time step `dt` [s] later. Pure; holds only the parts that the scene lists.

    In order: the laws (return map and stress of the trial gradient together), contact, momentum and
    mass to the grid, gravity and what boundaries do on the grid, velocity and its gradient back,
    what they do to particles, x <- x + dt v, F <- (I + dt C) F. The status says what failed first;
    the step itself goes on whatever happens, and addresses no memory outside the grid.

    In float32 the sums x, F and time carry what rounding left out (`State.residual`), without which
    steps of stiff matter are too small to move it. A law that returns another F than it was given
    leaves that of F as it is: right where nothing yields, and off by a rounding of F where it does.
    """
    grid, shape = config.grid, config.nodes
    dt = jnp.asarray(dt, state.position.dtype)
    F, stress, history = apply_laws(config, model, state)

    # Momentum changes by m C per metre, less the impulse of the stress: -dt V tau grad w, in which
    # MLS-MPM replaces grad w by w (x_i - x_p) 4 / dx^2.
    impulse = (-4.0 / grid.spacing**2) * dt * model.volume
    affine = model.mass * state.affine + impulse * stress
    momentum = model.mass * state.velocity
    given, slip = stages.impulses(
        model, grid, state.position, state.velocity, state.slip, state.time, dt
    )
    origin = window_origin(shape, grid.spacing, grid.shape, state.position)
    rows = particle_to_grid(
        shape,
        grid.spacing,
        grid.shape,
        origin,
        state.position,
        model.mass,
        momentum if given is None else momentum + given,
        affine,
    )
    rows = update_grid(model, rows, dt)
    rows = stages.on_grid(model, grid, shape, origin, rows, state.time, dt)
    velocity, moment = grid_to_particle(
        shape, grid.spacing, grid.shape, origin, state.position, rows
    )
    C = moment * (4.0 / grid.spacing**2)
    velocity = stages.on_particles(model, state.position, velocity, state.time, dt)
    carried = state.residual or Residual(None, None, None, None)
    position, position_rest = compensated.add(state.position, carried.position, dt * velocity)
    time, time_rest = compensated.add(state.time, carried.time, dt)
    F, F_rest = compensated.add(F, carried.deformation, dt * algebra.matmul(C, F))
    total, total_rest = state.total, None
    if total is not None:
        with part("second deformation gradient"):
            change = dt * algebra.matmul(C, total)
            total, total_rest = compensated.add(total, carried.total, change)
    residual = Residual(position_rest, F_rest, total_rest, time_rest)
    return State(
        position=position,
        velocity=velocity,
        affine=C,
        deformation=F,
        total=total,
        history=history,
        time=time,
        status=judge(config, state, position, velocity, C, F, dt, origin),
        residual=None if state.residual is None else residual,
        slip=slip,
    )


def apply_laws(config: Config, model: Model, state: State) -> tuple[Array, Array, Array | None]:
    """Elastic F (3, 3, N), Kirchhoff stress (3, 3, N) [Pa] and history of every segment's law."""
    gradients, stresses, histories = [], [], []
    for law, start, stop in config.segments:
        kept = len(law.history)
        parameters = {name: model.parameters[name][start:stop] for name in law.parameters}
        if state.history is None:
            memory = jnp.zeros((0, stop - start), state.position.dtype)
        else:
            memory = state.history[:kept, start:stop]
        with part(f"law {law.name}"):
            F, stress, memory = law.update(parameters, state.deformation[:, :, start:stop], memory)
        gradients.append(F)
        stresses.append(stress)
        if state.history is not None:
            with part("history"):
                histories.append(jnp.concatenate([memory, state.history[kept:, start:stop]]))
    return _join(gradients), _join(stresses), _join(histories) if histories else None


def _join(parts: list[Array]) -> Array:
    return parts[0] if len(parts) == 1 else jnp.concatenate(parts, axis=-1)


def update_grid(model: Model, rows: Array, dt: Array) -> Array:
    """Node velocities [m/s] from momentum and mass rows, both (M, 4); the last column is void.

    Nodes with next to no mass stand still: below eps^2 of the heaviest particle a node adds less
    than round-off to any particle, and dividing by its mass could overflow.
    """
    mass = rows[:, 3:]
    least = jnp.finfo(rows.dtype).eps ** 2 * jnp.max(model.mass)
    filled = mass > least
    rows = rows / jnp.where(filled, mass, 1.0)
    if model.gravity is not None:
        with part("gravity"):
            # All four columns at once: XLA would otherwise pad each row that a transfer reads.
            rows = rows + dt * jnp.concatenate([model.gravity, jnp.zeros_like(model.gravity[:1])])
    return jnp.where(filled, rows, 0.0)


def judge(
    config: Config,
    before: State,
    position: Array,
    velocity: Array,
    C: Array,
    F: Array,
    dt: Array,
    origin: Array,
) -> Status:
    """The status after a step. The first failure stays; of one step, the lowest particle's.

    A step multiplies det F by det(I + dt C), so that only one with |dt C| >= 1 can turn a particle
    inside out: that is a step too large. What is inverted without one was given so, and no law
    brings it back: Hencky's take a mirror image for rest.
    """
    grid, status = config.grid, before.status
    finite = jnp.isfinite(jnp.sum(velocity, axis=0) + jnp.sum(F, axis=(0, 1)))
    slow = jnp.sum(velocity**2, axis=0) * dt**2 <= grid.spacing**2
    slow &= jnp.sum(C**2, axis=(0, 1)) * dt**2 <= 1
    volume = algebra.determinant(F)
    code = jnp.full(finite.shape, OK, jnp.int32)
    if config.nodes != grid.shape:
        # A particle that outgrew the window was clamped in the transfers of this very step.
        room = jnp.array(config.nodes, jnp.int32)[:, None] - 3
        local = base_node(before.position, grid.spacing, grid.shape) - origin[:, None]
        code = jnp.where(jnp.all(local <= room, axis=0), code, LEFT_WINDOW)
    code = jnp.where(inside(position, grid.spacing, grid.shape), code, LEFT_GRID)
    code = jnp.where(volume < COLLAPSE, COLLAPSED, code)
    code = jnp.where(volume <= 0, INVERTED, code)
    code = jnp.where(slow, code, STEP_TOO_LARGE)
    code = jnp.where(finite, code, NOT_FINITE)
    # One reduction finds the particle and its code together.
    count = code.shape[0]
    index = jnp.arange(count, dtype=jnp.int32)
    keys = jnp.where(code == OK, CODES * count, CODES * index + code)
    first = jnp.min(keys)
    fails = (status.code == OK) & (first < CODES * count)
    return Status(
        code=jnp.where(fails, first % CODES, status.code),
        step=jnp.where(fails, status.taken, status.step),
        particle=jnp.where(fails, first // CODES, status.particle),
        taken=status.taken + 1,
    )
