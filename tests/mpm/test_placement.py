"""One answer, however particles are cut into chunks and spread over devices."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import (
    Box,
    Cut,
    Damping,
    Impulse,
    Plane,
    Release,
    Rotate,
    Setting,
    Translate,
    Walls,
    prepare,
)
from jaxphys.mpm.loop.adjoint import Plain
from jaxphys.mpm.loop.chunks import cut, cuts, joined, numbers, orders
from jaxphys.mpm.loop.placement import Placement, Slabs, check_memory, second_cache_bytes, suited
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.materials.catalogue import MATERIALS, material_values
from jaxphys.mpm.state import OK, STEP_TOO_LARGE, UNSTABLE_STEP, Config, Model, initial_state
from jaxphys.mpm.transfer.schemes import AFLIP, APIC, Transfer

from .cases import KINDS, block

DEVICES = 4
PLACEMENTS = [Placement(1, 16), Placement(2), Placement(2, 16), Placement(4, 16)]
DT = 5e-4
# Of `mixed`, by devices. Four share nodes with the ones after the next as well.
SLABS = {2: Slabs(14, (8,)), 4: Slabs(10, (8, 6, 4))}
pytestmark = pytest.mark.skipif(
    jax.device_count() < DEVICES, reason=f"needs {DEVICES} host devices: see tests/conftest.py"
)


def mixed(dtype, boundaries=(), names=KINDS, count=150):
    """Materials side by side, in motion, strained into yielding: (config, model, state). Some ten
    cells along x.
    """
    random = np.random.default_rng(3)
    config, model, state = block(count=count, shape=(16, 10, 11), dtype=dtype)
    state = state._replace(position=state.position.at[0].multiply(3).at[0].add(-0.5))
    edges = np.linspace(0, count, len(names) + 1).astype(int)
    laws, parameters = [], {}
    for name, start, stop in zip(names, edges[:-1], edges[1:], strict=True):
        material = MATERIALS[name]
        laws.append((material.law, int(start), int(stop)))
        for parameter, value in material_values(material, {}).items():
            parameters.setdefault(parameter, np.zeros(count))[start:stop] = value
    config = Config(config.grid, tuple(laws), track_total=True, check_step=False)
    volume = 1e-4 * (1 + random.random(count))
    setting = Setting(config.grid, np.asarray(state.position.T), volume, np.dtype(dtype))
    boundaries = prepare(boundaries, setting)
    parameters["youngs_modulus"] = 2e3 * (1 + random.random(count))
    if "yield_stress" in parameters:
        parameters["yield_stress"] = np.full(count, 30.0)
    model = Model(
        jnp.asarray(0.1 + 0.1 * random.random(count), dtype),
        jnp.asarray(volume, dtype),
        {k: jnp.asarray(v, dtype) for k, v in parameters.items()},
        jnp.asarray([0.1, -0.2, -9.8], dtype),
        boundaries,
    )
    state = initial_state(
        config,
        state.position.T,
        velocity=0.5 * random.normal(size=(count, 3)),
        deformation=np.eye(3) + 0.05 * random.normal(size=(count, 3, 3)),
        affine=random.normal(size=(count, 3, 3)),
        dtype=dtype,
        boundaries=boundaries,
    )
    return config, model, state


EVERY_BOUNDARY = (
    Plane((0.0, 0.0, 0.28), friction=0.4),
    Plane((0.0, 0.28, 0.0), (0.0, 1.0, 0.0), surface="sticky", acts_on="particles"),
    Walls(surface="slip", inset=0.2),
    Box((0.3, 0.3, 0.3), (0.06, 0.06, 0.06), velocity=(0.1, 0.0, 0.0)),
    Impulse((0.5, 0.5, 0.5), (0.2, 0.2, 0.2), (0.5, 0.2, -0.1), duration=1e-3),
    Translate((0.55, 0.3, 0.3), (0.05, 0.1, 0.1), (0.0, 0.2, 0.0)),
    Rotate((0.4, 0.4, 0.4), (0.0, 0.0, 1.0), 0.05, 0.1, angular_velocity=2.0),
    Release((1.0, 0.0, 0.0), 0.25, 0.3, 0.0, 1e-3),
    Cut((0.0, 0.55, 0.0), (0.0, -1.0, 0.0)),
    Damping(0.5),
)


def gap(ours, theirs):
    """Largest difference of two arrays over the largest number."""
    scale = float(jnp.max(jnp.abs(theirs)))
    return float(jnp.max(jnp.abs(ours - theirs))) / (scale if scale > 0 else 1.0)


def same(ours, theirs, small):
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        if jnp.issubdtype(a.dtype, jnp.floating):
            assert gap(a, b) < small, (a.shape, gap(a, b))
        else:
            assert a == b


# Half of what four devices take to compile; what rounds is seen in float64.
DTYPES = [pytest.param(jnp.float32, marks=pytest.mark.slow), jnp.float64]


@pytest.mark.parametrize("dtype", DTYPES)
def test_every_material_and_boundary(dtype):
    config, model, state = mixed(dtype, EVERY_BOUNDARY)

    def end(placement, slabs=None):
        run = partial(rollout, replace(config, placement=placement, slabs=slabs), dt=DT, steps=4)
        return jax.jit(run)(model, state)._replace(residual=None)

    whole = end(Placement())
    assert int(whole.status.code) == OK and int(whole.status.taken) == 4
    ways = [(Placement(1, 16), None), (Placement(2), None), (Placement(2), SLABS[2])]
    if dtype == jnp.float32:
        ways = [(Placement(4, 16), None), (Placement(4, 16), SLABS[4])]
    for way in ways:
        same(end(*way), whole, 1e-6 if dtype == jnp.float32 else 1e-13)


def gradients(config, model, state):
    """Value and gradient of a loss by every number of model and state."""

    def loss(model, position, velocity, deformation):
        start = state._replace(position=position, velocity=velocity, deformation=deformation)
        end = rollout(config, model, start, dt=DT, steps=3, adjoint=Plain())
        value = jnp.sum(end.position**2) + 1e-2 * jnp.sum(end.velocity**2)
        value += 1e-4 * jnp.sum(end.affine**2) + jnp.sum(end.deformation**3)
        value += 0 if end.total is None else jnp.sum(end.total**2)
        return value + (0 if end.history is None else jnp.sum(end.history**2))

    run = jax.jit(jax.value_and_grad(loss, (0, 1, 2, 3), allow_int=True))
    found = run(model, state.position, state.velocity, state.deformation)
    return [g for g in jax.tree.leaves(found) if g.dtype != jax.dtypes.float0]


@pytest.mark.parametrize(
    ("names", "boundaries"),
    [
        (("jelly", "metal"), EVERY_BOUNDARY[:3]),
        *(
            pytest.param((name,), EVERY_BOUNDARY, marks=pytest.mark.slow, id=name)
            for name in MATERIALS
        ),
    ],
)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("slabs", [pytest.param(None, marks=pytest.mark.slow), SLABS[2]], ids=str)
def test_gradients_of_materials_and_boundaries(slabs, dtype, names, boundaries):
    config, model, state = mixed(dtype, boundaries, names, count=70)
    whole = gradients(config, model, state)
    small = 1e-5 if dtype == jnp.float32 else 1e-12
    spread = replace(config, placement=Placement(2, 16), slabs=slabs)
    same(gradients(spread, model, state), whole, small)


SLOW_CUBIC = pytest.param(Transfer(APIC(), "cubic"), marks=pytest.mark.slow)


@pytest.mark.parametrize("transfer", [Transfer(AFLIP(0.9)), SLOW_CUBIC], ids=str)
def test_transfers_on_slabs(transfer):
    """Bands carry rows of eight numbers, and what kernels reach in four nodes; forth and back."""
    config, model, state = mixed(jnp.float64, EVERY_BOUNDARY[:1], ("jelly",), count=70)
    config = replace(config, transfer=transfer)
    whole = gradients(config, model, state)
    spread = replace(config, placement=Placement(2, 16), slabs=Slabs(15, (9,)))
    same(gradients(spread, model, state), whole, 1e-12)


@pytest.mark.slow
def test_tangents_on_slabs_are_those_of_the_way_back():
    config, model, state = mixed(jnp.float64, EVERY_BOUNDARY[:1], ("jelly",), count=70)
    config = replace(config, placement=Placement(2, 16), slabs=SLABS[2])
    random = np.random.default_rng(5)
    along = jnp.asarray(random.normal(size=state.velocity.shape))
    weights = jnp.asarray(random.normal(size=state.position.shape))

    def weighted(velocity):
        end = rollout(config, model, state._replace(velocity=velocity), dt=DT, steps=3)
        return jnp.sum(weights * end.position) + 1e-2 * jnp.sum(weights * end.velocity)

    rate = jax.jit(lambda v: jax.jvp(weighted, (v,), (along,))[1])(state.velocity)
    back = jnp.vdot(jax.jit(jax.grad(weighted))(state.velocity), along)
    assert abs(float(rate)) > 1e-3
    np.testing.assert_allclose(rate, back, rtol=1e-11)


def test_the_same_bytes_from_run_to_run():
    config, model, state = mixed(jnp.float32, EVERY_BOUNDARY[:3], ("sand", "jelly"))
    config = replace(config, placement=Placement(4, 16))
    run = jax.jit(partial(rollout, config, dt=DT, steps=10))
    first = run(model, state)
    for _ in range(3):
        for a, b in zip(jax.tree.leaves(run(model, state)), jax.tree.leaves(first), strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("placement", [Placement(), Placement(1, 16), Placement(4, 16)], ids=str)
def test_the_particle_that_failed_first_is_named_wherever_it_is(placement):
    config, model, state = mixed(jnp.float64, names=("jelly",))
    config = replace(config, placement=placement)
    run, alone = (
        jax.jit(partial(rollout, c, dt=DT, steps=3))
        for c in (config, replace(config, placement=Placement()))
    )
    for wrong in (0, 77, 149):
        fast = state._replace(velocity=state.velocity.at[:, wrong:].multiply(1e4))
        status = run(model, fast).status
        # What the fast ones give to the grid makes others fail as well, but in the same step.
        assert int(status.code) == STEP_TOO_LARGE and int(status.step) == 0
        assert int(status.particle) == int(alone(model, fast).status.particle) <= wrong


@pytest.mark.parametrize("placement", [Placement(), Placement(2, 16), Placement(4)], ids=str)
def test_the_particle_too_stiff_for_the_step_is_named_wherever_it_is(placement):
    config, model, state = block(count=50, placement=placement)
    run = jax.jit(partial(rollout, config, dt=1e-3, steps=1))
    for stiff in (0, 31, 49):
        modulus = model.parameters["youngs_modulus"].at[stiff].set(1e9)
        changed = replace(model, parameters=model.parameters | {"youngs_modulus": modulus})
        status = run(changed, state).status
        assert (int(status.code), int(status.particle)) == (UNSTABLE_STEP, stiff)
    assert int(run(model, state).status.code) == OK


@pytest.mark.parametrize("placement", PLACEMENTS, ids=str)
def test_no_mass_is_lost_where_chunks_do_not_divide(placement):
    """The centre of mass of matter that is thrown falls as a stone does, whatever is left over."""
    for count in (1, 35):
        config, model, state = block(count=count, placement=placement, check_step=False)
        end = jax.jit(partial(rollout, config, dt=1e-3, steps=5))(model, state)
        mass, g = model.mass, model.gravity
        total = jnp.sum(mass)
        start_speed = jnp.sum(mass * state.velocity, axis=1) / total
        speed = jnp.sum(mass * end.velocity, axis=1) / total
        np.testing.assert_allclose(speed, start_speed + 5e-3 * g, atol=1e-12)


def test_a_window_follows_over_devices():
    config, model, state = block(placement=Placement(2, 16))
    windowed, _, _ = block(placement=Placement(2, 16), window=(8, 8, 8))
    a, b = (
        jax.jit(partial(rollout, c, dt=1e-3, steps=20))(model, state) for c in (config, windowed)
    )
    assert int(b.status.code) == OK
    np.testing.assert_allclose(a.position, b.position, atol=1e-13)


def test_scenes_over_a_batch_axis():
    config, model, state = block(count=33, placement=Placement(2, 16))
    speeds = jnp.stack([state.velocity, 0 * state.velocity, -state.velocity])

    def end(velocity):
        return rollout(config, model, state._replace(velocity=velocity), dt=1e-3, steps=3).position

    together, alone = jax.jit(jax.vmap(end))(speeds), jax.jit(end)
    for i in range(3):
        np.testing.assert_allclose(together[i], alone(speeds[i]), atol=1e-14)


def test_mixed_particles_are_sorted_and_come_back_in_their_places():
    config, _, _ = block(count=600, shape=(22, 12, 12))
    position = np.array([[2.0], [1.0], [1.0]]) * np.random.default_rng(1).random((3, 600))
    position = jnp.asarray(0.05 + 0.9 * position)
    order, inverse = orders(position, config.grid, config.segments)
    cells = np.floor(np.asarray(position).T / 0.1 - 0.5).astype(int)
    keys = (cells[:, 0] * 12 + cells[:, 1]) * 12 + cells[:, 2]
    assert (np.diff(keys[order]) >= 0).all() and (np.diff(keys) < 0).any()
    np.testing.assert_array_equal(np.asarray(order)[inverse], np.arange(600))
    # What is sorted stays, and what has deformed a little too.
    there = position[:, order]
    for moved in (there, there + 0.02 * jnp.sin(7 * there[::-1])):
        again, _ = orders(moved, config.grid, config.segments)
        np.testing.assert_array_equal(again, np.arange(600))
    # Two segments do not mix.
    law = config.segments[0][0]
    apart, _ = orders(position, config.grid, ((law, 0, 100), (law, 100, 600)))
    assert set(np.asarray(apart[:100]).tolist()) == set(range(100))


@pytest.mark.parametrize("count", [1, 5, 16, 100])
@pytest.mark.parametrize("placement", PLACEMENTS, ids=str)
def test_cutting_and_joining_keeps_every_particle(count, placement):
    law = block(count=1)[0].segments[0][0]
    segments = ((law, 0, count), (law, count, 3 * count))
    random = np.random.default_rng(0)
    order = np.concatenate([random.permutation(count), count + random.permutation(2 * count)])
    order = jnp.asarray(order, jnp.int32)
    inverse = jnp.zeros_like(order).at[order].set(jnp.arange(3 * count, dtype=jnp.int32))
    x = jnp.asarray(random.random((3, 3 * count)))
    into = cuts(segments, placement)
    assert all(one.chunks % placement.devices == 0 for one in into)
    parts = [cut(x, one, order) for one in into]
    np.testing.assert_array_equal(joined(parts, into, inverse), x)
    zeroed = [cut(x, one, order, empty=True) for one in into]
    np.testing.assert_allclose(sum(jnp.sum(z) for z in zeroed), jnp.sum(x), rtol=1e-13)
    found = np.concatenate([np.asarray(numbers(one, order)).ravel() for one in into])
    assert sorted(found[found >= 0].tolist()) == list(range(3 * count))


def test_wrong_placements_are_named():
    with pytest.raises(InputError, match="devices is 0"):
        Placement(0)
    with pytest.raises(InputError, match="chunk is 0"):
        Placement(1, 0)
    many = jax.device_count() + 1
    config, model, state = block(placement=Placement(many))
    with pytest.raises(
        InputError,
        match=rf"devices is {many}, but JAX has {many - 1} cpu device.*jax_num_cpu_devices",
    ):
        rollout(config, model, state, dt=1e-3, steps=1)


class Device:
    """One that tells its memory as an accelerator does."""

    def __init__(self, name, limit):
        self.name, self.limit = name, limit

    def __str__(self):
        return self.name

    def memory_stats(self):
        return None if self.limit is None else {"bytes_limit": self.limit}


def test_of_devices_of_unequal_memory_the_one_too_small_is_named():
    devices = [Device("cuda:0", 80e9), Device("cuda:1", 2e9), Device("cpu:0", None)]
    check_memory(devices, 4_000_000)
    with pytest.raises(InputError, match=r"10000000 particles need 4 GB .* cuda:1 has 2: "):
        check_memory(devices, 10_000_000)
    check_memory(jax.devices(), 10**9)  # a processor's is told by the system


def test_few_particles_stay_on_one_device_and_many_are_cut():
    assert suited(100) == Placement(1, None)
    second = second_cache_bytes()
    assert 2**14 <= second <= 2**28
    large = suited(10**6)
    assert large.devices == jax.device_count() and large.chunk * 256 == second
    assert suited(10**6, devices=2).devices == 2
    assert suited(10**6, devices=1) == Placement(1, large.chunk)
    assert suited(4 * large.chunk, devices=1) == Placement(1, None)
