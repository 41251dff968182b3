"""What slabs of the grid tell each other, against one grid that everybody sees."""

import re
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.loop import halo
from jaxphys.mpm.loop.placement import APART, EVERYWHERE, Placement, Slabs, spread
from jaxphys.mpm.loop.window import followed, orders_for, windowed

from .cases import block, long_block

DEVICES = 4
NODES = (40, 3, 4)
pytestmark = pytest.mark.skipif(
    jax.device_count() < DEVICES, reason=f"needs {DEVICES} host devices: see tests/conftest.py"
)


def slabbed(slabs, devices=DEVICES, shape=NODES):
    """A config of so many slabs."""
    config, _, _ = block(count=60, shape=shape, placement=Placement(devices))
    return replace(config, slabs=slabs)


def below_of(lowest, highest):
    """`Seen.below` of devices whose particles span x from lowest to highest."""
    below = np.zeros((len(lowest), 6), np.int32)
    below[:, 0], below[:, 3] = lowest, -np.asarray(highest)
    return jnp.asarray(below)


def exchange(config, below):
    """(S, planes, line) -> the same after the exchange, and the first planes (S,) of the slabs."""
    origin = followed(config, below, jnp.zeros((config.parts, 3), jnp.int32))

    def own(common, rows):
        origin, bands = common
        return None, halo.exchanged(config, origin.reshape(3), bands, rows[0])[None]

    place = halo.where(config)
    assert place == APART
    run = spread(config.placement, own, lambda nothing: nothing, (place, place), EVERYWHERE)
    bands = halo.bands(config, below)

    @jax.jit
    def call(planes):
        rows = planes.reshape(config.parts, -1, 4)
        return run((origin, bands), rows)[1].reshape(planes.shape)

    return call, np.asarray(origin[:, 0])


LINE = NODES[1] * NODES[2] * 4
# Neighbours alone; thin slabs, three of which share nodes; cuts that wander; the grid's two ends.
HULLS = [
    (Slabs(16, (8,)), [2, 10, 19, 28], [10, 19, 28, 36]),
    (Slabs(12, (8, 4)), [9, 13, 17, 21], [14, 18, 21, 24]),
    (Slabs(20, (12, 8, 4)), [3, 5, 9, 15], [12, 10, 18, 20]),
    (Slabs(16, (8,)), [0, 0, 24, 26], [2, 3, 26, 37]),
]


@pytest.mark.parametrize(("slabs", "lowest", "highest"), HULLS)
def test_every_copy_of_a_node_has_what_all_devices_give_to_it(slabs, lowest, highest):
    config = slabbed(slabs)
    call, origin = exchange(config, below_of(lowest, highest))
    random = np.random.default_rng(0)
    planes, dense = np.zeros((DEVICES, slabs.planes, LINE)), np.zeros((NODES[0], LINE))
    touched = []
    for device, (low, high) in enumerate(zip(lowest, highest, strict=True)):
        # Wherever its particles are after a step.
        there = np.arange(max(low - 1, 0), min(high + 4, NODES[0]))
        there = there[(there >= origin[device]) & (there < origin[device] + slabs.planes)]
        values = random.normal(size=(len(there), LINE))
        planes[device, there - origin[device]] = values
        dense[there] += values
        touched.append(there)
    assert all(len(there) > 2 for there in touched)
    after = np.asarray(call(jnp.asarray(planes)))
    for device, there in enumerate(touched):
        np.testing.assert_allclose(after[device, there - origin[device]], dense[there], atol=1e-14)


@pytest.mark.parametrize(("slabs", "lowest", "highest"), HULLS[1:3])
def test_the_exchange_is_its_own_transpose(slabs, lowest, highest):
    call, _ = exchange(slabbed(slabs), below_of(lowest, highest))
    random = np.random.default_rng(1)
    a, b = jnp.asarray(random.normal(size=(2, DEVICES, slabs.planes, LINE)))
    there, back = jnp.sum(call(a) * b), jnp.sum(a * call(b))
    assert abs(there - back) < 1e-11 < abs(there - jnp.sum(a * b))
    (transposed,) = jax.linear_transpose(call, a)(b)
    np.testing.assert_allclose(transposed, call(b), atol=1e-13)


def test_where_a_band_is_too_narrow_the_highest_particles_have_no_room():
    lowest, highest = [2, 10, 19, 28], [10, 19, 28, 36]
    below = below_of(lowest, highest)
    config = slabbed(Slabs(16, (8,)))
    # Touching hulls share 3 planes, and one more on either side if their particles move.
    np.testing.assert_array_equal(halo.overlaps(config, below), [5, -4, -13])
    assert int(halo.widest(config, below)) == 12
    np.testing.assert_array_equal(halo.bands(config, below).highest[:3], [13, 22, 31])
    assert bool(halo.holds(config, below, room=3))
    assert not bool(halo.holds(config, below, room=4))
    narrow = slabbed(Slabs(16, (4,)))
    np.testing.assert_array_equal(halo.bands(narrow, below).highest[:3], [9, 18, 27])
    # Those after the next one share no node, or there is no room either.
    below = below_of([2, 10, 13, 28], [10, 19, 28, 36])
    assert int(halo.bands(config, below).highest[0]) == 8
    # A slab that is too short.
    room = halo.highest(config, jnp.array([4, 0, 0]), None)
    np.testing.assert_array_equal(room, [17, 0, 1])


@pytest.mark.parametrize(
    ("devices", "slabs", "planes"),
    [
        (2, None, 40),
        (4, None, 60),
        (2, Slabs(24, (8,)), 8),
        (4, Slabs(12, (8,)), 16),
        (4, Slabs(12, (8, 4)), 20),
        (4, Slabs(12, (8, 4, 4)), 20),
    ],
)
def test_what_a_device_sends_is_counted(devices, slabs, planes):
    config = slabbed(slabs, devices)
    assert halo.sent_planes(config) == planes
    assert halo.sent_bytes(config) == planes * 16 * NODES[1] * NODES[2]


def test_bands_are_all_that_a_compiled_exchange_sends():
    slabs = Slabs(12, (8, 4))
    call, _ = exchange(slabbed(slabs), below_of(*HULLS[1][1:]))
    text = call.lower(jnp.zeros((DEVICES, slabs.planes, LINE))).compile().as_text()
    sent = re.findall(r"f64\[(\d+),(\d+)\]\S* collective-permute(?:-start)?\(", text)
    assert sorted(int(planes) for planes, _ in sent) == [4, 4, 8, 8]
    assert {int(line) for _, line in sent} == {LINE}
    assert "all-reduce" not in text and "all-gather" not in text


def test_slabs_where_devices_then_send_less():
    whole, _, state = long_block(devices=2)
    config = windowed(whole, state, slabs=True)
    # Half of 24 cells, the nodes beside them and room; three planes, room for a step and more.
    assert config.slabs == Slabs(20, (8,))
    assert config.nodes == (20, 10, 11)
    # What it is depends on the state alone, not on the order of the particles.
    assert windowed(config, state, slabs=True) == config
    backwards = state._replace(position=state.position[:, ::-1])
    assert windowed(config, backwards, slabs=True) == config
    # One device; particles in one place; many devices, all of which share nodes.
    assert windowed(replace(whole, placement=Placement()), state, slabs=True).slabs is None
    together = state._replace(position=0 * state.position + 0.5)
    assert windowed(whole, together, slabs=True).slabs is None
    short, _, short_state = long_block(cells=4, devices=4)
    assert windowed(short, short_state, slabs=True).slabs is None
    # Of one memory two devices have windows unless they are told to, and more have slabs.
    assert windowed(whole, state).slabs is None
    more, _, same = long_block(devices=4)
    assert (
        windowed(more, same).slabs is not None and windowed(more, same, slabs=False).slabs is None
    )


def test_particles_are_sorted_where_slabs_would_not_hold_them():
    config, _, state = long_block(devices=2)
    config = windowed(config, state, slabs=True)
    find = jax.jit(partial(orders_for, config))
    as_they_are = np.arange(200)
    np.testing.assert_array_equal(find(state.position)[0], as_they_are)
    # Two that change places are no mixture, but each is far from its device's slab.
    swapped = state.position[:, np.r_[199, 1:199, 0]]
    order, inverse = find(swapped)
    cells = np.floor(np.asarray(swapped[0]) / 0.1 - 0.5)
    assert (np.diff(cells[order]) >= 0).all() and (np.diff(cells) < 0).any()
    np.testing.assert_array_equal(np.asarray(order)[inverse], as_they_are)
    none = replace(config, slabs=None)
    np.testing.assert_array_equal(orders_for(none, swapped)[0], as_they_are)


def test_wrong_slabs_are_named():
    for slabs in (dict(planes=8, bands=()), dict(planes=8, bands=(9,)), dict(planes=8, bands=(0,))):
        with pytest.raises(InputError, match=r"Slabs\.bands is"):
            Slabs(**slabs)
    with pytest.raises(InputError, match=r"planes is 41.*40 nodes"):
        slabbed(Slabs(41, (8,)))
    with pytest.raises(InputError, match="one device"):
        slabbed(Slabs(8, (8,)), devices=1)
