"""Contact between objects with a velocity field each: what it does at a node, in a step, and
however that is computed. In float64 unless said.
"""

from dataclasses import replace
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.program import parts
from jaxphys.mpm.boundaries import Plane, Setting, prepare
from jaxphys.mpm.loop.halo import sent_bytes
from jaxphys.mpm.loop.implicit.step import check_implicit
from jaxphys.mpm.loop.placement import Placement, Slabs
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.loop.window import windowed
from jaxphys.mpm.meeting import meet
from jaxphys.mpm.state import OK
from jaxphys.mpm.transfer.schemes import AFLIP, Transfer

from .cases import block, long_block, public
from .test_conservation import angular_momentum
from .test_forward_mode import agree, both_directions, direction_of, loss_by
from .test_placement import same

LIGHTEST = 1e-12
X, Y, Z = np.eye(3)


def nodes_of(*insides, size=11):
    """Masses (K, n, n, n) that a lattice of particles gives to nodes around the origin by quadratic
    B-splines, of objects that hold the points (N, 3) [cells] where `inside` says so.
    """
    line = (np.arange(2 * (size + 3)) + 0.5) / 2 - (size + 3) / 2
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    nodes = np.arange(size) - (size - 1) / 2

    def seen(own):
        d = np.abs(points[own][:, :, None] - nodes)
        w = np.where(d < 0.5, 0.75 - d**2, 0.5 * np.maximum(1.5 - d, 0) ** 2)
        return np.einsum("pi,pj,pk->ijk", w[:, 0], w[:, 1], w[:, 2], optimize=True)

    return np.stack([seen(inside(points)) for inside in insides])


def halves(normal=X, offset=0.0, density=(1.0, 1.0), gap=0.0):
    """Of two half-spaces that touch at a plane, or have `gap` [cells] between them."""
    mass = nodes_of(
        lambda x: x @ normal - offset < -gap / 2, lambda x: x @ normal - offset > gap / 2
    )
    return mass * np.reshape(density, (2, 1, 1, 1))


met = jax.jit(meet)


def after(mass, velocity, friction=None):
    friction = None if friction is None else jnp.asarray(friction)
    return np.asarray(met(jnp.asarray(mass), jnp.asarray(velocity), LIGHTEST, friction))


def everywhere(mass, *vectors):
    """Velocities (3, K, ...) that are the same all over each object."""
    shape = mass.shape[1:]
    return np.stack([np.broadcast_to(v[:, None, None, None], (3, *shape)) for v in vectors], 1)


def inner(nodes):
    """What stands at nodes that are not at the ends, beyond which there is no mass."""
    return nodes[..., 2:-2, 2:-2, 2:-2]


def shared_nodes(mass):
    return (inner(mass) > LIGHTEST).all(axis=0)


def test_two_that_approach_go_on_together_along_the_normal_and_as_they_were_beside_it():
    mass = halves(offset=0.5, density=(1.0, 3.0))
    velocity = everywhere(mass, np.array([1.0, 0.5, 0.0]), np.array([-1.0, 0.0, 0.2]))
    found, shared = inner(after(mass, velocity)), shared_nodes(mass)
    common = inner((mass[0] - mass[1]) / (mass[0] + mass[1]))
    velocity = inner(velocity)
    for k in (0, 1):
        np.testing.assert_allclose(found[0, k][shared], common[shared], atol=1e-14)
        np.testing.assert_allclose(found[1:, k], velocity[1:, k], atol=1e-14)
        np.testing.assert_array_equal(found[:, k][:, ~shared], velocity[:, k][:, ~shared])
    assert shared.any() and not shared.all()


def test_two_that_part_are_left_alone():
    mass = halves()
    velocity = everywhere(mass, np.array([-1.0, 0.5, 0.0]), np.array([1.0, 0.0, 0.2]))
    np.testing.assert_array_equal(after(mass, velocity, friction=0.5), velocity)


@pytest.mark.parametrize(("friction", "left"), [(0.25, 0.5), (0.5, 0.0), (2.0, 0.0)])
def test_sliding_is_slowed_as_coulomb_has_it(friction, left):
    """Normal 2 m/s lost, sliding 1 m/s: friction takes 2 mu of it, and no more than there is."""
    mass = halves(density=(1.0, 2.0))
    velocity = everywhere(mass, X + 0.6 * Y, -X - 0.8 * Z)
    found, shared = inner(after(mass, velocity, friction)), shared_nodes(mass)
    relative = (found[:, 0] - found[:, 1])[:, shared]
    np.testing.assert_allclose(
        relative, left * (0.6 * Y + 0.8 * Z)[:, None] + 0 * relative, atol=1e-14
    )


@pytest.mark.parametrize("density", [(1.0, 1.0), (1.0, 1e4), (1e4, 1.0)])
def test_the_normal_is_that_of_the_surface_between_them_whatever_they_weigh(density):
    normal = np.array([2.0, 1.0, 0.5]) / 5.25**0.5
    mass = halves(normal, 0.2, density)
    velocity = everywhere(mass, normal, -normal)
    gained = inner(mass[0] * (after(mass, velocity) - velocity)[:, 0]).reshape(3, -1)
    impulse = gained.sum(axis=1) / np.linalg.norm(gained.sum(axis=1))
    assert -impulse @ normal > np.cos(np.radians(3))
    each = gained / np.maximum(np.linalg.norm(gained, axis=0), 1e-30)
    spread = np.average(-normal @ each, weights=np.linalg.norm(gained, axis=0))
    assert spread > np.cos(np.radians(8))


def test_what_bounds_both_alike_has_no_part_in_the_normal():
    """Bars that meet end to end, and are free at their sides."""
    mass = nodes_of(
        *(
            partial(lambda side, x: (side * x[:, 0] > 0) & (abs(x[:, 1]) < 2), side)
            for side in (-1, 1)
        )
    )
    velocity = everywhere(mass, X, -X)
    impulse = inner(mass[0] * (velocity - after(mass, velocity))[:, 0])
    along, across = np.abs(impulse[0]), np.linalg.norm(impulse[1:], axis=0)
    np.testing.assert_allclose(impulse.sum(axis=(1, 2, 3))[1:], 0, atol=1e-12)
    assert across.sum() < 0.05 * along.sum()


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)])
def test_the_edge_of_a_block_has_no_part_in_the_normal_of_the_slab_that_it_slides_on(place):
    """A node of the block's front edge sees mass fall off forwards and down: a normal in between,
    some 30 degrees off, brakes a block that slides as fast as it is pressed on.
    """
    edge, top = place
    mass = nodes_of(
        lambda x: (x[:, 0] < edge) & (x[:, 2] > top),
        lambda x: (x[:, 2] < top) & (x[:, 2] > top - 2),
    )
    velocity = everywhere(mass, X - Z, 0 * X)
    impulse = inner(mass[0] * (after(mass, velocity) - velocity)[:, 0])
    x, _, z = impulse.sum(axis=(1, 2, 3))
    assert z > 1 and abs(x) < 0.015 * z


def test_objects_touch_at_their_surfaces_and_not_where_their_kernels_end():
    def meets(gap):
        mass = halves(gap=gap)
        velocity = everywhere(mass, X, -X)
        return shared_nodes(mass).any(), inner(after(mass, velocity) != velocity).any()

    assert meets(0.0) == (True, True)
    assert meets(1.0) == (True, False)


def test_many_at_a_node_keep_momentum_and_gain_no_energy():
    random = np.random.default_rng(0)
    mass = 0.1 + random.random((4, 5, 5, 5))
    velocity = random.normal(size=(3, 4, 5, 5, 5))
    found = after(mass, velocity, friction=0.3)
    assert np.abs(found - velocity).max() > 0.1
    np.testing.assert_allclose(
        np.sum(mass * found, axis=1), np.sum(mass * velocity, axis=1), atol=1e-14
    )
    energy, before = (np.sum(mass * v**2, axis=(0, 1)) for v in (found, velocity))
    assert (energy <= before * (1 + 1e-14)).all()


def test_its_derivative_forward_and_back_is_the_difference():
    mass = halves(np.array([2.0, 1.0, 0.5]) / 5.25**0.5, 0.2)
    random = np.random.default_rng(1)
    # Nobody is at the edge between sliding and sticking, nor between meeting and parting.
    velocity = everywhere(mass, X + 0.3 * Y, -X) + 0.05 * random.random((3, 2, 11, 11, 11))
    numbers = (jnp.asarray(mass), jnp.asarray(velocity), jnp.asarray(0.1))
    direction = jax.tree.map(lambda x: x * random.random(x.shape), numbers)

    def loss(numbers):
        mass, velocity, friction = numbers
        return jnp.sum(jnp.sin(3 * inner(mass * meet(mass, velocity, LIGHTEST, friction))))

    agree(*both_directions(loss, numbers, direction))


def apart(scene, fields=2, friction=0.3):
    """A scene whose particles belong to one object after the other."""
    config, model, state = scene
    field = jnp.arange(config.particles, dtype=jnp.int32) % fields
    friction = jnp.asarray(friction, model.mass.dtype)
    return replace(config, fields=fields), replace(model, field=field, friction=friction), state


@cache
def program(config, steps):
    return jax.jit(partial(rollout, config, dt=5e-4, steps=steps))


def end(config, model, state, steps=4):
    state = program(config, steps)(model, state)
    assert int(state.status.code) == OK
    return state


def three_above_a_floor(height, dtype=jnp.float64):
    """Three objects that have the same place, and nodes that are held up to a height [m]."""
    config, model, state = apart(block(dtype=dtype), 3)
    setting = Setting(config.grid, np.asarray(state.position.T), model.volume, np.dtype(dtype))
    floor = Plane((0.0, 0.0, height), friction=0.4, acts_on="nodes")
    model = replace(model, boundaries=prepare((floor,), setting), gravity=jnp.zeros(3, dtype))
    return config, model, state


def test_momentum_and_angular_momentum_are_kept():
    config, model, state = three_above_a_floor(0.01)

    def momenta(state):
        x, v, C, _ = public(state)
        each = [jnp.sum(model.mass[:, None] * v * (model.field == k)[:, None], 0) for k in range(3)]
        return jnp.stack(each), angular_momentum(config.grid, model.mass, x, v, C)

    (before, turning), (after, turned) = momenta(state), momenta(end(config, model, state))
    scale = float(jnp.sum(model.mass) * jnp.abs(state.velocity).max())
    np.testing.assert_allclose(after.sum(axis=0), before.sum(axis=0), atol=1e-13 * scale)
    np.testing.assert_allclose(turned, turning, atol=1e-13 * scale)
    # Control: they exchange it.
    assert float(jnp.abs(after - before).max()) > 1e-2 * scale


def test_boundaries_that_act_on_its_nodes_are_told():
    config, *given = three_above_a_floor(0.3)
    found = parts(program(config, 4), *given)
    assert {"contact between objects", "boundary 0 plane"} <= set(found)


@pytest.mark.parametrize(
    ("dtype", "way", "small"),
    [
        (jnp.float64, {"placement": Placement(4, 16), "window": (8, 8, 8)}, 1e-13),
        pytest.param(
            jnp.float32,
            {"placement": Placement(1, 16), "window": (8, 8, 8)},
            2e-6,
            marks=pytest.mark.slow,
        ),
    ],
    ids=["on four devices, in a window", "in chunks, float32"],
)
def test_however_it_is_computed(dtype, way, small):
    if way["placement"].devices > jax.device_count():
        pytest.skip("needs four host devices: see tests/conftest.py")
    config, model, state = three_above_a_floor(0.3, dtype)
    found, whole = (end(one, model, state) for one in (replace(config, **way), config))
    same(found._replace(residual=None), whole._replace(residual=None), small)


@pytest.mark.slow
def test_far_from_each_other_each_moves_as_it_would_alone():
    config, model, state = block(shape=(22, 10, 11))
    second = jnp.arange(config.particles) % 2
    state = state._replace(position=state.position.at[0].add(1.0 * second))
    one = end(config, model, state)
    two = end(*apart((config, model, state)))
    same(two, one, 1e-13)


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [{"window": (8, 8, 8)}, {"transfer": Transfer(AFLIP(0.9), "cubic")}],
    ids=["window", "cubic AFLIP"],
)
def test_both_directions_of_the_derivative_of_a_rollout(options):
    config, model, state = apart(block(count=40))
    loss, numbers = loss_by(replace(config, **options), model, state)
    agree(*both_directions(loss, numbers, direction_of(numbers)))


def test_devices_share_the_window_as_a_whole():
    config, _, state = apart(long_block(devices=4))
    if jax.device_count() < 4:
        pytest.skip("needs four host devices: see tests/conftest.py")
    alone = replace(config, fields=1)
    assert windowed(alone, state, slabs=True).slabs is not None
    assert windowed(config, state, slabs=True).slabs is None
    assert sent_bytes(config) == 2 * sent_bytes(alone)
    with pytest.raises(InputError, match="2 velocity fields every device has the window as"):
        replace(config, slabs=Slabs(20, (8,)))


def test_what_does_not_go_together_is_refused():
    config, model, state = apart(block())
    with pytest.raises(InputError, match="contact between objects needs explicit steps"):
        check_implicit(config, model)
    for wrong in (replace(config, fields=1), replace(config, fields=2)):
        field = None if wrong.fields == 2 else model.field
        with pytest.raises(InputError, match=r"Model\.field does not fit Config\.fields"):
            rollout(wrong, replace(model, field=field), state, dt=1e-4, steps=1)
    with pytest.raises(InputError, match=r"Config\.fields is 0"):
        replace(config, fields=0)
