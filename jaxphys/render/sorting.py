"""Exact sorts shaped for XLA's CPU backend, which sorts one array of integers on one core, and a
key with a payload at a quarter of that speed.
"""

from collections.abc import Sequence

import jax.numpy as jnp
from jax import Array

from jaxphys.core import algebra


def stable_order(keys: Array, bits: int) -> Array:
    """Indices that sort `keys`, uint32 (N,) below 2^bits, equal keys by index. int32 (N,).

    From the lowest digit to the highest, as many bits at a time as an integer has room for beside
    the index, so that each pass sorts single integers.
    """
    index_bits = max(keys.shape[0] - 1, 1).bit_length()
    digit_bits = 32 - index_bits
    place = jnp.arange(keys.shape[0], dtype=jnp.uint32)
    order = place
    for shift in range(0, bits, digit_bits):
        digit = (keys[order] >> shift) & jnp.uint32((1 << digit_bits) - 1)
        packed = jnp.sort((digit << index_bits) | place)
        order = order[packed & jnp.uint32((1 << index_bits) - 1)]
    return order.astype(jnp.int32)


def group_stably(
    parts: Sequence[tuple[Array, Array]], group_count: int, item_count: int
) -> tuple[Array, Array]:
    """Items of each group one after the other, from a list whose items come in increasing order.

    parts: the list, cut: groups in [0, group_count] and items in [0, item_count), int32 (M_p,)
    each; (group_count + 1) item_count must not exceed 2^32. Returns the items, int32 (M,), and the
    first slot of each group and the end of the last, int32 (group_count + 1,); what belongs to
    group `group_count` lies behind that. Each part is sorted by the one integer that holds group
    and item. As the items come in order, a group's list is that of the first part, then of the
    second.
    """
    step = jnp.uint32(item_count)
    keys = [jnp.sort(g.astype(jnp.uint32) * step + i.astype(jnp.uint32)) for g, i in parts]
    boundaries = jnp.arange(group_count + 1, dtype=jnp.uint32) * step
    firsts = [jnp.searchsorted(part, boundaries).astype(jnp.int32) for part in keys]
    ends = [jnp.append(f[1:], len(part)) for f, part in zip(firsts, keys, strict=True)]

    merged = jnp.zeros(sum(map(len, keys)), jnp.int32)
    for index, part in enumerate(keys):
        group = part // step
        before = sum(ends[:index] + firsts[index + 1 :], start=jnp.zeros_like(firsts[0]))
        slot = jnp.arange(len(part), dtype=jnp.int32) + before[group]
        merged = merged.at[slot].set(
            (part - group * step).astype(jnp.int32), mode="drop", unique_indices=True
        )
    return merged, algebra.total(firsts)
