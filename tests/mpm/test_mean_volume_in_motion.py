"""The stress at a mean volume through the whole loop: against dense sums, in every placement, and
its derivatives against differences.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.program import parts
from jaxphys.mpm.boundaries import Plane
from jaxphys.mpm.loop.adjoint import Checkpointed
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.loop.rollout import rollout, step
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.mean_volume import at_mean_volume
from jaxphys.mpm.state import OK, Config
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.mpm.transfer import FLIP, Transfer

from . import reference
from .cases import block, inside, public, simulation_of
from .test_forward_mode import agree, both_directions, direction_of, loss_by
from .test_placement import DEVICES, SLABS, mixed, same

DT = 5e-4
APIC_QUADRATIC = Transfer()
SHARED = 30  # of the particles, those whose stress is at the mean volume


def halves(transfer=APIC_QUADRATIC, **options):
    """A random block whose first part takes the mean volume and whose other has its own."""
    config, model, state = block(count=50, law=at_mean_volume(NEO_HOOKEAN))
    segments = (config.segments[0][0], 0, SHARED), (NEO_HOOKEAN, SHARED, 50)
    config = Config(config.grid, segments, check_step=False, transfer=transfer, **options)
    return config, model, state


@jax.jit(static_argnames=("kernel", "affine", "blend"))
def plain_step(numbers, now, ratio, kernel, affine, blend):
    """The published step with the stress of a scaled F, and the next ratio by dense sums."""
    grid = block(count=1)[0].grid
    x, v, C, F = now
    scale = jnp.exp(ratio / 3)[:, None, None]
    *moved, scaled = reference.step(grid, numbers, x, v, C, scale * F, DT, kernel, affine, blend)
    w, m, J = reference.all_weights(grid, x, kernel), numbers["mass"], jnp.linalg.det(F)
    total = jnp.einsum("pijk,p->ijk", w, m)
    mean = jnp.einsum("pijk,p->ijk", w, m * J) / jnp.where(total > 0, total, 1)
    following = jnp.log(jnp.einsum("pijk,ijk->p", w, mean) / J)
    return (*moved, scaled / scale), following.at[SHARED:].set(0)


@pytest.mark.parametrize("transfer", [Transfer(), Transfer(FLIP(0.9), "cubic")], ids=str)
def test_steps_are_the_plain_steps_with_a_mean_of_dense_sums(transfer):
    config, model, state = halves(transfer)
    numbers = {
        "mass": model.mass,
        "volume": model.volume,
        "E": model.parameters["youngs_modulus"],
        "nu": model.parameters["poisson_ratio"],
        "gravity": model.gravity,
    }
    scheme = transfer.scheme
    expected, ratio = public(state), jnp.zeros(50)
    for _ in range(3):
        expected, ratio = plain_step(
            numbers, expected, ratio, transfer.kernel, float(scheme.affine), scheme.blend
        )
    end = jax.jit(partial(rollout, config, dt=DT, steps=3))(model, state)
    assert int(end.status.code) == OK and float(jnp.abs(ratio[:SHARED]).min()) > 1e-4
    for ours, theirs in zip((*public(end), end.history[0]), (*expected, ratio), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12 * float(jnp.abs(theirs).max()))


def test_frames_go_on_where_others_ended():
    config, model, state = halves()
    run = jax.jit(partial(rollout, config, dt=DT), static_argnames="steps")
    once = run(model, state, steps=5)
    twice = run(model, run(model, state, steps=2), steps=3)
    same(once, twice, 1e-13)


def widths(jaxpr):
    """The lengths of the last axes of all arrays in a program."""
    found = {v.aval.shape[-1] for e in jaxpr.eqns for v in e.outvars if v.aval.shape}
    return found.union(*(widths(inner) for e in jaxpr.eqns for inner in inside(e)))


def test_what_does_not_ask_for_it_holds_nothing_of_it():
    config, model, state = halves()
    plain = replace(config, segments=((NEO_HOOKEAN, 0, 50),))
    traced = [
        (
            parts(partial(step, one), model, start, DT),
            jax.make_jaxpr(partial(step, one))(model, start, DT),
        )
        for one, start in ((config, state), (plain, state._replace(history=None)))
    ]
    (names, program), (none, without) = traced
    assert "mean volume" in names and 8 in widths(program.jaxpr)
    assert "mean volume" not in none and "history" not in none and 8 not in widths(without.jaxpr)


def beside(dtype):
    """Some ten cells of jelly, the first half at the mean volume, in contact with a floor."""
    config, model, state = mixed(dtype, (Plane((0.0, 0.0, 0.28), friction=0.4),), ("jelly",), 70)
    segments = (at_mean_volume(NEO_HOOKEAN), 0, 40), (NEO_HOOKEAN, 40, 70)
    return (
        replace(config, segments=segments, track_total=False),
        model,
        state._replace(history=jnp.zeros((1, 70), dtype)),
    )


@pytest.mark.skipif(jax.device_count() < DEVICES, reason="needs host devices: see conftest.py")
@pytest.mark.parametrize(
    ("dtype", "options"),
    [
        (jnp.float64, {"placement": Placement(2, 16), "slabs": SLABS[2]}),
        *(
            pytest.param(jnp.float32, options, marks=pytest.mark.slow)
            for options in (
                {"placement": Placement(4, 16), "slabs": SLABS[4]},
                {"placement": Placement(1, 16), "window": (14, 9, 9)},
            )
        ),
    ],
)
def test_one_answer_in_chunks_windows_and_slabs(dtype, options):
    config, model, state = beside(dtype)

    def end(**options):
        run = partial(rollout, replace(config, **options), dt=DT, steps=4)
        return jax.jit(run)(model, state)._replace(residual=None)

    whole = end()
    assert int(whole.status.code) == OK and float(jnp.abs(whole.history).max()) > 1e-3
    small = 1e-5 if dtype == jnp.float32 else 1e-13
    same(end(**options), whole, small)


@pytest.mark.slow
def test_derivatives_in_both_directions_are_the_difference():
    """By every number, where some particles share nodes with others that have their own volume."""
    config, model, state = halves()
    loss, numbers = loss_by(config, model, state)
    agree(*both_directions(loss, numbers, direction_of(numbers)))


@pytest.mark.slow
@pytest.mark.skipif(jax.device_count() < DEVICES, reason="needs host devices: see conftest.py")
def test_derivatives_on_slabs_with_flip_and_checkpoints():
    config, model, state = beside(jnp.float64)
    transfer = Transfer(FLIP(0.9))
    config = replace(config, placement=Placement(2, 16), slabs=SLABS[2], transfer=transfer)
    loss, numbers = loss_by(config, model, state, Checkpointed(2), steps=4)
    agree(*both_directions(loss, numbers, direction_of(numbers)))


@pytest.mark.parametrize("poisson", [0.1, 0.4, 0.499])
def test_a_step_at_its_bounds_is_stable(poisson):
    """Kinetic energy of a shaken lump, after hundreds of steps at nine tenths of the bound."""
    config, model, state = halves()
    config = replace(config, segments=((config.segments[0][0], 0, 50),), check_step=True)
    parameters = model.parameters | {"poisson_ratio": jnp.full(50, poisson)}
    model = replace(model, gravity=None, parameters=parameters)
    at_rest = jnp.broadcast_to(jnp.eye(3)[:, :, None], state.deformation.shape)
    state = state._replace(
        velocity=1e-3 * state.velocity, affine=1e-3 * state.affine, deformation=at_rest
    )
    dt = 0.9 * largest_stable_dt(config, model, state).limit
    end = jax.jit(partial(rollout, config, dt=dt, steps=800))(model, state)
    assert int(end.status.code) == OK
    energy = [float(jnp.sum(model.mass * s.velocity**2)) for s in (state, end)]
    assert energy[1] < energy[0]


def test_its_numbers_change_by_name():
    config, model, state = halves()
    simulation = simulation_of(config, model, state, dt=DT, steps=2)
    stiffer = simulation.with_(youngs_modulus=2e6, poisson_ratio=0.45)
    assert set(np.unique(stiffer.model.parameters["poisson_ratio"])) == {0.45}
    assert stiffer.config.segments == config.segments and stiffer.dt < 0.5 * simulation.dt
