"""A frame in steps that adapt: blocks of passes, between which the bounds are looked at again.

chunks --look--> dt --a few passes--> chunks --look--> dt --> ... --last pass--> state

What a look needs of all particles it reads off the chunks (F) or off the pass before (speed, rate
of deformation), so that the state stays cut. A pass begins the next step while it ends its own, so
a look's step is the second one after it.

A frame that fails is not taken up again in its middle: that would keep a second copy of all chunks
and write it in each block, for what happens in few frames, and frames are tried again as a whole
anyway (`pipeline.frames`), with a share of the bounds.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.loop.one_pass import whole
from jaxphys.mpm.loop.placement import AXIS, spread
from jaxphys.mpm.loop.rates import fastest
from jaxphys.mpm.loop.rollout import Chunks, Passes, keep_good, prepared
from jaxphys.mpm.loop.status import NO_FAILURE, least
from jaxphys.mpm.loop.step_check import stiffening
from jaxphys.mpm.state import OK, TOO_MANY_STEPS, UNSTABLE_STEP, Config, Model, State
from jaxphys.mpm.stepping.adaptive import GROWTH, LEAST, Adaptive, Steps, matter_bounds, next_steps
from jaxphys.mpm.stepping.bounds import ADVECTION, GRADIENT, SAFETY, contact_bound
from jaxphys.mpm.stepping.fixed import MOST_STEPS


def rollout_adaptively(
    config: Config,
    model: Model,
    state: State,
    stepping: Adaptive,
    *,
    duration,
    share=1.0,
    record: int = 0,
) -> tuple[State, Steps]:
    """The state `duration` [s] later, or `state` with the failure's status, and the steps taken.

    Pure and free of host traffic; one program for any number of steps, hence without reverse mode:
    for gradients replay the steps, `rollout(..., dt=steps.dt, steps=steps.count)`. The end is hit
    to a rounding. The steps begin anew from the bounds, whatever was before.

    Args:
        share: of the step that `stepping` takes, () in (0, 1].
        record: how many steps are kept, M; as many are taken at most, if it is not 0.

    Raises:
        InputError: as `rollout`.
    """
    config = replace(config, tells_rates=True)
    passes = prepared(config, model, state)
    dtype = state.position.dtype
    most = min(stepping.most_steps or MOST_STEPS, record or MOST_STEPS)
    duration, share = jnp.asarray(duration, dtype), jnp.asarray(share, dtype)
    start = passes.cut()
    fixed = _lasting(passes, start, state.time, duration)

    def block(carry):
        chunks, dt, left, taken, kept = carry
        bound, limit, particle = _look(passes, chunks, stepping.safety, fixed)
        bound = jnp.where(chunks.first, share * bound, jnp.minimum(share * bound, GROWTH * dt))
        chunks = _told(chunks, bound, jnp.where(chunks.first, 0, dt), limit, particle)
        sound = chunks.status.code == OK
        count, ahead = next_steps(left, bound, most)
        passes_now = jnp.where(
            sound, jnp.minimum(jnp.minimum(count, stepping.every), most - taken), 0
        )

        def once(k, chunks):
            return passes.run(chunks, jnp.where((k == 0) & ~chunks.first, dt, ahead), ahead)

        chunks = jax.lax.fori_loop(0, passes_now, once, chunks)
        place = jnp.arange(record)
        kept = jnp.where((place >= taken) & (place < taken + passes_now), ahead, kept)
        left = jnp.where(passes_now == count, 0, left - passes_now * ahead)
        taken = taken + passes_now
        return _spent(chunks, left, taken >= most, particle), ahead, left, taken, kept

    def goes_on(carry):
        chunks, _, left, *_ = carry
        return (chunks.status.code == OK) & (left > 0)

    none = jnp.zeros((), jnp.int32)
    first = start, duration, duration, none, jnp.zeros(record, dtype)
    chunks, dt, _, taken, kept = jax.lax.while_loop(goes_on, block, first)
    return keep_good(state, passes.end(chunks, dt), taken), Steps(kept, taken)


class Lasting(NamedTuple):
    """What holds for a frame, () each: the bound of contact [s], the largest speed of a boundary
    [m/s], and the step [s] that matter bears which swings about its rest.
    """

    contact: Array
    boundaries: Array
    swing: Array


def _lasting(passes: Passes, chunks: Chunks, begin: Array, duration: Array) -> Lasting:
    config, model = passes.config, passes.model
    speeds = [boundary.fastest(begin, begin + duration) for boundary in model.boundaries]
    speed = jnp.max(jnp.stack([jnp.zeros(()), *speeds])).astype(model.mass.dtype)
    F, history = stiffening(config, chunks.particles)
    rest = tuple(jnp.broadcast_to(jnp.eye(3, dtype=f.dtype)[..., None], f.shape) for f in F)
    _, limit, _ = _of_matter(passes, rest, history, SAFETY, jnp.zeros((), model.mass.dtype))
    return Lasting(contact_bound(model, config.grid), speed, LEAST / SAFETY * limit)


def _look(passes: Passes, chunks: Chunks, safety: float, fixed: Lasting):
    """(step to take [s], limit of stability [s], the particle that decides of matter), () each."""
    F, history = stiffening(passes.config, chunks.particles)
    wanted, limit, particle = _of_matter(passes, F, history, safety, fixed.swing)
    assert chunks.rates is not None  # what `Config.tells_rates` is for
    speed, rate = fastest(chunks.rates, wanted.dtype)
    advection = ADVECTION * passes.config.grid.spacing / jnp.maximum(speed, fixed.boundaries)
    others = jnp.minimum(jnp.minimum(advection, GRADIENT / rate), fixed.contact)
    return jnp.minimum(wanted, safety * others), jnp.minimum(limit, fixed.contact), particle


def _of_matter(passes: Passes, F: tuple, history: tuple, safety: float, swing: Array):
    """`_weakest` of all devices, for deformations and histories of each run."""
    config = passes.config
    own = passes.matter, passes.flags, F, history, passes.names

    def on_device(swing, own):
        return _weakest(config, safety, swing, own), None

    return spread(config.placement, on_device, _least_of_devices)(swing, own)[0]


def _weakest(config: Config, safety: float, swing: Array, own) -> tuple[Array, Array, Array]:
    """The least `matter_bounds` [s] of any particle, and the first that has the least step. Chunk
    by chunk: all at once would go through memory some twenty times.
    """
    dtype = own[2][0].dtype
    best = jnp.array(jnp.inf, dtype), jnp.array(jnp.inf, dtype), jnp.array(NO_FAILURE, jnp.int32)

    def of_chunk(law, best, chunk):
        matter, flags, F, history, numbers = chunk
        matter = whole(matter, flags)
        parameters = law.present(matter.parameters, history)
        density = matter.mass / jnp.where(matter.mass > 0, matter.volume, 1)
        parts = matter_bounds(
            law, parameters, F, density, config.grid.spacing, safety, swing, config.transfer
        )
        # NaN counts as the least of all.
        wanted, limit = (jnp.where(jnp.isnan(part), -1, part) for part in parts)
        lowest = least(wanted)
        number = least(jnp.where((wanted <= lowest) & (numbers >= 0), numbers, NO_FAILURE))
        return _lesser(best, (lowest, least(limit), number)), None

    for (law, _, _), *parts in zip(config.runs, *own, strict=True):
        best, _ = jax.lax.scan(partial(of_chunk, law), best, tuple(parts))
    return best


def _lesser(one, other):
    lower = (other[0] < one[0]) | ((other[0] == one[0]) & (other[2] < one[2]))
    number = jnp.where(lower, other[2], one[2])
    return jnp.minimum(one[0], other[0]), jnp.minimum(one[1], other[1]), number


def _least_of_devices(best):
    wanted, limit = jax.lax.pmin(best[:2], AXIS)
    return wanted, limit, jax.lax.pmin(jnp.where(best[0] <= wanted, best[2], NO_FAILURE), AXIS)


def _told(chunks: Chunks, bound: Array, dt: Array, limit: Array, particle: Array) -> Chunks:
    """With the failure of a state that has outrun the step `dt` [s], or gives no bound."""
    # A step at the limit passes, whichever way its digits were rounded; not a number does not.
    allowed = (bound > 0) & (dt <= (1 + 1e-4) * limit)
    return _failing(chunks, ~allowed, UNSTABLE_STEP, particle)


def _spent(chunks: Chunks, left: Array, spent: Array, particle: Array) -> Chunks:
    """With the failure of a frame whose steps are used up before its end."""
    return _failing(chunks, spent & (left > 0), TOO_MANY_STEPS, particle)


def _failing(chunks: Chunks, fails: Array, code: int, particle: Array) -> Chunks:
    status = chunks.status
    fails = (status.code == OK) & fails
    return chunks._replace(
        status=status._replace(
            code=jnp.where(fails, code, status.code),
            step=jnp.where(fails, status.taken, status.step),
            particle=jnp.where(fails, particle, status.particle),
        )
    )
