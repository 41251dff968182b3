"""Attention, whole or in slices of queries so that memory is a setting."""

import jax
import jax.numpy as jnp
from jax import Array, lax


def split_heads(x: Array, heads: int) -> Array:
    """(B, T, H D) -> (B, H, T, D)."""
    return x.reshape(*x.shape[:2], heads, -1).transpose(0, 2, 1, 3)


def join_heads(x: Array) -> Array:
    """(B, H, T, D) -> (B, T, H D)."""
    return x.transpose(0, 2, 1, 3).reshape(x.shape[0], x.shape[2], -1)


def attend(
    queries: Array,
    keys: Array,
    values: Array,
    *,
    causal: bool = False,
    slice_size: int | None = None,
) -> Array:
    """softmax(q k^T / sqrt(D)) v (Vaswani et al. 2017).

    Args:
        queries: (B, H, Q, D).
        keys, values: (B, H, K, D).
        causal: query i reads keys 0 to i only.
        slice_size: so many queries at a time: (B, H, slice, K) numbers are held instead of
            (B, H, Q, K). None takes all at once. The result is the same.
    """
    count = queries.shape[2]
    if slice_size is None or slice_size >= count:
        return _attend(queries, keys, values, jnp.arange(count), causal)
    slices = -(-count // slice_size)
    padded = jnp.pad(queries, ((0, 0), (0, 0), (0, slices * slice_size - count), (0, 0)))
    stacked = padded.reshape(*queries.shape[:2], slices, slice_size, -1).transpose(2, 0, 1, 3, 4)
    rows = jnp.arange(slices * slice_size).reshape(slices, slice_size)

    @jax.checkpoint
    def one(part: tuple[Array, Array]) -> Array:
        return _attend(part[0], keys, values, part[1], causal)

    mixed = lax.map(one, (stacked, rows)).transpose(1, 2, 0, 3, 4)
    return mixed.reshape(padded.shape[:3] + values.shape[-1:])[:, :, :count]


def _attend(queries: Array, keys: Array, values: Array, rows: Array, causal: bool) -> Array:
    # Sums in float32 or better: more exact, and faster of bfloat16 (see `layers.product`).
    wide = jnp.promote_types(queries.dtype, jnp.float32)
    queries = queries * queries.shape[-1] ** -0.5
    logits = jnp.einsum("bhqd,bhkd->bhqk", queries, keys, preferred_element_type=wide)
    if causal:
        seen = rows[:, None] >= jnp.arange(keys.shape[2])
        logits = jnp.where(seen, logits, -jnp.inf)
    weights = jax.nn.softmax(logits, axis=-1).astype(values.dtype)
    mixed = jnp.einsum("bhqk,bhkd->bhqd", weights, values, preferred_element_type=wide)
    return mixed.astype(values.dtype)
