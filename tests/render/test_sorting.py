import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.render.sorting import group_stably, stable_order


@pytest.mark.parametrize("count", [1, 2, 3, 1000, 70_000])
@pytest.mark.parametrize("most", [1, 50, 2**31])
def test_order_is_numpys_stable_one(count, most):
    keys = np.random.default_rng(count).integers(0, most, count).astype(np.uint32)
    order = stable_order(jnp.asarray(keys), bits=31)
    np.testing.assert_array_equal(order, np.argsort(keys, kind="stable"))


def test_order_looks_at_every_bit():
    keys = jnp.array([1 << 30, 1, (1 << 30) | 1, 0, 1 << 15], jnp.uint32)
    np.testing.assert_array_equal(stable_order(keys, bits=31), [3, 1, 4, 0, 2])


@pytest.mark.parametrize("cuts", [[], [400], [1, 2, 999], [0, 1000]])
def test_groups_hold_their_items_in_order(cuts):
    random = np.random.default_rng(0)
    groups = random.integers(0, 12, 1000)
    groups[random.random(1000) < 0.2] = 40  # what belongs to no group
    items = np.sort(random.integers(0, 300, 1000))
    parts = [
        (jnp.asarray(g, jnp.int32), jnp.asarray(i, jnp.int32))
        for g, i in zip(np.split(groups, cuts), np.split(items, cuts), strict=True)
    ]
    merged, firsts = group_stably(parts, 40, 300)
    expected = items[np.argsort(groups, kind="stable")]
    assert firsts.shape == (41,)
    np.testing.assert_array_equal(firsts, np.searchsorted(np.sort(groups), np.arange(41)))
    np.testing.assert_array_equal(merged[: firsts[-1]], expected[: firsts[-1]])


def test_groups_fill_the_integer_to_its_last_value():
    # (group_count + 1) item_count = 2^32: the end of the last group is no uint32.
    groups, items = jnp.array([0, 2**16 - 1, 2**16 - 2]), jnp.array([0, 5, 2**16 - 1])
    merged, firsts = group_stably(
        [(groups[:1], items[:1]), (groups[1:], items[1:])], 2**16 - 1, 2**16
    )
    assert firsts[0] == 0 and firsts[-1] == 2
    np.testing.assert_array_equal(merged, [0, 2**16 - 1, 5])
