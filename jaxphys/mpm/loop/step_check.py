"""Whether a time step is one that the state allows, before the first of many is taken."""

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.loop.one_pass import whole
from jaxphys.mpm.loop.particle_step import Matter, Particles
from jaxphys.mpm.loop.placement import AXIS, spread
from jaxphys.mpm.loop.status import NO_FAILURE, least
from jaxphys.mpm.state import OK, UNSTABLE_STEP, Config, Status
from jaxphys.mpm.stepping.bounds import hard_limit


def checked(
    config: Config,
    matter: tuple[Matter, ...],
    flags: tuple[Matter, ...],
    deformation: tuple[Array, ...],
    history: tuple[Array | None, ...],
    numbers: tuple[Array, ...],
    contact: Array,
    status: Status,
    dt: Array,
) -> Status:
    """`status`, which becomes UNSTABLE_STEP if it is sound but the state too stiff for `dt` [s].

    Of particles one for each run, in chunks; history: of those whose stiffness depends on it;
    contact: `contact_bound` [s], ().
    """
    run = spread(config.placement, lambda _, own: (weakest(config, own), None), _least_of_devices)
    own = jax.lax.stop_gradient((matter, flags, deformation, history, numbers))
    (limit, particle), _ = run(None, own)
    # A step at the limit passes, whichever way its digits were rounded; not a number does not.
    allowed = jax.lax.stop_gradient(dt) <= (1 + 1e-4) * jnp.minimum(limit, contact)
    fails = (status.code == OK) & ~allowed
    return status._replace(
        code=jnp.where(fails, UNSTABLE_STEP, status.code),
        step=jnp.where(fails, status.taken, status.step),
        particle=jnp.where(fails, particle, status.particle),
    )


def stiffening(config: Config, particles: tuple[Particles, ...]) -> tuple[tuple, tuple]:
    """What the stiffness of particles depends on, for each run: deformations, and histories or None
    where they change nothing.
    """
    history = tuple(
        own.history if law.hardened is not None else None
        for (law, _, _), own in zip(config.runs, particles, strict=True)
    )
    return tuple(own.deformation for own in particles), history


def weakest(config: Config, own) -> tuple[Array, Array]:
    """The least `hard_limit` [s] of any particle, (), and the number of the first that has it.

    Chunk by chunk, since all at once it goes through memory some twenty times.
    """
    best = jnp.array(jnp.inf, own[2][0].dtype), jnp.array(NO_FAILURE, jnp.int32)

    def of_chunk(law, best, chunk):
        matter, flags, F, history, numbers = chunk
        matter = whole(matter, flags)
        parameters = law.present(matter.parameters, history)
        density = matter.mass / jnp.where(matter.mass > 0, matter.volume, 1)
        limits = hard_limit(law, parameters, F, density, config.grid.spacing, config.transfer)
        # NaN counts as the least of all.
        limits = jnp.where(jnp.isnan(limits), -1, limits)
        lowest = least(limits)
        number = least(jnp.where((limits <= lowest) & (numbers >= 0), numbers, NO_FAILURE))
        return _less(best, (lowest, number)), None

    for (law, _, _), *parts in zip(config.runs, *own, strict=True):
        best, _ = jax.lax.scan(partial(of_chunk, law), best, tuple(parts))
    return best


def _less(one, other):
    """Of two (limit, number), the one of the lower limit, and of the lower number where equal."""
    lower = (other[0] < one[0]) | ((other[0] == one[0]) & (other[1] < one[1]))
    return tuple(jnp.where(lower, b, a) for a, b in zip(one, other, strict=True))


def _least_of_devices(best):
    limit = jax.lax.pmin(best[0], AXIS)
    return limit, jax.lax.pmin(jnp.where(best[0] <= limit, best[1], NO_FAILURE), AXIS)
