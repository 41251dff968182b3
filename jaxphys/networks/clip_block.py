"""The transformer that both towers of CLIP are made of (Radford et al. 2021): norms come first."""

import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.networks.attention import attend, join_heads, split_heads
from jaxphys.networks.clip_config import ACTIVATIONS, TextConfig, VisionConfig
from jaxphys.networks.layers import LayerNorm, Linear

TowerConfig = TextConfig | VisionConfig


class ClipAttention(nnx.Module):
    """Self-attention of several heads over (B, T, width)."""

    def __init__(self, width: int, heads: int):
        self.heads = heads
        self.q_proj = Linear(width, width)
        self.k_proj = Linear(width, width)
        self.v_proj = Linear(width, width)
        self.out_proj = Linear(width, width)

    def __call__(self, x: Array, *, causal: bool) -> Array:
        queries, keys, values = (
            split_heads(project(x), self.heads)
            for project in (self.q_proj, self.k_proj, self.v_proj)
        )
        return self.out_proj(join_heads(attend(queries, keys, values, causal=causal)))


class ClipPerceptron(nnx.Module):
    """Two linear layers with an activation in between."""

    def __init__(self, config: TowerConfig):
        self.activation = config.hidden_act
        self.fc1 = Linear(config.hidden_size, config.intermediate_size)
        self.fc2 = Linear(config.intermediate_size, config.hidden_size)

    def __call__(self, x: Array) -> Array:
        return self.fc2(ACTIVATIONS[self.activation](self.fc1(x)))


class ClipLayer(nnx.Module):
    """Attention and a perceptron, each added to what it read."""

    def __init__(self, config: TowerConfig):
        width, epsilon = config.hidden_size, config.layer_norm_eps
        self.layer_norm1 = LayerNorm(width, epsilon=epsilon)
        self.self_attn = ClipAttention(width, config.num_attention_heads)
        self.layer_norm2 = LayerNorm(width, epsilon=epsilon)
        self.mlp = ClipPerceptron(config)

    def __call__(self, x: Array, *, causal: bool) -> Array:
        x = x + self.self_attn(self.layer_norm1(x), causal=causal)
        return x + self.mlp(self.layer_norm2(x))


class ClipTransformer(nnx.Module):
    """The layers one after another: (B, T, width) -> the same."""

    def __init__(self, config: TowerConfig):
        self.layers = nnx.List([ClipLayer(config) for _ in range(config.num_hidden_layers)])

    def __call__(self, x: Array, *, causal: bool) -> Array:
        for layer in self.layers:
            x = layer(x, causal=causal)
        return x


def unit_norm(embeddings: Array) -> Array:
    """(B, D) with rows of length 1: what cosines, aesthetic heads and Point-E read."""
    return embeddings / jnp.linalg.norm(embeddings, axis=-1, keepdims=True)
