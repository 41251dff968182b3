"""What must move moves, and what is no answer says so."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.spectral import log_stretches
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import _choose, rollout, step
from jaxphys.mpm.loop.status import SimulationError, check
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN, lame
from jaxphys.mpm.state import (
    COLLAPSED,
    INVERTED,
    OK,
    STEP_TOO_LARGE,
    UNSTABLE_STEP,
    Config,
    Model,
    initial_state,
)
from jaxphys.mpm.stepping.bounds import isolated_bound, present_bounds

from .cases import KINDS, block, count_primitives
from .test_step import remembering

SPACING = 0.1
jit_step = jax.jit(step, static_argnums=0)


def steel(places, dtype=jnp.float32, law=NEO_HOOKEAN, **motion):
    """Eight particles of steel, a cell wide, around each of `places` along the diagonal."""
    corners = np.stack(np.meshgrid(*[[-0.025, 0.025]] * 3, indexing="ij"), -1).reshape(8, 3)
    position = np.concatenate([place + corners for place in places])
    count = len(position)
    config = Config(Grid((27, 27, 27), SPACING), ((law, 0, count),))
    model = Model(
        mass=jnp.full(count, 7800 * 1.25e-4, dtype),
        volume=jnp.full(count, 1.25e-4, dtype),
        parameters={
            "youngs_modulus": jnp.full(count, 2e11, dtype),
            "poisson_ratio": jnp.full(count, 0.3, dtype),
        },
        gravity=None,
    )
    return config, model, initial_state(config, position, dtype=dtype, **motion)


def moved(before, after, name):
    """How far a sum went, in float64, with what it still carries."""
    change = np.asarray(getattr(after, name), np.float64) - np.asarray(getattr(before, name))
    return change + np.asarray(getattr(after.residual, name))


PLACES = (0.15, 1.0, 2.4)


@pytest.mark.parametrize("speed", [pytest.param(0.01, marks=pytest.mark.slow), 0.03])
def test_steel_drifts_in_float32(speed):
    """Steps of 1e-8 m are less than a rounding of 1 m, and arrive all the same; so does time."""
    config, model, state = steel(PLACES)
    state = state._replace(velocity=jnp.full_like(state.velocity, speed))
    steps, dt = 10_000, 1e-6
    end = jax.jit(partial(rollout, config, steps=steps))(model, state, dt=dt)
    check(end.status)
    far = moved(state, end, "position").reshape(3, len(PLACES), 8).mean(2)
    np.testing.assert_allclose(far, speed * steps * dt, rtol=1e-3)
    assert abs(float(end.time) - steps * dt) < 1e-6 * steps * dt


def test_slow_strain_arrives_in_float32():
    """A velocity gradient of 1e-2/s that nothing resists: 1e-8 a step."""
    rate = 1e-2 * np.array([[1.0, 0.5, 0.0], [0.2, -1.0, 0.3], [0.0, 0.7, 0.4]])
    model = Model(jnp.ones(1, jnp.float32), jnp.ones(1, jnp.float32), {}, None)
    steps, dt = 20_000, 1e-6
    for plastic in (False, True):
        law = replace(remembering(0), plastic=plastic)
        # The law has no energy to take moduli from.
        config = Config(
            Grid((6, 6, 6), SPACING), ((law, 0, 1),), track_total=True, check_step=False
        )
        state = initial_state(config, [[0.25, 0.28, 0.3]], affine=rate[None], dtype=jnp.float32)
        end = jax.jit(partial(rollout, config, steps=steps))(model, state, dt=dt)
        check(end.status)
        expected = steps * dt * (rate + 0.5 * steps * dt * rate @ rate)
        assert (end.total is not None) == plastic
        for name in ("deformation", "total")[: 1 + plastic]:
            found = moved(state, end, name)[..., 0]
            np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())


def test_float64_carries_nothing():
    config, model, state = block(count=5)
    assert state.residual is None and jit_step(config, model, state, 1e-3).residual is None
    _, _, narrow = block(count=5, dtype=jnp.float32)
    assert narrow.residual.total is None
    assert narrow.residual.deformation.shape == narrow.deformation.shape


def test_the_gradient_carries_no_residual():
    """A step of float32 keeps as many numbers for the way back as one of float64."""

    def kept(dtype):
        config, model, state = block(count=7, dtype=dtype)

        def loss(position):
            end = rollout(config, model, state._replace(position=position), dt=dtype(1e-4), steps=5)
            return jnp.sum(end.position**2) + jnp.sum(end.deformation**2)

        jaxpr = jax.make_jaxpr(jax.grad(loss))(state.position).jaxpr
        loops = [e for e in jaxpr.eqns if e.params.get("length") == 5]
        forward, backward = loops
        stacked = forward.outvars[forward.params["num_carry"] :]
        sizes = [v.aval.size // 5 for v in stacked if jnp.issubdtype(v.aval.dtype, jnp.floating)]
        return sum(sizes), len(backward.outvars)

    numbers, cotangents = kept(jnp.float32)
    assert (numbers, cotangents) == kept(jnp.float64)
    # A start, what it gathered, and the rows.
    assert numbers >= 12 * 7 + 12 * 7 + 4 * 9 * 10 * 11


# What is turned inside out, or as flat as a point.


def material_block(name, F, count=27):
    law = MATERIALS[name].law
    values = MATERIALS[name].defaults
    line = 0.3 + 0.05 * np.arange(3)
    position = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    config = Config(Grid((9, 9, 9), SPACING), ((law, 0, count),))
    model = Model(
        mass=jnp.full(count, values["density"] * 1.25e-4),
        volume=jnp.full(count, 1.25e-4),
        parameters={n: jnp.full(count, values[n]) for n in law.parameters},
        gravity=None,
    )
    state = initial_state(config, position, dtype=jnp.float64)
    return config, model, state._replace(deformation=jnp.moveaxis(jnp.asarray(F), 0, -1))


MIRROR = np.broadcast_to(np.diag([1.02, 0.97, -0.9]), (27, 3, 3))
ONE = np.broadcast_to(np.eye(3), (27, 3, 3)).copy()
ONE[13] = np.diag([1.0, 1.0, -0.5])
FLAT = np.broadcast_to(np.diag([1.0, 1.0, 5e-4]), (27, 3, 3))


@pytest.mark.parametrize(
    "name", [n if n in KINDS else pytest.param(n, marks=pytest.mark.slow) for n in MATERIALS]
)
def test_what_is_inside_out_or_flat_is_never_sound(name):
    run = None
    for F, code, particle in ((MIRROR, INVERTED, 0), (ONE, INVERTED, 13), (FLAT, COLLAPSED, 0)):
        if F is FLAT and name == "snow":
            continue  # it gives way: the volume is gone for good, and what is left is sound
        config, model, state = material_block(name, F)
        run = run or jax.jit(partial(rollout, replace(config, check_step=False), steps=3))
        end = run(model, state, dt=1e-6)
        assert [int(x) for x in end.status[:3]] == [code, 0, particle]
        np.testing.assert_array_equal(end.deformation, state.deformation)
        with pytest.raises(SimulationError, match=f"particle {particle} (is turned|was pressed)"):
            check(end.status)
    # Control: a rotation and a fair squeeze are sound.
    fair = np.broadcast_to(np.array([[0, -0.9, 0], [0.9, 0, 0], [0, 0, 1.0]]), (27, 3, 3))
    config, model, state = material_block(name, fair)
    assert int(run(model, state, dt=1e-6).status.code) == OK


def test_what_is_inside_out_is_told_as_such_where_its_stress_is_no_number():
    """Neo-Hookean stress has the logarithm of det F: a run would say NOT_FINITE after a step."""
    config, model, state = block(count=27, check_step=False)
    run = jax.jit(partial(rollout, config, steps=3))
    assert int(run(model, state, dt=1e-6).status.code) == OK
    state = state._replace(deformation=jnp.moveaxis(jnp.asarray(ONE), 0, -1))
    end = run(model, state, dt=1e-6)
    assert [int(x) for x in end.status[:3]] == [INVERTED, 0, 13]
    np.testing.assert_array_equal(end.deformation, state.deformation)


def test_the_initial_state_refuses_what_is_inside_out():
    config, _, state = material_block("jelly", MIRROR)
    with pytest.raises(InputError, match=r"deformation\[13\] has determinant -0.5"):
        initial_state(config, state.position.T, deformation=ONE)
    with pytest.raises(InputError, match=r"deformation\[0\]"):
        initial_state(config, state.position.T, deformation=0 * ONE)


def test_a_step_that_deforms_by_more_than_itself_is_too_large():
    """det(I + dt C) changes its sign only where |dt C| >= 1."""
    config, model, state = material_block("jelly", np.broadcast_to(np.eye(3), (27, 3, 3)))
    centre = jnp.mean(state.position, axis=1, keepdims=True)

    def squeezed(share):
        rate = -share / 1e-3
        velocity = jnp.zeros_like(state.velocity).at[2].set(rate * (state.position - centre)[2])
        affine = state.affine.at[2, 2].set(rate)
        moving = state._replace(velocity=velocity, affine=affine)
        return jit_step(config, model, moving, 1e-3)

    # At dt C = -1.1 the middle would come out upside down, though no particle moves a cell.
    end = squeezed(1.1)
    assert int(end.status.code) == STEP_TOO_LARGE
    assert float(jnp.min(jnp.linalg.det(jnp.moveaxis(end.deformation, -1, 0)))) < 0
    assert float(jnp.max(jnp.abs(end.velocity))) * 1e-3 < SPACING
    assert int(squeezed(0.9).status.code) == OK


# A particle alone at finite strain.

STRAINS = (0.01, 0.03, 0.1, 0.3)
LAWS = (FIXED_COROTATED, NEO_HOOKEAN, HENCKY)


ALONE = {"youngs_modulus": 1e5, "poisson_ratio": 0.3}


def stored(law, F):
    """Energy per rest volume of F (3, 3, N) [J/m^3]."""
    return law.principal_energy(ALONE, jnp.exp(log_stretches(F)))


def strained(law):
    """F of every strain in squeezing and stretching, all ways and one way, and in shear."""
    gradients = []
    for e in STRAINS:
        for logs in ((-e, -e, -e), (e, e, e), (-e, 0, 0), (e, 0, 0), (e, -e, 0)):
            gradients.append(np.diag(np.exp(logs)))
        gradients.append(np.eye(3) + e * np.outer([1, 0, 0], [0, 1, 0]))
    F = np.array(gradients)
    if law is FIXED_COROTATED:
        # It takes mu + lambda / 2 to flatten this one, whatever the step: 1.35 I holds more.
        mu, lam = lame(ALONE)
        F = F[np.asarray(stored(law, jnp.moveaxis(F, 0, -1))) < mu + lam / 2]
        assert len(F) == 6 * len(STRAINS) - 1
    return F


def swing(share, bound, steps=5000):
    """(largest energy over the first, code) of particles of every law, alone, at `share` of their
    bounds: a particle's density is such that all bounds are the same.
    """
    parts = [strained(law) for law in LAWS]
    edges = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    count = edges[-1]
    segments = tuple(zip(LAWS, edges[:-1], edges[1:], strict=True))
    # Three nodes each, and none of them shared.
    lines = [0.21 + 0.3 * np.arange(n) for n in (5, 5, 3)]
    places = np.stack(np.meshgrid(*lines, indexing="ij"), -1)
    config = Config(Grid((16, 16, 10), SPACING), segments)
    state = initial_state(config, places.reshape(-1, 3)[:count], deformation=np.concatenate(parts))
    parameters = {name: jnp.full(count, value) for name, value in ALONE.items()}
    dt, density = 1e-3, []
    for law, start, stop in segments:
        one = bound(law, ALONE, state.deformation[..., start:stop], jnp.ones(stop - start), SPACING)
        density.append((dt / (share * one)) ** 2)
    volume = 1.25e-4
    density = jnp.concatenate(density)
    model = Model(density * volume, jnp.full(count, volume), parameters, None)

    def energy(state):
        moving = density * SPACING**2 / 8 * jnp.sum(state.affine**2, axis=(0, 1))
        return moving + jnp.concatenate(
            [stored(law, state.deformation[..., a:b]) for law, a, b in segments]
        )

    def body(_, carry):
        state, most = carry
        state = jax.lax.fori_loop(0, 10, lambda _, s: step(config, model, s, dt), state)
        return state, jnp.maximum(most, energy(state))

    first = energy(state)
    end, most = jax.jit(lambda s: jax.lax.fori_loop(0, steps // 10, body, (s, first)))(state)
    return np.asarray(most / first), int(end.status.code)


@pytest.mark.slow
def test_a_particle_alone_keeps_its_energy_at_the_bound():
    def bound(law, parameters, F, density, spacing):
        return isolated_bound(law, parameters, F, 0 * F, density, spacing)

    grown, code = swing(0.99, bound)
    assert code == OK
    assert grown.max() < 3, grown


@pytest.mark.slow
def test_at_the_limit_of_what_it_is_now_it_does_not():
    """Control: the bound of the present stiffness alone lets it swing out and fail."""
    grown, code = swing(0.99, lambda *a: present_bounds(*a)[1], steps=100)
    assert code != OK and not grown.max() < 100


# Bounds at every frame, and gradients of what failed.


def test_a_step_too_long_for_the_numbers_fails_at_the_start_of_a_frame():
    config, model, state = block()
    run = jax.jit(partial(rollout, config, steps=2))
    dt = 2e-3
    assert int(run(model, state, dt=dt).status.code) == OK
    stiff = model.parameters | {"youngs_modulus": model.parameters["youngs_modulus"].at[7].set(1e7)}
    end = run(replace(model, parameters=stiff), state, dt=dt)
    assert [int(x) for x in end.status[:3]] == [UNSTABLE_STEP, 0, 7]
    np.testing.assert_array_equal(end.position, state.position)
    with pytest.raises(SimulationError, match="step 0: particle 7 is stiffer than the step allows"):
        check(end.status)
    # What failed before stays; numbers that are none are no bound.
    failed = state._replace(status=state.status._replace(code=jnp.int32(INVERTED)))
    end = run(replace(model, parameters=stiff), failed, dt=dt)
    assert int(end.status.code) == INVERTED
    nan = jax.tree.map(lambda p: p * jnp.nan, model.parameters)
    assert int(run(replace(model, parameters=nan), state, dt=dt).status.code) == UNSTABLE_STEP
    off = jax.jit(partial(rollout, replace(config, check_step=False), steps=1))
    assert int(off(replace(model, parameters=stiff), state, dt=dt).status.code) != UNSTABLE_STEP


def test_the_gradient_of_a_failure_is_not_a_number():
    config, model, state = block(count=20)

    def end_of(modulus, gravity, position, dt):
        parameters = model.parameters | {"youngs_modulus": modulus * jnp.ones(20)}
        changed = replace(model, parameters=parameters, gravity=gravity)
        end = rollout(config, changed, state._replace(position=position), dt=dt, steps=2)
        return jnp.sum(end.position**2), end

    numbers = (1e3, model.gravity, state.position)
    run = jax.jit(jax.value_and_grad(end_of, argnums=(0, 1, 2), has_aux=True))
    (_, end), gradient = run(*numbers, 1e-3)
    assert int(end.status.code) == OK
    assert all(bool(jnp.isfinite(g).all()) for g in gradient)
    (value, end), gradient = run(*numbers, 1.0)
    assert int(end.status.code) == UNSTABLE_STEP and bool(jnp.isfinite(value))
    np.testing.assert_array_equal(end.position, state.position)
    assert all(bool(jnp.isnan(g).all()) for g in gradient)


def test_a_kept_value_has_no_tangent_either():
    """Forward mode, which the transfers do not have, at the one place that decides."""
    numbers, slopes = ((jnp.array(a), jnp.array(b)) for a, b in ((1.0, 2.0), (5.0, 7.0)))
    for good, slope in ((True, 5.0), (False, jnp.nan)):
        value, found = jax.jvp(
            lambda new, old, good=good: _choose(jnp.array(good), new, old), numbers, slopes
        )
        assert float(value) == (1.0 if good else 2.0)
        np.testing.assert_equal(float(found), slope)


def test_no_gravity_is_not_traced():
    config, model, state = block(count=5)
    jaxpr = jax.make_jaxpr(step, static_argnums=0)
    falling = jaxpr(config, model, state, 1e-3).jaxpr
    floating = jaxpr(config, replace(model, gravity=None), state, 1e-3).jaxpr
    for name in ("add", "mul", "concatenate"):
        assert count_primitives(falling, name) == count_primitives(floating, name) + 2  # two passes
    zero = jit_step(config, replace(model, gravity=jnp.zeros(3)), state, 1e-3)
    none = jit_step(config, replace(model, gravity=None), state, 1e-3)
    np.testing.assert_array_equal(zero.velocity, none.velocity)
