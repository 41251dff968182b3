"""What a step does to some particles between the two transfers, as pure functions.

A step is a grid update and one pass over the particles: gather from this grid, `move`, `give` into
the next one. Between passes particles are placed, deformed and past their law; nobody stores their
affine part, nor their velocity unless the transfer lets it differ from the grid's.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra, compensated
from jaxphys.core.program import part
from jaxphys.core.spectral import volume_change
from jaxphys.mpm.boundaries import stages
from jaxphys.mpm.boundaries.free import Wrench
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.state import Config, Residual


class Shared(NamedTuple):
    """What is the same for all particles.

    gravity: (3,) [m/s^2] or None; boundaries: without what they hold of every particle; dt: [s], of
    the step that moves; ahead: [s], of the next one, for which a pass gives; time: [s], at the
    start of the step that moves; later: at its end, where the next one starts; friction: between
    objects that have a velocity field each, or None.
    """

    gravity: Array | None
    boundaries: tuple
    dt: Array
    ahead: Array
    time: Array
    later: Array
    friction: Array | None = None


class Matter(NamedTuple):
    """What no step changes, of some particles: mass (N,) [kg], volume (N,) [m^3], parameters of
    their law, the loads of every boundary, and in which velocity field they move, (N,) int32 or
    None where there is one.
    """

    mass: Array
    volume: Array
    parameters: dict[str, Array]
    loads: tuple[dict[str, Array], ...]
    field: Array | None = None


class Particles(NamedTuple):
    """What a step changes, of some particles, as in `State`; history: the rows of their law;
    velocity: None where it is what the grid's is.
    """

    position: Array
    deformation: Array
    total: Array | None
    history: Array | None
    slip: Array | None
    velocity: Array | None = None


class Flow(NamedTuple):
    """Velocity (3, N) [m/s] and its first moment (3, 3, N) [m^2/s] at some particles.

    before: (3, N) [m/s] what the velocity was before forces and boundaries acted on the grid, or
    None where no particle has a velocity of its own. volume: (N,) mean of J - 1 around each, by
    mass, or None where no law asks for it.
    """

    velocity: Array
    moment: Array
    before: Array | None = None
    volume: Array | None = None

    @classmethod
    def of(cls, config: Config, sums: Array, moments: Array) -> "Flow":
        """What `gather` gives, by names."""
        before = volume = None
        others = sums[4:]
        if config.transfer.keeps_velocity:
            before, others = others[:3], others[3:]
        if config.shares_volume:
            volume = others[0]
        return cls(sums[:3], moments[:3], before, volume)

    @property
    def vectors(self) -> tuple[Array, Array]:
        """Its vectors and their moments, as `scatter` takes them."""
        others = [] if self.before is None else [self.before]
        if self.volume is not None:
            others.append(self.volume[None])
        if not others:
            return self.velocity, self.moment
        more = jnp.concatenate(others)
        none = jnp.zeros((len(more), *self.moment.shape[1:]), self.moment.dtype)
        return jnp.concatenate([self.velocity, more]), jnp.concatenate([self.moment, none])


def velocity_gradient(config: Config, flow: Flow) -> Array:
    """C = 4 / dx^2 B (3, 3, N) [1/s], with cubic splines 3 / dx^2 B (Jiang et al. 2015)."""
    return flow.moment * (config.kernel.inverse_inertia / config.grid.spacing**2)


def move(
    config: Config,
    law: Law,
    shared: Shared,
    matter: Matter,
    particles: Particles,
    residual: Residual | None,
    flow: Flow,
    still: Array | bool,
) -> tuple[Particles, Residual | None, Flow]:
    """Particles, residuals and flow after boundaries at particles, x <- x + dt v, and
    F <- (I + dt C) F. The velocity of the flow is afterwards the particles' own.

    still: () bool, whether nothing moves: what comes before the first step.
    """

    def held(velocity):
        after = stages.on_particles(
            shared.boundaries,
            matter.loads,
            particles.position,
            velocity,
            shared.time,
            shared.dt,
        )
        return jnp.where(still, velocity, after)

    own = None
    if particles.velocity is not None and flow.before is not None:
        with part("velocity of its own"):
            beyond = config.transfer.scheme.blend * (particles.velocity - flow.before)
            own = held(flow.velocity + beyond)
    flow = flow._replace(velocity=held(flow.velocity))
    dt = jnp.where(still, 0, shared.dt)
    C = velocity_gradient(config, flow)
    carried = residual or Residual(None, None, None, None)
    position, position_rest = compensated.add(
        particles.position, carried.position, dt * flow.velocity
    )
    F, F_rest = compensated.add(
        particles.deformation, carried.deformation, dt * algebra.matmul(C, particles.deformation)
    )
    total, total_rest = particles.total, None
    if total is not None:
        with part("second deformation gradient"):
            total, total_rest = compensated.add(total, carried.total, dt * algebra.matmul(C, total))
    moved = particles._replace(position=position, deformation=F, total=total)
    if law.shares_volume and flow.volume is not None and particles.history is not None:
        with part("mean volume"):
            ratio = jnp.log1p(flow.volume) - jnp.log1p(volume_change(particles.deformation))
            moved = moved._replace(history=jnp.where(still, particles.history, ratio[None]))
    kept = Residual(position_rest, F_rest, total_rest, None)
    if own is not None:
        moved = moved._replace(velocity=own)
        if particles.slip is not None:
            # Contact takes a particle to have moved by dt times its own velocity.
            ahead = jnp.tile(flow.velocity - own, (len(particles.slip) // 3, 1))
            moved = moved._replace(slip=particles.slip + dt * ahead)
        flow = flow._replace(velocity=own)
    return moved, None if residual is None else kept, flow


def give(
    config: Config, law: Law, shared: Shared, matter: Matter, particles: Particles, flow: Flow
) -> tuple[Particles, Array, Array, Wrench | None]:
    """Particles past their law (return map and stress of the trial gradient together) and past
    contact, and what they give to the grid: momentum (3, N) [kg m/s] and affine part (3, 3, N),
    followed by what the two are without stress and contact where particles have a velocity of their
    own, and by m (J - 1) where volumes are shared; and what of it a rigid body gave.
    """
    history = particles.history
    kept = jnp.zeros((0, *matter.mass.shape), matter.mass.dtype) if history is None else history
    with part(f"law {law.name}"):
        F, stress, kept = law.update(matter.parameters, particles.deformation, kept, shared.dt)
    # Momentum changes by m C per metre, less the impulse of the stress: -dt V tau grad w, in which
    # MLS-MPM replaces grad w by w (x_i - x_p) 4 / dx^2, or 3 / dx^2 for a cubic w.
    per_metre = -config.kernel.inverse_inertia / config.grid.spacing**2
    impulse = per_metre * shared.ahead * matter.volume
    spin = None
    if config.transfer.scheme.affine:
        spin = matter.mass * velocity_gradient(config, flow)
    affine = impulse * stress if spin is None else spin + impulse * stress
    momentum = matter.mass * flow.velocity
    given, slip, wrench = stages.impulses(
        shared.boundaries,
        matter.loads,
        particles.position,
        flow.velocity,
        particles.slip,
        shared.later,
        shared.ahead,
        shared.dt,
    )
    if particles.velocity is not None:
        affine = jnp.concatenate([affine, jnp.zeros_like(affine) if spin is None else spin])
        momentum = jnp.concatenate([momentum if given is None else momentum + given, momentum])
    elif given is not None:
        momentum = momentum + given
    if config.shares_volume:
        with part("mean volume"):
            change = matter.mass * volume_change(F)
            momentum = jnp.concatenate([momentum, change[None]])
            affine = jnp.concatenate([affine, jnp.zeros_like(affine[:1])])
    after = particles._replace(deformation=F, slip=slip)
    if history is not None:
        after = after._replace(history=kept)
    return after, momentum, affine, wrench


def update_grid(shared: Shared, lightest: Array, rows: Array) -> Array:
    """Node velocities [m/s] from momentum and mass rows, both (M, 4), column 3 of what it gives
    being void; or (M, 8), where the second half has what forces leave alone: what velocities were
    before any, or mean volumes.

    lightest: [kg] () nodes with no more stand still: below eps^2 of the heaviest particle a node
    adds less than round-off to any particle, and dividing by its mass could overflow.
    """
    mass = rows[:, 3:4]
    filled = mass > lightest
    rows = rows / jnp.where(filled, mass, 1.0)
    if shared.gravity is not None:
        with part("gravity"):
            # All four columns at once: XLA would otherwise pad each row that a transfer reads.
            fall = jnp.concatenate([shared.gravity, jnp.zeros_like(shared.gravity[:1])])
            if rows.shape[1] == 8:
                fall = jnp.concatenate([fall, jnp.zeros_like(fall)])
            rows = rows + shared.dt * fall
    return jnp.where(filled, rows, 0.0)
