"""The Llama network (Touvron et al. 2023): a decoder with rotary positions, grouped-query attention
and gated feed-forward layers, which predicts the next token of a text.

Attributes are named as the arrays of published checkpoints, but for those that are JOINED. What was
read once is kept: a cache of keys and values makes the next token cost one row instead of a whole
text.
"""

import jax
import jax.numpy as jnp
from flax import nnx
from jax import Array, lax

from jaxphys.networks.layers import Embedding, Linear
from jaxphys.networks.llama_config import LlamaConfig

# Keys and values (B * key heads, capacity, D) of every layer; written up to the text's length. With
# more axes XLA would reshape them for its products, and copy them to do so, for every token.
Cache = tuple[tuple[Array, Array], ...]
JOINED = {"qkv_proj": ("q_proj", "k_proj", "v_proj"), "gate_up_proj": ("gate_proj", "up_proj")}


def empty_cache(
    config: LlamaConfig, capacity: int, batch: int = 1, dtype: jnp.dtype = jnp.float32
) -> Cache:
    """Room for `capacity` tokens of each of `batch` texts."""
    shape = (batch * config.num_key_value_heads, capacity, config.head_dim)
    return tuple(
        (jnp.zeros(shape, dtype), jnp.zeros(shape, dtype)) for _ in range(config.num_hidden_layers)
    )


class RMSNorm(nnx.Module):
    """x / rms(x) times a scale, over the last axis (Zhang & Sennrich 2019)."""

    def __init__(self, width: int, *, epsilon: float):
        self.epsilon = epsilon
        self.scale = nnx.Param(jnp.ones((width,)))

    def __call__(self, x: Array) -> Array:
        unit = x * lax.rsqrt(jnp.mean(x**2, -1, keepdims=True) + self.epsilon)
        return unit * self.scale[...].astype(x.dtype)


def rotary(positions: Array, width: int, base: float, dtype: jnp.dtype) -> tuple[Array, Array]:
    """Cosines and sines (T, width) of position times frequency base^(-2i/width), i < width / 2,
    for both halves (Su et al. 2021).
    """
    frequencies = base ** (-jnp.arange(0, width, 2, dtype=dtype) / width)
    angles = jnp.tile(positions[:, None].astype(dtype) * frequencies, (1, 2))
    return jnp.cos(angles), jnp.sin(angles)


def rotate(x: Array, cosines: Array, sines: Array) -> Array:
    """x (..., T, D) with every pair (x_i, x_{i + D/2}) turned by its angle."""
    first, second = jnp.split(x, 2, axis=-1)
    return x * cosines + jnp.concatenate((-second, first), axis=-1) * sines


class GroupedQueryAttention(nnx.Module):
    """Causal attention in which groups of query heads share a head of keys and values (Ainslie et
    al. 2023).
    """

    def __init__(self, config: LlamaConfig):
        self.config = config
        width, inner = config.hidden_size, config.num_attention_heads * config.head_dim
        shared = config.num_key_value_heads * config.head_dim
        self.qkv_proj = Linear(width, inner + 2 * shared, bias=False)
        self.o_proj = Linear(inner, width, bias=False)

    def __call__(
        self, x: Array, cache: tuple[Array, Array], positions: Array
    ) -> tuple[Array, tuple[Array, Array]]:
        """(B, T, width) at consecutive `positions` (T,) and this layer's cache, to its output and
        the cache with their keys and values.
        """
        config, (batch, count, _) = self.config, x.shape
        cosines, sines = rotary(positions, config.head_dim, config.rope_theta, x.dtype)

        def heads(rows: Array) -> Array:
            rows = rows.reshape(batch, count, -1, config.head_dim).transpose(0, 2, 1, 3)
            return rows.reshape(-1, count, config.head_dim)

        def extended(held: Array, rows: Array) -> Array:
            return lax.dynamic_update_slice(held, rows, (0, positions[0], 0))

        inner = config.num_attention_heads * config.head_dim
        shared = config.num_key_value_heads * config.head_dim
        queries, keys, values = jnp.split(self.qkv_proj(x), (inner, inner + shared), axis=-1)
        queries = rotate(heads(queries), cosines, sines)
        keys = extended(cache[0], rotate(heads(keys), cosines, sines))
        values = extended(cache[1], heads(values))

        # The heads of a group stand below each other: (B * key heads, group * T, D).
        queries = queries.reshape(len(keys), -1, config.head_dim) * config.head_dim**-0.5
        scores = jnp.einsum("kqd,kcd->kqc", queries, keys)
        seen = jnp.arange(keys.shape[1]) <= positions[:, None]
        seen = jnp.tile(seen, (queries.shape[1] // count, 1))
        weights = jax.nn.softmax(jnp.where(seen, scores, -jnp.inf), axis=-1)
        mixed = jnp.einsum("kqc,kcd->kqd", weights, values)
        mixed = mixed.reshape(batch, -1, count, config.head_dim).transpose(0, 2, 1, 3)
        mixed = mixed.reshape(batch, count, -1)
        return self.o_proj(mixed), (keys, values)


class LlamaPerceptron(nnx.Module):
    """down(silu(gate(x)) * up(x)) (Shazeer 2020)."""

    def __init__(self, config: LlamaConfig):
        width, inner = config.hidden_size, config.intermediate_size
        self.gate_up_proj = Linear(width, 2 * inner, bias=False)
        self.down_proj = Linear(inner, width, bias=False)

    def __call__(self, x: Array) -> Array:
        gate, up = jnp.split(self.gate_up_proj(x), 2, axis=-1)
        return self.down_proj(jax.nn.silu(gate) * up)


class LlamaBlock(nnx.Module):
    """Attention, then the feed-forward layer, each on normalised input and added to it."""

    def __init__(self, config: LlamaConfig):
        self.input_layernorm = RMSNorm(config.hidden_size, epsilon=config.rms_norm_eps)
        self.self_attn = GroupedQueryAttention(config)
        self.post_attention_layernorm = RMSNorm(config.hidden_size, epsilon=config.rms_norm_eps)
        self.mlp = LlamaPerceptron(config)

    def __call__(
        self, x: Array, cache: tuple[Array, Array], positions: Array
    ) -> tuple[Array, tuple[Array, Array]]:
        mixed, cache = self.self_attn(self.input_layernorm(x), cache, positions)
        x = x + mixed
        return x + self.mlp(self.post_attention_layernorm(x)), cache


class LlamaDecoder(nnx.Module):
    """Embeddings, blocks and the last norm."""

    def __init__(self, config: LlamaConfig):
        self.embed_tokens = Embedding(config.vocab_size, config.hidden_size)
        self.layers = nnx.List([LlamaBlock(config) for _ in range(config.num_hidden_layers)])
        self.norm = RMSNorm(config.hidden_size, epsilon=config.rms_norm_eps)

    def embed(self, ids: Array) -> Array:
        """Ids (B, T) to (B, T, width). Parameters may be stored in 16 bits; activations never."""
        x = self.embed_tokens(ids)
        return x.astype(jnp.promote_types(x.dtype, jnp.float32))

    def __call__(self, ids: Array, cache: Cache, positions: Array) -> tuple[Array, Cache]:
        x, updated = self.embed(ids), []
        for block, held in zip(self.layers, cache, strict=True):
            x, held = block(x, held, positions)
            updated.append(held)
        return self.norm(x), tuple(updated)


class Llama(nnx.Module):
    """The network with its output layer, which may be the table of embeddings again.

    Filled from a checkpoint's `JoinedArrays(arrays, JOINED)`.
    """

    def __init__(self, config: LlamaConfig):
        self.config = config
        self.model = LlamaDecoder(config)
        tied = config.tie_word_embeddings
        self.lm_head = None if tied else Linear(config.hidden_size, config.vocab_size, bias=False)

    def __call__(self, ids: Array, cache: Cache, start: Array | int) -> tuple[Array, Cache]:
        """Reads tokens on from where the cache ends.

        Args:
            ids: (B, T) integers.
            cache: holds the `start` tokens before them and has room for T more. What lies beyond
                the tokens that were read is never looked at: padding at the end does no harm, it
                is overwritten.
            start: number of tokens before these.

        Returns:
            (B, T, width), which `logits` makes predictions of, and the cache with these tokens.
        """
        return self.model(ids, cache, start + jnp.arange(ids.shape[1]))

    def logits(self, hidden: Array) -> Array:
        """(..., width) -> (..., vocabulary): of the token that follows."""
        if self.lm_head is not None:
            return self.lm_head(hidden)
        return hidden @ self.model.embed_tokens.table[...].astype(hidden.dtype).T
