"""Transformer over the pixels of a picture that reads a text (Rombach et al. 2022, sec. 3.3)."""

import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.networks.attention import attend, join_heads, split_heads
from jaxphys.networks.layers import GroupNorm, LayerNorm, Linear, gelu

# Checkpoints number these layers among others that hold no parameter.
RENAMES = (
    (r"\.ff\.net\.0\.proj\.", ".ff.expand."),
    (r"\.ff\.net\.2\.", ".ff.contract."),
    (r"\.to_out\.0\.", ".to_out."),
)


class Attention(nnx.Module):
    """Multi-head attention (Vaswani et al. 2017); subclasses say of what to what."""

    def __init__(self, width: int, context: int, heads: int, *, bias: bool, slice_size: int | None):
        self.heads, self.slice_size = heads, slice_size
        self.to_q = Linear(width, width, bias=bias)
        self.to_k = Linear(context, width, bias=bias)
        self.to_v = Linear(context, width, bias=bias)
        self.to_out = Linear(width, width)

    def from_to(self, x: Array, context: Array) -> Array:
        """Of (B, T, width) tokens to (B, S, context)."""
        queries = split_heads(self.to_q(x), self.heads)
        keys = split_heads(self.to_k(context), self.heads)
        values = split_heads(self.to_v(context), self.heads)
        return self.to_out(join_heads(attend(queries, keys, values, slice_size=self.slice_size)))


class CrossAttention(Attention):
    """Attention of (B, T, width) tokens to (B, S, context)."""

    def __call__(self, x: Array, context: Array) -> Array:
        return self.from_to(x, context)


class GatedPerceptron(nnx.Module):
    """Perceptron with a gate (Shazeer 2020, GEGLU)."""

    def __init__(self, width: int):
        self.expand = Linear(width, 2 * 4 * width)
        self.contract = Linear(4 * width, width)

    def __call__(self, x: Array) -> Array:
        hidden, gate = jnp.split(self.expand(x), 2, axis=-1)
        return self.contract(hidden * gelu(gate))


class TransformerBlock(nnx.Module):
    """Attention among pixels, attention to the text, perceptron; each normed first and added."""

    def __init__(self, width: int, context: int, heads: int, *, slice_size: int | None):
        self.norm1 = LayerNorm(width)
        self.attn1 = CrossAttention(width, width, heads, bias=False, slice_size=slice_size)
        self.norm2 = LayerNorm(width)
        self.attn2 = CrossAttention(width, context, heads, bias=False, slice_size=slice_size)
        self.norm3 = LayerNorm(width)
        self.ff = GatedPerceptron(width)

    def __call__(self, x: Array, states: Array) -> Array:
        inner = self.norm1(x)
        x = x + self.attn1(inner, inner)
        x = x + self.attn2(self.norm2(x), states)
        return x + self.ff(self.norm3(x))


class SpatialTransformer(nnx.Module):
    """(B, H, W, width) told (B, T, context) -> (B, H, W, width)."""

    def __init__(
        self, width: int, context: int, heads: int, *, groups: int, slice_size: int | None
    ):
        self.norm = GroupNorm(groups, width, epsilon=1e-6)
        self.proj_in = Linear(width, width)
        block = TransformerBlock(width, context, heads, slice_size=slice_size)
        self.transformer_blocks = nnx.List([block])
        self.proj_out = Linear(width, width)

    def __call__(self, x: Array, states: Array) -> Array:
        tokens = self.proj_in(self.norm(x).reshape(x.shape[0], -1, x.shape[-1]))
        for block in self.transformer_blocks:
            tokens = block(tokens, states)
        return x + self.proj_out(tokens).reshape(x.shape)
