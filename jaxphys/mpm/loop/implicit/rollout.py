"""Many implicit steps: as long as speeds allow, or of lengths that are given."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.loop.adjoint import Adjoint, Plain, repeat
from jaxphys.mpm.loop.implicit.solve import Effort
from jaxphys.mpm.loop.implicit.step import Moving, attempt, taken_apart, told
from jaxphys.mpm.loop.particle_step import Flow
from jaxphys.mpm.loop.rollout import keep_good
from jaxphys.mpm.loop.status import NO_FAILURE
from jaxphys.mpm.state import (
    CODES,
    LEFT_GRID,
    LEFT_WINDOW,
    NOT_CONVERGED,
    OK,
    Config,
    Model,
    State,
    Status,
)
from jaxphys.mpm.stepping.implicit import GRADIENT, GROWTH, MOST_STEPS, Implicit, crossing_time

PLAIN, DEFAULT = Plain(), Implicit()


class ImplicitReport(NamedTuple):
    """What a rollout took. Arrays () but for `lengths`.

    steps: taken; rejected: tried and taken shorter; effort: of all of them; lengths: (most_steps,)
    [s] of the steps taken, 0 from then on.
    """

    steps: Array
    rejected: Array
    effort: Effort
    lengths: Array


def implicit_steps(
    config: Config,
    model: Model,
    state: State,
    lengths,
    stepping: Implicit = DEFAULT,
    adjoint: Adjoint = PLAIN,
) -> State:
    """The state after steps of given `lengths` (K,) [s], those of 0 left out; or `state` with the
    failure's status if one fails.

    This is how a rollout is differentiated: its lengths, as `implicit_rollout` reports them, are
    taken again. The gradient is that of these steps, not of how they were chosen.
    """
    bodies, moving, put = taken_apart(config, model, state)
    lengths = jnp.asarray(lengths, state.position.dtype)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)

    def taken(carry):
        moving, status, past, k = carry
        tried = attempt(
            config,
            stepping,
            bodies,
            boundaries,
            model.gravity,
            moving,
            state.time + past,
            lengths[k],
        )
        return tried.moving, told(status, tried), past + lengths[k], k + 1

    def body(carry):
        k = carry[-1]
        return jax.lax.cond(lengths[k] > 0, taken, lambda c: (*c[:-1], c[-1] + 1), carry)

    count = lengths.shape[0]
    carry = (moving, state.status, jnp.zeros_like(state.time), jnp.zeros((), jnp.int32))
    moving, status, past, _ = repeat(adjoint, body, carry, count)
    return keep_good(state, put(moving, past, status), count)


def implicit_rollout(
    config: Config,
    model: Model,
    state: State,
    *,
    time,
    stepping: Implicit = DEFAULT,
    share=1.0,
) -> tuple[State, ImplicitReport]:
    """The state exactly `time` [s] later, and what it took; or `state` with the failure's status.

    Steps are as long as speeds allow: no particle crosses more than ADVECTION cells or is deformed
    by more than GRADIENT. One that cannot be solved is tried again with half the length. One loop
    without host traffic; for derivatives see `implicit_steps`.

    share: of the step that `stepping` takes, () in (0, 1].
    """
    bodies, moving, put = taken_apart(config, model, state)
    dtype = state.position.dtype
    time = jnp.asarray(time, dtype)
    boundaries = tuple(boundary.shared() for boundary in model.boundaries)
    most = stepping.most_steps or MOST_STEPS
    share = jnp.asarray(share, dtype)
    longest = share * (time if stepping.dt is None else jnp.minimum(time, stepping.dt))
    shortest = longest / most

    class Carry(NamedTuple):
        moving: Moving
        status: Status
        left: Array
        wanted: Array
        report: ImplicitReport

    def going(c: Carry):
        return (c.left > 0) & (c.status.code == OK)

    def body(c: Carry):
        wanted = jnp.minimum(c.wanted, share * _speed_limit(config, model, c.moving.flows))
        # All that are left of one length; the last one ends where the time does.
        count = jnp.maximum(jnp.ceil(c.left / wanted - 1e-4), 1)
        dt = c.left / count
        now = state.time + (time - c.left)
        tried = attempt(config, stepping, bodies, boundaries, model.gravity, c.moving, now, dt)
        lost = tried.failure % CODES
        hopeless = (tried.failure < NO_FAILURE) & ((lost == LEFT_GRID) | (lost == LEFT_WINDOW))
        good = tried.solved & (tried.failure == NO_FAILURE)
        last = ~good & (hopeless | (0.5 * dt < shortest))
        full = good & (c.report.steps + 1 >= most) & (count > 1)
        status = jax.tree.map(partial(jnp.where, good | last), told(c.status, tried), c.status)
        status = status._replace(
            code=jnp.where(full, NOT_CONVERGED, status.code),
            step=jnp.where(full, c.report.steps, status.step),
        )
        effort = jax.tree.map(jnp.add, c.report.effort, tried.effort)
        report = ImplicitReport(
            c.report.steps + good.astype(jnp.int32),
            c.report.rejected + (~good).astype(jnp.int32),
            effort,
            c.report.lengths.at[c.report.steps].set(jnp.where(good, dt, 0), mode="drop"),
        )
        return Carry(
            jax.tree.map(partial(jnp.where, good), tried.moving, c.moving),
            status,
            jnp.where(good, jnp.where(count > 1, c.left - dt, 0), c.left),
            jnp.where(good, jnp.minimum(GROWTH * jnp.maximum(dt, 0), longest), 0.5 * dt),
            report,
        )

    none = jnp.zeros((), jnp.int32)
    report = ImplicitReport(none, none, Effort.none(), jnp.zeros(most, dtype))
    end = jax.lax.while_loop(going, body, Carry(moving, state.status, time, longest, report))
    after = put(end.moving, time, end.status)
    return keep_good(state, after, jnp.ones((), jnp.int32)), end.report


def _speed_limit(config: Config, model: Model, flows: tuple[Flow, ...]) -> Array:
    """How long a step may be for the speeds of now and what gravity adds to them [s], ()."""
    dx = config.grid.spacing
    speed = jnp.sqrt(jnp.max(jnp.stack([jnp.max(_squares(f.velocity, 1)) for f in flows])))
    rates = [jnp.max(_squares(f.moment, (1, 2))) for f in flows]
    rate = 4 / dx**2 * jnp.sqrt(jnp.max(jnp.stack(rates)))
    tiny = jnp.finfo(speed.dtype).tiny ** 0.5
    return jnp.minimum(crossing_time(dx, speed, model.gravity), GRADIENT / (rate + tiny))


def _squares(x: Array, axes) -> Array:
    return jnp.sum(x * x, axis=axes)
