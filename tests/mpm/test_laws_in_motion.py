"""The laws beyond the five of the paper in the loop: gradients through steps, and their bounds."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.mpm.boundaries import Plane, Setting, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.loop.status import SimulationError, check
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN
from jaxphys.mpm.materials.fibres import FIBRES
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.mpm.materials.viscoelasticity import STANDARD_SOLID
from jaxphys.mpm.state import OK, UNSTABLE_STEP, Config, Model, initial_state
from jaxphys.mpm.stepping.bounds import largest_stable_dt, with_wave_modulus

from .materials.test_laws import LAWS, NAMES, NUMBERS

EACH = 6
DT = 2e-3


def several(names=NAMES):
    """Laws side by side, strained into yielding, above a floor: (config, model, state)."""
    random = np.random.default_rng(5)
    laws = [LAWS[name] for name in names]
    count = EACH * len(laws)
    segments = tuple((law, EACH * i, EACH * (i + 1)) for i, law in enumerate(laws))
    config = Config(Grid((8, 8, 8), 0.1), segments)
    position = 0.22 + 0.2 * random.random((count, 3))
    F = np.eye(3) + 0.04 * random.normal(size=(count, 3, 3))
    if names[0] == "water":  # a fluid's start is a multiple of the identity
        F[:EACH] = np.eye(3) * (1 + 0.01 * random.normal(size=(EACH, 1, 1)))
    volume = 1e-4 * (1 + random.random(count))
    boundaries = prepare(
        (Plane((0.0, 0.0, 0.21), friction=0.3),),
        Setting(config.grid, position, volume, np.dtype(np.float64)),
    )
    names = {name for law in laws for name in law.parameters}
    model = Model(
        mass=jnp.asarray(volume * 100 * (1 + random.random(count))),
        volume=jnp.asarray(volume),
        parameters={name: jnp.full(count, NUMBERS[name] * UNITS.get(name, 1)) for name in names},
        gravity=jnp.asarray([0.1, -0.2, -9.8]),
        boundaries=boundaries,
    )
    state = initial_state(
        config,
        position,
        velocity=0.3 * random.normal(size=(count, 3)),
        affine=random.normal(size=(count, 3, 3)),
        deformation=F,
        boundaries=boundaries,
        dtype=jnp.float64,
    )
    return config, model, state


STRESSES = ("youngs_modulus", "bulk_modulus", "shear_modulus", "shear_yield_stress", "yield_stress")
STRESSES += ("cohesion", "relaxing_modulus", "fibre_stiffness", "consistency")
UNITS = dict.fromkeys(STRESSES, 1e3) | {"viscosity": 50.0, "plastic_viscosity": 100.0}


# Each compiles for half a minute to a minute; most laws' gradient is in docs/gradients.jsonl too.
QUICK = ("snow",)


@pytest.mark.parametrize(
    "law",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in NAMES],
)
def test_gradients_through_steps_against_central_differences(law):
    """Of every parameter of every law, through yielding, flowing, hardening and contact."""
    config, model, state = several((law,))
    config = replace(config, check_step=False)
    random = np.random.default_rng(6)
    weights = [
        jnp.asarray(random.normal(size=x.shape)) for x in (state.position, state.deformation)
    ]

    def loss(parameters, start):
        end = rollout(config, replace(model, parameters=parameters), start, dt=DT, steps=4)
        seen = (end.position, 0.1 * end.deformation)
        return sum(jnp.sum(w * x) for w, x in zip(weights, seen, strict=True)), end.status.code

    value = jax.jit(loss)
    (_, code), gradient = jax.jit(jax.value_and_grad(loss, has_aux=True))(model.parameters, state)
    assert int(code) == OK
    for name, numbers in model.parameters.items():
        step = 1e-5 * numbers * jnp.asarray(random.uniform(0.5, 1, len(numbers)))
        up, down = (
            value(model.parameters | {name: numbers + side * step}, state)[0] for side in (1, -1)
        )
        expected, found = float(up - down) / 2, float(jnp.sum(gradient[name] * step))
        assert found != 0 and found == pytest.approx(expected, rel=1e-5, abs=1e-14)


@pytest.mark.slow
def test_the_bounds_are_those_of_each_law():
    config, model, state = several()
    bounds = largest_stable_dt(config, model, state)
    density = model.mass / model.volume
    thinnest = float(jnp.min(density[:EACH]))
    viscosity = NUMBERS["viscosity"] * UNITS["viscosity"]
    assert bounds.viscous == pytest.approx(thinnest * 0.1**2 / (4 * viscosity), rel=1e-9)
    # Contact is as stiff as the laws' own waves at rest: of water the bulk modulus.
    known = with_wave_modulus(config, model).wave_modulus
    np.testing.assert_allclose(known[:EACH], NUMBERS["bulk_modulus"] * 1e3)
    run = jax.jit(partial(rollout, config, steps=2))
    check(run(model, state, dt=bounds.dt).status)


@pytest.mark.slow
def test_snow_that_has_hardened_fails_a_step_that_was_good_for_it():
    config, model, state = several()
    snow = NAMES.index("snow")
    own = slice(EACH * snow, EACH * (snow + 1))
    packed = state._replace(history=state.history.at[0, own].set(np.log(0.6)))
    run = jax.jit(partial(rollout, config, steps=1))
    dt = largest_stable_dt(config, model, state).dt
    assert int(run(model, state, dt=dt).status.code) == OK
    end = run(model, packed, dt=dt)
    assert (
        int(end.status.code) == UNSTABLE_STEP and own.start <= int(end.status.particle) < own.stop
    )
    assert largest_stable_dt(config, model, packed).dt < dt


ELASTIC = (NEO_HOOKEAN, FIXED_COROTATED, HENCKY, FIBRES, STANDARD_SOLID)
ELASTIC += (at_mean_volume(NEO_HOOKEAN),)


@pytest.fixture(scope="module")
def lone():
    """A particle of each elastic law, alone: (state of gradients F, 20 steps, step)."""
    count = len(ELASTIC)
    segments = tuple((law, i, i + 1) for i, law in enumerate(ELASTIC))
    config = Config(Grid((5, 5, 4 * count + 1), 0.1), segments, check_step=False)
    position = np.array([[0.2, 0.21, 0.4 * i + 0.19] for i in range(count)])
    numbers = {name: jnp.full(count, NUMBERS[name] * UNITS.get(name, 1)) for name in NUMBERS}
    model = Model(jnp.full(count, 0.05), jnp.full(count, 1.25e-4), numbers, None)
    start = initial_state(config, position, dtype=jnp.float64)

    def deformed(F):
        return start._replace(deformation=jnp.moveaxis(jnp.asarray(F), 0, -1))

    flat = deformed(np.broadcast_to(np.diag([1.0, 1.0, 0.1]), (count, 3, 3)))
    # At rest the stiffest allows 25 ms, and is a hundred times stiffer at a tenth.
    return deformed, jax.jit(partial(rollout, config, model, dt=1e-3, steps=20)), flat


def test_what_is_flattened_springs_back(lone):
    """Pressed to a tenth, it swings out and back."""
    _, run, state = lone
    thickness = []
    for _ in range(60):
        state = run(state)
        thickness.append(np.asarray(state.deformation[2, 2]))
    check(state.status)
    assert np.all(np.max(thickness, axis=0) > 0.9)
    volume = np.linalg.det(np.moveaxis(np.asarray(state.deformation), -1, 0))
    assert np.all((volume > 0.05) & (volume < 10))


@pytest.mark.parametrize("which", range(len(ELASTIC)), ids=[law.name for law in ELASTIC])
def test_what_is_turned_inside_out_or_crushed_is_one_error(lone, which):
    """A start that `initial_state` did not see, of which it would have been refused. What has the
    logarithm of J has no stress then, and is told by that.
    """
    deformed, run, _ = lone
    inside_out = "(is turned inside out|became infinite or not a number)"
    for thickness, words in ((-0.9, inside_out), (5e-4, "was pressed to less")):
        F = np.tile(np.eye(3), (len(ELASTIC), 1, 1))
        F[which, 2, 2] = thickness
        with pytest.raises(SimulationError, match=f"particle {which} {words}") as error:
            check(run(deformed(F)).status)
        assert "\n" not in str(error.value)
